"""What a cell file must satisfy by itself: its hull, its shapes, its lists."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.database.findings import Findings
from ptmtools.database.hull import convex_hull
from ptmtools.database.wrl import Document, Node
from ptmtools.errors import DatabaseError
from ptmtools.tolerance import Tolerance

#: How far the ach values as written, single precision, may sum up beside 1.
ACH_SLACK = 1e-5
_CELL = {
    "cellName": "SFString",
    "hullPoint": "MFVec3f",
    "hullIndex": "MFInt32",
    "adjacentUrl": "MFString",
    "visibleUrl": "MFString",
    "ach": "MFFloat",
}
_LEAVES = {"leafPoint": "MFVec3f", "leafStart": "MFInt32"}


@dataclass(frozen=True)
class ReadCell:
    """A cell as its file has it.

    Attributes
    ----------
    name: `cellName`.
    adjacent, visible: URLs as written, relative to the cell's file.
    ach: (n,) float64.
    hull: (h, 3) the hull's points.
    leaves: the (n, 3) points of each leaf; empty if the cell is a single one.
    textures: the URL lists of its image textures, each once, in the order of the file.
    """

    name: str
    adjacent: tuple[str, ...]
    visible: tuple[str, ...]
    ach: NDArray[np.float64]
    hull: NDArray[np.float64]
    leaves: tuple[NDArray[np.float64], ...]
    textures: tuple[tuple[str, ...], ...]


def read_cell(document: Document, file: str, found: Findings) -> ReadCell | None:
    """The cell of a file, or None (told as PTM-D663) if it lacks part of the pattern."""
    nodes = document.of_type("PTMCell")
    if len(nodes) != 1:
        found.add("PTM-D663", file, "", f"{len(nodes)} PTMCell nodes, not 1")
        return None
    fields, declared = nodes[0].fields, document.protos["PTMCell"]
    if declared not in (_CELL, _CELL | _LEAVES):
        found.add("PTM-D663", file, "", "PROTO PTMCell does not declare the pattern's fields")
        return None
    if missing := [f for f in declared if f not in fields]:
        found.add("PTM-D663", file, f"line {nodes[0].line}", f"PTMCell lacks {missing[0]}")
        return None
    textures: dict[tuple[str, ...], None] = {}
    for shape in document.of_type("Shape"):
        texture = _child(shape, "appearance", "texture")
        if texture is not None:
            textures[texture.fields.get("url", ())] = None
    return ReadCell(
        name=fields["cellName"],
        adjacent=fields["adjacentUrl"],
        visible=fields["visibleUrl"],
        ach=fields["ach"],
        hull=fields["hullPoint"],
        leaves=tuple(np.split(fields["leafPoint"], fields["leafStart"][1:]))
        if "leafPoint" in fields
        else (),
        textures=tuple(textures),
    )


def check_cell(
    document: Document,
    cell: ReadCell,
    file: str,
    box: NDArray[np.float64],
    tolerance: Tolerance,
    found: Findings,
) -> None:
    """Checks all that needs no other cell.

    ``file`` is relative to the database; ``box`` (2, 3) holds the hulls of all cells. Geometry
    beyond a face of that box is in order: a model that is open is subdivided within its walls,
    and what lies farther out belongs to the cells at the rim. There the hull of several leaves may
    lean inwards, and what lies before one of the leaves is in order too.
    """
    node = document.of_type("PTMCell")[0]
    place = f"line {node.line}"
    planes = _check_hull(cell.hull, node.fields["hullIndex"], tolerance, file, place, found)
    bodies = [planes[~_in_box_face(planes, box, tolerance)]]
    if "leafPoint" in node.fields and "leafStart" in node.fields:
        points, start = node.fields["leafPoint"], node.fields["leafStart"]
        if len(start) < 2 or start[0] != 0 or (np.diff([*start, len(points)]) < 4).any():
            found.add("PTM-D685", file, place, "leafStart does not cut leafPoint into leaves")
        else:
            leaves = np.split(points, start[1:])
            bodies += [p[~_in_box_face(p, box, tolerance)] for p in _leaf_planes(leaves, tolerance)]
        _check_inside([planes], points, tolerance, file, place, "a leaf", found)
    for shape in document.of_type("Shape"):
        where = f"line {shape.line}" + (f", {shape.name}" if shape.name else "")
        _check_shape(shape, file, where, found)
        coord = _child(shape, "geometry", "coord")
        if coord is not None:
            points = coord.fields.get("point", np.zeros((0, 3)))
            _check_inside(bodies, points, tolerance, file, where, "geometry", found)
    own = file.rpartition("/")[2]
    if f"{cell.name}.wrl" != own:
        found.add("PTM-D698", file, place, f"cellName is {cell.name!r}")
    if not cell.visible or cell.visible[0] != own:
        found.add("PTM-D690", file, place, f"visibleUrl does not begin with {own}")
    for name, urls, rest in (
        ("adjacentUrl", cell.adjacent, cell.adjacent),
        ("visibleUrl", cell.visible, cell.visible[1:]),
    ):
        if len(set(urls)) < len(urls) or own in rest:
            found.add("PTM-D697", file, place, f"{name} names a cell twice or the cell itself")
    if hidden := sorted(set(cell.adjacent) - set(cell.visible)):
        found.add("PTM-D696", file, place, f"{hidden[0]} is adjacent, but not visible")
    if len(cell.ach) != len(cell.visible):
        found.add(
            "PTM-D691",
            file,
            place,
            f"{len(cell.ach)} ach values for {len(cell.visible)} visible cells",
        )
    check_shares(cell.ach, ACH_SLACK, file, place, ("PTM-D692", "PTM-D693"), found)


def check_shares(
    ach: NDArray[np.float64],
    slack: float,
    file: str,
    place: str,
    codes: tuple[str, str],
    found: Findings,
) -> None:
    """Values in [0, 1] that sum to 1."""
    if ((ach < 0) | (ach > 1)).any():
        found.add(codes[0], file, place, "an ach value is outside 0 to 1")
    total = float(ach.sum())
    if not abs(total - 1) <= slack:
        found.add(codes[1], file, place, f"the ach values sum to {total:.9g}")


def _child(node: Node, *path: str) -> Node | None:
    for field in path:
        child = node.fields.get(field)
        if not isinstance(child, Node):
            return None
        node = child
    return node


def _loops(index: NDArray[np.int64], points: int) -> NDArray[np.int64] | None:
    """(m, 3) triangles of an index field over so many points, or None if it is no such list."""
    if len(index) % 4:
        return None
    rows = index.reshape(-1, 4)
    corners = rows[:, :3]
    whole = (rows[:, 3] == -1).all() and (corners >= 0).all() and (corners < points).all()
    return corners if whole else None


def _check_shape(shape: Node, file: str, place: str, found: Findings) -> None:
    geometry, appearance = _child(shape, "geometry"), _child(shape, "appearance")
    if geometry is None or appearance is None:
        found.add("PTM-D663", file, place, "a Shape without appearance or geometry")
        return
    coord, fields = _child(geometry, "coord"), list(geometry.fields)
    if coord is None or "coordIndex" not in fields or "point" not in coord.fields:
        found.add("PTM-D663", file, place, "an IndexedFaceSet without coord or coordIndex")
        return
    if fields.index("coord") > fields.index("coordIndex"):
        found.add("PTM-D661", file, place, "coordIndex stands before coord")
    points = len(coord.fields["point"])
    triangles = _loops(geometry.fields["coordIndex"], points)
    if triangles is None:
        found.add("PTM-D680", file, place, f"coordIndex is no triangles over {points} points")
    elif len(triangles) == 0 or (triangles == np.roll(triangles, 1, axis=1)).any():
        found.add("PTM-D680", file, place, "coordIndex has a triangle with two equal corners")
    count = len(geometry.fields["coordIndex"]) // 4
    _check_texture(geometry, appearance, count, file, place, found)
    _check_colours(geometry, appearance, count, file, place, found)


def _check_texture(
    geometry: Node, appearance: Node, count: int, file: str, place: str, found: Findings
) -> None:
    texture, coord = _child(appearance, "texture"), _child(geometry, "texCoord")
    index = geometry.fields.get("texCoordIndex")
    if texture is None and coord is None and index is None:
        return
    if texture is None or not texture.fields.get("url"):
        found.add("PTM-D663", file, place, "texture coordinates without a texture")
    if coord is None or index is None or "point" not in coord.fields:
        found.add("PTM-D663", file, place, "a texture without texCoord or texCoordIndex")
        return
    points = len(coord.fields["point"])
    triangles = _loops(index, points)
    if triangles is None:
        found.add("PTM-D681", file, place, f"texCoordIndex is no triangles over {points} points")
    elif len(triangles) != count:
        found.add("PTM-D681", file, place, f"texCoordIndex has {len(triangles)} faces of {count}")


def _check_colours(
    geometry: Node, appearance: Node, count: int, file: str, place: str, found: Findings
) -> None:
    values: list[Any] = []
    material, color = _child(appearance, "material"), _child(geometry, "color")
    if material is not None:
        values += list(material.fields.values())
    if color is not None:
        values += list(color.fields.values())
        colours = len(color.fields.get("color", ()))
        index = geometry.fields.get("colorIndex", np.zeros(0, np.int64))
        in_range = ((index >= 0) & (index < colours)).all()
        if geometry.fields.get("colorPerVertex", True) or len(index) != count or not in_range:
            found.add("PTM-D682", file, place, f"colorIndex is no colour for each of {count} faces")
    if any(((v < 0) | (v > 1)).any() for v in values):
        found.add("PTM-D682", file, place, "a colour or transparency is outside 0 to 1")


def _check_hull(
    points: NDArray[np.float64],
    index: NDArray[np.int64],
    tolerance: Tolerance,
    file: str,
    place: str,
    found: Findings,
) -> NDArray[np.float64]:
    """(f, 4) unit planes of the hull, empty if it is no polyhedron."""
    none = np.zeros((0, 4))
    triangles = _loops(index, len(points))
    if triangles is None or len(triangles) < 4:
        found.add("PTM-D683", file, place, "hullIndex is no list of triangles over hullPoint")
        return none
    edges = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).tolist()
    directed = {(a, b) for a, b in edges}
    if len(directed) < len(edges) or any((b, a) not in directed for a, b in directed):
        found.add("PTM-D683", file, place, "the hull is not closed")
        return none
    planes = _unit_planes(points, triangles, tolerance)
    if len(planes) == 0:
        found.add("PTM-D683", file, place, "the hull is flat")
        return none
    if _outside(planes, points).max(initial=0.0) > tolerance.plane:
        found.add("PTM-D683", file, place, "the hull is not convex")
        return none
    return planes


def _unit_planes(
    points: NDArray[np.float64], triangles: NDArray[np.integer], tolerance: Tolerance
) -> NDArray[np.float64]:
    """(f, 4) planes of the triangles, outwards. A sliver's normal says nothing and is left out; its
    neighbours bound the hull."""
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    longest = np.max(np.linalg.norm([b - a, c - b, a - c], axis=2), axis=0)
    sound = length > 2 * tolerance.plane * longest
    normal = normal[sound] / length[sound, None]
    return np.column_stack([normal, -np.einsum("ij,ij->i", normal, a[sound])])


def _leaf_planes(
    leaves: Sequence[NDArray[np.float64]], tolerance: Tolerance
) -> Iterator[NDArray[np.float64]]:
    """The planes of each leaf that is not flat."""
    for leaf in leaves:
        try:
            points, triangles = convex_hull(leaf.astype(np.float32))
        except DatabaseError:
            continue
        yield _unit_planes(points.astype(np.float64), triangles, tolerance)


def _in_box_face(
    planes: NDArray[np.float64], box: NDArray[np.float64], tolerance: Tolerance
) -> NDArray[np.bool_]:
    """(f,) whether a plane, its normal outwards, is that of a face of the box."""
    faces = np.concatenate([-planes[:, 3:] - box[1], -planes[:, 3:] + box[0]], axis=1)
    outwards = np.concatenate([planes[:, :3], -planes[:, :3]], axis=1) >= tolerance.cosine
    return np.asarray((outwards & (abs(faces) <= tolerance.plane)).any(axis=1))


def _outside(planes: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n,) how far each point lies in front of the plane that it is farthest in front of."""
    far = np.full(len(points), -np.inf)
    for plane in planes:
        far = np.maximum(far, points @ plane[:3] + plane[3])
    return far


def _check_inside(
    bodies: Sequence[NDArray[np.float64]],
    points: NDArray[np.float64],
    tolerance: Tolerance,
    file: str,
    place: str,
    what: str,
    found: Findings,
) -> None:
    """Every point lies in one of the bodies, given by their planes; the first is the hull."""
    far = np.min([_outside(planes, points) for planes in bodies], axis=0).max(initial=0.0)
    if far > tolerance.cluster:
        found.add("PTM-D684", file, place, f"{what} lies {far:.3g} m outside of the hull")
