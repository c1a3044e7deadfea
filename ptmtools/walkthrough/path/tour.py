"""In which order the rooms of a building are visited: always the nearest next, by way on foot.

A room whose pictures are worth a stop is visited there; another one somewhere in its middle, unless
the way to somewhere else leads through it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.walkthrough.path.ground import Ground
from ptmtools.walkthrough.path.views import Stop, Views

#: Places in a row on the way that count as a visit of the room they are in.
_PASSED = 3


@dataclass(frozen=True)
class Leg:
    """A way from one visit to the next, and what is looked at there.

    Attributes
    ----------
    places: (n,) on the ground, both ends included.
    passed: indices of ``places`` at which a room is visited in passing.
    looks: (k, 3) unit vectors to look along at its end; none if nothing there is worth a stop.
    """

    places: Ints
    passed: tuple[int, ...]
    looks: Floats

    @staticmethod
    def at(place: int, *looks: tuple[float, float, float]) -> Leg:
        """No way, and what is looked at from there."""
        return Leg(np.array([place]), (), np.array(looks, dtype=np.float64).reshape(-1, 3))


def tour(ground: Ground, middles: dict[int, int], views: Views, first: Leg) -> Iterator[list[Leg]]:
    """Round after round, without an end, the ``first`` leg before them.

    Each round visits all cells that have ``middles``, see `middles_of`.
    """
    legs, before = [first], [first]
    while True:
        legs = list(_round(ground, middles, views.round(), int(legs[-1].places[-1])))
        yield before + legs
        before = []


def middles_of(ground: Ground, standing: Bools) -> dict[int, int]:
    """By each cell that (C,) ``standing`` marks and the ground reaches, a place in its middle: of
    those with most space around the nearest to all."""
    found = {}
    for cell in np.unique(ground.cell[ground.cell >= 0]):
        if standing[cell]:
            places = np.flatnonzero(ground.cell == cell)
            away = np.linalg.norm(ground.eye[places] - ground.eye[places].mean(axis=0), axis=1)
            found[int(cell)] = int(places[np.lexsort((away, -ground.space[places]))[0]])
    return found


def _round(
    ground: Ground, middles: dict[int, int], stops: dict[int, list[Stop]], at: int
) -> Iterator[Leg]:
    """One time round, from the place ``at``."""
    looks: dict[int, list[tuple[float, ...]]] = {}
    for stop in (one for several in stops.values() for one in several):
        looks.setdefault(stop.place, []).append(stop.direction)
    missing = {cell: place for cell, place in middles.items() if cell not in stops}
    goal = np.zeros(len(ground.eye), dtype=np.bool_)
    goal[[*looks, *missing.values()]] = True
    while goal.any():
        way = ground.way_to_nearest(at, goal)
        at = int(way[-1])
        missing.pop(int(ground.cell[at]), None)
        passed = []
        for cell, middle in _runs(ground.cell[way]):
            if cell in missing:
                goal[missing.pop(cell)] = False
                passed.append(middle)
        goal[at] = False
        yield Leg(way, tuple(passed), np.array(looks.get(at, [])).reshape(-1, 3))


def _runs(cells: Ints) -> Iterator[tuple[int, int]]:
    """Each cell that several places in a row are in, and the index of the middle one."""
    first = np.flatnonzero(np.diff(cells, prepend=-2))
    for begin, end in zip(first, [*first[1:], len(cells)], strict=True):
        if end - begin >= _PASSED and cells[begin] >= 0:
            yield int(cells[begin]), int(begin + end - 1) // 2
