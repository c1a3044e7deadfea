"""Reads the index of a campus, and summarises it beside the sizes of the paper."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from ptmtools import schemas
from ptmtools.errors import InputError, LimitError
from ptmtools.files import open_below
from ptmtools.quantities import count, size
from ptmtools_systems.campus.model import (
    CHANNELS,
    DIFFUSE,
    INDEX,
    LIGHT,
    LIGHT_SIZES,
    SIZES,
    Campus,
)
from ptmtools_systems.schemas import CAMPUS

#: Longest index, bytes.
LONGEST = 1 << 28


def read_campus(folder: str | os.PathLike[str]) -> Campus:
    """The index of a campus folder; `check_campus` checks the rest.

    Raises
    ------
    InputError: PTM-I122 it cannot be read, PTM-I821 it violates its schema, or an object has fewer
        or more meshes than the campus has levels.
    LimitError: PTM-L204 it is too long.
    """
    file = Path(folder) / INDEX

    def wrong(place: str | None, message: str) -> InputError:
        remedy = "write it again with `ptm campus`"
        return InputError("PTM-I821", message, file=file, place=place, remedy=remedy)

    try:
        with open_below(folder, INDEX) as stream:
            data = stream.read(LONGEST + 1)
    except (OSError, ValueError) as fault:
        why = getattr(fault, "strerror", None) or str(fault)
        remedy = "specify a folder that `ptm campus` wrote"
        raise InputError("PTM-I122", f"cannot be read ({why})", file=file, remedy=remedy) from None
    if len(data) > LONGEST:
        raise LimitError("PTM-L204", "is too long for the index of a campus", file=file)
    try:
        campus = Campus.from_document(schemas.read(data, CAMPUS))
    except schemas.ShapeError as fault:
        raise wrong(fault.place or None, fault.message) from None
    for place, item in enumerate(campus.objects):
        if len(item.meshes) != campus.lods:
            message = f"has {len(item.meshes)} items, not {campus.lods}"
            raise wrong(f"objects[{place}].meshes", message)
    return campus


#: Average sizes of the paper's table 1, KB (of 1024 bytes), by side.
PAPER_TEXTURES = {128: 3.09, 256: 10.63, 512: 78.81}
PAPER_LIGHTMAPS = {512: 88.32, 1024: 258.56, 2048: 784.23}
_WORDS = {"d": "diffuse", "a": "alpha", "m": "mask", "l": "lightmap"}


@dataclass(frozen=True)
class TextureStatistics:
    """Textures of one side and channel: how many, their bytes, those of files that are larger than
    their source, and the paper's average, KB."""

    channel: str
    size: int
    files: int
    bytes: int
    enlarged: int
    paper: float

    @property
    def average(self) -> float:
        """KB of 1024 bytes."""
        return self.bytes / self.files / 1024


def kinds(campus: Campus) -> list[TextureStatistics]:
    """The textures of a campus, by channel and size."""
    result = []
    for channel, sizes, paper in (
        *((channel, SIZES, PAPER_TEXTURES) for channel in CHANNELS),
        (LIGHT, LIGHT_SIZES, PAPER_LIGHTMAPS),
    ):
        for side in sizes:
            these = [t for t in campus.textures if t.channel == channel and t.size == side]
            if these:
                total = sum(t.bytes for t in these)
                enlarged = sum(t.bytes for t in these if side > max(t.source))
                result.append(
                    TextureStatistics(channel, side, len(these), total, enlarged, paper[side])
                )
    return result


def summary(campus: Campus) -> Iterator[str]:
    """The lines that `ptm campus` prints."""
    parts = sum(len(o.parts) for o in campus.objects)
    joined = f" of the model's {parts:,}" if parts != len(campus.objects) else ""
    shared = sum(len(o.materials) for o in campus.objects)
    bases = {m.base for m in campus.materials if m.base is not None}
    yield (
        f"{count(len(campus.objects), 'object')}{joined}, "
        f"{count(len(campus.materials), 'material')} used {shared:,} times, "
        f"{count(len(bases), 'image')}"
    )
    yield f"{'meshes':<12} {'faces':>12} {'average':>10} {'bytes':>10} {'worst error':>12}"
    for lod in range(campus.lods):
        level = [o.meshes[lod] for o in campus.objects]
        faces = sum(m.faces for m in level)
        yield (
            f"level {lod:<6} {faces:>12,} {faces / len(level):>10,.0f} "
            f"{size(sum(m.bytes for m in level)):>10} {max(m.error for m in level):>10.3g} m"
        )
    yield f"{'textures':<12} {'size':>6} {'files':>6} {'bytes':>10} {'average':>10} {'paper':>10}"
    for kind in kinds(campus):
        paper = f"{kind.paper:.2f} KB"
        yield (
            f"{_WORDS[kind.channel]:<12} {kind.size:>6} {kind.files:>6,} {size(kind.bytes):>10} "
            f"{kind.average:>7.2f} KB {paper:>10}"
        )
    enlarged = sum(kind.enlarged for kind in kinds(campus) if kind.channel == DIFFUSE)
    if enlarged:
        yield f"{size(enlarged)} of the diffuse textures are larger than what they were made of"
    yield f"{'start':<25} {size(campus.start):>10}"
    for preset in campus.presets:
        what = f"{preset.diffuse} / {preset.light}"
        yield (
            f"{preset.name:<12} {what:>12} {size(preset.bytes):>10} "
            f"{size(preset.download):>10} to load"
        )


def describe_campus(folder: Path) -> tuple[tuple[str, ...], Mapping[str, Any]]:
    """The lines of `ptm info`, and its record as JSON; raises as `read_campus`."""
    campus = read_campus(folder)
    return tuple(summary(campus)), record(campus)


def record(campus: Campus) -> dict[str, Any]:
    """The record of a `Campus` in `ptm campus --json` and `ptm info --json`."""
    document = campus.to_document()
    return {
        "objects": len(campus.objects),
        "faces": [sum(o.meshes[lod].faces for o in campus.objects) for lod in range(campus.lods)],
        "textures": [asdict(kind) | {"average": kind.average} for kind in kinds(campus)],
        **{name: document[name] for name in ("unit", "origin", "lightmaps", "start", "presets")},
    }


def page_files(index: Mapping[str, Any]) -> Iterator[str]:
    """The files of a folder with this index that its page fetches."""
    for thing in index["objects"]:
        yield from (mesh["file"] for mesh in thing["meshes"])
        if "record" in thing:
            yield thing["record"]["file"]
    yield from (texture["file"] for texture in index["textures"])
