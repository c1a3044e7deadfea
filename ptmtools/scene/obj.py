"""Reads Wavefront OBJ files and resolves their materials.

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
from collections.abc import Iterable, Iterator, Mapping, Set
from dataclasses import dataclass, field
from io import TextIOWrapper
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from ptmtools.errors import InputError, LimitError
from ptmtools.progress import Progress, silent
from ptmtools.scene.colors import luminance
from ptmtools.scene.model import Shine, Wrap
from ptmtools.scene.mtl import MapStatement, MtlMaterial, read_mtl
from ptmtools.scene.notes import Findings
from ptmtools.scene.polygon import triangulate
from ptmtools.scene.source import (
    MAX_VERTICES,
    FileRange,
    NormalTexture,
    Source,
    SourceMaterial,
    Texture,
    too_many_triangles,
    vertex_colors,
)

#: The next file of a mtllib statement, up to its suffix, or the rest of the statement.
_LIBRARIES = re.compile(r".*?\.mtl[\"']*(?: |$)|.+", re.IGNORECASE)


def library_names(text: str) -> list[str]:
    """The files of a mtllib statement, separated by blanks, which may also be part of names."""
    return [name.strip() for name in _LIBRARIES.findall(text) if name.strip()]


def resolve_materials(
    path: Path,
    libraries: Iterable[tuple[str, int]],
    named: Mapping[str, tuple[int, int]],
    used: Set[int],
    findings: Findings,
) -> tuple[tuple[SourceMaterial, ...], dict[int, MapStatement]]:
    """The materials of an OBJ file, and the map_Kd statements by number of material.

    Parameters
    ----------
    libraries: text and line of each mtllib statement.
    named: by name of material, in order: its number, and the line of the first usemtl.
    used: numbers of the materials of faces; the images of others are not looked up.

    Raises the errors of `read_mtl`.
    """
    defined: dict[str, MtlMaterial] = {}
    read: set[Path] = set()
    for text, line in libraries:
        place = f"{path.name}:{line}"
        for name in library_names(text):
            missing = findings.folder.find(name).path is None
            hint = _renaming_hint(path, name) if missing else ""
            file = findings.locate(name, f"mtllib {name}", place, "PTM-N203", hint=hint)
            if file is None or (real := file.resolve()) in read:
                continue
            read.add(real)
            for key, block in read_mtl(file, findings).items():
                defined.setdefault(key, block)

    materials: list[SourceMaterial] = []
    maps: dict[int, MapStatement] = {}
    for name, (index, line) in named.items():
        material = defined.get(name)
        if material is None:
            if name and index in used:
                findings.miss("PTM-N207", f"usemtl {name}: no such material", f"{path.name}:{line}")
            materials.append(SourceMaterial(name or "default"))
            continue
        texture = mask = normal = None
        if index in used:
            texture = _texture(material, "map_Kd", material.map_kd, findings)
            mask = _texture(material, "map_d", material.map_d, findings)
            normal = _normal(material, texture, findings)
        if texture is not None and material.map_kd is not None:
            maps[index] = material.map_kd
        materials.append(
            SourceMaterial(
                name=name,
                color=material.color,
                opacity=material.dissolve,
                # A missing mask must not hide anything.
                see_through=material.dissolve < 1 or (material.map_d is not None and mask is None),
                texture=texture,
                mask=mask,
                shine=_shine(material),
                normal=normal,
                **_glow(material, findings, index in used),
            )
        )
    return tuple(materials), maps


def _normal(
    material: MtlMaterial, texture: Texture | None, findings: Findings
) -> NormalTexture | None:
    """The normal map of a material; with the coordinates as written if it has no ``texture``."""
    if material.relief is None:
        return None
    key, statement = material.relief
    image = _texture(material, key, statement, findings)
    if image is None:
        return None
    height = key != "norm"
    return NormalTexture(image, max(statement.strength, 0.0), height, own=texture is None)


def _shine(material: MtlMaterial) -> Shine | None:
    colors, reflection, base = material.map_kd, material.map_ks, material.library.parent
    if material.map_ks_fault:
        return Shine("", base, f"map_Ks: {material.map_ks_fault}")
    if reflection is None:
        return None
    same = colors is None or (colors.scale, colors.offset) == (reflection.scale, reflection.offset)
    return Shine(reflection.file, base, "" if same else "other texture coordinates")


def _glow(material: MtlMaterial, findings: Findings, used: bool) -> dict[str, Any]:
    """The emission of a material, as the fields of a `SourceMaterial`. ``Ke`` is a factor of
    ``map_Ke``; without ``Ke`` it is 1. An image that is missing counts as white."""
    factor = material.glow or (0.0 if material.map_ke is None else 1.0,) * 3
    glow = float(luminance(np.array(factor)))
    if not (used and glow):
        return {}
    image = None
    if material.map_ke is not None:
        base, name = material.library.parent, material.map_ke.file
        file = findings.folder.find(name, base).path
        place = f"{findings.folder.label(material.library)}:{material.map_ke.line}"
        image = file and Texture(FileRange(file), file.name, f"map_Ke {name}", place)
    return {"glow": glow, "glow_map": image}


def _renaming_hint(path: Path, name: str) -> str:
    """A hint for a missing library: a renamed model still refers to the old name of its library."""
    libraries = [p.name for p in path.absolute().parent.glob("*") if p.suffix.lower() == ".mtl"]
    if len(libraries) != 1:
        return ""
    return f"; if {libraries[0]} is the library of the model, rename it to {Path(name).name}"


def _texture(
    material: MtlMaterial, key: str, statement: MapStatement | None, findings: Findings
) -> Texture | None:
    if statement is None:
        return None
    place = f"{findings.folder.label(material.library)}:{statement.line}"
    what = f"{key} {statement.file}"
    file = findings.locate(statement.file, what, place, base=material.library.parent)
    if file is None:
        return None
    if statement.ignored:
        findings.note("PTM-N215", f"{what}: ignored {' '.join(statement.ignored)}", place)
    transform, colors = (statement.scale, statement.offset), material.map_kd
    if transform != ((1.0, 1.0), (0.0, 0.0)):
        if key == "map_Kd":
            findings.note("PTM-N215", f"{what}: -s and -o baked into its faces", place)
        elif colors is None or transform != (colors.scale, colors.offset):
            findings.note("PTM-N215", f"{what}: ignored -s -o", place)
    wrap: Wrap = "clamp" if statement.clamp else "repeat"
    return Texture(
        read=FileRange(file),
        label=file.name,
        what=what,
        place=place,
        wrap_s=wrap,
        wrap_t=wrap,
        channel=statement.channel,
    )


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
    """The statements of a file as flat arrays, and the number and first line of each material."""

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


def read_obj(
    path: Path,
    findings: Findings,
    progress: Progress = silent,
    max_triangles: int = MAX_VERTICES,
) -> Source:
    """Reads an OBJ file with its materials.

    Raises InputError with the line of an invalid statement, and for a file without faces;
    LimitError for more vertices than int32 can number (PTM-L203), a line longer than `LONGEST_LINE`
    (PTM-L204), more than ``max_triangles`` (PTM-L203, before polygons are cut), and the errors of
    `read_mtl`.
    """
    statements = _read_statements(path, findings, progress, max_triangles)
    for key, lines in statements.unknown.items():
        kind = _NOT_DRAWN.get(key, "unknown statement")
        findings.note("PTM-N215", f"{key}: {kind}, skipped", f"{path.name}:{lines[0]}", len(lines))
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
    line = np.frombuffer(statements.face_line, dtype=np.int64)
    points = np.frombuffer(statements.points, dtype=np.float64).reshape(-1, 3)
    coords = np.frombuffer(statements.coords, dtype=np.float64).reshape(-1, 2)
    corner_point = np.frombuffer(statements.corner_point, dtype=np.int64)
    corner_coord = np.frombuffer(statements.corner_coord, dtype=np.int64)
    for corner, count, item in (
        (corner_point, len(points), "vertex"),
        (corner_coord, len(coords), "texture coordinate"),
    ):
        invalid = np.flatnonzero(corner >= count)
        if len(invalid):
            face = int(np.searchsorted(start, invalid[0], side="right")) - 1
            raise InputError(
                "PTM-I245",
                f"{item} {corner[invalid[0]] + 1} of {count} does not exist",
                file=path,
                place=f"line {line[face]}",
                remedy="the file may be truncated",
            )

    cut = triangulate(points[corner_point], start)
    cut.note(findings, path.name)
    coord = corner_coord[cut.corner]
    uv = np.zeros((len(coord), 3, 2))
    uv[coord >= 0] = coords[coord[coord >= 0]]
    face_material = np.frombuffer(statements.face_material, dtype=np.int64)
    used = set(np.unique(face_material).tolist())
    materials, maps = resolve_materials(
        path, statements.libraries, statements.materials, used, findings
    )
    triangle_material = face_material[cut.polygon]
    ends = np.cumsum(np.bincount(triangle_material, minlength=len(materials)))
    grouped = np.split(np.argsort(triangle_material, kind="stable"), ends[:-1])
    for index, statement in maps.items():
        rows = grouped[index]
        uv[rows] = uv[rows] * statement.scale + statement.offset
        bare = np.unique(cut.polygon[rows[(coord[rows] < 0).any(axis=1)]])
        if len(bare):
            findings.note(
                "PTM-N229",
                f"faces of textured material {materials[index].name} have no texture coordinates",
                f"{path.name}:{line[bare[0]]}",
                len(bare),
            )
    triangles = corner_point[cut.corner]
    own = any(material.normal and material.normal.own for material in materials)
    colors = None
    if statements.colored:
        colored = np.frombuffer(statements.colored, dtype=np.int64)
        values = np.frombuffer(statements.colors, dtype=np.float64).reshape(-1, 3)
        materials, colors = vertex_colors(materials, triangles, triangle_material, colored, values)
    return Source(
        points=points,
        triangles=triangles,
        uv=uv,
        triangle_object=np.frombuffer(statements.face_object, dtype=np.int64)[cut.polygon],
        triangle_material=triangle_material,
        objects=tuple(statements.objects),
        materials=materials,
        colors=colors,
        normal_uv=uv if own else None,
    )


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
    path: Path, findings: Findings, progress: Progress, max_triangles: int
) -> _Statements:
    statements = _Statements()
    points, coords = statements.points, statements.coords
    size = path.stat().st_size
    object_name = group_name = ""
    object_index = material_index = -1
    short: list[int] = []

    with open(path, "rb") as raw, TextIOWrapper(raw, encoding="latin-1") as stream:
        for number, line in _logical_lines(stream, path):
            if not number % _LINES_A_TICK:
                progress(raw.tell(), size, "reading")
            if number == 1:
                line = line.removeprefix(_MARK)
            words = line.split()
            if not words:
                continue
            key = words[0]
            if key.startswith("#"):
                continue
            if key in ("v", "vt", "f") and "#" in line:
                words = line[: line.index("#")].split()
            try:
                if key == "v":
                    if len(words) >= 7:
                        statements.colored.append(len(points) // 3)
                        statements.colors.extend(map(float, words[4:7]))
                    points.extend(map(float, words[1:4]))
                    if len(words) < 4:
                        raise ValueError("a vertex has three coordinates")
                elif key == "vt":
                    coords.append(float(words[1]))
                    coords.append(float(words[2]) if len(words) > 2 else 0.0)
                elif key == "f":
                    if len(words) < 4:
                        short.append(number)
                        continue
                    if object_index < 0:
                        name = "/".join(part for part in (object_name, group_name) if part)
                        object_index = statements.objects.setdefault(
                            name or path.stem, len(statements.objects)
                        )
                    if material_index < 0:
                        unnamed = len(statements.materials), number
                        material_index, _ = statements.materials.setdefault("", unnamed)
                    _face(statements, words)
                    statements.face_line.append(number)
                    statements.face_object.append(object_index)
                    statements.face_material.append(material_index)
                    if len(statements.corner_point) - 2 * len(statements.face_line) > max_triangles:
                        raise too_many_triangles(max_triangles, path)
                elif key == "usemtl":
                    name, new = _rest(line, "usemtl"), (len(statements.materials), number)
                    material_index, _ = statements.materials.setdefault(name, new)
                elif key == "o":
                    object_name, group_name, object_index = _rest(line, "o"), "", -1
                elif key == "g":
                    group_name, object_index = _rest(line, "g"), -1
                elif key == "mtllib":
                    statements.libraries.append((_rest(line, "mtllib"), number))
                elif key not in _SILENT:
                    if "\0" in line:
                        raise ValueError("binary data")
                    statements.unknown.setdefault(key[:40], []).append(number)
            except (ValueError, IndexError, OverflowError) as error:
                raise InputError(
                    "PTM-I245",
                    f"invalid statement {line.strip()[:60]!r}"
                    + ("" if isinstance(error, IndexError) else f" ({error})"),
                    file=path,
                    place=f"line {number}",
                ) from None
    if len(points) // 3 > MAX_VERTICES:
        raise LimitError(
            "PTM-L203", f"more than {MAX_VERTICES} vertices", file=path, remedy="split the model"
        )
    if short:
        findings.miss(
            "PTM-N214", "faces of fewer than three corners", f"{path.name}:{short[0]}", len(short)
        )
    progress(size, size, "reading")
    return statements


def _face(statements: _Statements, words: list[str]) -> None:
    """Appends the corners of a face: ``p``, ``p/t``, ``p//n`` or ``p/t/n``; -1 is the last one."""
    for word in words[1:]:
        parts = word.split("/")
        point = int(parts[0])
        coord = int(parts[1]) if len(parts) > 1 and parts[1] else None
        if point < 0:
            point += len(statements.points) // 3 + 1
        if coord is not None and coord < 0:
            coord += len(statements.coords) // 2 + 1
        if point < 1 or (coord is not None and coord < 1):
            raise ValueError(f"{word} is 0 or before the first one")
        statements.corner_point.append(point - 1)
        statements.corner_coord.append(-1 if coord is None else coord - 1)
    statements.face_start.append(len(statements.corner_point))
