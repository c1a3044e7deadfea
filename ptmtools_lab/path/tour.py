"""The order in which the rooms of a building are visited: always the nearest next, by way on foot.

A room with pictures worth a stop is visited there; another one in its middle, unless a way to
another place leads through it.

`StopViews` finds the stops: places that show much of an image, near and from the front. From places
in each room rays are cast all around. A ray counts if its hit is at viewing distance and faces it;
its weight is the bytes of the image's file for the covered part of its surface. So a painting of a
megabyte counts for more than plaster of a megabyte that covers all walls. No ray counts for more
than a screen can show.

Viewed pictures are remembered by image and position, in boxes of about a metre, so that the next
stop is at another picture, of the same image or of another.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints, areas, normals
from ptmtools.scene.model import Scene
from ptmtools_lab.path.ground import WalkGround, WalkObstacles

#: Viewing distances of a picture, metres, and least cosine of the angle to its normal.
NEAR, FAR, FACED = 0.8, 3.0, 0.75
#: Number of ray directions around, and the slopes of their rows.
_AROUND, _SLOPES = 36, (-0.25, 0.0, 0.25)
#: Directions to each side that belong to a view.
_BESIDE = 2
#: Number of places in a room from which views are evaluated.
_CANDIDATES = 48
#: Least free space around a stop, metres.
_SPACE = 0.35
#: Side of the boxes of viewed pictures, metres.
_BOX = 1.2
#: A pixel of a screen of 1080 rows, as an angle.
_PIXEL = 1e-3
#: Least worth of a stop, as shares of the best view of all and of the first stop in the room.
_LEAST, _LEAST_IN_ROOM = 0.05, 0.35
#: Most stops in a room in each round.
_STOPS = 3


@dataclass(frozen=True)
class WalkStop:
    """A place on the ground to stop at, and the unit direction of view."""

    place: int
    direction: tuple[float, float, float]


class StopViews:
    """The views of a building, and which parts of them a visitor has not yet viewed."""

    def __init__(
        self,
        scene: Scene,
        ground: WalkGround,
        obstacles: WalkObstacles,
        random: np.random.Generator,
    ) -> None:
        self._place = _candidates(ground, random)
        self._cell = ground.cell[self._place]
        angle = 2 * np.pi * np.arange(_AROUND) / _AROUND
        level = np.stack([np.cos(angle), np.zeros(_AROUND), np.sin(angle)], axis=1)
        along = level[:, None] + np.array(_SLOPES)[:, None] * np.array([0.0, 1.0, 0.0])
        self._along = along / np.linalg.norm(along, axis=2, keepdims=True)  # (around, slopes, 3)
        shape = (len(self._place), _AROUND, len(_SLOPES))
        self._eye, self._obstacles = ground.eye[self._place], obstacles
        eye = np.repeat(self._eye, _AROUND * len(_SLOPES), axis=0)
        ray = np.tile(self._along.reshape(-1, 3), (len(self._place), 1))
        worth, self._box, self._boxes = _worth(scene, obstacles, eye, ray)
        self._worth, self._box = worth.reshape(shape), self._box.reshape(shape)
        self._new = np.ones(self._boxes)
        self._best = float(self._view_worth().max(initial=0.0))

    def round(self) -> dict[int, list[WalkStop]]:
        """The stops of one round by cell: at pictures not yet viewed, or, once all were, at all of
        them again."""
        if self._view_worth().max(initial=0.0) < _LEAST * self._best:
            self._new[:] = 1.0
        return {
            int(cell): stops for cell in np.unique(self._cell) if (stops := self._stops_in(cell))
        }

    def _stops_in(self, cell: int) -> list[WalkStop]:
        rows = np.flatnonzero(self._cell == cell)
        stops: list[WalkStop] = []
        least = _LEAST * self._best
        while len(stops) < _STOPS:
            shown = self._view_worth(rows)
            row, ahead = np.unravel_index(shown.argmax(), shown.shape)
            if shown[row, ahead] <= 0 or shown[row, ahead] < least:
                break
            least = max(least, _LEAST_IN_ROOM * float(shown[row, ahead]))
            place, window = rows[row], (ahead + np.arange(-_BESIDE, _BESIDE + 1)) % _AROUND
            box = self._box[place, window]
            weight = self._worth[place, window] * self._new[box]
            x, y, z = self._middle(self._eye[place], self._along[window], weight).tolist()
            stops.append(WalkStop(int(self._place[place]), (x, y, z)))
            self._new[box] = 0.0
        return stops

    def _middle(self, eye: Floats, along: Floats, weight: Floats) -> Floats:
        """(3,) unit vector to the middle of rays (…, 3) with (…) weights; if the hit there is too
        far, as in a door between two pictures, the direction of the nearest ray."""
        middle = (weight[..., None] * along).sum(axis=(0, 1))
        middle = middle / np.linalg.norm(middle)
        _, distance = self._obstacles.first(eye[None], middle[None], FAR)
        if NEAR <= distance[0] < FAR:
            return np.asarray(middle)
        counted = along[weight > 0]
        return np.asarray(counted[(counted @ middle).argmax()])

    def _view_worth(self, rows: Ints | slice = slice(None)) -> Floats:
        """(n, around) worth of views not yet viewed, in bytes."""
        ray = (self._worth[rows] * self._new[self._box[rows]]).sum(axis=2)
        return np.asarray(sum(np.roll(ray, k, axis=1) for k in range(-_BESIDE, _BESIDE + 1)))


def _candidates(ground: WalkGround, random: np.random.Generator) -> Ints:
    """Places of views: in each cell some of those with free space, evenly chosen."""
    spacious: Bools = ground.space >= _SPACE
    order = np.flatnonzero(spacious & (ground.cell >= 0))
    order = order[np.argsort(ground.cell[order], kind="stable")]
    _, first, count = np.unique(ground.cell[order], return_index=True, return_counts=True)
    parts = [order[:0]]
    for begin, total in zip(first, count, strict=True):
        chosen = (
            (np.arange(min(total, _CANDIDATES)) + random.random()) * total / min(total, _CANDIDATES)
        )
        parts.append(order[begin + chosen.astype(np.int64)])
    return np.concatenate(parts)


def _worth(
    scene: Scene, obstacles: WalkObstacles, eye: Floats, along: Floats
) -> tuple[Floats, Ints, int]:
    """(n,) the worth in bytes of each ray, from (n, 3) along (n, 3); (n,) the box of its hit; and
    the number of boxes."""
    image = np.array([material.image for material in scene.materials])[scene.triangle_material]
    corners = scene.corners
    length = np.array([len(image.load()) for image in scene.images] + [0], dtype=np.float64)
    size = areas(corners)
    shown = np.roll(np.bincount(image + 1, size, len(length)), -1)
    # No face shows a normal map alone.
    density = np.divide(length, shown, out=np.zeros(len(length)), where=shown > 0)
    met, distance = obstacles.first(eye, along, FAR)
    front = normals(corners[met])
    width = np.linalg.norm(front, axis=1)
    faced = np.abs(np.einsum("ij,ij->i", front, along))
    faced = np.divide(faced, width, out=np.zeros(len(met)), where=width > 0)
    counts = (met >= 0) & (distance >= NEAR) & (faced >= FACED)
    # The area covered by a ray, from its solid angle, which is the same for all.
    bytes_seen = density[image[met]] * distance**2 / np.maximum(faced, FACED)
    worth = np.where(counts, np.minimum(bytes_seen, _PIXEL**-2), 0.0)
    at = np.floor((eye + distance[:, None] * along) / _BOX).astype(np.int64)
    key = np.column_stack([image[met], at])
    key[~counts] = -1
    boxes, box = np.unique(key, axis=0, return_inverse=True)
    return worth, box.reshape(-1).astype(np.int64), len(boxes)


#: Consecutive places on the way that count as a visit of their room.
_PASSED = 3


@dataclass(frozen=True)
class Leg:
    """A way from one visit to the next, with the views at its end.

    Attributes
    ----------
    places: (n,) on the ground, both ends included.
    passed: indices of ``places`` where a room is visited in passing.
    looks: (k, 3) unit directions of view at its end; none without a stop.
    """

    places: Ints
    passed: tuple[int, ...]
    looks: Floats

    @staticmethod
    def at(place: int, *looks: tuple[float, float, float]) -> Leg:
        """A leg without a way, at a place with views."""
        return Leg(np.array([place]), (), np.array(looks, dtype=np.float64).reshape(-1, 3))


def tour(
    ground: WalkGround, middles: dict[int, int], views: StopViews, first: Leg
) -> Iterator[list[Leg]]:
    """Endless rounds of legs; the ``first`` leg precedes them.

    Each round visits all cells that have ``middles``, see `middles_of`.
    """
    legs, before = [first], [first]
    while True:
        legs = list(_round(ground, middles, views.round(), int(legs[-1].places[-1])))
        yield before + legs
        before = []


def middles_of(ground: WalkGround, standing: Bools) -> dict[int, int]:
    """A place in the middle of each (C,) ``standing`` cell that the ground reaches: of those with
    most free space the nearest to the mean of all."""
    result = {}
    for cell in np.unique(ground.cell[ground.cell >= 0]):
        if standing[cell]:
            places = np.flatnonzero(ground.cell == cell)
            away = np.linalg.norm(ground.eye[places] - ground.eye[places].mean(axis=0), axis=1)
            result[int(cell)] = int(places[np.lexsort((away, -ground.space[places]))[0]])
    return result


def _round(
    ground: WalkGround, middles: dict[int, int], stops: dict[int, list[WalkStop]], at: int
) -> Iterator[Leg]:
    """One round, from the place ``at``."""
    looks: dict[int, list[tuple[float, ...]]] = {}
    for stop in chain.from_iterable(stops.values()):
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
    """Each cell with several consecutive places, and the index of the middle one."""
    first = np.flatnonzero(np.diff(cells, prepend=-2))
    for begin, end in zip(first, [*first[1:], len(cells)], strict=True):
        if end - begin >= _PASSED and cells[begin] >= 0:
            yield int(cells[begin]), int(begin + end - 1) // 2
