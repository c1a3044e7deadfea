"""The directions that a building is laid out in, and the tolerances of a scene, so that turning it
changes nothing.

The tolerances and the first root box depend on the model's extent. Taken along the coordinate axes
that would grow by up to √3 when the model is turned, and cells with it. They are taken along the
building's own axes instead: the direction that most area is square to, and the one with most area
among those that are square to the first. Where these are the coordinate axes within rounding, as
nearly always, the coordinate axes themselves are taken.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.tolerance import PARALLEL_COSINE, Tolerance, ranked

#: The largest triangles, this many, propose directions.
_CANDIDATES = 64
_AT_ONCE = 4096
#: Directions with a lesser dot product than this are square to one another.
_SQUARE = 1e-3


def tolerance_of(
    points: NDArray[np.float64], triangles: NDArray[np.integer], step: float = 0.0
) -> Tolerance:
    """The tolerances for a scene of (T, 3) triangles over (V, 3) points, which the file has on a
    grid of this ``step``."""
    return Tolerance.for_points(points @ main_axes(points[triangles]).T, step)


def main_axes(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3, 3) orthonormal rows, right-handed, of (T, 3, 3) triangles; the unit matrix for triangles
    that are laid out along the coordinate axes or along none."""
    extent = float(np.ptp(corners.reshape(-1, 3), axis=0).max()) if len(corners) else 0.0
    if not extent > 0:
        return np.eye(3)
    edges = (corners[:, 1:] - corners[:, :1]) / extent
    normals = np.cross(edges[:, 0], edges[:, 1])
    areas = np.linalg.norm(normals, axis=1)
    whole = areas > 0
    normals, areas = normals[whole] / areas[whole, None], areas[whole]
    candidates = normals[ranked(areas)[:_CANDIDATES]]
    weights = np.zeros(len(candidates))
    for first in range(0, len(areas), _AT_ONCE):  # so many at a time stay in the cache
        rows = slice(first, first + _AT_ONCE)
        weights += areas[rows] @ (np.abs(normals[rows] @ candidates.T) >= PARALLEL_COSINE)
    order = ranked(weights)
    square = [i for i in order if abs(float(candidates[i] @ candidates[order[0]])) < _SQUARE]
    if not square:
        return np.eye(3)
    first, second = candidates[order[0]], candidates[square[0]]
    second = second - (second @ first) * first
    second /= np.linalg.norm(second)
    axes = np.stack([first, second, np.cross(first, second)])
    if np.all(np.abs(axes).max(axis=1) >= PARALLEL_COSINE):
        return np.eye(3)
    return axes
