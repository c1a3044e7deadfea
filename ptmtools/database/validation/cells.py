"""What a cell file must satisfy by itself: its hull, its shapes, its lists."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ptmtools.database.validation.findings import Place
from ptmtools.database.validation.lists import check_list, check_shares
from ptmtools.database.validation.solids import MOST_CORNERS, SolidError, farthest, solid_planes
from ptmtools.database.vrml.hull import convex_hull
from ptmtools.database.vrml.reader import Document, Node
from ptmtools.errors import DatabaseError
from ptmtools.tolerance import Tolerance

#: How far the ach values as written, single precision, may sum up beside 1.
ACH_SLACK = 1e-5


@dataclass(frozen=True)
class ReadCell:
    """A cell as its file has it.

    Attributes
    ----------
    name: `cellName`.
    adjacent, visible: URLs as written, relative to the cell's file.
    ach: (n,) float64.
    hull: (h, 3) the hull's points.
    box: (2, 3) least and greatest corner of the hull and all shapes.
    leaves: the (n, 3) points of each leaf; empty if the cell is a single one.
    textures: the URL lists of its image textures, each once, in the order of the file.
    """

    name: str
    adjacent: tuple[str, ...]
    visible: tuple[str, ...]
    ach: NDArray[np.float64]
    hull: NDArray[np.float64]
    box: NDArray[np.float64]
    leaves: tuple[NDArray[np.float64], ...]
    textures: tuple[tuple[str, ...], ...]


def read_cell(document: Document, at: Place) -> ReadCell | None:
    """The cell of a file, or None, and PTM-D663, if there is not one."""
    nodes = document.of_type("PTMCell")
    if len(nodes) != 1:
        at.add("PTM-D663", f"{len(nodes)} PTMCell nodes, not 1")
        return None
    fields, shapes = nodes[0].fields, document.of_type("Shape")
    held = [fields["hullPoint"], *(s.at("geometry", "coord")["point"] for s in shapes)]
    points = np.concatenate([some for some in held if len(some)] or [np.zeros((1, 3))])
    leaves = []
    if "leafPoint" in fields:
        leaves = np.split(fields["leafPoint"], fields["leafStart"][1:])
    textures = [s.at("appearance", "texture") for s in shapes]
    return ReadCell(
        name=fields["cellName"],
        adjacent=fields["adjacentUrl"],
        visible=fields["visibleUrl"],
        ach=fields["ach"],
        hull=fields["hullPoint"],
        box=np.stack([points.min(axis=0), points.max(axis=0)]),
        leaves=tuple(leaves),
        textures=tuple(dict.fromkeys(texture["url"] for texture in textures if texture)),
    )


def check_cell(
    document: Document, cell: ReadCell, box: NDArray[np.float64], tolerance: Tolerance, at: Place
) -> None:
    """Checks all that needs no other cell.

    ``box`` (2, 3) holds the hulls of all cells. Geometry beyond a face of that box is in order: a
    model that is open is subdivided within its walls, and what lies farther out belongs to the
    cells at the rim. There the hull of several leaves may lean inwards, and what lies before one of
    the leaves is in order too.
    """
    (node,) = document.of_type("PTMCell")
    own, here = at.file.rpartition("/")[2], at.at(f"line {node.line}")
    body = _Body(node, cell, box, tolerance, here)
    for shape in document.of_type("Shape"):
        there = at.at(f"line {shape.line}" + (f", {shape.name}" if shape.name else ""))
        _check_shape(shape, there)
        far = body.outside(shape.at("geometry", "coord")["point"])
        if far > tolerance.cluster:
            there.add("PTM-D684", f"geometry lies {far:.3g} m outside of the hull")
    if f"{cell.name}.wrl" != own:
        here.add("PTM-D698", f"cellName is {cell.name!r}")
    check_list("adjacentUrl", own, cell.adjacent, here)
    check_list("visibleUrl", own, cell.visible, here)
    if len(cell.ach) != len(cell.visible):
        here.add("PTM-D691", f"{len(cell.ach)} ach values for {len(cell.visible)} visible cells")
    check_shares(cell.ach, ACH_SLACK, ("PTM-D692", "PTM-D693"), here)


class _Body:
    """The convex body of a cell, and if it has several, its leaves."""

    def __init__(
        self,
        node: Node,
        cell: ReadCell,
        box: NDArray[np.float64],
        tolerance: Tolerance,
        at: Place,
    ) -> None:
        """Says what is wrong with them."""
        self._box, self._tolerance = box, tolerance
        self._leaves = cell.leaves
        hull = np.zeros((0, 4))
        triangles = _loops(node.fields["hullIndex"], len(cell.hull))
        if triangles is None or len(triangles) < 4:
            at.add("PTM-D683", "hullIndex is not a list of triangles over hullPoint")
        else:
            try:
                hull = solid_planes(cell.hull, triangles.tolist(), tolerance)
            except SolidError as fault:
                at.add("PTM-D683", f"the hull {fault}")
        self._hull = self._without_rim(hull)
        if cell.leaves:
            sizes, given = [len(leaf) for leaf in cell.leaves], node.fields["leafStart"]
            cut = len(given) > 1 and np.array_equal(given, np.cumsum([0, *sizes[:-1]]))
            if not cut or min(sizes) < 4 or max(sizes) > MOST_CORNERS:
                at.add("PTM-D685", "leafStart does not cut leafPoint into leaves")
                self._leaves = ()
            far = farthest(hull, node.fields["leafPoint"]).max(initial=0.0)
            if far > tolerance.cluster:
                at.add("PTM-D684", f"a leaf lies {far:.3g} m outside of the hull")

    def outside(self, points: NDArray[np.float64]) -> float:
        """How far the farthest of (n, 3) points lies outside, metres; 0 if none does."""
        far = farthest(self._hull, points)
        if not (far > self._tolerance.cluster).any():
            return 0.0
        for planes in self._leaf_planes:
            far = np.minimum(far, farthest(planes, points))
        return float(far.max(initial=0.0))

    @cached_property
    def _leaf_planes(self) -> list[NDArray[np.float64]]:
        """Of each leaf that is not flat. Most cells have nothing outside of their hulls, and never
        ask."""
        bodies = []
        for leaf in self._leaves:
            try:
                points, triangles = convex_hull(leaf.astype(np.float32))
                planes = solid_planes(
                    points.astype(np.float64), triangles.tolist(), self._tolerance
                )
            except (DatabaseError, SolidError):
                continue
            bodies.append(self._without_rim(planes))
        return bodies

    def _without_rim(self, planes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Planes, but for those of the faces of the box."""
        box, tolerance = self._box, self._tolerance
        faces = np.concatenate([-planes[:, 3:] - box[1], -planes[:, 3:] + box[0]], axis=1)
        outwards = np.concatenate([planes[:, :3], -planes[:, :3]], axis=1) >= tolerance.cosine
        return planes[~(outwards & (abs(faces) <= tolerance.plane)).any(axis=1)]


def _loops(index: NDArray[np.int64], points: int) -> NDArray[np.int64] | None:
    """(m, 3) triangles of an index field over so many points, or None if it is no such list."""
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
        at.add("PTM-D680", f"coordIndex is not a list of triangles over {len(points)} points")
    elif len(triangles) == 0 or (triangles == np.roll(triangles, 1, axis=1)).any():
        at.add("PTM-D680", "coordIndex has a triangle with two equal corners")
    count = len(geometry["coordIndex"]) // 4
    _check_texture(shape, count, at)
    _check_colours(shape, count, at)


def _check_texture(shape: Node, count: int, at: Place) -> None:
    texture, index = shape.at("appearance", "texture"), shape.at("geometry").get("texCoordIndex")
    coord = shape.at("geometry", "texCoord")
    if not texture and not coord and index is None:
        return
    if not texture.get("url"):
        at.add("PTM-D663", "texture coordinates without a texture")
    if not coord or index is None:
        at.add("PTM-D663", "a texture without texCoord or texCoordIndex")
        return
    points = len(coord["point"])
    triangles = _loops(index, points)
    if triangles is None:
        at.add("PTM-D681", f"texCoordIndex is not a list of triangles over {points} points")
    elif len(triangles) != count:
        at.add("PTM-D681", f"texCoordIndex has {len(triangles)} faces of {count}")


def _check_colours(shape: Node, count: int, at: Place) -> None:
    geometry, color = shape.at("geometry"), shape.at("geometry", "color")
    if color:
        index = geometry.get("colorIndex", np.zeros(0, np.int64))
        in_range = ((index >= 0) & (index < len(color["color"]))).all()
        if geometry.get("colorPerVertex", True) or len(index) != count or not in_range:
            at.add("PTM-D682", f"colorIndex does not give a colour to each of {count} faces")
    values = [*shape.at("appearance", "material").values(), *color.values()]
    if any(((v < 0) | (v > 1)).any() for v in values):
        at.add("PTM-D682", "a colour or transparency is outside 0 to 1")
