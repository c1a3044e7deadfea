"""What is wrong with the VRML files of a database, each by itself.

Browsers are lenient: view3dscene and X_ITE both accept indices out of range and colours above 1. So
these are checks of the emitter, not of a database.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import DatabaseError
from ptmtools.output.convexity import convex_hull
from ptmtools.output.vrml import PATTERN
from ptmtools.tolerance import Tolerance
from tests.output.solids import (
    MOST_CORNERS,
    Planes,
    Points,
    SolidError,
    farthest,
    solid_planes,
    tolerance_about,
)
from tests.output.vrml_reader import VrmlDocument, VrmlNode


def vrml_faults(documents: Mapping[str, VrmlDocument], extent: float) -> Iterator[str]:
    """The faults of the files, given by name ("root" and those of the cells), as "KIND: place:
    message". ``extent``: see `tolerance_about`."""
    cells: dict[str, VrmlNode] = {}
    for name, document in documents.items():
        for node in document.nodes:
            for lack in node.lacks:
                yield f"lacks: {name}, {node.place}: {lack}"
        if name == "root":
            yield from _root_faults(document)
            continue
        nodes = document.of_type("PTMCell")
        if len(nodes) != 1:
            yield f"lacks: {name}: {len(nodes)} PTMCell nodes, not 1"
        elif not nodes[0].lacks:
            cells[name] = nodes[0]
    hulls = [node.fields["hullPoint"] for node in cells.values()]
    points = np.concatenate([np.zeros((0, 3)), *hulls])
    points = points if len(points) else np.zeros((1, 3))
    box = np.stack([points.min(axis=0), points.max(axis=0)])
    tolerance = tolerance_about(points, extent)
    for name, node in cells.items():
        for fault in _cell_faults(documents[name], node, box, tolerance):
            kind, _, message = fault.partition(": ")
            yield f"{kind}: {name}: {message}"


def _root_faults(document: VrmlDocument) -> Iterator[str]:
    for type in ("WorldInfo", "NavigationInfo"):
        nodes = document.of_type(type)
        if len(nodes) != 1:
            yield f"lacks: root: not one {type}"
        elif type == "WorldInfo" and nodes[0].fields.get("info", ())[:1] != (
            f"ptm:database {PATTERN}",
        ):
            yield "lacks: root: info does not begin with the pattern"


def _cell_faults(
    document: VrmlDocument, node: VrmlNode, box: NDArray[np.float64], tolerance: Tolerance
) -> Iterator[str]:
    """What needs no other cell.

    ``box`` (2, 3) holds the hulls of all cells. Geometry beyond a face of that box is accepted: an
    open model is subdivided within its walls, and geometry farther out belongs to the cells at the
    rim. There the hull of several leaves may lean inwards, so geometry before one of the leaves is
    accepted too.
    """
    leaves = _leaves(node)
    if leaves is None:
        yield "leaf_start: does not divide leafPoint into leaves"
    hull, fault = _hull(node, tolerance)
    if fault:
        yield f"hull: {fault}"
    body, bodies = _without_rim(hull, box, tolerance), None
    for shape in document.of_type("Shape"):
        if shape.lacks:
            continue
        yield from _shape_faults(shape)
        points = shape.at("geometry", "coord")["point"]
        far = farthest(body, points)
        if (far > tolerance.cluster).any():  # seldom
            bodies = _leaf_bodies(leaves or (), box, tolerance) if bodies is None else bodies
            far = np.min([far, *(farthest(planes, points) for planes in bodies)], axis=0)
        if (beyond := far.max(initial=0.0)) > tolerance.cluster:
            yield f"outside_hull: {shape.place} lies {beyond:.3g} m outside of the hull"
    ach, visible = len(node.fields["ach"]), len(node.fields["visibleUrl"])
    if ach != visible:
        yield f"ach_length: {ach} ach values for {visible} visible cells"


def _hull(node: VrmlNode, tolerance: Tolerance) -> tuple[Planes, str]:
    """The planes of the hull, none if it is invalid, and its fault."""
    points = node.fields["hullPoint"]
    triangles = _loops(node.fields["hullIndex"], len(points))
    if triangles is None or len(triangles) < 4:
        return np.zeros((0, 4)), "hullIndex is not a list of triangles over hullPoint"
    try:
        return solid_planes(points, triangles.tolist(), tolerance), ""
    except SolidError as fault:
        return np.zeros((0, 4)), str(fault)


def _leaves(node: VrmlNode) -> list[Points] | None:
    """The points of the leaves, empty if the cell has only one; None if they are invalid."""
    if "leafPoint" not in node.fields:
        return []
    points, start = node.fields["leafPoint"], node.fields["leafStart"]
    size = np.diff([*start, len(points)])
    if len(size) > 1 and start[0] == 0 and size.min() >= 4 and size.max() <= MOST_CORNERS:
        return np.split(points, start[1:])
    return None


def _leaf_bodies(
    leaves: Iterable[Points], box: NDArray[np.float64], tolerance: Tolerance
) -> list[Planes]:
    """The planes of each leaf that is not flat."""
    bodies = []
    for leaf in leaves:
        with suppress(DatabaseError, SolidError):
            points, triangles = convex_hull(leaf.astype(np.float32))
            planes = solid_planes(points.astype(np.float64), triangles.tolist(), tolerance)
            bodies.append(_without_rim(planes, box, tolerance))
    return bodies


def _without_rim(planes: Planes, box: NDArray[np.float64], tolerance: Tolerance) -> Planes:
    """The planes without those of the faces of the box."""
    faces = np.concatenate([-planes[:, 3:] - box[1], -planes[:, 3:] + box[0]], axis=1)
    outwards = np.concatenate([planes[:, :3], -planes[:, :3]], axis=1) >= tolerance.cosine
    return planes[~(outwards & (abs(faces) <= tolerance.plane)).any(axis=1)]


def _loops(index: NDArray[np.int64], points: int) -> NDArray[np.int64] | None:
    """(m, 3) triangles of an index field over ``points`` points; None if it is no such list."""
    if len(index) % 4:
        return None
    rows = index.reshape(-1, 4)
    corners = rows[:, :3]
    whole = (rows[:, 3] == -1).all() and (corners >= 0).all() and (corners < points).all()
    return corners if whole else None


def _shape_faults(shape: VrmlNode) -> Iterator[str]:
    place, geometry = shape.place, shape.at("geometry")
    points = shape.at("geometry", "coord")["point"]
    if list(geometry).index("coord") > list(geometry).index("coordIndex"):
        yield f"vrml: {place}: coordIndex stands before coord"
    triangles = _loops(geometry["coordIndex"], len(points))
    if triangles is None:
        yield f"coord_index: {place}: not a list of triangles over {len(points)} points"
    elif len(triangles) == 0 or (triangles == np.roll(triangles, 1, axis=1)).any():
        yield f"coord_index: {place}: a triangle with two equal corners"
    count = len(geometry["coordIndex"]) // 4
    if fault := _texture_fault(shape, count):
        yield f"tex_coord_index: {place}: {fault}"
    yield from _color_faults(shape, count)


def _texture_fault(shape: VrmlNode, count: int) -> str:
    texture, index = shape.at("appearance", "texture"), shape.at("geometry").get("texCoordIndex")
    coord = shape.at("geometry", "texCoord")
    if not texture and not coord and index is None:
        return ""
    if not texture.get("url"):
        return "texture coordinates without a texture"
    if not coord or index is None:
        return "a texture without texCoord or texCoordIndex"
    points = len(coord["point"])
    triangles = _loops(index, points)
    if triangles is None:
        return f"not a list of triangles over {points} points"
    return "" if len(triangles) == count else f"{len(triangles)} faces of {count}"


def _color_faults(shape: VrmlNode, count: int) -> Iterator[str]:
    geometry, color = shape.at("geometry"), shape.at("geometry", "color")
    if color:
        index = geometry.get("colorIndex", np.zeros(0, np.int64))
        if geometry.get("colorPerVertex", True):
            corners = _loops(index, len(color["color"]))
            complete = corners is not None and len(corners) == count
        else:
            in_range = (index >= 0) & (index < len(color["color"]))
            complete = bool(in_range.all()) and len(index) == count
        if not complete:
            yield f"colour: {shape.place}: not a colour for each of {count} faces"
    values = [*shape.at("appearance", "material").values(), *color.values()]
    if any(((v < 0) | (v > 1)).any() for v in values):
        yield f"colour: {shape.place}: a colour or transparency is outside 0 to 1"
