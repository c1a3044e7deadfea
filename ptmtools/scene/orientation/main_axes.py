"""Computes the main axes of a building, and from them tolerances that do not change with rotation.

The tolerances and the first root box depend on the model's extent. An extent along the coordinate
axes would grow by up to √3 when the model is rotated, and the cells would change with it. Therefore
the extent is measured along the main axes: the direction that most area is perpendicular to, and
the one with most area among the directions perpendicular to the first. If these are the coordinate
axes within rounding, as nearly always, the coordinate axes themselves are used.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats
from ptmtools.tolerance import PARALLEL_COSINE, Tolerance, rank

#: Number of the largest triangles whose normals are candidate directions.
_CANDIDATES = 64
#: Rows of one matrix product, which fit the cache.
_BATCH = 4096
#: Directions with a smaller dot product are perpendicular.
_PERPENDICULAR = 1e-3


def tolerance_of(points: Floats, triangles: NDArray[np.integer], step: float = 0.0) -> Tolerance:
    """The tolerances for (T, 3) triangles over (V, 3) points on a grid of this ``step``."""
    return Tolerance.for_points(points @ main_axes(points[triangles]).T, step)


def main_axes(corners: Floats) -> Floats:
    """(3, 3) orthonormal rows, right-handed, of (T, 3, 3) triangles; the unit matrix if these are
    the coordinate axes, or without a second axis."""
    extent = float(np.ptp(corners.reshape(-1, 3), axis=0).max()) if len(corners) else 0.0
    if not extent > 0:
        return np.eye(3)
    edges = (corners[:, 1:] - corners[:, :1]) / extent
    normals = np.cross(edges[:, 0], edges[:, 1])
    areas = np.linalg.norm(normals, axis=1)
    positive = areas > 0
    normals, areas = normals[positive] / areas[positive, None], areas[positive]
    candidates = normals[rank(areas)[:_CANDIDATES]]
    weights = np.zeros(len(candidates))
    for first in range(0, len(areas), _BATCH):
        rows = slice(first, first + _BATCH)
        weights += areas[rows] @ (np.abs(normals[rows] @ candidates.T) >= PARALLEL_COSINE)
    order = rank(weights)
    across = [i for i in order if abs(float(candidates[i] @ candidates[order[0]])) < _PERPENDICULAR]
    if not across:
        return np.eye(3)
    first, second = candidates[order[0]], candidates[across[0]]
    second = second - (second @ first) * first
    second /= np.linalg.norm(second)
    axes = np.stack([first, second, np.cross(first, second)])
    if np.all(np.abs(axes).max(axis=1) >= PARALLEL_COSINE):
        return np.eye(3)
    return axes
