"""Compiled collapses of edges: what they cost, in which order they come, what they leave.

An edge may collapse in three ways: into either end, or to the best place where both ends are free
and nothing is painted on the faces. Which ones are allowed, `legality_kernels` says.
"""

from __future__ import annotations

import numpy as np

from ptmtools.jit import plain_kernel as kernel
from ptmtools.simplification.legality_kernels import (
    has_counterparts,
    is_linked,
    keeps_faces,
    may_close,
)
from ptmtools.simplification.quadrics import (
    add,
    best_place,
    shift,
    shift_wedge,
    value_at,
    wedge_value_at,
)
from ptmtools.simplification.state_kernels import (
    ENTRIES,
    FACES,
    KEEP,
    MADE,
    MARKS,
    REFUSED,
    TOPOLOGY,
    Heap,
    State,
    heapify,
    meet,
    move,
    prune,
    rise,
    sink,
    without_stale,
)
from ptmtools.simplification.surface import FREE, LINE
from ptmtools.tolerance import ROUNDING_SHARE

#: When costs have grown so many times, what was refused before is tried again first: others have
#: gone since, and on flat walls it costs nothing.
AGAIN = 4.0
#: The ways of a collapse: into the second end, into the first, to the best place; none.
SECOND, FIRST, PLACED, NONE = 0, 1, 2, 3
#: Share of the weight that pulls the best place to the middle of the edge.
PULL = 1e-5
#: Share of weight times squared length that is added to the cost for the order alone: where
#: everything is flat the shortest edges go first.
SHORTEST = ROUNDING_SHARE
#: A best place must be better than an end by this share of weight times squared length: ends are
#: exact, and corners of a box stay where they are.
BETTER = ROUNDING_SHARE


@kernel
def cost_into(state: State, a: int, b: int, count: int, x: float, y: float, z: float) -> float:
    """What it costs to move vertex a into b, (x, y, z) away."""
    cost = value_at(state.quadric, a, x, y, z) + state.quadric[b, 9]
    if state.attribute.shape[1] == 0:
        return float(cost)
    for i in range(count):
        known = False
        for j in range(i):
            known |= state.shared[j, 0] == state.shared[i, 0]
        if not known:
            here, there = state.shared[i, 0], state.shared[i, 1]
            cost += wedge_value_at(state.texture, state.attribute, here, there, x, y, z)
            cost += state.texture[there, 9]
    return float(cost)


@kernel
def weigh(state: State, a: int, b: int, tried: int) -> int:
    """The cheapest way to collapse an edge, a < b, of those that were not tried.

    Leaves in ``state.shown`` what it costs, and what it costs for the order; for `PLACED` the place
    is left in ``state.place``, as seen from a.
    """
    free_a, free_b = state.freedom[a] == FREE, state.freedom[b] == FREE
    painted = state.attribute.shape[1] > 0
    count = 0
    to_b, to_a = free_a, free_b
    if painted or not (free_a or free_b):
        count = meet(state, a, b)
        if count < 1:
            return NONE
        if state.shared[0, 3]:
            to_b, to_a = state.freedom[a] == LINE, state.freedom[b] == LINE
    point = state.point
    x, y, z = point[b, 0] - point[a, 0], point[b, 1] - point[a, 1], point[b, 2] - point[a, 2]
    weight = (state.quadric[a, 10] + state.quadric[b, 10]) * (x * x + y * y + z * z)
    way, least = NONE, np.inf
    if to_b and not tried & 1:
        cost = cost_into(state, a, b, count, x, y, z)
        if cost < least:
            way, least = SECOND, cost
    if to_a and not tried & 2:
        for i in range(count):
            here = state.shared[i, 0]
            state.shared[i, 0] = state.shared[i, 1]
            state.shared[i, 1] = here
        cost = cost_into(state, b, a, count, -x, -y, -z)
        if cost < least:
            way, least = FIRST, cost
    if free_a and free_b and not painted and not tried & 4:
        cost = best_place(state.quadric, a, b, x, y, z, PULL, state.place)
        if cost < least - BETTER * weight:
            way, least = PLACED, cost
    least = max(least, 0.0)
    state.shown[0] = least
    state.shown[1] = least + SHORTEST * weight
    return way


@kernel
def push(state: State, heap: Heap, a: int, b: int, tried: int) -> None:
    """Puts an edge into the heap, if it may collapse in a way that was not tried."""
    if a > b:
        a, b = b, a
    if weigh(state, a, b, tried) == NONE:
        return
    number = state.number
    if number[ENTRIES] + 2 > len(heap.cost):
        number[ENTRIES] = without_stale(heap, number[ENTRIES], state.version)
    put(state, heap, a, b, tried, state.shown[1])
    rise(heap, number[ENTRIES], number[ENTRIES] - 1)


@kernel
def put(state: State, heap: Heap, a: int, b: int, tried: int, cost: float) -> None:
    """Writes an entry behind the last of the heap."""
    at = state.number[ENTRIES]
    heap.cost[at] = cost
    heap.ends[at, 0] = a
    heap.ends[at, 1] = b
    heap.version[at] = state.version[a] + state.version[b]
    heap.tried[at] = tried
    state.number[ENTRIES] = at + 1


@kernel
def fill(state: State, heap: Heap) -> None:
    """Puts all edges into an empty heap."""
    triangle = state.triangle
    state.number[ENTRIES] = state.number[REFUSED] = 0
    for t in range(len(triangle)):
        if triangle[t, 0] < 0:
            continue
        for k in range(3):
            a, b = triangle[t, k], triangle[t, (k + 1) % 3]
            # Edges that are not kept have two faces, each of which begins them at another end.
            if a > b:
                if not (state.kept[t] >> k) & 1:
                    continue
                a, b = b, a
            if weigh(state, a, b, 0) != NONE:
                put(state, heap, a, b, 0, state.shown[1])
    heapify(heap, state.number[ENTRIES])


@kernel
def keep_edges(state: State, v: int, count: int) -> None:
    """Where an edge that was kept has fallen onto one of v that was not, that is kept now."""
    triangle, kept, shared = state.triangle, state.kept, state.shared
    for i in range(count):
        if not (shared[i, 4] or shared[i, 5]):
            continue
        third, corner = shared[i, 2], state.head[v]
        while corner >= 0:
            t, k = corner // 3, corner % 3
            corner = state.beyond[corner]
            if triangle[t, (k + 1) % 3] == third:
                kept[t] |= np.uint8(1 << k)
            if triangle[t, (k + 2) % 3] == third:
                kept[t] |= np.uint8(1 << ((k + 2) % 3))


@kernel
def cancel(state: State, v: int) -> None:
    """Takes away the faces of v that lie back to back."""
    triangle = state.triangle
    corner = state.head[v]
    while corner >= 0:
        t, k = corner // 3, corner % 3
        corner = state.beyond[corner]
        if triangle[t, 0] < 0:
            continue
        x, y = triangle[t, (k + 1) % 3], triangle[t, (k + 2) % 3]
        other = corner
        while other >= 0:
            s, j = other // 3, other % 3
            other = state.beyond[other]
            alive = triangle[s, 0] >= 0
            if alive and triangle[s, (j + 1) % 3] == y and triangle[s, (j + 2) % 3] == x:
                triangle[t, 0] = triangle[s, 0] = -1
                state.number[FACES] -= 2
                break


@kernel
def collapse(state: State, u: int, v: int, count: int, px: float, py: float, pz: float) -> None:
    """Moves u into v, and v to that place; ``shared`` holds the faces between them."""
    triangle, wedge, shared, point = state.triangle, state.wedge, state.shared, state.point
    texture, attribute = state.texture, state.attribute
    x, y, z = px - point[u, 0], py - point[u, 1], pz - point[u, 2]
    shift(state.quadric, u, x, y, z)
    shift(state.quadric, v, px - point[v, 0], py - point[v, 1], pz - point[v, 2])
    add(state.quadric, v, u)
    if attribute.shape[1]:
        for i in range(count):
            known = False
            for j in range(i):
                known |= shared[j, 0] == shared[i, 0]
            if not known:
                here, there = shared[i, 0], shared[i, 1]
                shift_wedge(texture, attribute, here, there, x, y, z)
                add(texture, there, here)
    point[v, 0], point[v, 1], point[v, 2] = px, py, pz
    corner = state.head[u]
    while corner >= 0:
        t, k = corner // 3, corner % 3
        corner = state.beyond[corner]
        if triangle[t, (k + 1) % 3] == v or triangle[t, (k + 2) % 3] == v:
            triangle[t, 0] = -1
            state.number[FACES] -= 1
            continue
        triangle[t, k] = v
        for i in range(count):
            if shared[i, 0] == wedge[t, k]:
                wedge[t, k] = shared[i, 1]
                break
    state.beyond[state.tail[v]] = state.head[u]
    state.tail[v] = state.tail[u]
    prune(state, v)
    if state.number[TOPOLOGY] != KEEP:
        cancel(state, v)
        prune(state, v)
    state.head[u] = state.tail[u] = -1
    keep_edges(state, v, count)
    state.version[u] += 1
    state.version[v] += 1
    state.number[MADE] += 1


@kernel
def push_around(state: State, heap: Heap, v: int) -> None:
    """Puts the edges of a vertex into the heap, each once."""
    triangle, mark = state.triangle, state.mark
    seen = state.number[MARKS] + 1
    state.number[MARKS] = seen
    mark[v] = seen
    corner = state.head[v]
    while corner >= 0:
        t = corner // 3
        for k in range(3):
            other = triangle[t, k]
            if mark[other] != seen:
                mark[other] = seen
                push(state, heap, v, other, 0)
        corner = state.beyond[corner]


@kernel
def collapse_edges(state: State, heap: Heap, faces: int) -> None:
    """Collapses edges, the cheapest first, until so many faces are left or no edge."""
    number, version = state.number, state.version
    while number[FACES] > faces and number[ENTRIES] > 0:
        a, b = heap.ends[0, 0], heap.ends[0, 1]
        tried, stamp = heap.tried[0], heap.version[0]
        if number[REFUSED] > 0 and heap.cost[0] > state.worst[2]:
            state.worst[2] = AGAIN * heap.cost[0]
            fill(state, heap)
            continue
        number[ENTRIES] -= 1
        move(heap, 0, number[ENTRIES])
        sink(heap, number[ENTRIES], 0)
        if stamp != version[a] + version[b]:
            continue
        way = weigh(state, a, b, tried)
        cost = state.shown[0]
        weight = state.quadric[a, 10] + state.quadric[b, 10]
        if cost > state.worst[1] * weight:
            continue
        u, v = (a, b) if way == SECOND else (b, a)
        px, py, pz = state.point[v, 0], state.point[v, 1], state.point[v, 2]
        if way == PLACED:
            px, py, pz = px + state.place[0], py + state.place[1], pz + state.place[2]
        prune(state, u)
        prune(state, v)
        count = meet(state, u, v)
        keep = number[TOPOLOGY] == KEEP
        fits = is_linked(state, u, v, count) if keep else may_close(state, u, v, count)
        if count < 1 or not fits:
            number[REFUSED] += 1
            continue
        fits = has_counterparts(state, u, v, count) and keeps_faces(state, u, v, px, py, pz)
        if not fits or (way == PLACED and not keeps_faces(state, v, u, px, py, pz)):
            number[REFUSED] += 1
            push(state, heap, a, b, tried | (1 << way))
            continue
        if cost > state.worst[0] * weight:
            state.worst[0] = cost / weight
        state.moved[v] |= way == PLACED
        collapse(state, u, v, count, px, py, pz)
        push_around(state, heap, v)
