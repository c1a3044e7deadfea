"""Convex bodies, and the check of the hints in space: leaves, portals between them, viewpoints.

All in float64 with the distances of `Tolerance`. A body is its planes: (f, 4) outward unit normals
and offsets, so that n·x + d is the distance of x in front of a plane.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.diagnostics import Place
from ptmtools.tolerance import TIE_SHARE, Tolerance

Row = Mapping[str, Any]


@dataclass(frozen=True)
class _Leaf:
    """A leaf of the hints: its cell, its place in the record, (n, 3) points; planes if valid."""

    cell: int
    place: Place
    points: Points
    planes: Planes | None


def check_space(
    records: Sequence[Row | None], viewpoints: Sequence[Row], places: Sequence[Place], at: Place
) -> None:
    """Checks the leaves and portals of the records, whose places are ``places``, and the viewpoints
    of the index, whose place is ``at``; all indices must be in range."""
    read = [
        (i, places[i].at(f"leaves[{k}]"), leaf, np.array(leaf["points"], np.float64))
        for i, record in enumerate(records)
        for k, leaf in enumerate(record["leaves"] if record is not None else ())
    ]
    if not read:
        return
    tolerance = Tolerance.for_points(np.concatenate([points for *_, points in read]))
    leaves: list[_Leaf] = []
    for cell, place, leaf, points in read:
        try:
            planes = solid_planes(points, leaf["faces"], tolerance)
        except SolidError as fault:
            place.add("PTM-D683", str(fault))
            planes = None
        leaves.append(_Leaf(cell, place, points, planes))
    _check_apart(leaves, tolerance)
    bodies: list[list[Planes]] = [[] for _ in records]
    for each in leaves:
        if each.planes is not None:
            bodies[each.cell].append(each.planes)
    _check_portals(records, bodies, tolerance, places)
    for i, view in enumerate(viewpoints):
        inside = _inside(bodies[view["cell"]], np.array([view["position"]], np.float64), tolerance)
        if bodies[view["cell"]] and not inside:
            message = f"does not lie in cell {view['cell']}"
            at.add("PTM-D699", message, f"viewpoints[{i}].position")


def _check_apart(leaves: Sequence[_Leaf], tolerance: Tolerance) -> None:
    """The centroid of a leaf lies in no other leaf."""
    middles = np.array([leaf.points.mean(axis=0) for leaf in leaves])
    order = np.argsort(middles[:, 0], kind="stable")
    along = middles[order, 0]
    for k, leaf in enumerate(leaves):
        if leaf.planes is None:
            continue
        low, high = leaf.points.min(axis=0), leaf.points.max(axis=0)
        near = order[np.searchsorted(along, low[0]) : np.searchsorted(along, high[0], "right")]
        near = near[((middles[near] >= low) & (middles[near] <= high)).all(axis=1)]
        within = near[farthest(leaf.planes, middles[near]) < -tolerance.rounding]
        for other in within[within != k].tolist():
            leaf_place = f"{leaf.place.file}: {leaf.place.place}"
            leaves[other].place.add("PTM-D683", f"lies in {leaf_place}")


def _check_portals(
    records: Sequence[Row | None],
    bodies: Sequence[Sequence[Planes]],
    tolerance: Tolerance,
    places: Sequence[Place],
) -> None:
    openings: list[Counter[tuple[Any, ...]]] = [Counter() for _ in records]
    for i, record in enumerate(records):
        if record is None:
            continue
        neighbours = {portal["neighbour"] for portal in record["portals"]}
        if neighbours != set(record["adjacent"]):
            places[i].add("PTM-D699", "do not lead to exactly the adjacent cells", "portals")
        for k, portal in enumerate(record["portals"]):
            polygon = tuple(map(tuple, portal["polygon"]))
            openings[i][(portal["neighbour"], polygon, portal["area"])] += 1
            # The portals of the other direction are these in reverse.
            if i < portal["neighbour"] and (
                fault := _portal_fault(portal, bodies[i], bodies[portal["neighbour"]], tolerance)
            ):
                places[i].add("PTM-D699", fault, f"portals[{k}]")
    for i, of_cell in enumerate(openings):
        for (neighbour, polygon, area), count in of_cell.items():
            reverse = openings[neighbour][(i, polygon[::-1], area)]
            if records[neighbour] is not None and reverse != count:
                message = f"a portal to cell {neighbour} is not in its record in reverse"
                places[i].add("PTM-D699", message, "portals")


def _portal_fault(
    portal: Row, here: Sequence[Planes], beyond: Sequence[Planes], tolerance: Tolerance
) -> str:
    """The fault of a portal between two cells, given by their leaves; "" if there is none."""
    polygon = np.array(portal["polygon"], np.float64)
    try:
        plane = polygon_plane(polygon, tolerance)
    except SolidError as fault:
        return str(fault)
    area = polygon_area(polygon)
    slack = tolerance.plane * tolerance.extent
    if not portal["area"] <= area * (1 + TIE_SHARE) + slack:
        return "has an area larger than its polygon"
    # A sliver, whose plane is arbitrary, need only lie in the body.
    if area <= 2 * tolerance.plane * float(np.linalg.norm(np.ptp(polygon, axis=0))):
        plane = None
    for bodies, inwards, cell in ((here, 1.0, "this cell"), (beyond, -1.0, "its neighbour")):
        # Invalid leaves are reported elsewhere.
        if bodies and not any(_in_face(b, polygon, plane, inwards, tolerance) for b in bodies):
            return f"does not lie in a face of {cell}, or faces the wrong way"
    return ""


def _in_face(
    planes: Planes,
    polygon: Points,
    plane: NDArray[np.float64] | None,
    inwards: float,
    tolerance: Tolerance,
) -> bool:
    """Whether a polygon lies in a face of a body, with its normal times ``inwards`` pointing into
    the body; for a sliver, without a plane, whether it lies in the body."""
    if not farthest(planes, polygon).max() <= tolerance.plane:
        return False
    if plane is None:
        return True
    distance = np.abs(polygon @ planes[:, :3].T + planes[:, 3]).max(axis=0)
    turned = planes[:, :3] @ plane[:3] * inwards <= -tolerance.cosine
    return bool((turned & (distance <= tolerance.plane)).any())


def _inside(bodies: Sequence[Planes], points: Points, tolerance: Tolerance) -> bool:
    return any((farthest(planes, points) <= tolerance.plane).all() for planes in bodies)


Points = NDArray[np.float64]


Planes = NDArray[np.float64]


#: Largest number of corners of a cell: the time of `convex_hull` grows by their square.
MOST_CORNERS = 1 << 14


#: Distances computed at a time.
_BATCH = 1 << 22


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
    """(4,) the plane of a convex polygon, counter-clockwise about the normal; None for a sliver,
    whose normal is arbitrary.

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
    """(n,) the largest distance of each point in front of a plane; -inf without planes."""
    far = np.full(len(points), -np.inf)
    step = max(_BATCH // max(len(planes), 1), 1)
    for i in range(0, len(points) if len(planes) else 0, step):
        part = points[i : i + step]
        far[i : i + step] = (part @ planes[:, :3].T + planes[:, 3]).max(axis=1)
    return far


def _newell(
    here: Points, following: Points, start: NDArray[np.int64], tolerance: Tolerance
) -> tuple[Planes, NDArray[np.bool_]]:
    """The planes of polygons whose edges begin ``here``, and whether each is sound: the normal of a
    sliver thinner than the on-plane distance is arbitrary."""
    size = np.diff([*start, len(here)])
    first = np.repeat(here[start], size, axis=0)
    normal = np.add.reduceat(np.cross(here - first, following - first), start, axis=0)
    longest = np.maximum.reduceat(np.linalg.norm(following - here, axis=1), start)
    twice_area = np.linalg.norm(normal, axis=1)
    sound = twice_area > 2 * tolerance.plane * longest
    normal /= np.where(sound, twice_area, 1.0)[:, None]
    middle = np.add.reduceat(here, start, axis=0) / size[:, None]
    return np.column_stack([normal, -np.einsum("ij,ij->i", normal, middle)]), sound
