"""Compiled searches of the graph that a walk is planned on (`ground`)."""

from __future__ import annotations

from heapq import heappop, heappush

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.jit import kernel


@kernel
def nearest_goal(start: Ints, target: Ints, cost: Floats, source: int, goal: Bools) -> Ints:
    """Dijkstra's algorithm from a ``source`` to the nearest of the (n,) ``goal`` places: the places
    on the way, or none."""
    count = len(start) - 1
    least = np.full(count, np.inf)
    before = np.full(count, -1, dtype=np.int64)
    least[source] = 0.0
    heap = [(0.0, source)]
    nearest = -1
    while len(heap):
        paid, place = heappop(heap)
        if paid > least[place]:
            continue
        if goal[place]:
            nearest = place
            break
        for step in range(start[place], start[place + 1]):
            to, sum_ = target[step], paid + cost[step]
            if sum_ < least[to]:
                least[to] = sum_
                before[to] = place
                heappush(heap, (sum_, to))
    length, place = 0, nearest
    while place >= 0:
        length += 1
        place = before[place]
    way = np.empty(length, dtype=np.int64)
    place = nearest
    while place >= 0:
        length -= 1
        way[length] = place
        place = before[place]
    return way


@kernel
def spread_parts(start: Ints, target: Ints, part: Ints) -> int:
    """Writes the number of the connected part of each place to (n,) ``part``, all -1 before;
    returns the number of parts."""
    waiting = np.empty(len(part), dtype=np.int64)
    parts = 0
    for first in range(len(part)):
        if part[first] >= 0:
            continue
        part[first] = parts
        waiting[0] = first
        count = 1
        while count:
            count -= 1
            place = waiting[count]
            for step in range(start[place], start[place + 1]):
                to = target[step]
                if part[to] < 0:
                    part[to] = parts
                    waiting[count] = to
                    count += 1
        parts += 1
    return parts
