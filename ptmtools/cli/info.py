"""`ptm info`: describes a model, a database, another folder of `ptm`, or a `.ptm` file."""

from __future__ import annotations

import io
import shlex
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ptmtools.cli.batch import STANDARD, no_name, standard_input
from ptmtools.cli.console import Console
from ptmtools.cli.parameters import Command, json_option, local_copy, options_of, take, with_console
from ptmtools.errors import InputError, naming
from ptmtools.folder_kinds import folder_kind
from ptmtools.quantities import count, size
from ptmtools.scene.formats import find_format
from ptmtools.scene.options import IngestOptions
from ptmtools.store.copies import url_of
from ptmtools.texture.model import Description, PtmHeader, gpu_texel_bytes

if TYPE_CHECKING:
    from ptmtools.cells.doors import Enclosure
    from ptmtools.scene.inspection import Inspection
    from ptmtools.scene.model import Scene

#: Shown for a stage whose record has another recipe.
_OLD = "computed by another release of ptmtools"
#: Objects, images and doors that are listed without ``-v``.
_SHOWN = 5


def _copy(context: click.Context, parameter: click.Parameter, value: str) -> str:
    """As `local_copy`, but the URL of a model stays one."""
    return value if find_format(value) else local_copy(context, parameter, value)


@click.command("info", cls=Command)
@click.argument("target", metavar="MODEL|FILE|DB", type=click.Path(), callback=_copy)
@options_of(IngestOptions)
@json_option
@with_console
def info(console: Console, target: str, **values: Any) -> None:
    """Describe a database, the levels of a .ptm file (- for stdin), or a model that has not been
    built yet.

    The options apply to models, which `ptm` reads as `build-scene` does. Of a .ptm file it reads
    only the head.
    """
    if not target:
        raise no_name()
    if target != STANDARD and Path(target).is_dir():
        if kind := folder_kind(Path(target)):
            lines, record = kind.describe.load()(Path(target))
            console.result(record, [f"{Path(target)}: {kind.about}", *lines])
        else:
            _info_database(console, target)
    elif find_format(target):
        _info_model(console, target, take(IngestOptions, values))
    else:
        _info_ptm(console, target)


def _info_database(console: Console, target: str) -> None:
    from ptmtools.cli.build import visitor_lines
    from ptmtools.options import arguments
    from ptmtools.pipeline.command import build_command, open_database
    from ptmtools.pipeline.report import Visitor
    from ptmtools.pipeline.stages import STAGES

    db = open_database(target)
    stages = db.manifest.stages
    visitor = Visitor.of(db.manifest)
    old = [n for n, s in STAGES.items() if n in stages and stages[n].recipe != s.recipe]
    if old:
        console.warn(f"{url_of(target)}: {', '.join(old)}: {_OLD}; run `{build_command(target)}`")
    shown = "recipe", "parameters", "counts", "notes", "warnings"
    document = {
        "model": db.manifest.model,
        "stages": {
            name: {key: getattr(record, key) for key in shown} | {"files": len(record.outputs)}
            for name, record in stages.items()
        },
        "outdated": old,
        "visitor": visitor and asdict(visitor),
    }
    lines = [f"{url_of(target)}: database of {db.manifest.model}"]
    for name, stage in STAGES.items():
        if name not in stages:
            continue
        record = stages[name]
        lines.append(f"{name:<9} {_OLD if name in old else stage.summarize(record.counts)}")
        details: list[str] = []
        with suppress(ValueError):
            if words := arguments([stage.recorded(record)]):
                details.append(f"options: {shlex.join(words)}")
        details += [f"warning: {warning}" for warning in record.warnings]
        if console.verbose:
            details += [f"{key} = {value}" for key, value in record.parameters.items()]
            details += [f"note: {note}" for note in record.notes if note not in record.warnings]
        lines += [f"{'':<9}   {detail}" for detail in details]
    console.result(document, [*lines, *visitor_lines(visitor)])


def _info_ptm(console: Console, target: str) -> None:
    from ptmtools.texture.container import HEAD_MAX, read_header, whole_levels
    from ptmtools.texture.sources import open_file

    with (
        io.BytesIO(standard_input()) if target == STANDARD else open_file(target) as file,
        naming(target),
    ):
        header = read_header(file.read(HEAD_MAX))
        file_bytes = file.seek(0, io.SEEK_END)
        offset, length, crc32 = header.description
        file.seek(offset)
        description = _description(file.read(length), crc32)
    whole = whole_levels(header, file_bytes)
    levels = _levels(header)
    fields = None if description is None else _description_fields(description)
    document = {
        **asdict(header),
        "description": fields,
        "levels": levels,
        "file_bytes": file_bytes,
        "whole_levels": whole,
    }
    exact = "lossless" if not header.max_error else f"errors up to {header.max_error}"
    trimmed = f", {count(header.trimmed, 'finer level')} omitted" if header.trimmed else ""
    lines = [
        f"{target}: {header.width} x {header.height}, {count(header.components, 'component')} of "
        f"{header.kind}, profile {header.profile}, {exact}{trimmed}, {size(file_bytes)}"
    ]
    if fields is None:
        lines.append("the description is damaged or incomplete")
    elif fields:
        lines.append("; ".join(f"{name} {value}" for name, value in fields.items()))
    lines.append(
        "level       size       tiles         bytes   share  bits/texel      cumulative   in GPU "
        "memory  padded to RGBA"
    )
    for n, level in enumerate(levels):
        extent = f"{level['width']} x {level['height']}"
        across, down = level["tiles"]
        tiles = f"{across} x {down}" if across * down > 1 else "1"
        cut = "" if n < whole else "   cut off"
        lines.append(
            f"{n:>5}  {extent:>14} {tiles:>8} {level['length']:>13,} {level['share']:>7.2%} "
            f"{level['bits_per_texel']:>11.2f} {level['end']:>15,} {level['gpu_bytes']:>15,} "
            f"{level['gpu_bytes_padded']:>15,}{cut}"
        )
    console.result(document, lines)


def _levels(header: PtmHeader) -> list[dict[str, Any]]:
    """The records of the levels; `end` and `gpu_…` count all bytes up to and including a level."""
    per_texel = gpu_texel_bytes(header.texel_bytes, header.components)
    records, texels = [], 0
    for level in header.levels:
        level_texels = level.width * level.height
        texels += level_texels
        records.append(
            {
                **asdict(level),
                "end": level.end,
                "share": level.length / header.file_size,
                "bits_per_texel": 8 * level.length / level_texels,
                "texel_bytes": header.texel_bytes * level_texels,
                "gpu_bytes_padded": per_texel * texels,
            }
        )
    return records


def _description(data: bytes, crc32: int) -> Description | None:
    import zlib

    from ptmtools.texture.container import parse_description

    try:
        return parse_description(data) if zlib.crc32(data) == crc32 else None
    except InputError:
        return None


def _description_fields(given: Description) -> dict[str, Any]:
    """The fields of a description that are set."""
    fields = {
        "icc_bytes": None if given.icc is None else len(given.icc),
        "srgb_intent": given.srgb,
        "gamma": None if given.gamma is None else given.gamma / 100_000,
        "chromaticities": given.chromaticities
        and [part / 100_000 for part in given.chromaticities],
        "orientation": None if given.orientation == 1 else given.orientation,
    }
    return {name: value for name, value in fields.items() if value is not None}


def _info_model(console: Console, target: str, options: IngestOptions) -> None:
    """Raises what `ptmtools.scene.ingest` raises."""
    from ptmtools.cells.doors import enclosure
    from ptmtools.parallel import processors
    from ptmtools.scene.inspection import inspect
    from ptmtools.store.remote import model_file

    with console.progress() as progress, model_file(target) as (file, _):
        model = inspect(file, options, progress, workers=processors())
    around = enclosure(model.scene)
    by = f", written by {model.generator}" if model.generator else ""
    head = f"{target}: {model.format}, {size(model.bytes)}{by}"
    rows = _rows(model, around, every=console.verbose)
    lines = (f"{name:<11} {text}" for name, text in rows)
    console.result(_record(model, around), [head, *lines])


def _rows(model: Inspection, around: Enclosure, *, every: bool) -> Iterator[tuple[str, str]]:
    """The headings and texts of the description of a model; with ``every`` object, image, door and
    note."""
    from ptmtools.scene.notes import GUESSES, lines, warnings

    def some(names: list[str]) -> str:
        shown = names if every else names[:_SHOWN]
        more = f" and {len(names) - len(shown):,} more" if len(names) > len(shown) else ""
        return ", ".join(shown) + more

    scene = model.scene
    space = scene.space
    for name, outcome in model.extensions.items():
        yield "extension", f"{name}: {outcome}"
    yield "triangles", f"{len(scene.triangles):,} in {count(len(scene.objects), 'object')}"
    yield "", f"largest: {some([f'{name} {faces:,}' for name, faces in model.objects.items()])}"
    yield "materials", _materials(model)
    yield "images", _images(model)
    if model.images:
        yield "", some([f"{i.name} {i.width} x {i.height}" for i in model.images])
    width, height, depth = _size(scene)
    yield "size", f"{width:.3g} x {depth:.3g} m, {height:.3g} m high"
    yield "unit", f"{space.metres:g} m ({'guessed' if space.unit_guessed else 'given'})"
    yield "up axis", f"{space.up.upper()} ({'guessed' if space.up_guessed else 'given'})"
    yield "closed", _closed_text(around)
    names = f": {some(list(around.doors))}" if around.doors else ""
    yield "doors", f"{len(around.doors)} recognised{names}"
    if scene.storeys:
        yield "storeys", some([f"{s.name} at {s.height:.3g} m" for s in scene.storeys])
    if scene.rooms:
        yield "rooms", f"{len(scene.rooms)}: {some([r.name or 'unnamed' for r in scene.rooms])}"
    for warning in warnings(scene.notes):
        yield "warning", warning
    guesses = GUESSES if space.unit_guessed or space.up_guessed else ()
    for text in lines(note for note in scene.notes if every or note.code in guesses):
        yield "note", text


def _size(scene: Scene) -> list[float]:
    """Width, height and depth in metres."""
    extent: list[float] = (scene.points.max(axis=0) - scene.points.min(axis=0)).tolist()
    return extent


def _materials(model: Inspection) -> str:
    materials = model.scene.materials
    plain = sum(material.image < 0 for material in materials)
    through = sum(material.transparent for material in materials)
    parts = [f"{plain:,} without an image"] if plain else []
    parts += [f"{through:,} transparent"] if through else []
    return f"{len(materials):,}" + (f", of which {', '.join(parts)}" if parts else "")


def _images(model: Inspection) -> str:
    kinds = Counter(image.format for image in model.images)
    if not kinds:
        return "none"
    texels = sum(image.width * image.height for image in model.images)
    files = ", ".join(f"{number:,} {kind}" for kind, number in kinds.most_common())
    total = sum(image.bytes for image in model.images)
    return f"{files}; {size(total)}, {texels:,} texels"


def _closed_text(around: Enclosure) -> str:
    if not around.rooms:
        return "unknown: no place has a roof above and walls around it"
    if around.looks_closed:
        return "probably; no sight line from a room leaves the building"
    roof = "" if around.roofed > 0.99 else f"; {1 - around.roofed:.0%} of the floor has no ceiling"
    return (
        f"probably not; {around.leaving:.1%} of the sight lines from the rooms leave the "
        f"building{roof}"
    )


def _record(model: Inspection, around: Enclosure) -> dict[str, Any]:
    scene = model.scene
    return {
        "format": model.format,
        "generator": model.generator,
        "bytes": model.bytes,
        "extensions": model.extensions,
        "triangles": len(scene.triangles),
        "objects": model.objects,
        "materials": [vars(material) for material in scene.materials],
        "images": [asdict(image) for image in model.images],
        "space": vars(scene.space),
        "size": _size(scene),
        "enclosure": asdict(around) | {"closed": around.looks_closed},
        "storeys": [vars(storey) for storey in scene.storeys],
        "rooms": [room.name for room in scene.rooms],
        "notes": [vars(note) for note in scene.notes],
    }
