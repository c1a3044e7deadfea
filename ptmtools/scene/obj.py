"""Reads Wavefront OBJ files; `mtl` resolves their materials.

trimesh (5.2) is not used because it reads the first ``mtllib`` only, supports neither ``d``, ``Tr``
and ``map_d`` nor the options of ``map_Kd``, cuts concave quads and polygons as fans, joins the
names of objects and materials, ignores missing files silently, and loses line numbers. Statements
are read line by line into flat arrays: 1,002,528 triangles (65 MB) take 9 s of one core and 0.5 GB,
cleaning included. Normals and smoothing groups are skipped, since later stages do not use them;
curves, lines and points are skipped and counted. Vertices may have colours (``v x y z r g b``), an
unspecified extension that many scanners write; these replace ``Kd``.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from io import TextIOWrapper
from pathlib import Path
from typing import TextIO

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.errors import InputError, LimitError
from ptmtools.progress import Progress, silent
from ptmtools.scene.mtl import MapStatement, MtlMaterial, read_mtl, resolve_material
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.options import MAX_VERTICES, IngestOptions, too_many_triangles
from ptmtools.scene.polygon import triangulate
from ptmtools.scene.source import ModelSource, SourceMaterial, vertex_colors

#: The next file of a mtllib statement, up to its suffix, or the rest of the statement.
_LIBRARIES = re.compile(r".*?\.mtl[\"']*(?: |$)|.+", re.IGNORECASE)


def library_names(text: str) -> list[str]:
    """The files of a mtllib statement, separated by blanks, which may also be part of names."""
    return [name.strip() for name in _LIBRARIES.findall(text) if name.strip()]


def resolve_materials(
    path: Path, statements: _Statements, notes: IngestNotes, *, normals: bool
) -> tuple[tuple[SourceMaterial, ...], dict[int, MapStatement]]:
    """The materials of an OBJ file, with normal maps if ``normals``, and the statements of their
    colours, or of the emission that stands for them, by number of material. Only images of
    materials with faces are looked up.

    Raises the errors of `read_mtl`.
    """
    defined = _library_materials(path, statements.libraries, notes)
    used = set(statements.face_material)
    materials: list[SourceMaterial] = []
    maps: dict[int, MapStatement] = {}
    for name, (index, line) in statements.materials.items():
        material = defined.get(name)
        if material is None:
            if name and index in used:
                notes.miss("PTM-N207", f"usemtl {name}: no such material", f"{path.name}:{line}")
            materials.append(SourceMaterial(name or "default"))
            continue
        resolved, shown = resolve_material(material, notes, used=index in used, normals=normals)
        if shown is not None:
            maps[index] = shown
        materials.append(replace(resolved, name=name))
    return tuple(materials), maps


def _library_materials(
    path: Path, libraries: Iterable[tuple[str, int]], notes: IngestNotes
) -> dict[str, MtlMaterial]:
    """The materials of the libraries by name, the first of each; ``libraries``: text and line of
    each mtllib statement."""
    defined: dict[str, MtlMaterial] = {}
    read: set[Path] = set()
    for text, line in libraries:
        place = f"{path.name}:{line}"
        for name in library_names(text):
            missing = notes.folder.find(name).path is None
            hint = _renaming_hint(path, name) if missing else ""
            file = notes.locate(name, f"mtllib {name}", place, "PTM-N203", hint=hint)
            if file is None or (real := file.resolve()) in read:
                continue
            read.add(real)
            for key, block in read_mtl(file, notes).items():
                defined.setdefault(key, block)
    return defined


def _renaming_hint(path: Path, name: str) -> str:
    """A hint for a missing library: a renamed model still refers to the old name of its library."""
    libraries = [p.name for p in path.absolute().parent.glob("*") if p.suffix.lower() == ".mtl"]
    if len(libraries) != 1:
        return ""
    return f"; if {libraries[0]} is the library of the model, rename it to {Path(name).name}"


#: Statements without effect on surfaces, skipped without a note.
# fmt: off
_SILENT = frozenset({
    "vn", "vp", "s", "mg", "bevel", "c_interp", "d_interp", "lod", "shadow_obj", "trace_obj",
    "maplib", "usemap", "cstype", "deg", "bmat", "step", "parm", "trim", "hole", "scrv", "sp",
    "end", "con", "ctech", "stech", "call", "csh",
})
# fmt: on
#: Statements that draw other primitives than triangles.
_NOT_DRAWN = {"l": "lines", "p": "points", "curv": "curves", "curv2": "curves", "surf": "surfaces"}
_LINES_A_TICK = 1 << 16
#: Longest line, with its continuation lines, in characters.
LONGEST_LINE = 1 << 24
#: A UTF-8 byte order mark, read as Latin-1.
_MARK = "\u00ef\u00bb\u00bf"


@dataclass
class _Statements:
    """The statements of a file as flat arrays; ``stem`` names objects without a name.

    Attributes
    ----------
    materials: number and first line of each by name.
    short: lines of faces of fewer than three corners.
    unknown: lines of other statements by keyword.
    """

    stem: str
    points: array[float] = field(default_factory=lambda: array("d"))
    colored: array[int] = field(default_factory=lambda: array("q"))
    colors: array[float] = field(default_factory=lambda: array("d"))
    coords: array[float] = field(default_factory=lambda: array("d"))
    corner_point: array[int] = field(default_factory=lambda: array("q"))
    corner_coord: array[int] = field(default_factory=lambda: array("q"))
    face_start: array[int] = field(default_factory=lambda: array("q", [0]))
    face_line: array[int] = field(default_factory=lambda: array("q"))
    face_object: array[int] = field(default_factory=lambda: array("q"))
    face_material: array[int] = field(default_factory=lambda: array("q"))
    objects: dict[str, int] = field(default_factory=dict)
    materials: dict[str, tuple[int, int]] = field(default_factory=dict)
    libraries: list[tuple[str, int]] = field(default_factory=list)
    unknown: dict[str, list[int]] = field(default_factory=dict)
    short: list[int] = field(default_factory=list)
    _object_name: str = ""
    _group_name: str = ""
    _object: int = -1
    _material: int = -1

    def add(self, words: list[str], line: str, number: int) -> None:
        """Adds a statement; ``line`` is its text and ``number`` its place.

        Raises ValueError, IndexError or OverflowError for an invalid one.
        """
        key = words[0]
        if key == "v":
            if len(words) >= 7:
                self.colored.append(len(self.points) // 3)
                self.colors.extend(map(float, words[4:7]))
            self.points.extend(map(float, words[1:4]))
            if len(words) < 4:
                raise ValueError("a vertex has three coordinates")
        elif key == "vt":
            self.coords.append(float(words[1]))
            self.coords.append(float(words[2]) if len(words) > 2 else 0.0)
        elif key == "f":
            self._add_face(words, number)
        elif key == "usemtl":
            self._use_material(_rest(line, "usemtl"), number)
        elif key == "o":
            self._object_name, self._group_name, self._object = _rest(line, "o"), "", -1
        elif key == "g":
            self._group_name, self._object = _rest(line, "g"), -1
        elif key == "mtllib":
            self.libraries.append((_rest(line, "mtllib"), number))
        elif key not in _SILENT:
            if "\0" in line:
                raise ValueError("binary data")
            self.unknown.setdefault(key[:40], []).append(number)

    def _use_material(self, name: str, number: int) -> None:
        self._material, _ = self.materials.setdefault(name, (len(self.materials), number))

    def _add_face(self, words: list[str], number: int) -> None:
        """Adds a face of corners ``p``, ``p/t``, ``p//n`` or ``p/t/n``; -1 is the last one."""
        if len(words) < 4:
            self.short.append(number)
            return
        if self._object < 0:
            name = "/".join(part for part in (self._object_name, self._group_name) if part)
            self._object = self.objects.setdefault(name or self.stem, len(self.objects))
        if self._material < 0:
            self._use_material("", number)
        for word in words[1:]:
            parts = word.split("/")
            point = int(parts[0])
            coord = int(parts[1]) if len(parts) > 1 and parts[1] else None
            if point < 0:
                point += len(self.points) // 3 + 1
            if coord is not None and coord < 0:
                coord += len(self.coords) // 2 + 1
            if point < 1 or (coord is not None and coord < 1):
                raise ValueError(f"{word} is 0 or before the first one")
            self.corner_point.append(point - 1)
            self.corner_coord.append(-1 if coord is None else coord - 1)
        self.face_start.append(len(self.corner_point))
        self.face_line.append(number)
        self.face_object.append(self._object)
        self.face_material.append(self._material)


def read_obj(
    path: Path, notes: IngestNotes, options: IngestOptions, progress: Progress = silent
) -> ModelSource:
    """Reads an OBJ file with its materials.

    Raises InputError with the line of an invalid statement, and for a file without faces;
    LimitError for more vertices than int32 can number (PTM-L203), a line longer than `LONGEST_LINE`
    (PTM-L204), too many triangles (PTM-L203, before polygons are cut), and the errors of
    `read_mtl`.
    """
    statements = _read_statements(path, notes, progress, options.max_triangles)
    if not statements.face_line:
        unknown = next(iter(statements.unknown.values()), None)
        garbage = None if statements.points else unknown
        raise InputError(
            "PTM-I247",
            "not an OBJ file" if garbage else "no faces",
            file=path,
            place=f"line {garbage[0]}" if garbage else None,
            remedy="use a model with f statements",
        )
    start = np.frombuffer(statements.face_start, dtype=np.int64)
    points = np.frombuffer(statements.points, dtype=np.float64).reshape(-1, 3)
    corner_point = np.frombuffer(statements.corner_point, dtype=np.int64)
    corner_coord = np.frombuffer(statements.corner_coord, dtype=np.int64)
    _check_corners(path, statements, corner_point, len(points), "vertex")
    coord_count = len(statements.coords) // 2
    _check_corners(path, statements, corner_coord, coord_count, "texture coordinate")
    cut = triangulate(points[corner_point], start)
    cut.note(notes, path.name)
    normals = options.normal_maps == "draw"
    materials, maps = resolve_materials(path, statements, notes, normals=normals)
    triangle_material = np.frombuffer(statements.face_material, dtype=np.int64)[cut.polygon]
    coord = corner_coord[cut.corner]
    uv = _texture_coordinates(statements, coord, triangle_material, maps)
    bare = np.flatnonzero((coord < 0).any(axis=1))
    for index in sorted(maps.keys() & set(triangle_material[bare].tolist())):
        faces = np.unique(cut.polygon[bare[triangle_material[bare] == index]])
        name, place = materials[index].name, f"{path.name}:{statements.face_line[faces[0]]}"
        message = f"faces of textured material {name} have no texture coordinates"
        notes.note("PTM-N229", message, place, len(faces))
    triangles = corner_point[cut.corner]
    colors = None
    if statements.colored:
        colored = np.frombuffer(statements.colored, dtype=np.int64)
        values = np.frombuffer(statements.colors, dtype=np.float64).reshape(-1, 3)
        materials, colors = vertex_colors(materials, triangles, triangle_material, colored, values)
    separate = any(material.normal and material.normal.own for material in materials)
    return ModelSource(
        points=points,
        triangles=triangles,
        uv=uv,
        triangle_object=np.frombuffer(statements.face_object, dtype=np.int64)[cut.polygon],
        triangle_material=triangle_material,
        objects=tuple(statements.objects),
        materials=materials,
        colors=colors,
        normal_uv=uv if separate else None,
    )


def _check_corners(
    path: Path, statements: _Statements, corner: Ints, count: int, item: str
) -> None:
    """Raises InputError PTM-I245 if a corner refers to none of the ``count`` items."""
    invalid = np.flatnonzero(corner >= count)
    if len(invalid):
        face = int(np.searchsorted(statements.face_start, invalid[0], side="right")) - 1
        raise InputError(
            "PTM-I245",
            f"{item} {corner[invalid[0]] + 1} of {count} does not exist",
            file=path,
            place=f"line {statements.face_line[face]}",
            remedy="the file may be truncated",
        )


def _texture_coordinates(
    statements: _Statements,
    coord: Ints,
    triangle_material: Ints,
    maps: Mapping[int, MapStatement],
) -> Floats:
    """(T, 3, 2) coordinates of triangles whose corners have the numbers ``coord``, (T, 3), or -1,
    with -s and -o of their materials; 0 without coordinates."""
    coords = np.frombuffer(statements.coords, dtype=np.float64).reshape(-1, 2)
    uv = np.zeros((len(coord), 3, 2))
    uv[coord >= 0] = coords[coord[coord >= 0]]
    count = len(statements.materials)
    scale, offset = np.ones((count, 2)), np.zeros((count, 2))
    mapped = np.zeros(count, dtype=bool)
    for index, statement in maps.items():
        mapped[index], scale[index], offset[index] = True, statement.scale, statement.offset
    rows = np.flatnonzero(mapped[triangle_material])
    material = triangle_material[rows]
    uv[rows] = uv[rows] * scale[material, None] + offset[material, None]
    return uv


def _name(text: str) -> str:
    """A name in UTF-8, if it is valid; the stream is read as Latin-1."""
    try:
        return text.encode("latin-1").decode("utf-8")
    except UnicodeDecodeError:
        return text


def _rest(line: str, key: str) -> str:
    """The text after the keyword; only ASCII blanks are trimmed, since a byte of UTF-8 may look
    like one in Latin-1."""
    return _name(line.strip(" \t\r\n")[len(key) :].strip(" \t"))


def _logical_lines(stream: TextIO, path: Path) -> Iterator[tuple[int, str]]:
    """The lines with their numbers from 1, joined with those that follow a final backslash. Raises
    LimitError PTM-L204."""
    number = 0
    while line := stream.readline(LONGEST_LINE + 1):
        number += 1
        first, length = number, len(line)
        if line.endswith("\\\n"):
            parts = [line[:-2]]
            while line.endswith("\\\n") and length <= LONGEST_LINE:
                number += 1
                line = stream.readline(LONGEST_LINE + 1)
                parts.append(line[:-2] if line.endswith("\\\n") else line)
                length += len(line)
            line = " ".join(parts)
        if length > LONGEST_LINE:
            raise LimitError(
                "PTM-L204",
                f"longer than {LONGEST_LINE} characters",
                file=path,
                place=f"line {first}",
                remedy="if this is an OBJ file, split the face",
            )
        yield first, line


def _read_statements(
    path: Path, notes: IngestNotes, progress: Progress, max_triangles: int
) -> _Statements:
    statements = _Statements(path.stem)
    size = path.stat().st_size
    with open(path, "rb") as raw, TextIOWrapper(raw, encoding="latin-1") as stream:
        for number, line in _logical_lines(stream, path):
            if not number % _LINES_A_TICK:
                progress(raw.tell(), size, "reading")
            if number == 1:
                line = line.removeprefix(_MARK)
            words = line.split()
            if not words or words[0].startswith("#"):
                continue
            if words[0] in ("v", "vt", "f") and "#" in line:
                words = line[: line.index("#")].split()
            try:
                statements.add(words, line, number)
            except (ValueError, IndexError, OverflowError) as error:
                raise InputError(
                    "PTM-I245",
                    f"invalid statement {line.strip()[:60]!r}"
                    + ("" if isinstance(error, IndexError) else f" ({error})"),
                    file=path,
                    place=f"line {number}",
                ) from None
            if words[0] == "f":
                triangles = len(statements.corner_point) - 2 * len(statements.face_line)
                if triangles > max_triangles:
                    raise too_many_triangles(max_triangles, path)
    if len(statements.points) // 3 > MAX_VERTICES:
        raise LimitError(
            "PTM-L203", f"more than {MAX_VERTICES} vertices", file=path, remedy="split the model"
        )
    if short := statements.short:
        message = "faces of fewer than three corners"
        notes.miss("PTM-N214", message, f"{path.name}:{short[0]}", len(short))
    for key, lines in statements.unknown.items():
        kind = _NOT_DRAWN.get(key, "unknown statement")
        notes.note("PTM-N215", f"{key}: {kind}, skipped", f"{path.name}:{lines[0]}", len(lines))
    progress(size, size, "reading")
    return statements
