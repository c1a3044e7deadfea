"""Convex bodies and polygons as a client reads them: what is wrong with one, and what is inside.

All in float64 with the distances of `Tolerance`; a body is its planes, (f, 4) unit normals
outwards and offsets, so that n·x + d is how far x lies in front.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from ptmtools.tolerance import Tolerance

Points = NDArray[np.float64]
Planes = NDArray[np.float64]

#: Corners of a body beyond which it is none of ours: `vrml.hull` takes time by their square.
MOST_CORNERS = 1 << 14
#: Distances computed at a time.
_BATCH = 1 << 22


class SolidError(Exception):
    """What is wrong with a body or a polygon, as the rest of a sentence."""


def solid_planes(points: Points, loops: Sequence[Sequence[int]], tolerance: Tolerance) -> Planes:
    """The planes of a closed convex polyhedron.

    Parameters
    ----------
    points: (n, 3).
    loops: its faces, indices into ``points``, counter-clockwise seen from outside.

    Raises SolidError: it is none, within the tolerance's on-plane distance.
    """
    if len(points) > MOST_CORNERS:
        raise SolidError(f"has {len(points)} corners, more than any cell")
    size = np.array([len(loop) for loop in loops])
    start = np.cumsum(size) - size
    index = np.fromiter(chain.from_iterable(loops), np.int64)
    following = np.roll(index, -1)
    following[start + size - 1] = index[start]
    there = index * len(points) + following
    if len(np.unique(there)) < len(there) or len(
        np.setdiff1d(there, following * len(points) + index)
    ):
        raise SolidError("is not closed")
    planes, sound = _newell(points[index], points[following], start, tolerance)
    if not sound.any():
        raise SolidError("is flat")
    if not farthest(planes[sound], points).max() <= tolerance.plane:
        raise SolidError("is not convex")
    face = np.repeat(np.arange(len(loops)), size)
    behind = -(np.einsum("ij,ij->i", planes[face, :3], points[index]) + planes[face, 3])
    if not behind[sound[face]].max() <= tolerance.plane:
        raise SolidError("has a face that is not flat")
    return planes[sound]


def polygon_plane(polygon: Points, tolerance: Tolerance) -> Planes | None:
    """(4,) the plane of a convex polygon, its normal towards whom it is counter-clockwise for;
    None for a sliver, whose normal says nothing.

    Raises SolidError: it is not flat, or not convex.
    """
    following = np.roll(polygon, -1, axis=0)
    planes, sound = _newell(polygon, following, np.zeros(1, np.int64), tolerance)
    if not sound[0]:
        return None
    plane: Planes = planes[0]
    if not np.abs(polygon @ plane[:3] + plane[3]).max() <= tolerance.plane:
        raise SolidError("is not flat")
    edge = following - polygon
    length = np.linalg.norm(edge, axis=1)
    long = length > tolerance.plane
    # (edges, corners) how far each corner lies on the inner side of each edge.
    inner = np.cross(plane[:3], edge[long] / length[long, None])
    inside = inner @ polygon.T - np.einsum("ij,ij->i", inner, polygon[long])[:, None]
    if not inside.min(initial=0.0) >= -tolerance.plane:
        raise SolidError("is not convex")
    return plane


def polygon_area(polygon: Points) -> float:
    """m²."""
    arms = polygon - polygon[0]
    return float(np.linalg.norm(np.cross(arms[1:-1], arms[2:]).sum(axis=0)) / 2)


def farthest(planes: Planes, points: Points) -> Points:
    """(n,) how far each point lies in front of the plane that it is farthest in front of; -inf
    without planes."""
    far = np.full(len(points), -np.inf)
    step = max(_BATCH // max(len(planes), 1), 1)
    for i in range(0, len(points) if len(planes) else 0, step):
        part = points[i : i + step]
        far[i : i + step] = (part @ planes[:, :3].T + planes[:, 3]).max(axis=1)
    return far


def _newell(
    here: Points, following: Points, start: NDArray[np.int64], tolerance: Tolerance
) -> tuple[Planes, NDArray[np.bool_]]:
    """The planes of polygons whose edges begin ``here``, and which of them are sound: of a sliver
    thinner than the on-plane distance the normal says nothing."""
    size = np.diff([*start, len(here)])
    first = np.repeat(here[start], size, axis=0)
    normal = np.add.reduceat(np.cross(here - first, following - first), start, axis=0)
    longest = np.maximum.reduceat(np.linalg.norm(following - here, axis=1), start)
    twice_area = np.linalg.norm(normal, axis=1)
    sound = twice_area > 2 * tolerance.plane * longest
    normal /= np.where(sound, twice_area, 1.0)[:, None]
    middle = np.add.reduceat(here, start, axis=0) / size[:, None]
    return np.column_stack([normal, -np.einsum("ij,ij->i", normal, middle)]), sound
