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

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells.model import Cells
from ptmtools.database.geometry import Geometry, Shape
from ptmtools.database.hull import convex_hull
from ptmtools.database.model import TextureRecord
from ptmtools.database.names import DefNames, cell_file, cell_name
from ptmtools.database.numerals import listed, numeral, numerals, quoted, single, tuples
from ptmtools.scene.model import Material, Scene

HEADER = "#VRML V2.0 utf8\n"
#: How bright an untextured surface is without light, as a share of its colour.
_GLOW = 0.25
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


class CellWriter:
    """Writes the cells of one scene; what they share is prepared once."""

    def __init__(
        self,
        scene: Scene,
        cells: Cells,
        textures: Mapping[int, TextureRecord],
        fallback: bool,
    ) -> None:
        self.geometry = Geometry(scene, cells)
        self._cells = cells
        self._objects = scene.objects
        self._materials = scene.materials
        self._point_text = tuples(self.geometry.point)
        self._uv_text = tuples(self.geometry.uv)
        self._image_text = {
            image: f"url {listed(_urls(record, fallback), 2, '    ')}"
            for image, record in textures.items()
        }

    def cell(
        self,
        cell: int,
        adjacent: Sequence[int],
        visible: Sequence[int],
        ach: NDArray[np.float64],
    ) -> CellText:
        """The file of one cell.

        Raises
        ------
        DatabaseError: PTM-D601 a number is not finite in float32; PTM-D603 the cell is flat.
        """
        leaves = [
            single(self._cells.leaf_points(leaf), f"{cell_name(cell)}: leaf points")
            for leaf in self._cells.cell_leaves(cell).tolist()
        ]
        hull, hull_triangles = convex_hull(np.concatenate(leaves))
        parts = [HEADER, "PROTO PTMCell [\n", _FIELDS]
        if len(leaves) > 1:
            parts.append(_LEAF_FIELDS)
        parts += [
            "] {\n  WorldInfo { }\n}\nPTMCell {\n",
            f"  cellName    {quoted(cell_name(cell))}\n",
            f"  hullPoint   {listed(tuples(hull), 8, '  ')}\n",
            f"  hullIndex   {_loops(hull_triangles)}\n",
            f"  adjacentUrl {_cell_urls(adjacent)}\n",
            f"  visibleUrl  {_cell_urls(visible)}\n",
            f"  ach         {listed(numerals(single(ach, 'ach')), 12, '  ')}\n",
        ]
        if len(leaves) > 1:
            start = np.cumsum([0] + [len(leaf) for leaf in leaves[:-1]]).tolist()
            parts.append(f"  leafPoint   {listed(tuples(np.concatenate(leaves)), 8, '  ')}\n")
            parts.append(f"  leafStart   {listed(map(str, start), 16, '  ')}\n")
        parts.append("}\n")

        names = DefNames(f"C{cell}")
        low, high = hull.min(axis=0), hull.max(axis=0)
        images: set[int] = set()
        shapes = triangles = 0
        for shape in self.geometry.shapes(cell):
            parts.append(self._shape(shape, names.take(self._objects[shape.object])))
            points = self.geometry.point[shape.point]
            low, high = np.minimum(low, points.min(axis=0)), np.maximum(high, points.max(axis=0))
            images.add(self._materials[shape.material].image)
            shapes += 1
            triangles += len(shape.triangle)
        return CellText(
            text="".join(parts),
            box=np.stack([low, high]),
            images=tuple(sorted(images - {-1})),
            shapes=shapes,
            triangles=triangles,
        )

    def _shape(self, shape: Shape, name: str) -> str:
        material = self._materials[shape.material]
        point = listed([self._point_text[i] for i in shape.point.tolist()], 8, "    ")
        parts = [
            f"DEF {name} Shape {{\n  appearance Appearance {{\n",
            self._appearance(material),
            "  }\n  geometry IndexedFaceSet {\n",
            "" if not shape.two_sided else "    solid FALSE\n",
            f"    coord Coordinate {{ point {point} }}\n",
            f"    coordIndex {_loops(shape.triangle, '    ')}\n",
        ]
        if material.image >= 0:
            uv = listed([self._uv_text[i] for i in shape.uv.tolist()], 8, "    ")
            parts.append(f"    texCoord TextureCoordinate {{ point {uv} }}\n")
            parts.append(f"    texCoordIndex {_loops(shape.uv_triangle, '    ')}\n")
            if material.opacity >= 1 and material.color != (1.0, 1.0, 1.0):
                zeros = listed(["0"] * len(shape.triangle), 48, "    ")
                parts.append(f"    color Color {{ color [ {_color(material)} ] }}\n")
                parts.append(f"    colorIndex {zeros}\n    colorPerVertex FALSE\n")
        parts.append("  }\n}\n")
        return "".join(parts)

    def _appearance(self, material: Material) -> str:
        text = ""
        if material.image < 0 or material.opacity < 1:
            fields = f"diffuseColor {_color(material)}"
            if material.image < 0:
                fields += f" emissiveColor {_color(material, _GLOW)}"
            if material.opacity < 1:
                fields += f" transparency {numeral(1 - min(max(material.opacity, 0.0), 1.0))}"
            text += f"    material Material {{ {fields} }}\n"
        if material.image >= 0:
            wrap = " repeatS FALSE" if material.wrap_s == "clamp" else ""
            wrap += " repeatT FALSE" if material.wrap_t == "clamp" else ""
            text += f"    texture ImageTexture {{ {self._image_text[material.image]}{wrap} }}\n"
        return text


def _color(material: Material, share: float = 1.0) -> str:
    return " ".join(numeral(share * min(max(c, 0.0), 1.0)) for c in material.color)


def _urls(record: TextureRecord, fallback: bool) -> list[str]:
    files = [record.fallback, record.file] if fallback else [record.file]
    return [quoted("../" + quote(file)) for file in files if file is not None]


def _cell_urls(cells: Sequence[int]) -> str:
    return listed((quoted(cell_file(c)) for c in cells), 8, "  ")


def _loops(triangles: NDArray[np.integer], indent: str = "  ") -> str:
    """Triangles as an index field."""
    return listed((f"{a}, {b}, {c}, -1" for a, b, c in triangles.tolist()), 8, indent)
