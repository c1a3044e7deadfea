"""Reads MTL, the materials of an OBJ file.

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

from ptmtools.errors import LimitError
from ptmtools.files import open_regular
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.source import decode

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
