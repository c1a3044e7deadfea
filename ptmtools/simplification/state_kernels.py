"""Mutable state of a mesh during edge collapses, its compiled traversal, and the heap of edges.

The corners of a vertex form a linked list, so two lists merge in constant time and memory stays
linear. Corners of removed faces stay in the list until `prune`.

The heap has the cheapest edge first; ties follow the vertex indices. An entry consists of
``cost[i]``, the vertices ``ends[i]`` (the lower first), the sum of their versions at its insertion,
and the bits of its rejected targets. An entry is stale if the version of a vertex has changed; it
stays until it is popped or the heap is full.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.jit import plain_kernel as kernel

#: Maximum number of faces of an edge that may collapse.
MAX_EDGE_FACES = 64

#: Valence from which `faces_of_edge` searches the faces of the other end instead.
HIGH_VALENCE = 32

#: Indices of `State.counters`: faces, heap entries, marks, collapses, rejections since the last
#: rebuild of the heap, and the permitted change of the topology.
FACES, ENTRIES, MARKS, COLLAPSES, REJECTIONS, TOPOLOGY = 0, 1, 2, 3, 4, 5
#: Permitted changes of the topology: none; close handles and drop closed parts; drop all parts.
KEEP_TOPOLOGY, CLOSE_HANDLES, DROP_PARTS = 0, 1, 2


class CollapseState(NamedTuple):
    """A mesh during edge collapses; kernels change all arrays in place.

    Attributes
    ----------
    point, triangle, constraint, wedge, freedom: see `Surface`; rows of removed faces begin with -1.
    quadric, wedge_quadric, attribute: (V, SIZE), (W, 10 + 5 m) and (W, m), see `quadrics`.
    head, tail: (V,) the first and the last corner of each vertex, -1 for none.
    next_corner: (3 T,) the next corner of the same vertex, -1 for none.
    version: (V,) number of changes of each vertex.
    moved: (V,) whether a vertex has left its original position.
    counters: (6,) indexed by `FACES` … `TOPOLOGY`.
    turn_limits: (3,) limits of a face's turn, such as `legality_kernels.STRICT_LIMITS`.
    errors: (3,) the largest squared error of a collapse, the maximum squared error, and the cost
        above which rejected edges are retried.
    mark, optimum, shared, edge_cost: (V,), (3,), (`MAX_EDGE_FACES`, 6) and (2,) scratch buffers.
    """

    point: Floats
    triangle: NDArray[np.int32]
    constraint: NDArray[np.uint8]
    wedge: NDArray[np.int32]
    freedom: NDArray[np.int8]
    quadric: Floats
    wedge_quadric: Floats
    attribute: Floats
    head: NDArray[np.int32]
    tail: NDArray[np.int32]
    next_corner: NDArray[np.int32]
    version: NDArray[np.int32]
    mark: Ints
    moved: Bools
    counters: Ints
    optimum: Floats
    shared: NDArray[np.int32]
    edge_cost: Floats
    turn_limits: Floats
    errors: Floats


@kernel
def link_corners(
    triangle: NDArray[np.int32],
    head: NDArray[np.int32],
    tail: NDArray[np.int32],
    next_corner: NDArray[np.int32],
) -> None:
    """Builds the list of corners of each vertex; heads and tails are -1 on entry."""
    for t in range(len(triangle)):
        for k in range(3):
            corner, v = 3 * t + k, triangle[t, k]
            next_corner[corner] = -1
            if head[v] < 0:
                head[v] = corner
            else:
                next_corner[tail[v]] = corner
            tail[v] = corner


@kernel
def prune(state: CollapseState, v: int) -> None:
    """Removes the corners of removed faces from the list of a vertex."""
    triangle, head, tail, next_corner = state.triangle, state.head, state.tail, state.next_corner
    last, corner = -1, head[v]
    head[v] = -1
    while corner >= 0:
        if triangle[corner // 3, 0] >= 0:
            if last < 0:
                head[v] = corner
            else:
                next_corner[last] = corner
            last = corner
        corner = next_corner[corner]
    tail[v] = last
    if last >= 0:
        next_corner[last] = -1


@kernel
def has_high_valence(state: CollapseState, v: int) -> bool:
    """Whether a vertex has at least `HIGH_VALENCE` corners."""
    corner = state.head[v]
    for _ in range(HIGH_VALENCE):
        if corner < 0:
            return False
        corner = state.next_corner[corner]
    return True


@kernel
def faces_of_edge(state: CollapseState, a: int, b: int) -> int:
    """Writes the faces of an edge to ``shared``; returns their number, -1 beyond `MAX_EDGE_FACES`.

    A row holds the wedges at a and b, the third vertex, and the constraint bits of the edge itself
    and of the edges from a and b to the third vertex.
    """
    triangle, constraint, wedge, shared = (
        state.triangle,
        state.constraint,
        state.wedge,
        state.shared,
    )
    # Searching the faces of a high-valence vertex for each of its edges takes quadratic time.
    first, second = (b, a) if has_high_valence(state, a) else (a, b)
    column_first, column_second = (1, 0) if first == b else (0, 1)
    count, corner = 0, state.head[first]
    while corner >= 0:
        t, k = corner // 3, corner % 3
        corner = state.next_corner[corner]
        if triangle[t, 0] < 0:
            continue
        after, last = (k + 1) % 3, (k + 2) % 3
        neighbour, third = after, last
        if triangle[t, last] == second:
            neighbour, third = last, after
        elif triangle[t, after] != second:
            continue
        if count == MAX_EDGE_FACES:
            return -1
        # The edge after a corner has the bit of that corner, the edge before it that of ``last``.
        to_neighbour = k if neighbour == after else last
        to_third = last if neighbour == after else k
        shared[count, column_first] = wedge[t, k]
        shared[count, column_second] = wedge[t, neighbour]
        shared[count, 2] = triangle[t, third]
        shared[count, 3] = (constraint[t] >> to_neighbour) & 1
        shared[count, 4 + column_first] = (constraint[t] >> to_third) & 1
        shared[count, 4 + column_second] = (constraint[t] >> after) & 1
        count += 1
    return count


class Heap(NamedTuple):
    """Buffers of the heap, with a row for each possible entry (see the module)."""

    cost: Floats
    ends: NDArray[np.int32]
    version: NDArray[np.int32]
    rejected: NDArray[np.int8]

    @staticmethod
    def empty(capacity: int) -> Heap:
        return Heap(
            np.empty(capacity),
            np.empty((capacity, 2), np.int32),
            np.empty(capacity, np.int32),
            np.empty(capacity, np.int8),
        )


@kernel
def precedes(heap: Heap, i: int, j: int) -> bool:
    """Whether entry i precedes entry j."""
    cost, ends = heap[0], heap[1]
    if cost[i] != cost[j]:
        return bool(cost[i] < cost[j])
    if ends[i, 0] != ends[j, 0]:
        return bool(ends[i, 0] < ends[j, 0])
    return bool(ends[i, 1] < ends[j, 1])


@kernel
def copy_entry(heap: Heap, to: int, at: int) -> None:
    """Copies an entry."""
    cost, ends, version, rejected = heap
    cost[to] = cost[at]
    ends[to, 0] = ends[at, 0]
    ends[to, 1] = ends[at, 1]
    version[to] = version[at]
    rejected[to] = rejected[at]


@kernel
def sift_down(heap: Heap, size: int, at: int) -> None:
    """Sifts an entry down. The row behind the last entry is a scratch buffer."""
    copy_entry(heap, size, at)
    while True:
        child = 2 * at + 1
        if child >= size:
            break
        if child + 1 < size and precedes(heap, child + 1, child):
            child += 1
        if not precedes(heap, child, size):
            break
        copy_entry(heap, at, child)
        at = child
    copy_entry(heap, at, size)


@kernel
def sift_up(heap: Heap, size: int, at: int) -> None:
    """Sifts an entry up. The row behind the last entry is a scratch buffer."""
    copy_entry(heap, size, at)
    while at > 0:
        parent = (at - 1) // 2
        if not precedes(heap, size, parent):
            break
        copy_entry(heap, at, parent)
        at = parent
    copy_entry(heap, at, size)


@kernel
def heapify(heap: Heap, size: int) -> None:
    """Establishes the order of the heap."""
    for at in range(size // 2 - 1, -1, -1):
        sift_down(heap, size, at)


@kernel
def drop_stale(heap: Heap, size: int, version: NDArray[np.int32]) -> int:
    """Drops stale entries, restores the order, and returns the number of entries."""
    ends, stamp = heap[1], heap[2]
    remaining = 0
    for i in range(size):
        if stamp[i] == version[ends[i, 0]] + version[ends[i, 1]]:
            copy_entry(heap, remaining, i)
            remaining += 1
    heapify(heap, remaining)
    return remaining
