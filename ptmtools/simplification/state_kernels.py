"""A mesh between collapses, and compiled ways around it: corners at a vertex, faces at an edge.

The corners at a vertex are a linked list, so that two lists become one at once, and memory is
linear. Corners of faces that are gone stay in it until `prune`.

The heap of edges has the cheapest first; ties go by their vertices. An entry is ``cost[i]``, the
vertices ``ends[i]`` (the lower first), the sum of their versions when it was made, and the ways
that were tried in vain. It is stale when a vertex has another version by now: it stays until it
comes up, or until room is wanted.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints
from ptmtools.jit import plain_kernel as kernel

#: So many faces at an edge at most; an edge with more does not collapse.
MOST_AT_EDGE = 64

#: A vertex of so many corners is a hub.
HUB = 32

#: Where `State.number` counts faces, entries of the heap, marks given out, collapses made, and
#: edges refused since all were tried; and says what collapses may do to the topology.
FACES, ENTRIES, MARKS, MADE, REFUSED, TOPOLOGY = 0, 1, 2, 3, 4, 5
#: Nothing; close handles, and let closed parts vanish; let parts with a border vanish, too.
KEEP, CLOSE, DROP = 0, 1, 2


class State(NamedTuple):
    """A mesh between collapses, all of it changed in place.

    Attributes
    ----------
    point, triangle, kept, wedge, freedom: as `Surface` has them; faces that are gone begin with -1.
    quadric, texture, attribute: (V, SIZE), (W, 10 + 5 m) and (W, m), as `quadrics` has them.
    head, tail: (V,) the first and the last corner at each vertex; beyond: (3 T,) the next one.
    version: (V,) how often each vertex has changed.
    moved: (V,) whether it has left its place.
    number: (6,) counts, by `FACES` and so on.
    limits: (3,) say when faces turn, such as `CAREFUL`.
    worst: (3,) the largest error of a collapse, squared, the largest that is allowed, and the cost
        up to which what was refused has been tried again.
    mark, place, shared, shown: (V,), (3,), (`MOST_AT_EDGE`, 6) and (2,), storage.
    """

    point: Floats
    triangle: NDArray[np.int32]
    kept: NDArray[np.uint8]
    wedge: NDArray[np.int32]
    freedom: NDArray[np.int8]
    quadric: Floats
    texture: Floats
    attribute: Floats
    head: NDArray[np.int32]
    tail: NDArray[np.int32]
    beyond: NDArray[np.int32]
    version: NDArray[np.int32]
    mark: Ints
    moved: NDArray[np.bool_]
    number: Ints
    place: Floats
    shared: NDArray[np.int32]
    shown: Floats
    limits: Floats
    worst: Floats


@kernel
def link_corners(
    triangle: NDArray[np.int32],
    head: NDArray[np.int32],
    tail: NDArray[np.int32],
    beyond: NDArray[np.int32],
) -> None:
    """Makes the lists of corners at each vertex; heads and tails are -1 before."""
    for t in range(len(triangle)):
        for k in range(3):
            corner, v = 3 * t + k, triangle[t, k]
            beyond[corner] = -1
            if head[v] < 0:
                head[v] = corner
            else:
                beyond[tail[v]] = corner
            tail[v] = corner


@kernel
def prune(state: State, v: int) -> None:
    """Takes the corners of faces that are gone out of a vertex's list."""
    triangle, head, tail, beyond = state.triangle, state.head, state.tail, state.beyond
    last, corner = -1, head[v]
    head[v] = -1
    while corner >= 0:
        if triangle[corner // 3, 0] >= 0:
            if last < 0:
                head[v] = corner
            else:
                beyond[last] = corner
            last = corner
        corner = beyond[corner]
    tail[v] = last
    if last >= 0:
        beyond[last] = -1


@kernel
def is_hub(state: State, v: int) -> bool:
    """Whether a vertex has many corners."""
    corner = state.head[v]
    for _ in range(HUB):
        if corner < 0:
            return False
        corner = state.beyond[corner]
    return True


@kernel
def meet(state: State, a: int, b: int) -> int:
    """Finds the faces at an edge and returns how many they are, -1 if too many.

    Into each row of ``shared``: the wedges at the two ends, the third vertex, and whether the edge
    itself and those from its ends to that vertex are kept.
    """
    triangle, kept, wedge, shared = state.triangle, state.kept, state.wedge, state.shared
    # Of the hub of a wheel every spoke would look at all others.
    one, two = (b, a) if is_hub(state, a) else (a, b)
    mine, theirs = (1, 0) if one == b else (0, 1)
    count, corner = 0, state.head[one]
    while corner >= 0:
        t, k = corner // 3, corner % 3
        corner = state.beyond[corner]
        if triangle[t, 0] < 0:
            continue
        after, last = (k + 1) % 3, (k + 2) % 3
        other, third = after, last
        if triangle[t, last] == two:
            other, third = last, after
        elif triangle[t, after] != two:
            continue
        if count == MOST_AT_EDGE:
            return -1
        # The edge after a corner has the corner's bit; the one before it that of the last.
        to_other = k if other == after else last
        to_third = last if other == after else k
        shared[count, mine] = wedge[t, k]
        shared[count, theirs] = wedge[t, other]
        shared[count, 2] = triangle[t, third]
        shared[count, 3] = (kept[t] >> to_other) & 1
        shared[count, 4 + mine] = (kept[t] >> to_third) & 1
        shared[count, 4 + theirs] = (kept[t] >> after) & 1
        count += 1
    return count


class Heap(NamedTuple):
    """Storage, each with a row for each entry there may be."""

    cost: Floats
    ends: NDArray[np.int32]
    version: NDArray[np.int32]
    tried: NDArray[np.int8]

    @staticmethod
    def of(capacity: int) -> Heap:
        return Heap(
            np.empty(capacity),
            np.empty((capacity, 2), np.int32),
            np.empty(capacity, np.int32),
            np.empty(capacity, np.int8),
        )


@kernel
def before(heap: Heap, i: int, j: int) -> bool:
    """Whether one entry is to come before another."""
    cost, ends = heap[0], heap[1]
    if cost[i] != cost[j]:
        return bool(cost[i] < cost[j])
    if ends[i, 0] != ends[j, 0]:
        return bool(ends[i, 0] < ends[j, 0])
    return bool(ends[i, 1] < ends[j, 1])


@kernel
def move(heap: Heap, to: int, at: int) -> None:
    """Copies an entry."""
    cost, ends, version, tried = heap
    cost[to] = cost[at]
    ends[to, 0] = ends[at, 0]
    ends[to, 1] = ends[at, 1]
    version[to] = version[at]
    tried[to] = tried[at]


@kernel
def sink(heap: Heap, size: int, at: int) -> None:
    """Lets an entry go down to where it belongs. The row behind the last is storage."""
    move(heap, size, at)
    while True:
        child = 2 * at + 1
        if child >= size:
            break
        if child + 1 < size and before(heap, child + 1, child):
            child += 1
        if not before(heap, child, size):
            break
        move(heap, at, child)
        at = child
    move(heap, at, size)


@kernel
def rise(heap: Heap, size: int, at: int) -> None:
    """Lets an entry go up to where it belongs. The row behind the last is storage."""
    move(heap, size, at)
    while at > 0:
        parent = (at - 1) // 2
        if not before(heap, size, parent):
            break
        move(heap, at, parent)
        at = parent
    move(heap, at, size)


@kernel
def heapify(heap: Heap, size: int) -> None:
    """Orders entries that are in any order."""
    for at in range(size // 2 - 1, -1, -1):
        sink(heap, size, at)


@kernel
def without_stale(heap: Heap, size: int, version: NDArray[np.int32]) -> int:
    """Drops the entries that are stale, orders the others, and returns how many they are."""
    ends, stamp = heap[1], heap[2]
    left = 0
    for i in range(size):
        if stamp[i] == version[ends[i, 0]] + version[ends[i, 1]]:
            move(heap, left, i)
            left += 1
    heapify(heap, left)
    return left
