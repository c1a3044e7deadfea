"""Convex bodies, and the faults of hints in space: leaves, portals and viewpoints.

All in float64 with the distances of `Tolerance`. A body is its planes: (f, 4) outward unit normals
and offsets, so that n·x + d is the distance of x in front of a plane.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import polygon_planes
from ptmtools.tolerance import PARALLEL_COSINE, Tolerance

Record = Mapping[str, Any]
Points = NDArray[np.float64]
Planes = NDArray[np.float64]

#: Largest number of corners of a cell: the time of `convex_hull` grows by their square.
MOST_CORNERS = 1 << 14
#: Distances computed at a time.
_BATCH = 1 << 22


def spatial_faults(
    records: Mapping[int, Record], viewpoints: Sequence[Record], extent: float
) -> Iterator[str]:
    """The leaves that are no convex polyhedra ("leaves"), the portals that lie in no face of their
    cell ("portals"), and the viewpoints outside of their cell ("viewpoint_place"). ``extent``: see
    `tolerance_about`."""
    leaves = [
        (i, k, leaf, np.array(leaf["points"], np.float64))
        for i, record in records.items()
        for k, leaf in enumerate(record["leaves"])
    ]
    if not leaves:
        return
    tolerance = tolerance_about(np.concatenate([points for *_, points in leaves]), extent)
    bodies: dict[int, list[Planes]] = {i: [] for i in records}
    for i, k, leaf, points in leaves:
        try:
            bodies[i].append(solid_planes(points, leaf["faces"], tolerance))
        except SolidError as fault:
            yield f"leaves: {i}: leaf {k} {fault}"
    for i, record in records.items():
        for k, portal in enumerate(record["portals"]):
            polygon = np.array(portal["polygon"], np.float64)
            if message := _portal_fault(polygon, bodies[i], tolerance):
                yield f"portals: {i}: portal {k} {message}"
    for view in viewpoints:
        if abs(np.linalg.norm(view["direction"]) - 1) > 1 - PARALLEL_COSINE:
            yield f"viewpoint_place: {view['name']} looks along no unit vector"
        around, eye = bodies.get(view["cell"], []), np.array([view["position"]], np.float64)
        if around and min(farthest(planes, eye)[0] for planes in around) > tolerance.plane:
            yield f"viewpoint_place: {view['name']} does not lie in cell {view['cell']}"


def _portal_fault(polygon: Points, bodies: Sequence[Planes], tolerance: Tolerance) -> str:
    """The fault of a portal of the cell with these leaves; "" if there is none."""
    try:
        plane = polygon_plane(polygon, tolerance)
    except SolidError as fault:
        return str(fault)
    arms = polygon - polygon[0]
    area = float(np.linalg.norm(np.cross(arms[1:-1], arms[2:]).sum(axis=0)) / 2)
    # A sliver, whose plane is arbitrary, need only lie in the body.
    if area <= 2 * tolerance.plane * float(np.linalg.norm(np.ptp(polygon, axis=0))):
        plane = None
    # Invalid leaves are reported elsewhere.
    if bodies and not any(_in_face(planes, polygon, plane, tolerance) for planes in bodies):
        return "does not lie in a face of this cell, or faces the wrong way"
    return ""


def _in_face(
    planes: Planes, polygon: Points, plane: NDArray[np.float64] | None, tolerance: Tolerance
) -> bool:
    """Whether a polygon lies in a face of a body, with its normal pointing into the body; for a
    sliver, without a plane, whether it lies in the body."""
    distance = polygon @ planes[:, :3].T + planes[:, 3]
    if not distance.max() <= tolerance.plane:
        return False
    if plane is None:
        return True
    # The normal of a narrow polygon is rounded: its side counts, its corners decide.
    turned = planes[:, :3] @ plane[:3] < 0
    return bool((turned & (np.abs(distance).max(axis=0) <= tolerance.plane)).any())


def tolerance_about(points: Points, extent: float) -> Tolerance:
    """The tolerance for the (n, 3) points of the cells of a model with this ``extent``, metres, or
    0 if that is unknown: cells may be a small part of a model, whose extent gave the distances by
    which they were divided."""
    of_points = Tolerance.for_points(points)
    within = of_points.extent < extent < np.inf
    return Tolerance.for_extent(extent) if within else of_points


class SolidError(Exception):
    """A fault of a body or a polygon, as a predicate: "is not convex"."""


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
    edges = index * len(points) + following
    if len(np.unique(edges)) < len(edges) or len(
        np.setdiff1d(edges, following * len(points) + index)
    ):
        raise SolidError("is not closed")
    planes, sound = polygon_planes(points[index], points[following], start, tolerance.plane)
    if not sound.any():  # small: a client computes the planes of all of its faces
        planes, sound = polygon_planes(points[index], points[following], start, 0.0)
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
    """(4,) the plane of a convex polygon, counter-clockwise about the normal; None for a sliver,
    whose normal is arbitrary.

    Raises SolidError: it is not flat, or not convex.
    """
    following = np.roll(polygon, -1, axis=0)
    planes, sound = polygon_planes(polygon, following, np.zeros(1, np.int64), tolerance.plane)
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


def farthest(planes: Planes, points: Points) -> Points:
    """(n,) the largest distance of each point in front of a plane; -inf without planes."""
    far = np.full(len(points), -np.inf)
    step = max(_BATCH // max(len(planes), 1), 1)
    for i in range(0, len(points) if len(planes) else 0, step):
        part = points[i : i + step]
        far[i : i + step] = (part @ planes[:, :3].T + planes[:, 3]).max(axis=1)
    return far
