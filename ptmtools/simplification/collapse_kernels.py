"""Compiled edge collapses: costs, the order of the heap, and the update of the mesh.

An edge has up to three targets: a half-edge collapse into either end, or the optimal position
between two free vertices of a mesh without attributes. `legality_kernels` decides which collapses
are legal.
"""

from __future__ import annotations

import numpy as np

from ptmtools.jit import plain_kernel as kernel
from ptmtools.simplification.legality_kernels import (
    has_counterpart_wedges,
    may_change_topology,
    preserves_faces,
    satisfies_link_condition,
)
from ptmtools.simplification.quadrics import (
    add,
    optimal_position,
    shift,
    shift_wedge,
    value_at,
    wedge_value_at,
)
from ptmtools.simplification.state_kernels import (
    COLLAPSES,
    ENTRIES,
    FACES,
    KEEP_TOPOLOGY,
    MARKS,
    REJECTIONS,
    TOPOLOGY,
    CollapseState,
    Heap,
    copy_entry,
    drop_stale,
    faces_of_edge,
    heapify,
    prune,
    sift_down,
    sift_up,
)
from ptmtools.simplification.surface import FREE, LINE
from ptmtools.tolerance import ROUNDING_SHARE

#: The heap is rebuilt when the cost has grown by this factor since the last retry: collapses that
#: were illegal may have become legal, and on flat walls they cost nothing.
RETRY_FACTOR = 4.0
#: Targets of a collapse: the second end, the first end, the optimal position, or none.
INTO_SECOND, INTO_FIRST, TO_OPTIMUM, NO_TARGET = 0, 1, 2, 3
#: Weight of the midpoint of an edge in the optimal position, as a share of the total weight.
MIDPOINT_WEIGHT = 1e-5
#: Share of weight times squared length added to the cost as the key of the heap: on flat regions
#: the shortest edges collapse first.
LENGTH_WEIGHT = ROUNDING_SHARE
#: The optimal position must improve on both ends by this share of weight times squared length: ends
#: are exact, so the corners of a box do not move.
OPTIMUM_MARGIN = ROUNDING_SHARE


@kernel
def half_edge_cost(
    state: CollapseState, a: int, b: int, count: int, x: float, y: float, z: float
) -> float:
    """Returns the cost of the half-edge collapse of vertex a into b, where (x, y, z) is b - a.

    The first ``count`` rows of ``state.shared`` hold the faces at the edge, seen from a.
    """
    cost = value_at(state.quadric, a, x, y, z) + state.quadric[b, 9]
    if state.attribute.shape[1] == 0:
        return float(cost)
    for i in range(count):
        duplicate = False
        for j in range(i):
            duplicate |= state.shared[j, 0] == state.shared[i, 0]
        if not duplicate:
            wedge_u, wedge_v = state.shared[i, 0], state.shared[i, 1]
            cost += wedge_value_at(state.wedge_quadric, state.attribute, wedge_u, wedge_v, x, y, z)
            cost += state.wedge_quadric[wedge_v, 9]
    return float(cost)


@kernel
def cheapest_target(state: CollapseState, a: int, b: int, rejected: int) -> int:
    """Returns the cheapest target of an edge, a < b, whose bit is not set in ``rejected``.

    Writes the cost of the collapse and its key in the heap to ``state.edge_cost``, and for
    `TO_OPTIMUM` the position relative to a to ``state.optimum``.
    """
    free_a, free_b = state.freedom[a] == FREE, state.freedom[b] == FREE
    has_attributes = state.attribute.shape[1] > 0
    count = 0
    to_b, to_a = free_a, free_b
    if has_attributes or not (free_a or free_b):
        count = faces_of_edge(state, a, b)
        if count < 1:
            return NO_TARGET
        if state.shared[0, 3]:
            to_b, to_a = state.freedom[a] == LINE, state.freedom[b] == LINE
    point = state.point
    x, y, z = point[b, 0] - point[a, 0], point[b, 1] - point[a, 1], point[b, 2] - point[a, 2]
    weight = (state.quadric[a, 10] + state.quadric[b, 10]) * (x * x + y * y + z * z)
    target, lowest = NO_TARGET, np.inf
    if to_b and not rejected & 1:
        cost = half_edge_cost(state, a, b, count, x, y, z)
        if cost < lowest:
            target, lowest = INTO_SECOND, cost
    if to_a and not rejected & 2:
        for i in range(count):
            wedge_a = state.shared[i, 0]
            state.shared[i, 0] = state.shared[i, 1]
            state.shared[i, 1] = wedge_a
        cost = half_edge_cost(state, b, a, count, -x, -y, -z)
        if cost < lowest:
            target, lowest = INTO_FIRST, cost
    if free_a and free_b and not has_attributes and not rejected & 4:
        cost = optimal_position(state.quadric, a, b, x, y, z, MIDPOINT_WEIGHT, state.optimum)
        if cost < lowest - OPTIMUM_MARGIN * weight:
            target, lowest = TO_OPTIMUM, cost
    lowest = max(lowest, 0.0)
    state.edge_cost[0] = lowest
    state.edge_cost[1] = lowest + LENGTH_WEIGHT * weight
    return target


@kernel
def push(state: CollapseState, heap: Heap, a: int, b: int, rejected: int) -> None:
    """Pushes an edge onto the heap, unless ``rejected`` covers all its targets."""
    if a > b:
        a, b = b, a
    if cheapest_target(state, a, b, rejected) == NO_TARGET:
        return
    counters = state.counters
    if counters[ENTRIES] + 2 > len(heap.cost):
        counters[ENTRIES] = drop_stale(heap, counters[ENTRIES], state.version)
    append_entry(state, heap, a, b, rejected, state.edge_cost[1])
    sift_up(heap, counters[ENTRIES], counters[ENTRIES] - 1)


@kernel
def append_entry(
    state: CollapseState, heap: Heap, a: int, b: int, rejected: int, cost: float
) -> None:
    """Appends an entry to the heap without restoring its order."""
    at = state.counters[ENTRIES]
    heap.cost[at] = cost
    heap.ends[at, 0] = a
    heap.ends[at, 1] = b
    heap.version[at] = state.version[a] + state.version[b]
    heap.rejected[at] = rejected
    state.counters[ENTRIES] = at + 1


@kernel
def fill_heap(state: CollapseState, heap: Heap) -> None:
    """Rebuilds the heap from all edges and resets the number of rejections."""
    triangle = state.triangle
    state.counters[ENTRIES] = state.counters[REJECTIONS] = 0
    for t in range(len(triangle)):
        if triangle[t, 0] < 0:
            continue
        for k in range(3):
            a, b = triangle[t, k], triangle[t, (k + 1) % 3]
            # The two faces of an unconstrained edge traverse it in opposite directions.
            if a > b:
                if not (state.constraint[t] >> k) & 1:
                    continue
                a, b = b, a
            if cheapest_target(state, a, b, 0) != NO_TARGET:
                append_entry(state, heap, a, b, 0, state.edge_cost[1])
    heapify(heap, state.counters[ENTRIES])


@kernel
def propagate_constraints(state: CollapseState, v: int, count: int) -> None:
    """Sets the constraint bit of edges of v onto which a collapse moved a constrained edge."""
    triangle, constraint, shared = state.triangle, state.constraint, state.shared
    for i in range(count):
        if not (shared[i, 4] or shared[i, 5]):
            continue
        third, corner = shared[i, 2], state.head[v]
        while corner >= 0:
            t, k = corner // 3, corner % 3
            corner = state.next_corner[corner]
            if triangle[t, (k + 1) % 3] == third:
                constraint[t] |= np.uint8(1 << k)
            if triangle[t, (k + 2) % 3] == third:
                constraint[t] |= np.uint8(1 << ((k + 2) % 3))


@kernel
def remove_opposite_faces(state: CollapseState, v: int) -> None:
    """Removes pairs of faces of v that coincide with opposite orientation."""
    triangle = state.triangle
    corner = state.head[v]
    while corner >= 0:
        t, k = corner // 3, corner % 3
        corner = state.next_corner[corner]
        if triangle[t, 0] < 0:
            continue
        x, y = triangle[t, (k + 1) % 3], triangle[t, (k + 2) % 3]
        candidate = corner
        while candidate >= 0:
            s, j = candidate // 3, candidate % 3
            candidate = state.next_corner[candidate]
            alive = triangle[s, 0] >= 0
            if alive and triangle[s, (j + 1) % 3] == y and triangle[s, (j + 2) % 3] == x:
                triangle[t, 0] = triangle[s, 0] = -1
                state.counters[FACES] -= 2
                break


@kernel
def collapse(
    state: CollapseState, u: int, v: int, count: int, px: float, py: float, pz: float
) -> None:
    """Collapses u into v and moves v to (px, py, pz).

    The first ``count`` rows of ``state.shared`` hold the faces at the edge, seen from u.
    """
    triangle, wedge, shared, point = state.triangle, state.wedge, state.shared, state.point
    wedge_quadric, attribute = state.wedge_quadric, state.attribute
    x, y, z = px - point[u, 0], py - point[u, 1], pz - point[u, 2]
    shift(state.quadric, u, x, y, z)
    shift(state.quadric, v, px - point[v, 0], py - point[v, 1], pz - point[v, 2])
    add(state.quadric, v, u)
    if attribute.shape[1]:
        for i in range(count):
            duplicate = False
            for j in range(i):
                duplicate |= shared[j, 0] == shared[i, 0]
            if not duplicate:
                wedge_u, wedge_v = shared[i, 0], shared[i, 1]
                shift_wedge(wedge_quadric, attribute, wedge_u, wedge_v, x, y, z)
                add(wedge_quadric, wedge_v, wedge_u)
    point[v, 0], point[v, 1], point[v, 2] = px, py, pz
    corner = state.head[u]
    while corner >= 0:
        t, k = corner // 3, corner % 3
        corner = state.next_corner[corner]
        if triangle[t, (k + 1) % 3] == v or triangle[t, (k + 2) % 3] == v:
            triangle[t, 0] = -1
            state.counters[FACES] -= 1
            continue
        triangle[t, k] = v
        for i in range(count):
            if shared[i, 0] == wedge[t, k]:
                wedge[t, k] = shared[i, 1]
                break
    state.next_corner[state.tail[v]] = state.head[u]
    state.tail[v] = state.tail[u]
    prune(state, v)
    if state.counters[TOPOLOGY] != KEEP_TOPOLOGY:
        remove_opposite_faces(state, v)
        prune(state, v)
    state.head[u] = state.tail[u] = -1
    propagate_constraints(state, v, count)
    state.version[u] += 1
    state.version[v] += 1
    state.counters[COLLAPSES] += 1


@kernel
def push_edges_of(state: CollapseState, heap: Heap, v: int) -> None:
    """Pushes each edge of a vertex onto the heap once."""
    triangle, mark = state.triangle, state.mark
    visited = state.counters[MARKS] + 1
    state.counters[MARKS] = visited
    mark[v] = visited
    corner = state.head[v]
    while corner >= 0:
        t = corner // 3
        for k in range(3):
            neighbour = triangle[t, k]
            if mark[neighbour] != visited:
                mark[neighbour] = visited
                push(state, heap, v, neighbour, 0)
        corner = state.next_corner[corner]


@kernel
def collapse_edges(state: CollapseState, heap: Heap, faces: int) -> None:
    """Collapses edges in ascending order of cost until ``faces`` faces are left or the heap is
    empty."""
    counters, version = state.counters, state.version
    while counters[FACES] > faces and counters[ENTRIES] > 0:
        a, b = heap.ends[0, 0], heap.ends[0, 1]
        rejected, stamp = heap.rejected[0], heap.version[0]
        if counters[REJECTIONS] > 0 and heap.cost[0] > state.errors[2]:
            state.errors[2] = RETRY_FACTOR * heap.cost[0]
            fill_heap(state, heap)
            continue
        counters[ENTRIES] -= 1
        copy_entry(heap, 0, counters[ENTRIES])
        sift_down(heap, counters[ENTRIES], 0)
        if stamp != version[a] + version[b]:
            continue
        target = cheapest_target(state, a, b, rejected)
        cost = state.edge_cost[0]
        weight = state.quadric[a, 10] + state.quadric[b, 10]
        if cost > state.errors[1] * weight:
            continue
        u, v = (a, b) if target == INTO_SECOND else (b, a)
        px, py, pz = state.point[v, 0], state.point[v, 1], state.point[v, 2]
        if target == TO_OPTIMUM:
            px, py, pz = px + state.optimum[0], py + state.optimum[1], pz + state.optimum[2]
        prune(state, u)
        prune(state, v)
        count = faces_of_edge(state, u, v)
        if counters[TOPOLOGY] == KEEP_TOPOLOGY:
            legal = satisfies_link_condition(state, u, v, count)
        else:
            legal = may_change_topology(state, u, v, count)
        if count < 1 or not legal:
            counters[REJECTIONS] += 1
            continue
        legal = has_counterpart_wedges(state, u, v, count)
        legal = legal and preserves_faces(state, u, v, px, py, pz)
        if not legal or (target == TO_OPTIMUM and not preserves_faces(state, v, u, px, py, pz)):
            counters[REJECTIONS] += 1
            push(state, heap, a, b, rejected | (1 << target))
            continue
        if cost > state.errors[0] * weight:
            state.errors[0] = cost / weight
        state.moved[v] |= target == TO_OPTIMUM
        collapse(state, u, v, count, px, py, pz)
        push_edges_of(state, heap, v)
