"""How far one sees from a place, all around, in a horizontal section of the walls.

A direction counts as the mean free distance over a sector about it, so that a slit between two
walls does not win; one that leaves the model counts as blind. (Tried: Embree rays from the middle
of a cell. They see down doorways, but the middle of a hall is as often a table.)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: Directions tried, and how many to either side make a sector (±15°).
_DIRECTIONS = 72
_SECTOR = 3
#: What angles may be wrong by, in steps from one direction to the next.
_LEEWAY = 1e-6
#: Walls seen from places at a time.
_AT_ONCE = 1 << 16
_YAW = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
_X, _Z = -np.sin(_YAW), -np.cos(_YAW)


def longest_views(
    places: NDArray[np.float64], walls: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(yaw in radians, mean free distance of its sector in metres), both (n,), from (n, 2) places
    among (m, 2, 2) walls."""
    some = max(1, _AT_ONCE // max(len(walls), 1))
    free = np.concatenate([_free(places[i : i + some], walls) for i in range(0, len(places), some)])
    sector = np.arange(-_SECTOR, _SECTOR + 1)
    mean = free[:, (np.arange(_DIRECTIONS)[:, None] + sector) % _DIRECTIONS].mean(axis=2)
    best = mean.argmax(axis=1)
    return _YAW[best], mean.max(axis=1)


def _free(places: NDArray[np.float64], walls: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 72) metres to the first wall in each direction; 0 where there is none."""
    along = walls[:, 1] - walls[:, 0]
    ends = walls - places[:, None, None]
    # Each wall only with the directions that it can stand in.
    angle = np.arctan2(-ends[..., 0], -ends[..., 1]) * (_DIRECTIONS / (2 * np.pi))
    turn = angle[..., 1] - angle[..., 0]
    turn -= _DIRECTIONS * np.round(turn / _DIRECTIONS)
    low = np.minimum(angle[..., 0], angle[..., 0] + turn)
    first = np.ceil(low - _LEEWAY).astype(np.int64).ravel()
    count = np.floor(low + abs(turn) + _LEEWAY).astype(np.int64).ravel() + 1 - first
    pair = np.repeat(np.arange(len(first)), count)
    step = np.arange(len(pair)) - np.repeat(np.cumsum(count) - count, count)
    way = (first[pair] + step) % _DIRECTIONS
    a, b, x, z = ends[..., 0, :].reshape(-1, 2)[pair], along[pair % len(along)], _X[way], _Z[way]
    det = x * b[:, 1] - z * b[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / det
        share = (a[:, 0] * z - a[:, 1] * x) / det
    hit = (det != 0) & (distance > 0) & (share >= 0) & (share <= 1)
    nearest = np.full(len(places) * _DIRECTIONS, np.inf)
    np.minimum.at(nearest, (pair // len(along) * _DIRECTIONS + way)[hit], distance[hit])
    return np.where(np.isfinite(nearest), nearest, 0.0).reshape(-1, _DIRECTIONS)
