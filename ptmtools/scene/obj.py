"""Reads Wavefront OBJ.

A reader of our own rather than trimesh's, because trimesh (5.2) reads the first ``mtllib`` only,
knows neither ``d``, ``Tr`` and ``map_d`` nor the options of ``map_Kd``, cuts concave quads and
polygons as fans, joins the names of objects and materials into one, passes over missing files in
silence, and forgets which line anything came from. Statements are read line by line into flat
arrays: 1,002,528 triangles (65 MB) take 9 s of one core and 0.5 GB, cleaning included. Normals and
smoothing groups are not used by later stages and are skipped; curves, lines and points are skipped
and counted. Vertices may have colours (``v x y z r g b``), which no specification has and many
scanners write; where one has, these take the place of ``Kd``.

Materials of an OBJ file: finds the libraries that it names, and in them what it uses."""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterable, Iterator, Mapping, Set
from dataclasses import dataclass, field
from io import TextIOWrapper
from pathlib import Path
from typing import TextIO

import numpy as np

from ptmtools.errors import InputError, LimitError
from ptmtools.progress import Progress, silent
from ptmtools.scene.model import Shine, Wrap
from ptmtools.scene.mtl import MapStatement, MtlMaterial, read_mtl
from ptmtools.scene.polygon import triangulate
from ptmtools.scene.rows import painted
from ptmtools.scene.source import (
    MAX_VERTICES,
    FileRange,
    Findings,
    Source,
    SourceMaterial,
    Texture,
    too_many_triangles,
)

#: The next file of a mtllib statement, which ends as such files do, or all that is left.
_LIBRARIES = re.compile(r".*?\.mtl[\"']*(?: |$)|.+", re.IGNORECASE)


def library_names(text: str) -> list[str]:
    """The files of a mtllib statement: several, divided by blanks that names may contain too."""
    return [name.strip() for name in _LIBRARIES.findall(text) if name.strip()]


def resolved(
    path: Path,
    libraries: Iterable[tuple[str, int]],
    named: Mapping[str, tuple[int, int]],
    used: Set[int],
    findings: Findings,
) -> tuple[tuple[SourceMaterial, ...], dict[int, MapStatement]]:
    """The materials of an OBJ file, and the map_Kd of those that have one, by number.

    Parameters
    ----------
    libraries: what each mtllib statement says, and its line.
    named: of the materials in their order, by name: number, and line of the first usemtl.
    used: the numbers of those that some face has; of the others no image is looked for.

    Raises what `read_mtl` raises.
    """
    defined: dict[str, MtlMaterial] = {}
    read: set[Path] = set()
    for text, line in libraries:
        place = f"{path.name}:{line}"
        for name in library_names(text):
            there = findings.folder.find(name).path is not None
            suggestion = "" if there else _suggestion(path, name)
            file = findings.locate(name, f"mtllib {name}", place, "PTM-N203", hint=suggestion)
            if file is None or (real := file.resolve()) in read:
                continue
            read.add(real)
            for key, material in read_mtl(file, findings).items():
                defined.setdefault(key, material)

    materials: list[SourceMaterial] = []
    maps: dict[int, MapStatement] = {}
    for name, (index, line) in named.items():
        known = defined.get(name)
        if known is None:
            if name and index in used:
                findings.miss("PTM-N207", f"usemtl {name}: no such material", f"{path.name}:{line}")
            materials.append(SourceMaterial(name or "default"))
            continue
        texture = mask = None
        if index in used:
            texture = _texture(known, "map_Kd", known.map_kd, findings)
            mask = _texture(known, "map_d", known.map_d, findings)
        if texture is not None and known.map_kd is not None:
            maps[index] = known.map_kd
        materials.append(
            SourceMaterial(
                name=name,
                color=known.color,
                opacity=known.dissolve,
                # A mask that cannot be read: better see too much than too little.
                see_through=known.dissolve < 1 or (known.map_d is not None and mask is None),
                texture=texture,
                mask=mask,
                shine=_shine(known),
            )
        )
    return tuple(materials), maps


def _shine(material: MtlMaterial) -> Shine | None:
    colors, said, base = material.map_kd, material.map_ks, material.library.parent
    if material.map_ks_fault:
        return Shine("", base, f"map_Ks: {material.map_ks_fault}")
    if said is None:
        return None
    alike = colors is None or (colors.scale, colors.offset) == (said.scale, said.offset)
    return Shine(said.file, base, "" if alike else "other texture coordinates")


def _suggestion(path: Path, name: str) -> str:
    """What to do about a missing library: a model that was renamed still asks for what its
    library was called."""
    beside = [p.name for p in path.absolute().parent.glob("*") if p.suffix.lower() == ".mtl"]
    if len(beside) != 1:
        return ""
    return f"; if {beside[0]} beside the model is meant, rename it to {Path(name).name}"


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
        findings.say("PTM-N215", f"{what}: ignored {' '.join(statement.ignored)}", place)
    if statement.scale != (1.0, 1.0) or statement.offset != (0.0, 0.0):
        if key == "map_Kd":
            findings.say("PTM-N216", f"{what}: -s and -o are baked into its faces", place)
        elif material.map_kd is None or (statement.scale, statement.offset) != (
            material.map_kd.scale,
            material.map_kd.offset,
        ):
            findings.say("PTM-N215", f"{what}: ignored -s -o", place)
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


#: Statements that say nothing about surfaces, skipped without a word.
# fmt: off
_SILENT = frozenset({
    "vn", "vp", "s", "mg", "bevel", "c_interp", "d_interp", "lod", "shadow_obj", "trace_obj",
    "maplib", "usemap", "cstype", "deg", "bmat", "step", "parm", "trim", "hole", "scrv", "sp",
    "end", "con", "ctech", "stech", "call", "csh",
})
# fmt: on
#: Statements that would draw something that is not a surface of triangles.
_NOT_DRAWN = {"l": "lines", "p": "points", "curv": "curves", "curv2": "curves", "surf": "surfaces"}
_LINES_A_TICK = 1 << 16
#: Longest line, with those that a backslash joins to it, in characters.
LONGEST_LINE = 1 << 24
#: A UTF-8 byte order mark, read as Latin-1.
_MARK = "\u00ef\u00bb\u00bf"


@dataclass
class _Statements:
    """The statements of a file: flat arrays, and of materials the number and the line where each
    first stands."""

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
    """Read an OBJ file with its materials.

    Raises InputError with the line for what cannot be read, and where there is no face at all;
    LimitError for more vertices than int32 can number (PTM-L200), a line longer than `LONGEST_LINE`
    (PTM-L202), more than ``max_triangles`` (PTM-L203, before polygons are cut), and what `read_mtl`
    raises.
    """
    said = _read_statements(path, findings, progress, max_triangles)
    for key, lines in said.unknown.items():
        what = _NOT_DRAWN.get(key, "not known")
        findings.say("PTM-N219", f"{key}: {what}, skipped", f"{path.name}:{lines[0]}", len(lines))
    if not said.face_line:
        garbage = next(iter(said.unknown.values()), None) if not said.points else None
        raise InputError(
            "PTM-I247",
            "not an OBJ file" if garbage else "no faces",
            file=path,
            place=f"line {garbage[0]}" if garbage else None,
            remedy="give a model with f statements",
        )
    start = np.frombuffer(said.face_start, dtype=np.int64)
    line = np.frombuffer(said.face_line, dtype=np.int64)
    points = np.frombuffer(said.points, dtype=np.float64).reshape(-1, 3)
    coords = np.frombuffer(said.coords, dtype=np.float64).reshape(-1, 2)
    corner_point = np.frombuffer(said.corner_point, dtype=np.int64)
    corner_coord = np.frombuffer(said.corner_coord, dtype=np.int64)
    for corner, count, what in (
        (corner_point, len(points), "vertex"),
        (corner_coord, len(coords), "texture coordinate"),
    ):
        wrong = np.flatnonzero(corner >= count)
        if len(wrong):
            face = int(np.searchsorted(start, wrong[0], side="right")) - 1
            raise InputError(
                "PTM-I246",
                f"{what} {corner[wrong[0]] + 1} does not exist, there are {count}",
                file=path,
                place=f"line {line[face]}",
                remedy="the file may be cut short",
            )

    cut = triangulate(points[corner_point], start)
    if cut.tangled:
        findings.say(
            "PTM-N221",
            "polygons with crossing edges, or too many corners, were cut into fans of triangles",
            path.name,
            cut.tangled,
        )
    coord = corner_coord[cut.corner]
    uv = np.zeros((len(coord), 3, 2))
    uv[coord >= 0] = coords[coord[coord >= 0]]
    face_material = np.frombuffer(said.face_material, dtype=np.int64)
    used = set(np.unique(face_material).tolist())
    materials, maps = resolved(path, said.libraries, said.materials, used, findings)
    triangle_material = face_material[cut.polygon]
    ends = np.cumsum(np.bincount(triangle_material, minlength=len(materials)))
    grouped = np.split(np.argsort(triangle_material, kind="stable"), ends[:-1])
    for index, statement in maps.items():
        which = grouped[index]
        uv[which] = uv[which] * statement.scale + statement.offset
        bare = np.unique(cut.polygon[which[(coord[which] < 0).any(axis=1)]])
        if len(bare):
            findings.say(
                "PTM-N229",
                f"faces of textured material {materials[index].name} have no texture coordinates",
                f"{path.name}:{line[bare[0]]}",
                len(bare),
            )
    triangles = corner_point[cut.corner]
    colors = None
    if said.colored:
        colored = np.frombuffer(said.colored, dtype=np.int64)
        given = np.frombuffer(said.colors, dtype=np.float64).reshape(-1, 3)
        materials, colors = painted(materials, triangles, triangle_material, colored, given)
    return Source(
        points=points,
        triangles=triangles,
        uv=uv,
        triangle_object=np.frombuffer(said.face_object, dtype=np.int64)[cut.polygon],
        triangle_material=triangle_material,
        objects=tuple(said.objects),
        materials=materials,
        colors=colors,
    )


def _name(text: str) -> str:
    """A name as it was meant: the stream is read as Latin-1, most files are UTF-8."""
    try:
        return text.encode("latin-1").decode("utf-8")
    except UnicodeDecodeError:
        return text


def _rest(line: str, key: str) -> str:
    """What follows the keyword; only blanks are trimmed (a stray UTF-8 byte may look like one)."""
    return _name(line.strip(" \t\r\n")[len(key) :].strip(" \t"))


def _logical_lines(stream: TextIO, path: Path) -> Iterator[tuple[int, str]]:
    """Lines with their numbers from 1; a backslash at the end joins the next one. Raises LimitError
    PTM-L202."""
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
                "PTM-L202",
                f"is longer than {LONGEST_LINE} characters",
                file=path,
                place=f"line {first}",
                remedy="if this is an OBJ file, split the face",
            )
        yield first, line


def _read_statements(
    path: Path, findings: Findings, progress: Progress, max_triangles: int
) -> _Statements:
    said = _Statements()
    points, coords = said.points, said.coords
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
                        said.colored.append(len(points) // 3)
                        said.colors.extend(map(float, words[4:7]))
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
                        object_index = said.objects.setdefault(name or path.stem, len(said.objects))
                    if material_index < 0:
                        unnamed = len(said.materials), number
                        material_index, _ = said.materials.setdefault("", unnamed)
                    _face(said, words)
                    said.face_line.append(number)
                    said.face_object.append(object_index)
                    said.face_material.append(material_index)
                    if len(said.corner_point) - 2 * len(said.face_line) > max_triangles:
                        raise too_many_triangles(max_triangles, path)
                elif key == "usemtl":
                    name, new = _rest(line, "usemtl"), (len(said.materials), number)
                    material_index, _ = said.materials.setdefault(name, new)
                elif key == "o":
                    object_name, group_name, object_index = _rest(line, "o"), "", -1
                elif key == "g":
                    group_name, object_index = _rest(line, "g"), -1
                elif key == "mtllib":
                    said.libraries.append((_rest(line, "mtllib"), number))
                elif key not in _SILENT:
                    if "\0" in line:
                        raise ValueError("binary data")
                    said.unknown.setdefault(key[:40], []).append(number)
            except (ValueError, IndexError, OverflowError) as error:
                raise InputError(
                    "PTM-I245",
                    f"{line.strip()[:60]!r} is not understood"
                    + ("" if isinstance(error, IndexError) else f" ({error})"),
                    file=path,
                    place=f"line {number}",
                ) from None
    if len(points) // 3 > MAX_VERTICES:
        raise LimitError(
            "PTM-L200", f"more than {MAX_VERTICES} vertices", file=path, remedy="split the model"
        )
    if short:
        findings.miss(
            "PTM-N220", "faces of fewer than three corners", f"{path.name}:{short[0]}", len(short)
        )
    progress(size, size, "reading")
    return said


def _face(said: _Statements, words: list[str]) -> None:
    """Append the corners of a face: ``p``, ``p/t``, ``p//n`` or ``p/t/n``; -1 is the last one."""
    for word in words[1:]:
        parts = word.split("/")
        point = int(parts[0])
        coord = int(parts[1]) if len(parts) > 1 and parts[1] else None
        if point < 0:
            point += len(said.points) // 3 + 1
        if coord is not None and coord < 0:
            coord += len(said.coords) // 2 + 1
        if point < 1 or (coord is not None and coord < 1):
            raise ValueError(f"{word} counts back beyond the first, or is 0")
        said.corner_point.append(point - 1)
        said.corner_coord.append(-1 if coord is None else coord - 1)
    said.face_start.append(len(said.corner_point))
