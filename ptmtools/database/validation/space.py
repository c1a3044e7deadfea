"""What the hints must satisfy in space: leaves, portals between them, and viewpoints inside."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.database.validation.findings import Place
from ptmtools.database.validation.solids import (
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
    """A leaf of the hints: its cell, its name in findings, (n, 3) points, planes if it is sound."""

    cell: int
    place: str
    points: Points
    planes: Planes | None


def check_space(cells: Sequence[Row], viewpoints: Sequence[Row], at: Place) -> None:
    """Checks `cells` and `viewpoints` of the hints, whose indices are in range."""
    read = [
        (i, f"cells[{i}].leaves[{k}]", leaf, np.array(leaf["points"], np.float64))
        for i, cell in enumerate(cells)
        for k, leaf in enumerate(cell["leaves"])
    ]
    tolerance = Tolerance.for_points(np.concatenate([points for *_, points in read]))
    leaves: list[_Leaf] = []
    for cell, place, leaf, points in read:
        try:
            planes = solid_planes(points, leaf["faces"], tolerance)
        except SolidError as fault:
            at.add("PTM-D709", str(fault), place)
            planes = None
        leaves.append(_Leaf(cell, place, points, planes))
    _check_apart(leaves, tolerance, at)
    bodies: list[list[Planes]] = [[] for _ in cells]
    for each in leaves:
        if each.planes is not None:
            bodies[each.cell].append(each.planes)
    _check_portals(cells, bodies, tolerance, at)
    for i, view in enumerate(viewpoints):
        inside = _inside(bodies[view["cell"]], np.array([view["position"]], np.float64), tolerance)
        if bodies[view["cell"]] and not inside:
            message = f"does not lie in cell {view['cell']}"
            at.add("PTM-D706", message, f"viewpoints[{i}].position")


def _check_apart(leaves: Sequence[_Leaf], tolerance: Tolerance, at: Place) -> None:
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
            at.add("PTM-D709", f"lies in {leaf.place}", leaves[other].place)


def _check_portals(
    cells: Sequence[Row], bodies: Sequence[Sequence[Planes]], tolerance: Tolerance, at: Place
) -> None:
    openings: list[Counter[tuple[Any, ...]]] = [Counter() for _ in cells]
    for i, cell in enumerate(cells):
        place = f"cells[{i}].portals"
        to = {portal["neighbour"] for portal in cell["portals"]}
        if to != set(cell["adjacent"]):
            at.add("PTM-D705", "they lead to other cells than the adjacent", place)
        for k, portal in enumerate(cell["portals"]):
            polygon = tuple(map(tuple, portal["polygon"]))
            openings[i][(portal["neighbour"], polygon, portal["area"])] += 1
            # The other half of the portals is the same turned round.
            if i < portal["neighbour"] and (
                fault := _misplaced(portal, bodies[i], bodies[portal["neighbour"]], tolerance)
            ):
                at.add("PTM-D705", fault, f"{place}[{k}]")
    for i, of_cell in enumerate(openings):
        for (neighbour, polygon, area), count in of_cell.items():
            if openings[neighbour][(i, polygon[::-1], area)] != count:
                message = f"a portal to cell {neighbour} does not stand there, turned round"
                at.add("PTM-D705", message, f"cells[{i}].portals")


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
