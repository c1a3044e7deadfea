"""The text of a cell's file: a PTMCell node, then the cell's shapes.

PTMCell rides beside ordinary nodes in a PROTO whose body draws nothing, so a browser that knows
nothing of it still shows the cell. What a shape looks like, and why (seen in view3dscene 4.2 and
X_ITE 15, the same in both unless said):

================================  ==================================================
texture                           ImageTexture alone: shown unlit, texel for texel
texture × colour                  ImageTexture and one Color for all faces: unlit, multiplied.
                                  A Material's diffuseColor multiplies too, but is lit, and
                                  emissiveColor hides the texture in view3dscene. VRML97 to the
                                  letter shows the bare texture.
texture, opacity < 1              ImageTexture and Material (diffuseColor, transparency): lit,
                                  as only a Material has a transparency
no texture                        Material (diffuseColor, transparency): lit by the headlight,
                                  and a quarter as bright by itself (emissiveColor). A
                                  headlight alone leaves floors, ceilings and corridor walls
                                  black, since it shines along them
================================  ==================================================

(Tried: baking the colour into a second image. It is not lossless, and costs a texture. Ambient
light in the root file instead of a glow: X_ITE shows none.)
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells.model import Cells
from ptmtools.database.geometry import Geometry
from ptmtools.database.model import TextureRecord
from ptmtools.database.names import DefNames, cell_file, cell_name
from ptmtools.database.numerals import (
    WORTHWHILE,
    Rows,
    field,
    lines,
    listed,
    loops,
    numeral,
    quoted,
    single,
)
from ptmtools.database.vrml.hull import convex_hull
from ptmtools.scene.model import Material, Scene
from ptmtools.visibility.model import Pvs

HEADER = "#VRML V2.0 utf8\n"
#: How bright an untextured surface is without light, as a share of its colour.
_GLOW = 0.25
#: Points whose text is made at a time.
_BATCH = 1 << 16
_FIELDS = (
    '  field SFString cellName    ""\n'
    "  field MFVec3f  hullPoint   [ ]\n"
    "  field MFInt32  hullIndex   [ ]\n"
    "  field MFString adjacentUrl [ ]\n"
    "  field MFString visibleUrl  [ ]\n"
    "  field MFFloat  ach         [ ]\n"
)
_LEAF_FIELDS = "  field MFVec3f  leafPoint   [ ]\n  field MFInt32  leafStart   [ ]\n"


@dataclass(frozen=True)
class CellText:
    """A cell's file and what the other files need to know of it.

    Attributes
    ----------
    text: the file's contents.
    box: (2, 3) float32 least and greatest corner of all that it holds.
    images: indices of the scene's images that its shapes use, ascending.
    shapes, triangles: how many there are.
    """

    text: str
    box: NDArray[np.float32]
    images: tuple[int, ...]
    shapes: int
    triangles: int


@dataclass(frozen=True)
class _Lists:
    """The number lists of the shapes from ``first`` on, without brackets; those of texture
    coordinates are empty where there is no texture."""

    first: int
    point: list[str]
    loop: list[str]
    uv: list[str]
    uv_loop: list[str]


class CellWriter:
    """Writes the cells of one scene; what they share is prepared once.

    Parameters
    ----------
    ach: (V,) hints, aligned with ``pvs.cell``.
    fallback: name the PNG twins of textures first.
    compiled: whether compiled loops write the numbers; None: where they are worth their loading.

    Raises
    ------
    DatabaseError: PTM-D601 a number is not finite in float32; PTM-D603 a cell is flat.
    """

    def __init__(
        self,
        scene: Scene,
        cells: Cells,
        pvs: Pvs,
        ach: NDArray[np.float64],
        textures: Mapping[int, TextureRecord],
        fallback: bool,
        compiled: bool | None = None,
    ) -> None:
        self.geometry = g = Geometry(scene, cells)
        if compiled is None:
            numbers = 3 * len(g.shape_point) + 2 * len(g.shape_uv) + 6 * len(g.triangle)
            compiled = numbers + len(ach) >= WORTHWHILE
        self._compiled = compiled
        self._objects = scene.objects
        self._materials = scene.materials
        self._image = np.array([m.image for m in scene.materials], dtype=np.int64)
        self._textures = {
            image: f"url {listed(_urls(record, fallback), 2)}" for image, record in textures.items()
        }
        self._pvs = pvs
        self._adjacent = cells.adjacent()
        self._url = [quoted(cell_file(c)) for c in range(cells.cell_count)]
        self._ach_text = self._rows(single(ach, "ach")[:, None])
        self._point_text, self._uv_text = self._rows(g.point), self._rows(g.uv)
        # The vertices of each cell's leaves, a leaf after the other.
        order = np.argsort(cells.leaf_cell, kind="stable")
        count = np.diff(cells.leaf_point_start)[order]
        first = np.repeat(cells.leaf_point_start[order] - (np.cumsum(count) - count), count)
        leaf_point = single(cells.leaf_point[first + np.arange(len(first))], "leaf points")
        self._leaf_text = self._rows(leaf_point)
        self._leaf_start = np.append(0, np.cumsum(count))
        self._cell_leaf = np.searchsorted(cells.leaf_cell[order], np.arange(cells.cell_count + 1))
        cut = self._leaf_start[self._cell_leaf[1:-1]]
        self._hulls = [convex_hull(points) for points in np.split(leaf_point, cut)]
        self._hull_text = self._rows(np.concatenate([points for points, _ in self._hulls]))
        self._hull_start = np.cumsum([0] + [len(points) for points, _ in self._hulls])
        self._lists = _Lists(0, [], [], [], [])

    def cell(self, cell: int) -> CellText:
        """The file of one cell; in ascending order is fastest."""
        g = self.geometry
        hull, triangles = self._hulls[cell]
        seen = np.arange(self._pvs.start[cell], self._pvs.start[cell + 1])
        leaves = self._leaf_start[self._cell_leaf[cell] : self._cell_leaf[cell + 1] + 1]
        (loop,) = loops(triangles, np.array([0, len(triangles)]), 16, self._compiled)
        of_hull = np.arange(*self._hull_start[cell : cell + 2])
        parts = [HEADER, "PROTO PTMCell [\n", _FIELDS]
        if len(leaves) > 2:
            parts.append(_LEAF_FIELDS)
        parts += [
            "] {\n  WorldInfo { }\n}\nPTMCell {\n",
            f"  cellName    {quoted(cell_name(cell))}\n",
            f"  hullPoint   {field(self._hull_text.list(of_hull))}\n",
            f"  hullIndex   {field(loop)}\n",
            f"  adjacentUrl {self._cell_urls(self._adjacent[cell])}\n",
            f"  visibleUrl  {self._cell_urls(self._pvs.cell[seen])}\n",
            f"  ach         {field(self._ach_text.list(seen, 16))}\n",
        ]
        if len(leaves) > 2:
            points = np.arange(leaves[0], leaves[-1])
            parts.append(f"  leafPoint   {field(self._leaf_text.list(points))}\n")
            begin = [str(i) for i in (leaves[:-1] - leaves[0]).tolist()]
            parts.append(f"  leafStart   {listed(begin, 16)}\n")
        parts.append("}\n")

        names = DefNames(f"C{cell}")
        first, last = g.cell_start[cell : cell + 2].tolist()
        taken = [names.take(self._objects[i]) for i in g.object[first:last].tolist()]
        textures = _Textures(self._textures, names)
        for shape, name in zip(range(first, last), taken, strict=True):
            parts.append(self._shape(shape, name, textures))
        used = g.point[g.shape_point[g.point_start[first] : g.point_start[last]]]
        images = np.unique(self._image[g.material[first:last]])
        return CellText(
            text="".join(parts),
            box=np.stack([np.r_[hull, used].min(axis=0), np.r_[hull, used].max(axis=0)]),
            images=tuple(images[images >= 0].tolist()),
            shapes=last - first,
            triangles=int(g.triangle_start[last] - g.triangle_start[first]),
        )

    def _shape(self, shape: int, name: str, textures: _Textures) -> str:
        g = self.geometry
        lists = self._lists_of(shape)
        at = shape - lists.first
        material = self._materials[int(g.material[shape])]
        parts = [
            f"DEF {name} Shape {{\n  appearance Appearance {{\n",
            _surface(material),
            textures.of(material),
            "  }\n  geometry IndexedFaceSet {\n",
            "    solid FALSE\n" if g.two_sided[shape] else "",
            f"    coord Coordinate {{ point {field(lists.point[at])} }}\n",
            f"    coordIndex {field(lists.loop[at])}\n",
        ]
        if material.image >= 0:
            parts.append(f"    texCoord TextureCoordinate {{ point {field(lists.uv[at])} }}\n")
            parts.append(f"    texCoordIndex {field(lists.uv_loop[at])}\n")
            if material.opacity >= 1 and material.color != (1.0, 1.0, 1.0):
                count = int(g.triangle_start[shape + 1] - g.triangle_start[shape])
                zeros = field(lines(["0"] * count, 48, " "))
                parts.append(f"    color Color {{ color [ {_color(material)} ] }}\n")
                parts.append(f"    colorIndex {zeros}\n    colorPerVertex FALSE\n")
        parts.append("  }\n}\n")
        return "".join(parts)

    def _lists_of(self, shape: int) -> _Lists:
        """Those of some shapes with this one among them: many at a time are faster."""
        held = self._lists
        if not held.first <= shape < held.first + len(held.point):
            g = self.geometry
            enough = int(g.point_start[shape]) + _BATCH
            last = max(shape + 1, int(np.searchsorted(g.point_start, enough, side="right")) - 1)
            some = slice(shape, last + 1)
            textured = self._image[g.material[shape:last]] >= 0
            uv, uv_start = _taken(g.uv_start[some], textured)
            corner, corner_start = _taken(g.triangle_start[some], textured)
            rows = slice(g.triangle_start[shape], g.triangle_start[last])
            points = slice(g.point_start[shape], g.point_start[last])
            self._lists = held = _Lists(
                shape,
                self._point_text.lists(
                    g.shape_point[points], g.point_start[some] - g.point_start[shape]
                ),
                self._loops(g.triangle[rows], g.triangle_start[some] - g.triangle_start[shape]),
                self._uv_text.lists(g.shape_uv[uv], uv_start),
                self._loops(g.uv_triangle[corner], corner_start),
            )
        return held

    def _rows(self, values: NDArray[np.float32]) -> Rows:
        return Rows(values, self._compiled)

    def _loops(self, loop: NDArray[np.int64], start: NDArray[np.int64]) -> list[str]:
        return loops(loop, start, compiled=self._compiled)

    def _cell_urls(self, cells: NDArray[np.int32]) -> str:
        return listed([self._url[c] for c in cells.tolist()], 8)


class _Textures:
    """The ImageTexture nodes of one file, each written once and then named: some browsers make a
    texture of every node, whatever its file."""

    def __init__(self, urls: Mapping[int, str], names: DefNames) -> None:
        self._urls = urls
        self._names = names
        self._written: dict[tuple[int, str, str], str] = {}

    def of(self, material: Material) -> str:
        """The field of an Appearance; "" where there is no texture."""
        if material.image < 0:
            return ""
        key = material.image, material.wrap_s, material.wrap_t
        if key in self._written:
            return f"    texture USE {self._written[key]}\n"
        name = self._written[key] = self._names.take("texture")
        wrap = " repeatS FALSE" if material.wrap_s == "clamp" else ""
        wrap += " repeatT FALSE" if material.wrap_t == "clamp" else ""
        return f"    texture DEF {name} ImageTexture {{ {self._urls[material.image]}{wrap} }}\n"


def _surface(material: Material) -> str:
    """The material of an Appearance; "" where it is that of no Material node."""
    if material.image >= 0 and material.opacity >= 1:
        return ""
    fields = f"diffuseColor {_color(material)}"
    if material.image < 0:
        fields += f" emissiveColor {_color(material, _GLOW)}"
    if material.opacity < 1:
        fields += f" transparency {numeral(1 - min(max(material.opacity, 0.0), 1.0))}"
    return f"    material Material {{ {fields} }}\n"


def _color(material: Material, share: float = 1.0) -> str:
    return " ".join(numeral(share * min(max(c, 0.0), 1.0)) for c in material.color)


def _urls(record: TextureRecord, fallback: bool) -> list[str]:
    files = [record.fallback, record.file] if fallback else [record.file]
    return [quoted("../" + quote(file)) for file in files if file is not None]


def _taken(
    start: NDArray[np.int64], lists: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """What is in some of the lists that begin at ``start``, the others being empty: indices of
    it, and where each list begins among those."""
    count = np.diff(start)
    taken = np.flatnonzero(np.repeat(lists, count)) + start[0]
    return taken, np.append(0, np.cumsum(np.where(lists, count, 0)))
