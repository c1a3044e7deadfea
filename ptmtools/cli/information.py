"""`ptm info`: what is in a model, a database, another folder that `ptm` wrote, or a `.ptm` file."""

from __future__ import annotations

import io
import shlex
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from ptmtools.cli.batch import STANDARD, no_name, standard_input
from ptmtools.cli.common import as_json, voiced
from ptmtools.cli.output import Voice
from ptmtools.cli.parameters import options_of, take
from ptmtools.errors import InputError, naming
from ptmtools.pipeline.validation import FolderKind, kind_of
from ptmtools.quantities import count, size
from ptmtools.scene.options import SUFFIXES, IngestOptions
from ptmtools.texture.model import Description, PtmHeader, gpu_texel_bytes

#: Of a stage whose record has another recipe.
_OLD = "made by another release of ptmtools"


@click.command("info")
@click.argument("target", metavar="MODEL|FILE|DB", type=click.Path())
@options_of(IngestOptions)
@as_json
@voiced
def info(voice: Voice, target: str, as_json: bool, **values: Any) -> None:
    """Show what a model is before anything is built of it, what is in a database, or level by level
    in a .ptm file (- for stdin).

    A model is read as build-scene reads it, with the options that follow. Only the head of a .ptm
    is read.
    """
    if not target:
        raise no_name()
    if target != STANDARD and Path(target).is_dir():
        if kind := kind_of(Path(target)):
            _info_folder(voice, Path(target), kind, as_json)
        else:
            _info_database(voice, target, as_json)
    elif Path(target).suffix.lower() in SUFFIXES:
        from ptmtools.cli.models import info_model

        info_model(voice, target, take(IngestOptions, values), as_json)
    else:
        _info_ptm(voice, target, as_json)


def _info_folder(voice: Voice, folder: Path, kind: FolderKind, as_json: bool) -> None:
    lines, record = kind.describe.load()(folder)
    if as_json:
        voice.emit_json(record)
        return
    voice.say(f"{folder}: {kind.about}")
    for line in lines:
        voice.say(line)


def _info_database(voice: Voice, target: str, as_json: bool) -> None:
    from ptmtools.cli.stages import print_visitor
    from ptmtools.pipeline.build import Visitor
    from ptmtools.pipeline.command import build_command, open_database
    from ptmtools.pipeline.stage import words
    from ptmtools.pipeline.stages import STAGES

    db = open_database(target)
    stages = db.manifest.stages
    visitor = Visitor.of(db.manifest)
    old = [n for n, s in STAGES.items() if n in stages and stages[n].recipe != s.recipe]
    if old:
        voice.warn(f"{target}: {', '.join(old)}: {_OLD}; run `{build_command(target)}`")
    if as_json:
        voice.emit_json(
            {
                "model": db.manifest.model,
                "stages": {
                    name: {
                        "recipe": record.recipe,
                        "parameters": record.parameters,
                        "counts": record.counts,
                        "notes": record.notes,
                        "warnings": record.warnings,
                        "files": len(record.outputs),
                    }
                    for name, record in stages.items()
                },
                "outdated": old,
                "visitor": visitor and asdict(visitor),
            }
        )
        return
    voice.say(f"{target}: database of {db.manifest.model}")
    for name, stage in STAGES.items():
        if name not in stages:
            continue
        record = stages[name]
        voice.say(f"{name:<9} {_OLD if name in old else stage.summarize(record.counts)}")
        with suppress(ValueError):
            if given := words([stage.recorded(record)]):
                voice.say(f"{'':<9}   options: {shlex.join(given)}")
        for warning in record.warnings:
            voice.say(f"{'':<9}   warning: {warning}")
        if voice.verbose:
            for key, value in record.parameters.items():
                voice.say(f"{'':<9}   {key} = {value}")
            for note in [note for note in record.notes if note not in record.warnings]:
                voice.say(f"{'':<9}   note: {note}")
    if visitor:
        print_visitor(voice, visitor)


def _info_ptm(voice: Voice, target: str, as_json: bool) -> None:
    from ptmtools.texture.container import HEAD_MAX, read_header, whole_levels
    from ptmtools.texture.sources import open_file

    with (
        io.BytesIO(standard_input()) if target == STANDARD else open_file(target) as file,
        naming(target),
    ):
        header = read_header(file.read(HEAD_MAX))
        bytes_there = file.seek(0, io.SEEK_END)
        offset, length, crc32 = header.description
        file.seek(offset)
        description = _description(file.read(length), crc32)
    whole = whole_levels(header, bytes_there)
    levels = _levels(header)
    if as_json:
        found = None if description is None else _described(description)
        voice.emit_json(
            {
                **asdict(header),
                "description": found,
                "levels": levels,
                "file_bytes": bytes_there,
                "whole_levels": whole,
            }
        )
        return
    exact = "lossless" if not header.max_error else f"errors up to {header.max_error}"
    trimmed = f", {count(header.trimmed, 'finer level')} left out" if header.trimmed else ""
    voice.say(
        f"{target}: {header.width} x {header.height}, {count(header.components, 'component')} of "
        f"{header.kind}, profile {header.profile}, {exact}{trimmed}, {size(bytes_there)}"
    )
    if description is None:
        voice.say("its description is damaged or cut off")
    elif found := _described(description):
        voice.say("; ".join(f"{name} {value}" for name, value in found.items()))
    voice.say(
        "level       size       tiles         bytes   share  bits/texel      up to here"
        "   in GPU memory  RGB as RGBA"
    )
    for n, level in enumerate(levels):
        extent = f"{level['width']} x {level['height']}"
        across, down = level["tiles"]
        tiles = f"{across} x {down}" if across * down > 1 else "1"
        cut = "" if n < whole else "   cut off"
        voice.say(
            f"{n:>5}  {extent:>14} {tiles:>8} {level['length']:>13,} {level['share']:>7.2%} "
            f"{level['bits_per_texel']:>11.2f} {level['end']:>15,} {level['gpu_bytes']:>15,} "
            f"{level['gpu_bytes_padded']:>12,}{cut}"
        )


def _levels(header: PtmHeader) -> list[dict[str, Any]]:
    """What is said of each level; bytes up to and including it are those of `end` and `gpu_…`."""
    per_texel = gpu_texel_bytes(header.texel_bytes, header.components)
    found, texels = [], 0
    for level in header.levels:
        here = level.width * level.height
        texels += here
        found.append(
            {
                **asdict(level),
                "end": level.end,
                "share": level.length / header.file_size,
                "bits_per_texel": 8 * level.length / here,
                "texel_bytes": header.texel_bytes * here,
                "gpu_bytes_padded": per_texel * texels,
            }
        )
    return found


def _description(data: bytes, crc32: int) -> Description | None:
    import zlib

    from ptmtools.texture.container import parse_description

    try:
        return parse_description(data) if zlib.crc32(data) == crc32 else None
    except InputError:
        return None


def _described(description: Description) -> dict[str, Any]:
    """What a description says, without what it does not."""
    found: dict[str, Any] = {}
    if description.icc is not None:
        found["icc_bytes"] = len(description.icc)
    if description.srgb is not None:
        found["srgb_intent"] = description.srgb
    if description.gamma is not None:
        found["gamma"] = description.gamma / 100_000
    if description.chromaticities is not None:
        found["chromaticities"] = [value / 100_000 for value in description.chromaticities]
    if description.orientation != 1:
        found["orientation"] = description.orientation
    return found
