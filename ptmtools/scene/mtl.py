"""Reads MTL, the materials of an OBJ file, and finds their images.

The reader keeps the statements that the emitted files use: ``Kd``, ``d``/``Tr``, ``map_Kd``,
``map_d``, ``norm`` and ``bump``/``map_Bump``, ``Ke`` and ``map_Ke`` for light, ``Pm``, ``Pr`` and
their maps, or else ``Ks``, ``Ns`` and ``illum``, for reflections, and ``map_Ks`` for a campus. The
format has no quoting, so the name of a texture is the rest of the statement after the last option,
spaces included.
"""

from __future__ import annotations

import math
import os
import re
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ptmtools.errors import LimitError
from ptmtools.files import open_regular
from ptmtools.scene.model import Shine, Wrap
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.source import (
    DARK,
    FileRange,
    NormalTexture,
    SourceMaterial,
    SourceTexture,
    decode,
)

#: Size limit of a library, MiB; those of whole cities have a few.
LARGEST = 64
#: Least ``illum`` of a material with highlights, and ``Ns`` of a mirror.
_HIGHLIGHTS, _SHARPEST = 2, 1000.0
#: Options of a texture statement with their smallest and largest number of arguments: words, and
#: numbers.
_WORDS = dict.fromkeys(("-blendu", "-blendv", "-cc", "-clamp", "-imfchan", "-type"), (1, 1))
_NUMBERS = {"-mm": (2, 2), **dict.fromkeys(("-o", "-s", "-t"), (1, 3))}
_NUMBERS |= dict.fromkeys(("-bm", "-boost", "-texres"), (1, 1))
OPTIONS = _WORDS | _NUMBERS


def number(text: str) -> float:
    """A finite number, or ValueError."""
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"not finite: {text}")
    return value


@dataclass(frozen=True)
class MapStatement:
    """A texture statement: ``map_Kd -s 2 2 1 -clamp on my wall.png``.

    Attributes
    ----------
    file: the name as written, spaces included.
    scale, offset: texture coordinates become ``uv * scale + offset``.
    clamp: ``-clamp on``.
    channel: of ``-imfchan``, or "".
    strength: of ``-bm``.
    ignored: unsupported options that would change the image.
    line: number of the line, from 1.
    """

    file: str
    scale: tuple[float, float] = (1.0, 1.0)
    offset: tuple[float, float] = (0.0, 0.0)
    clamp: bool = False
    channel: str = ""
    strength: float = 1.0
    ignored: tuple[str, ...] = ()
    line: int = 0


def parse_map(text: str, line: int = 0) -> MapStatement:
    """Parses the text after the keyword of a texture statement.

    Raises ValueError if an option lacks its arguments or the file is missing.
    """
    words = [(m.group(), m.start()) for m in re.finditer(r"[^ \t]+", text.strip(" \t\r\n"))]
    word: dict[str, str] = {}
    numbers: dict[str, list[float]] = {}
    at = 0
    while at < len(words) and (name := words[at][0].lower()) in OPTIONS:
        least, largest = OPTIONS[name]
        arguments = [argument for argument, _ in words[at + 1 : at + 1 + least]]
        if len(arguments) < least:
            raise ValueError(f"{name} lacks an argument")
        at += 1 + least
        if name in _WORDS:
            word[name] = arguments[0].lower()
            continue
        numbers[name] = [number(argument) for argument in arguments]
        # Further arguments only if they are numbers; the last word always belongs to the file.
        with suppress(ValueError):
            while len(numbers[name]) < largest and at < len(words) - 1:
                numbers[name].append(number(words[at][0]))
                at += 1
    if at >= len(words):
        raise ValueError("the file is missing")
    scale = [*numbers.get("-s", ()), 1.0, 1.0]
    offset = [*numbers.get("-o", ()), 0.0, 0.0]
    # Unsupported options that change colours or positions.
    changes = {
        "-cc": word.get("-cc") == "on",
        "-mm": numbers.get("-mm", [0.0, 1.0]) != [0.0, 1.0],
        "-t": any(numbers.get("-t", ())),
    }
    return MapStatement(
        file=text.strip(" \t\r\n")[words[at][1] :],
        scale=(scale[0], scale[1]),
        offset=(offset[0], offset[1]),
        clamp=word.get("-clamp") == "on",
        channel=word.get("-imfchan", ""),
        strength=numbers.get("-bm", [1.0])[0],
        ignored=tuple(name for name, changed in changes.items() if changed),
        line=line,
    )


@dataclass
class MtlMaterial:
    """A ``newmtl`` block of a library; ``dissolve`` is ``d``, or else 1 - ``Tr``. An invalid
    ``map_Ks`` is no miss, since few builds use it; ``map_ks_fault`` is its error. Nor is an invalid
    ``Ke`` or ``map_Ke``, which then has no effect, nor one of `_MATTER`. ``glow`` is linear light.
    ``ks`` is the largest part of ``Ks``. ``relief`` is the last of ``norm``, a normal map, and
    ``bump`` or ``map_Bump``, with its keyword."""

    library: Path
    color: tuple[float, float, float] | None = None
    dissolve: float = 1.0
    dissolve_given: bool = False
    map_kd: MapStatement | None = None
    map_d: MapStatement | None = None
    map_ks: MapStatement | None = None
    map_ks_fault: str = ""
    relief: tuple[str, MapStatement] | None = None
    glow: tuple[float, float, float] | None = None
    map_ke: MapStatement | None = None
    pm: float = 0.0
    pr: float | None = None
    map_pm: MapStatement | None = None
    map_pr: MapStatement | None = None
    illum: float = 0.0
    ks: float = 0.0
    ns: float = 0.0

    @property
    def roughness(self) -> float:
        """As stated, or else by the highlight."""
        if self.pr is not None:
            return self.pr
        return roughness_of(self.ks if self.illum >= _HIGHLIGHTS else 0.0, self.ns)


def roughness_of(specular: float, exponent: float) -> float:
    """The roughness of a surface with a highlight of a colour whose largest part is ``specular``,
    and of this exponent (Phong 1975), which Blender writes as 1000 (1 - roughness)²."""
    share = min(max(0.0, exponent / _SHARPEST), 1.0)
    return 1.0 - math.sqrt(share) if specular > 0 else 1.0


def read_mtl(path: Path, notes: IngestNotes) -> dict[str, MtlMaterial]:
    """The materials by name, in the order of the file, the first of each name.

    An invalid line is a miss. Raises LimitError PTM-L204 for a library larger than `LARGEST`, and
    OSError.
    """
    with open_regular(path) as stream:
        if os.fstat(stream.fileno()).st_size > LARGEST << 20:
            raise LimitError(
                "PTM-L204",
                f"larger than {LARGEST} MiB",
                file=path,
                remedy="remove the unused materials",
            )
        data = stream.read()
    label = notes.folder.label(path)
    materials: dict[str, MtlMaterial] = {}
    current: MtlMaterial | None = None
    for index, line in enumerate(re.split(r"\r\n|\n|\r", decode(data)), start=1):
        words = line.strip(" \t").split(None, 1)
        if not words or words[0].startswith("#"):
            continue
        key, rest = words[0].lower(), words[1].strip(" \t") if len(words) > 1 else ""
        place = f"{label}:{index}"
        if key == "newmtl":
            current = MtlMaterial(path)
            if materials.setdefault(rest, current) is not current:
                notes.note(
                    "PTM-N208", f"material {rest} defined again; the first definition used", place
                )
        elif current is not None:
            try:
                _statement(current, key, rest, index)
            except ValueError as error:
                message = f"invalid statement {line.strip()[:80]} ({error})"
                if key in _MATTER:
                    notes.note("PTM-N215", message, place)
                else:
                    notes.miss("PTM-N214", message, place)
    return materials


def _share(words: list[str]) -> float:
    """The first word as a number, clipped to [0, 1]."""
    if not words:
        raise ValueError("a number is missing")
    return min(max(number(words[0]), 0.0), 1.0)


def _is_normal_map(material: MtlMaterial) -> bool:
    """Whether the relief is that of ``norm``, which ``bump`` repeats for older readers."""
    return material.relief is not None and material.relief[0] == "norm"


#: Statements of reflections, without which a material is drawn all the same.
_MATTER = ("pm", "pr", "map_pm", "map_pr", "illum", "ks", "ns")


def _matter_value(key: str, rest: str, line: int) -> MapStatement | float:
    """The value of a statement of `_MATTER`; of a colour the largest part."""
    if key.startswith("map_"):
        return parse_map(rest, line)
    numbers = [number(word) for word in rest.split()[: 3 if key == "ks" else 1]]
    if not numbers:
        raise ValueError("a number is missing")
    return max(numbers)


def _statement(material: MtlMaterial, key: str, rest: str, line: int) -> None:
    words = rest.split()
    if key == "kd":
        if words and words[0].lower() in ("spectral", "xyz"):
            raise ValueError("only Kd r g b is supported")
        red = _share(words)
        green, blue = (_share(words[k:]) if len(words) > 2 else red for k in (1, 2))
        material.color = (red, green, blue)
    elif key == "d":
        material.dissolve = _share([word for word in words if word.lower() != "-halo"])
        material.dissolve_given = True
    elif key == "tr" and not material.dissolve_given:
        material.dissolve = 1.0 - _share(words)
    elif key == "map_kd":
        material.map_kd = parse_map(rest, line)
    elif key == "map_d":
        material.map_d = parse_map(rest, line)
    elif key == "norm" or (key in ("bump", "map_bump") and not _is_normal_map(material)):
        material.relief = key, parse_map(rest, line)
    elif key == "ke":
        with suppress(ValueError):
            values = [max(number(word), 0.0) for word in words[:3]]
            material.glow = (values[0], values[1], values[2]) if len(values) == 3 else None
    elif key == "map_ke":
        with suppress(ValueError):
            material.map_ke = parse_map(rest, line)
    elif key in _MATTER:
        setattr(material, key, _matter_value(key, rest, line))
    elif key == "map_ks":
        try:
            material.map_ks, material.map_ks_fault = parse_map(rest, line), ""
        except ValueError as error:
            material.map_ks_fault = str(error)


def resolve_material(
    material: MtlMaterial, notes: IngestNotes, *, used: bool, normals: bool
) -> tuple[SourceMaterial, MapStatement | None]:
    """A material without its name, and the statement of its colours, or of the emission that stands
    for them. Images are looked up if it is ``used``, normal maps if ``normals``."""
    texture = mask = normal = None
    if used:
        texture = _texture(material, "map_Kd", material.map_kd, notes)
        mask = _texture(material, "map_d", material.map_d, notes)
        normal = _normal(material, texture, notes) if normals else None
    glow, shown = _glow(material, notes, used), material.map_kd
    if texture is None:
        dark = max(material.color or (1.0,)) <= DARK
        shown = material.map_ke if dark and glow.get("glow_map") else None
    resolved = SourceMaterial(
        name="",
        color=material.color,
        opacity=material.dissolve,
        # A missing mask must not hide anything.
        see_through=material.dissolve < 1 or (material.map_d is not None and mask is None),
        texture=texture,
        mask=mask,
        shine=_shine(material),
        normal=normal,
        **glow,
        **_matter(material, notes, used),
    )
    return resolved, shown


def _normal(
    material: MtlMaterial, texture: SourceTexture | None, notes: IngestNotes
) -> NormalTexture | None:
    """The normal map of a material; with the coordinates as written if it has no ``texture``."""
    if material.relief is None:
        return None
    key, statement = material.relief
    image = _texture(material, key, statement, notes)
    if image is None:
        return None
    return NormalTexture(image, statement.strength, height=key != "norm", own=texture is None)


def _shine(material: MtlMaterial) -> Shine | None:
    colors, reflection, base = material.map_kd, material.map_ks, material.library.parent
    if material.map_ks_fault:
        return Shine("", base, f"map_Ks: {material.map_ks_fault}")
    if reflection is None:
        return None
    same = colors is None or (colors.scale, colors.offset) == (reflection.scale, reflection.offset)
    return Shine(reflection.file, base, "" if same else "other texture coordinates")


def _glow(material: MtlMaterial, notes: IngestNotes, used: bool) -> dict[str, Any]:
    """The emission of a material, as the fields of a `SourceMaterial`. ``Ke`` is a factor of
    ``map_Ke``; without ``Ke`` it is 1. An image that is missing counts as white."""
    glow = material.glow or (0.0 if material.map_ke is None else 1.0,) * 3
    if not (used and any(glow)):
        return {}
    image = _texture(material, "map_Ke", material.map_ke, notes, optional=True)
    return {"glow": glow, "glow_map": image}


def _matter(material: MtlMaterial, notes: IngestNotes, used: bool) -> dict[str, Any]:
    """Metallic and roughness of a material, as the fields of a `SourceMaterial`. A map replaces the
    number, which many programs write as 0 beside it; one that is missing is matt."""
    fields: dict[str, Any] = {"metallic": material.pm, "roughness": material.roughness}
    if used and material.map_pm is not None:
        fields["metallic_map"] = _texture(material, "map_Pm", material.map_pm, notes, optional=True)
        fields["metallic"] = float(fields["metallic_map"] is not None)
    if used and material.map_pr is not None:
        fields["roughness_map"] = _texture(
            material, "map_Pr", material.map_pr, notes, optional=True
        )
        fields["roughness"] = 1.0
    return fields


def _texture(
    material: MtlMaterial,
    key: str,
    statement: MapStatement | None,
    notes: IngestNotes,
    *,
    optional: bool = False,
) -> SourceTexture | None:
    """An image, with notes on its absence and ignored options, unless it is ``optional``."""
    if statement is None:
        return None
    place = f"{notes.folder.label(material.library)}:{statement.line}"
    what, base = f"{key} {statement.file}", material.library.parent
    if optional:
        file = notes.folder.find(statement.file, base).path
    else:
        file = notes.locate(statement.file, what, place, base=base)
    if file is None:
        return None
    wrap: Wrap = "clamp" if statement.clamp else "repeat"
    image = SourceTexture(FileRange(file), file.name, what, place, wrap, wrap, statement.channel)
    if optional:
        return image
    if statement.ignored:
        notes.note("PTM-N215", f"{what}: ignored {' '.join(statement.ignored)}", place)
    transform, colors = (statement.scale, statement.offset), material.map_kd
    if transform != ((1.0, 1.0), (0.0, 0.0)):
        if key == "map_Kd":
            notes.note("PTM-N215", f"{what}: -s and -o baked into its faces", place)
        elif colors is None or transform != (colors.scale, colors.offset):
            notes.note("PTM-N215", f"{what}: ignored -s -o", place)
    return image
