"""The check of the VRML files: each by itself, and its URLs."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from ptmtools.diagnostics import Place
from ptmtools.errors import DatabaseError
from ptmtools.output.convexity import convex_hull
from ptmtools.output.names import CELL_FOLDER, HINTS, ROOT, VRML
from ptmtools.output.validation.files import ServedDatabase
from ptmtools.output.validation.space import (
    MOST_CORNERS,
    Planes,
    Points,
    SolidError,
    farthest,
    solid_planes,
    tolerance_about,
)
from ptmtools.output.vrml import PATTERN
from ptmtools.output.vrml_reader import Document, Node, parse
from ptmtools.tolerance import Tolerance


def read_file(path: str, data: bytes) -> Document | None:
    """A VRML file; None of other files."""
    return parse(data) if path.endswith(".wrl") else None


def check_files(database: ServedDatabase) -> None:
    """Checks all files."""
    documents = {p: d for p, d in database.contents.items() if isinstance(d, Document)}
    cells: dict[str, Node] = {}
    for path, document in documents.items():
        for node in document.nodes:
            for lack in node.lacks:
                database.at(path, node.place).add("PTM-D661", lack)
        if path == ROOT:
            _check_root(document, database)
        elif path.startswith(f"{CELL_FOLDER}/"):
            nodes = document.of_type("PTMCell")
            if len(nodes) != 1:
                database.at(path).add("PTM-D661", f"{len(nodes)} PTMCell nodes, not 1")
            elif not nodes[0].lacks:
                cells[path] = nodes[0]
    hulls = [node.fields["hullPoint"] for node in cells.values()]
    points = np.concatenate([np.zeros((0, 3)), *hulls])
    points = points if len(points) else np.zeros((1, 3))
    box, tolerance = (
        np.stack([points.min(axis=0), points.max(axis=0)]),
        tolerance_about(points, database.extent),
    )
    for path, node in cells.items():
        _check_cell(documents[path], node, box, tolerance, database.at(path))
        for url in (*node.fields["adjacentUrl"], *node.fields["visibleUrl"]):
            database.resolve(path, url)
        textures = [s.at("appearance", "texture") for s in documents[path].of_type("Shape")]
        for urls in dict.fromkeys(texture["url"] for texture in textures if "url" in texture):
            database.resolve_each(path, "url", urls)
    if database.hints:
        listed = database.hints.urls(VRML) or []
        database.resolve_each(HINTS, "cells", listed)
        for path in sorted(cells.keys() - set(listed)):
            database.at(HINTS, "cells").add("PTM-D700", f"does not name {path}")


def _check_root(document: Document, database: ServedDatabase) -> None:
    for type in ("WorldInfo", "NavigationInfo"):
        nodes = document.of_type(type)
        if len(nodes) != 1:
            database.at(ROOT).add("PTM-D661", f"not one {type}")
        elif type == "WorldInfo" and nodes[0].fields.get("info", ())[:1] != (
            f"ptm:database {PATTERN}",
        ):
            place = f"line {nodes[0].line}"
            database.at(ROOT, place).add("PTM-D661", "info does not begin with the pattern")
    for node in document.nodes:
        for url in (*node.fields.get("url", ()), *node.fields.get("cellUrl", ())):
            database.resolve(ROOT, url)


def _check_cell(
    document: Document, node: Node, box: NDArray[np.float64], tolerance: Tolerance, at: Place
) -> None:
    """Checks everything that needs no other cell.

    ``box`` (2, 3) holds the hulls of all cells. Geometry beyond a face of that box is accepted: an
    open model is subdivided within its walls, and geometry farther out belongs to the cells at the
    rim. There the hull of several leaves may lean inwards, so geometry before one of the leaves is
    accepted too.
    """
    here, fields = at.at(f"line {node.line}"), node.fields
    leaves = _leaves(node, here)
    body, bodies = _without_rim(_hull(node, tolerance, here), box, tolerance), None
    for shape in document.of_type("Shape"):
        if shape.lacks:
            continue
        shape_at = at.at(shape.place)
        _check_shape(shape, shape_at)
        points = shape.at("geometry", "coord")["point"]
        far = farthest(body, points)
        if (far > tolerance.cluster).any():  # seldom
            bodies = _leaf_bodies(leaves, box, tolerance) if bodies is None else bodies
            far = np.min([far, *(farthest(planes, points) for planes in bodies)], axis=0)
        if (most := far.max(initial=0.0)) > tolerance.cluster:
            shape_at.add("PTM-D683", f"geometry lies {most:.3g} m outside of the hull")
    ach, visible = len(fields["ach"]), len(fields["visibleUrl"])
    if ach != visible:
        here.add("PTM-D692", f"{ach} ach values for {visible} visible cells")


def _hull(node: Node, tolerance: Tolerance, at: Place) -> Planes:
    """The planes of the hull; none if it is invalid."""
    points = node.fields["hullPoint"]
    triangles = _loops(node.fields["hullIndex"], len(points))
    if triangles is None or len(triangles) < 4:
        at.add("PTM-D683", "hullIndex is not a list of triangles over hullPoint")
    else:
        try:
            return solid_planes(points, triangles.tolist(), tolerance)
        except SolidError as fault:
            at.add("PTM-D683", f"the hull {fault}")
    return np.zeros((0, 4))


def _leaves(node: Node, at: Place) -> list[Points]:
    """The points of the leaves; empty if they are invalid or the cell has only one."""
    if "leafPoint" not in node.fields:
        return []
    points, start = node.fields["leafPoint"], node.fields["leafStart"]
    size = np.diff([*start, len(points)])
    if len(size) > 1 and start[0] == 0 and size.min() >= 4 and size.max() <= MOST_CORNERS:
        return np.split(points, start[1:])
    at.add("PTM-D683", "leafStart does not divide leafPoint into leaves")
    return []


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


def _check_shape(shape: Node, at: Place) -> None:
    geometry, points = shape.at("geometry"), shape.at("geometry", "coord")["point"]
    if list(geometry).index("coord") > list(geometry).index("coordIndex"):
        at.add("PTM-D661", "coordIndex stands before coord")
    triangles = _loops(geometry["coordIndex"], len(points))
    if triangles is None:
        at.add("PTM-D661", f"coordIndex is not a list of triangles over {len(points)} points")
    elif len(triangles) == 0 or (triangles == np.roll(triangles, 1, axis=1)).any():
        at.add("PTM-D661", "coordIndex has a triangle with two equal corners")
    count = len(geometry["coordIndex"]) // 4
    _check_texture(shape, count, at)
    _check_colours(shape, count, at)


def _check_texture(shape: Node, count: int, at: Place) -> None:
    texture, index = shape.at("appearance", "texture"), shape.at("geometry").get("texCoordIndex")
    coord = shape.at("geometry", "texCoord")
    if not texture and not coord and index is None:
        return
    if not texture.get("url"):
        at.add("PTM-D661", "texture coordinates without a texture")
    if not coord or index is None:
        at.add("PTM-D661", "a texture without texCoord or texCoordIndex")
        return
    points = len(coord["point"])
    triangles = _loops(index, points)
    if triangles is None:
        at.add("PTM-D661", f"texCoordIndex is not a list of triangles over {points} points")
    elif len(triangles) != count:
        at.add("PTM-D661", f"texCoordIndex has {len(triangles)} faces of {count}")


def _check_colours(shape: Node, count: int, at: Place) -> None:
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
            at.add("PTM-D661", f"colorIndex does not give a colour to each of {count} faces")
    values = [*shape.at("appearance", "material").values(), *color.values()]
    if any(((v < 0) | (v > 1)).any() for v in values):
        at.add("PTM-D661", "a colour or transparency is outside 0 to 1")
