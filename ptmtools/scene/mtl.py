"""Reads MTL, the materials of an OBJ file.

Only what the emitted files need is kept: ``Kd``, ``d``/``Tr``, ``map_Kd``, ``map_d``. The
statements of physically based extensions (``Pr``, ``norm``, …) are passed over. The format has no
quoting, so the name of a texture is all that follows the last option, spaces included.
"""

from __future__ import annotations

import math
import os
import re
from dataclasses import dataclass, field, replace
from pathlib import Path

from ptmtools.errors import LimitError
from ptmtools.files import open_regular
from ptmtools.scene.source import Findings, decode

#: Largest library that is read, MiB; those of whole cities have a few.
LARGEST = 64
#: Options of a texture statement with the least and the greatest number of their arguments.
OPTIONS = {
    "-blendu": (1, 1),
    "-blendv": (1, 1),
    "-bm": (1, 1),
    "-boost": (1, 1),
    "-cc": (1, 1),
    "-clamp": (1, 1),
    "-imfchan": (1, 1),
    "-mm": (2, 2),
    "-o": (1, 3),
    "-s": (1, 3),
    "-t": (1, 3),
    "-texres": (1, 1),
    "-type": (1, 1),
}
_NUMERIC = {"-bm", "-boost", "-mm", "-o", "-s", "-t", "-texres"}
#: Options that change colours or positions and are not carried over.
_IGNORED = ("-cc", "-mm", "-t")


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
    file: the name as it stands, spaces included.
    scale, offset: texture coordinates become ``uv * scale + offset``.
    clamp: ``-clamp on``.
    channel: of ``-imfchan``, or "".
    ignored: options that would change the picture and are not carried over.
    line: number of the line, from 1.
    """

    file: str
    scale: tuple[float, float] = (1.0, 1.0)
    offset: tuple[float, float] = (0.0, 0.0)
    clamp: bool = False
    channel: str = ""
    ignored: tuple[str, ...] = ()
    line: int = 0


def parse_map(text: str, line: int = 0) -> MapStatement:
    """Parse what follows the keyword of a texture statement.

    Raises ValueError where an option lacks its arguments or no file is named.
    """
    words = [(m.group(), m.start()) for m in re.finditer(r"[^ \t]+", text.strip(" \t\r\n"))]
    given: dict[str, list[str]] = {}
    at = 0
    while at < len(words) and words[at][0].lower() in OPTIONS:
        name = words[at][0].lower()
        least, most = OPTIONS[name]
        arguments = [word for word, _ in words[at + 1 : at + 1 + least]]
        if len(arguments) < least:
            raise ValueError(f"{name} lacks an argument")
        if name in _NUMERIC:
            for word in arguments:
                number(word)
        at += 1 + least
        # Further arguments only if they are numbers, and the last word is always the file's.
        while len(arguments) < most and at < len(words) - 1:
            try:
                number(words[at][0])
            except ValueError:
                break
            arguments.append(words[at][0])
            at += 1
        given[name] = arguments
    if at >= len(words):
        raise ValueError("no file is named")
    file = text.strip(" \t\r\n")[words[at][1] :]

    scale = [float(x) for x in given.get("-s", [])] + [1.0, 1.0]
    offset = [float(x) for x in given.get("-o", [])] + [0.0, 0.0]
    identity = {"-mm": [0.0, 1.0], "-t": [0.0, 0.0, 0.0]}
    ignored = []
    for name in _IGNORED:
        if name not in given:
            continue
        if name == "-cc":
            changes = given[name][0].lower() == "on"
        else:
            values = [float(x) for x in given[name]]
            changes = values != identity[name][: len(values)]
        if changes:
            ignored.append(name)
    return MapStatement(
        file=file,
        scale=(scale[0], scale[1]),
        offset=(offset[0], offset[1]),
        clamp=given.get("-clamp", ["off"])[0].lower() == "on",
        channel=given.get("-imfchan", [""])[0].lower(),
        ignored=tuple(ignored),
        line=line,
    )


@dataclass(frozen=True)
class MtlMaterial:
    """A ``newmtl`` block; ``dissolve`` is ``d``, or 1 - ``Tr`` where only that is given."""

    name: str
    library: Path = field(repr=False)
    line: int
    color: tuple[float, float, float] | None = None
    dissolve: float = 1.0
    dissolve_given: bool = False
    map_kd: MapStatement | None = None
    map_d: MapStatement | None = None


def read_mtl(path: Path, label: str, findings: Findings) -> dict[str, MtlMaterial]:
    """Materials by name, in the order of the file; of two with one name the first is kept.

    ``label`` names the file in notes. A line that cannot be understood is a miss. Raises LimitError
    PTM-L204 for a library larger than `LARGEST`, and OSError.
    """
    with open_regular(path) as stream:
        if os.fstat(stream.fileno()).st_size > LARGEST << 20:
            raise LimitError(
                "PTM-L204",
                f"is larger than {LARGEST} MiB",
                file=path,
                remedy="remove the materials that are not used",
            )
        data = stream.read()
    materials: dict[str, MtlMaterial] = {}
    current: MtlMaterial | None = None
    for index, line in enumerate(re.split(r"\r\n|\n|\r", decode(data)), start=1):
        words = line.strip(" \t").split(None, 1)
        if not words or words[0].startswith("#"):
            continue
        key, rest = words[0].lower(), words[1].strip(" \t") if len(words) > 1 else ""
        place = f"{label}:{index}"
        if key == "newmtl":
            current = MtlMaterial(rest, path, index)
            if rest in materials:
                findings.say(
                    "PTM-N218", f"material {rest} is defined again; the first counts", place
                )
            else:
                materials[rest] = current
            continue
        if current is None:
            continue
        try:
            changed = _statement(current, key, rest, index)
        except ValueError as error:
            findings.miss("PTM-N214", f"{line.strip()[:80]}: not understood ({error})", place)
            continue
        if materials[current.name] is current:
            materials[current.name] = changed
        current = changed
    return materials


def _share(words: list[str]) -> float:
    """The first word as a number, brought into [0, 1]."""
    if not words:
        raise ValueError("a number is missing")
    return min(max(number(words[0]), 0.0), 1.0)


def _statement(material: MtlMaterial, key: str, rest: str, line: int) -> MtlMaterial:
    words = rest.split()
    if key == "kd":
        if words and words[0].lower() in ("spectral", "xyz"):
            raise ValueError("only Kd r g b is read")
        red = _share(words)
        grey = len(words) < 3
        return replace(
            material,
            color=(red, red if grey else _share(words[1:]), red if grey else _share(words[2:])),
        )
    if key == "d":
        dissolve = _share([word for word in words if word.lower() != "-halo"])
        return replace(material, dissolve=dissolve, dissolve_given=True)
    if key == "tr" and not material.dissolve_given:
        return replace(material, dissolve=1.0 - _share(words))
    if key == "map_kd":
        return replace(material, map_kd=parse_map(rest, line))
    if key == "map_d":
        return replace(material, map_d=parse_map(rest, line))
    return material
