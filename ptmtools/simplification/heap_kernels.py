"""Compiled heap of edges, the cheapest first; equal ones go by their vertices.

An entry is ``cost[i]``, the vertices ``ends[i]`` (the lower first), the sum of their versions when
it was made, and the ways that were tried in vain. It is stale when a vertex has another version by
now: it stays until it comes up, or until room is wanted.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats
from ptmtools.compiled import plain_kernel as kernel


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
