"""The VRML97 files: a cell file for each cell, and `root.wrl`, where a walk can begin.

A cell file is a PTMCell node, then the cell's shapes. PTMCell is a PROTO whose body draws nothing,
so a browser that ignores it still shows the cell. docs/formats/database.md lists the appearance of
a shape by its material, and what browsers show: a texture alone is unlit; a `Color` tints it; a
`Material` stands only where transparency or a missing texture needs one, with a glow
(emissiveColor), since a headlight leaves floors and corridor walls black. (Tried: ambient light in
the root file instead of a glow: X_ITE shows none.)

The tests read the files by the emission pattern, all nodes and fields that they may have. The
items of a list are separated by a comma, or by a line's end after several: one character, which
VRML97 reads as white space.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Singles
from ptmtools.output.content import Content
from ptmtools.output.convexity import convex_hull, hull_rows, slack_of
from ptmtools.output.model import TextureRecord
from ptmtools.output.names import ROOT, VRML_FILES, DefNames, cell_file, cell_name, path_of
from ptmtools.output.numbers import decimal, row_texts, single
from ptmtools.scene.colors import pack_colors, unpack_colors
from ptmtools.scene.model import Material


def field(items: Sequence[str], per_line: int = 8, between: str = ",") -> str:
    """A multiple-valued field of these items, with a line's end after every ``per_line``."""
    if not items:
        return "[ ]"
    rows = [between.join(items[i : i + per_line]) for i in range(0, len(items), per_line)]
    return "[ " + "\n".join(rows) + " ]"


def list_field(items: Sequence[str], per_line: int) -> str:
    """A field of strings or of single numbers."""
    return field(items, per_line, ", ")


def rows_field(rows: Sequence[str], index: NDArray[np.integer], per_line: int = 8) -> str:
    """The field of some of the rows."""
    return field([rows[i] for i in index.tolist()], per_line)


def loops(polygons: NDArray[np.integer], per_line: int = 8) -> str:
    """The field of (m, k) indices, each row closed by -1."""
    return field([f"{row} -1" for row in row_texts(polygons)], per_line)


def sf_string(text: str) -> str:
    """An SFString."""
    flat = " ".join(text.split())
    return '"' + flat.replace("\\", "\\\\").replace('"', '\\"') + '"'


HEADER = "#VRML V2.0 utf8\n"
#: The version of the pattern, in WorldInfo's first info string.
PATTERN = 1

_CELL = {
    "cellName": "SFString",
    "hullPoint": "MFVec3f",
    "hullIndex": "MFInt32",
    "adjacentUrl": "MFString",
    "visibleUrl": "MFString",
    "ach": "MFFloat",
}
#: The fields of the PROTOs, whose bodies draw nothing: a cell of one leaf, a cell of several, and
#: the cell of a viewpoint.
CELL = ("PTMCell", _CELL)
CELL_OF_LEAVES = ("PTMCell", _CELL | {"leafPoint": "MFVec3f", "leafStart": "MFInt32"})
VIEWPOINT_CELL = ("PTMViewpointCell", {"viewpoint": "SFString", "cellUrl": "MFString"})


def declaration(name: str, fields: Mapping[str, str]) -> str:
    """The text of a PROTO."""
    width = max(map(len, fields))
    rows = []
    for field, type in fields.items():
        default = "[ ]" if type.startswith("MF") else '""'
        rows.append(f"  field {type:<8} {field:<{width}} {default}\n")
    return f"PROTO {name} [\n{''.join(rows)}] {{\n  WorldInfo {{ }}\n}}\n"


#: Brightness of an untextured surface without light, as a share of its colour.
_GLOW = 0.25
#: Decimals of a colour of a corner, which is one of 256 levels.
_DIGITS = 3
_WHOLE = np.ones(3)


class CellWriter:
    """Writes the cells of one scene.

    Raises DatabaseError: PTM-D601 in float32, a number is not finite or a cell is flat.
    """

    def __init__(self, content: Content) -> None:
        self._geometry = g = content.geometry
        self._objects, self._materials = content.scene.objects, content.scene.materials
        self._urls = {
            image: f"url {list_field(_urls(record, content.options.fallback), 2)}"
            for image, (_, record) in content.places.of_image.items()
        }
        cells, self._pvs = content.cells, content.pvs
        self._adjacent = cells.adjacent()
        self._cell_url = [sf_string(cell_file(c)) for c in range(cells.cell_count)]
        self._ach = row_texts(single(np.concatenate(content.shares), "ach")[:, None])
        self._point, self._uv = row_texts(g.point), row_texts(g.uv)
        self._leaves = [
            [single(cells.leaf_points(leaf), "leaf points") for leaf in leaves]
            for leaves in content.leaves
        ]
        self._hulls = [convex_hull(np.concatenate(leaves)) for leaves in self._leaves]
        self._slack = slack_of(cells)

    def cell(self, cell: int) -> tuple[str, Singles]:
        """The file of one cell, and the (2, 3) least and greatest corner of its hull and shapes."""
        g = self._geometry
        hull, triangles = self._hulls[cell]
        entries = np.arange(self._pvs.start[cell], self._pvs.start[cell + 1])
        leaves = self._leaves[cell]
        lists = {
            "cellName": sf_string(cell_name(cell)),
            "hullPoint": field(hull_rows(hull, triangles, self._slack)),
            "hullIndex": loops(triangles, 16),
            "adjacentUrl": self._cells(self._adjacent[cell]),
            "visibleUrl": self._cells(self._pvs.cell[entries]),
            "ach": rows_field(self._ach, entries, 16),
        }
        if len(leaves) > 1:
            start = np.cumsum([0, *map(len, leaves[:-1])])
            lists["leafPoint"] = _points(np.concatenate(leaves))
            lists["leafStart"] = list_field([str(i) for i in start.tolist()], 16)
        proto = CELL if len(leaves) == 1 else CELL_OF_LEAVES
        parts = [HEADER, declaration(*proto), "PTMCell {\n"]
        parts += [f"  {name:<11} {text}\n" for name, text in lists.items()]
        parts.append("}\n")

        names = DefNames(f"C{cell}")
        first, last = g.cell_start[cell : cell + 2].tolist()
        taken = [names.take(self._objects[i]) for i in g.object[first:last].tolist()]
        textures: dict[tuple[int, str, str], str] = {}
        for shape, name in zip(range(first, last), taken, strict=True):
            parts.append(self._shape(shape, name, names, textures))
        used = g.point[g.shape_point[g.point_start[first] : g.point_start[last]]]
        points = np.concatenate([hull, used])
        return "".join(parts), np.stack([points.min(axis=0), points.max(axis=0)])

    def _cells(self, cells: NDArray[np.int32]) -> str:
        return list_field([self._cell_url[c] for c in cells.tolist()], 8)

    def _shape(
        self, shape: int, name: str, names: DefNames, textures: dict[tuple[int, str, str], str]
    ) -> str:
        s = self._geometry.shape(shape)
        material = self._materials[s.material]
        parts = [
            f"DEF {name} Shape {{\n  appearance Appearance {{\n",
            _surface(material, s.color),
            self._texture(material, names, textures),
            "  }\n  geometry IndexedFaceSet {\n",
            "    solid FALSE\n" if s.two_sided else "",
            f"    coord Coordinate {{ point {rows_field(self._point, s.point)} }}\n",
            f"    coordIndex {loops(s.triangle)}\n",
        ]
        if material.image >= 0:
            uv = rows_field(self._uv, s.uv)
            parts.append(f"    texCoord TextureCoordinate {{ point {uv} }}\n")
            parts.append(f"    texCoordIndex {loops(s.uv_triangle)}\n")
            tinted = material.opacity >= 1 and material.color != (1.0, 1.0, 1.0)
            if tinted and s.color is None:
                zeros = field(["0"] * len(s.triangle), 48, " ")
                parts.append(f"    color Color {{ color [ {_color(material)} ] }}\n")
                parts.append(f"    colorIndex {zeros}\n    colorPerVertex FALSE\n")
        if s.color is not None:
            colors, place = np.unique(pack_colors(s.color), return_inverse=True)
            rows = row_texts(single(np.round(unpack_colors(colors) / 255, _DIGITS), "colours"))
            parts.append(f"    color Color {{ color {field(rows)} }}\n")
            parts.append(f"    colorIndex {loops(place.reshape(-1, 3))}\n")
        parts.append("  }\n}\n")
        return "".join(parts)

    def _texture(
        self, material: Material, names: DefNames, written: dict[tuple[int, str, str], str]
    ) -> str:
        """The texture of an Appearance; "" for none. Each is ``written`` once in a file and then
        named: some browsers create a texture for every node, even of the same file."""
        if material.image < 0:
            return ""
        key = material.image, material.wrap_s, material.wrap_t
        if key in written:
            return f"    texture USE {written[key]}\n"
        name = written[key] = names.take("texture")
        wrap = " repeatS FALSE" if material.wrap_s == "clamp" else ""
        wrap += " repeatT FALSE" if material.wrap_t == "clamp" else ""
        return f"    texture DEF {name} ImageTexture {{ {self._urls[material.image]}{wrap} }}\n"


def _surface(material: Material, colors: NDArray[np.uint8] | None) -> str:
    """The material of an Appearance; "" for a shape without a Material node. The ``colors`` of a
    shape replace the diffuse colour, and their mean glows."""
    if material.image >= 0 and material.opacity >= 1:
        return ""
    fields = f"diffuseColor {_color(material)}"
    if material.image < 0:
        mean = np.ones(3) if colors is None else colors.mean(axis=(0, 1)) / 255
        fields += f" emissiveColor {_color(material, _GLOW * mean)}"
    if material.opacity < 1:
        fields += f" transparency {decimal(1 - min(max(material.opacity, 0.0), 1.0))}"
    return f"    material Material {{ {fields} }}\n"


def _color(material: Material, share: Floats = _WHOLE) -> str:
    color = (s * min(max(c, 0.0), 1.0) for c, s in zip(material.color, share, strict=True))
    return " ".join(map(decimal, color))


def _urls(record: TextureRecord, fallback: bool) -> list[str]:
    files = [record.fallback, record.file] if fallback else [record.file]
    return [sf_string("../" + quote(file)) for file in files if file is not None]


def _points(points: Singles) -> str:
    return field(row_texts(points))


def vrml_files(content: Content) -> Iterator[tuple[str, str]]:
    """Path, relative to the served folder, and text of each file.

    Raises DatabaseError: PTM-D601 in float32, a number is not finite or a cell is flat; before
    the first file.
    """
    return _files(content, CellWriter(content))


def _files(content: Content, writer: CellWriter) -> Iterator[tuple[str, str]]:
    boxes, count = [], content.cells.cell_count
    for c in range(count):
        content.extras.progress(c, count, "cells")
        text, box = writer.cell(c)
        boxes.append(box)
        yield path_of(c, VRML_FILES), text
    content.extras.progress(count, count, "cells")
    yield ROOT, _root_text(content, boxes)


def _root_text(content: Content, boxes: Sequence[Singles]) -> str:
    """The root file; ``boxes`` are the (2, 3) bounds of every cell's contents."""
    viewpoints, options = content.viewpoints, content.options
    info = [sf_string(f"ptm:database {PATTERN}")]
    cell_urls = [path_of(v.cell, VRML_FILES) for v in viewpoints]
    info += [
        sf_string(f"ptm:viewpoint {v.name} {url}")
        for v, url in zip(viewpoints, cell_urls, strict=True)
    ]
    avatar = ", ".join(decimal(x) for x in options.avatar(content.cells.walker))
    parts = [
        HEADER,
        declaration(*VIEWPOINT_CELL),
        f"WorldInfo {{\n  title {sf_string(options.title)}\n  info {list_field(info, 1)}\n}}\n",
        f'NavigationInfo {{ type [ "WALK", "ANY" ] avatarSize [ {avatar} ] headlight TRUE }}\n',
    ]
    poses = (
        row_texts(single([np.ravel(getattr(v, name)) for v in viewpoints], "viewpoints"))
        for name in ("position", "orientation", "field_of_view")
    )
    parts += [
        f"DEF {v.name} Viewpoint {{ position {position} orientation {turn}"
        f" fieldOfView {field} description {sf_string(v.description)} }}\n"
        for v, position, turn, field in zip(viewpoints, *poses, strict=True)
    ]
    parts += [
        f"PTMViewpointCell {{ viewpoint {sf_string(v.name)} cellUrl [ {sf_string(url)} ] }}\n"
        for v, url in zip(viewpoints, cell_urls, strict=True)
    ]
    for cell, (centre, size) in enumerate(zip(*map(row_texts, _centre_boxes(boxes)), strict=True)):
        url = sf_string(path_of(cell, VRML_FILES))
        parts.append(f"Inline {{ url [ {url} ] bboxCenter {centre} bboxSize {size} }}\n")
    return "".join(parts)


def _centre_boxes(boxes: Sequence[Singles]) -> tuple[Singles, Singles]:
    """Centres and sizes (n, 3) in float32 of boxes that contain the (n, 2, 3) boxes."""
    low, high = np.moveaxis(np.array(boxes, np.float64), 1, 0)
    centre = single((low + high) / 2, "bounding boxes")
    half = np.maximum(high - centre, centre - low)
    size = single(2 * half, "bounding boxes")
    short = size.astype(np.float64) < 2 * half
    return centre, np.where(short, np.nextafter(size, np.float32(np.inf)), size)
