"""Where to look from a place: where there is most to see, and of views that are worth about as much
along the longest.

What there is to see is counted by rays (`pictures`). How far one sees is measured all around, in a
horizontal section of the walls: a direction counts as the mean free distance over a sector about
it, so that a slit between two walls does not win; one that leaves the model counts as blind.

(Tried: the longest view alone. It is often along a bare wall. Embree rays from the middle of a
cell, for the longest view: they see down doorways, but the middle of a hall is as often a table.)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial

import numpy as np
from numpy.typing import NDArray

from ptmtools.database.model import TextureRecord
from ptmtools.database.section import triangle_section
from ptmtools.database.viewpoints.pictures import DIRECTIONS, Pictures
from ptmtools.scene.model import Scene

#: Views worth at least this share of the best are worth about as much.
_AS_GOOD = 0.97
#: How many directions to either side make a sector (±15°).
_SECTOR = 3
#: What angles may be wrong by, in steps from one direction to the next.
_LEEWAY = 1e-6
#: Walls seen from places at a time.
_AT_ONCE = 1 << 16
_YAW = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
_X, _Z = -np.sin(_YAW), -np.cos(_YAW)


@dataclass(frozen=True)
class View:
    """What is best seen from some places.

    Attributes
    ----------
    place: which of them it is seen from.
    yaw: radians, counter-clockwise from -Z.
    worth: see `Pictures.worth`.
    """

    place: int
    yaw: float
    worth: float


class Outlook:
    """What one sees of a scene.

    Attributes
    ----------
    walls: (m, 2, 2) segments in plan, the section of the opaque triangles at a height; made once
        for each: rooms of a storey share one.
    """

    def __init__(self, scene: Scene, textures: Sequence[TextureRecord]) -> None:
        self.walls: Callable[[float], NDArray[np.float64]] = cache(
            partial(triangle_section, scene.corners[scene.opaque])
        )
        self._pictures = Pictures(scene, textures)

    def best(self, places: NDArray[np.float64], height: float) -> View:
        """From (n, 3) places, about as high as ``height``."""
        worth = self._pictures.worth(places)
        good = worth >= _AS_GOOD * worth.max()
        length = np.where(good, lengths(places[:, [0, 2]], self.walls(height)), -1.0)
        place, way = np.unravel_index(int(length.argmax()), length.shape)
        return View(int(place), float(_YAW[way]), float(worth[place, way]))


def lengths(places: NDArray[np.float64], walls: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, DIRECTIONS) mean free distance of the sector about each direction, metres, from (n, 2)
    places among (m, 2, 2) walls."""
    some = max(1, _AT_ONCE // max(len(walls), 1))
    free = np.concatenate([_free(places[i : i + some], walls) for i in range(0, len(places), some)])
    sector = np.arange(-_SECTOR, _SECTOR + 1)
    around = (np.arange(DIRECTIONS)[:, None] + sector) % DIRECTIONS
    mean: NDArray[np.float64] = free[:, around].mean(axis=2)
    return mean


def _free(places: NDArray[np.float64], walls: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 72) metres to the first wall in each direction; 0 where there is none."""
    along = walls[:, 1] - walls[:, 0]
    ends = walls - places[:, None, None]
    # Each wall only with the directions that it can stand in.
    angle = np.arctan2(-ends[..., 0], -ends[..., 1]) * (DIRECTIONS / (2 * np.pi))
    turn = angle[..., 1] - angle[..., 0]
    turn -= DIRECTIONS * np.round(turn / DIRECTIONS)
    low = np.minimum(angle[..., 0], angle[..., 0] + turn)
    first = np.ceil(low - _LEEWAY).astype(np.int64).ravel()
    count = np.floor(low + abs(turn) + _LEEWAY).astype(np.int64).ravel() + 1 - first
    pair = np.repeat(np.arange(len(first)), count)
    step = np.arange(len(pair)) - np.repeat(np.cumsum(count) - count, count)
    way = (first[pair] + step) % DIRECTIONS
    a, b, x, z = ends[..., 0, :].reshape(-1, 2)[pair], along[pair % len(along)], _X[way], _Z[way]
    det = x * b[:, 1] - z * b[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / det
        share = (a[:, 0] * z - a[:, 1] * x) / det
    hit = (det != 0) & (distance > 0) & (share >= 0) & (share <= 1)
    nearest = np.full(len(places) * DIRECTIONS, np.inf)
    np.minimum.at(nearest, (pair // len(along) * DIRECTIONS + way)[hit], distance[hit])
    return np.where(np.isfinite(nearest), nearest, 0.0).reshape(-1, DIRECTIONS)
