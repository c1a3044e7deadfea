"""What the hints must satisfy in space: leaves, portals between them, and viewpoints inside."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.diagnostics import Place
from ptmtools.output.validation.cells import (
    Planes,
    Points,
    SolidError,
    farthest,
    polygon_area,
    polygon_plane,
    solid_planes,
)
from ptmtools.tolerance import TIE_SHARE, Tolerance

Row = Mapping[str, Any]


@dataclass(frozen=True)
class _Leaf:
    """A leaf of the hints: its cell, its place in the record, (n, 3) points, planes if sound."""

    cell: int
    place: Place
    points: Points
    planes: Planes | None


def check_space(
    records: Sequence[Row | None], viewpoints: Sequence[Row], places: Sequence[Place], at: Place
) -> None:
    """Checks the leaves and portals of the records, each with its place, and the viewpoints of the
    index, whose place is ``at``; indices are in range."""
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
            place.add("PTM-D709", str(fault))
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
            at.add("PTM-D706", message, f"viewpoints[{i}].position")


def _check_apart(leaves: Sequence[_Leaf], tolerance: Tolerance) -> None:
    """The middle of a leaf lies in no other leaf."""
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
            where = f"{leaf.place.file}: {leaf.place.place}"
            leaves[other].place.add("PTM-D709", f"lies in {where}")


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
        to = {portal["neighbour"] for portal in record["portals"]}
        if to != set(record["adjacent"]):
            places[i].add("PTM-D705", "they lead to other cells than the adjacent", "portals")
        for k, portal in enumerate(record["portals"]):
            polygon = tuple(map(tuple, portal["polygon"]))
            openings[i][(portal["neighbour"], polygon, portal["area"])] += 1
            # The other half of the portals is the same turned round.
            if i < portal["neighbour"] and (
                fault := _misplaced(portal, bodies[i], bodies[portal["neighbour"]], tolerance)
            ):
                places[i].add("PTM-D705", fault, f"portals[{k}]")
    for i, of_cell in enumerate(openings):
        for (neighbour, polygon, area), count in of_cell.items():
            turned = openings[neighbour][(i, polygon[::-1], area)]
            if records[neighbour] is not None and turned != count:
                message = f"a portal to cell {neighbour} does not stand there, turned round"
                places[i].add("PTM-D705", message, "portals")


def _misplaced(
    portal: Row, here: Sequence[Planes], beyond: Sequence[Planes], tolerance: Tolerance
) -> str:
    """What is wrong with a portal from a cell to another, given by their leaves; or ""."""
    polygon = np.array(portal["polygon"], np.float64)
    try:
        plane = polygon_plane(polygon, tolerance)
    except SolidError as fault:
        return str(fault)
    area = polygon_area(polygon)
    slack = tolerance.plane * tolerance.extent
    if not portal["area"] <= area * (1 + TIE_SHARE) + slack:
        return "is said to be open for more than its polygon"
    # Within a face that is a sliver, which says nothing of its plane.
    if area <= 2 * tolerance.plane * float(np.linalg.norm(np.ptp(polygon, axis=0))):
        plane = None
    for bodies, inwards, whose in ((here, 1.0, "this cell"), (beyond, -1.0, "its neighbour")):
        # Where no leaf is sound, that is a finding already.
        if bodies and not any(_in_face(b, polygon, plane, inwards, tolerance) for b in bodies):
            return f"does not lie in a face of {whose}, or faces the wrong way"
    return ""


def _in_face(
    planes: Planes,
    polygon: Points,
    plane: NDArray[np.float64] | None,
    inwards: float,
    tolerance: Tolerance,
) -> bool:
    """Whether a polygon lies in a face of a body, its normal times ``inwards`` into the body; of a
    sliver, without a plane, whether it lies in the body."""
    if not farthest(planes, polygon).max() <= tolerance.plane:
        return False
    if plane is None:
        return True
    distance = np.abs(polygon @ planes[:, :3].T + planes[:, 3]).max(axis=0)
    turned = planes[:, :3] @ plane[:3] * inwards <= -tolerance.cosine
    return bool((turned & (distance <= tolerance.plane)).any())


def _inside(bodies: Sequence[Planes], points: Points, tolerance: Tolerance) -> bool:
    return any((farthest(planes, points) <= tolerance.plane).all() for planes in bodies)
