"""Commands for images and `.ptm`s: `ptm encode` and `decode`."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import click

from ptmtools.cli.batch import (
    STANDARD,
    Batch,
    FileJob,
    Report,
    Shard,
    ShardOf,
    jobs_for,
    many_files,
    standard_input,
)
from ptmtools.cli.encoding import FileCoding, FilePreviews, encoded_by_cluster, encoded_file
from ptmtools.cli.parameters import (
    Command,
    Numbers,
    option,
    options_of,
    output_option,
    scheduler_address,
    take,
)
from ptmtools.errors import InputError, OutputError, naming
from ptmtools.quantities import count, size
from ptmtools.texture.model import Description, EncodeOptions
from ptmtools.texture.profiles import PROFILES


@click.command("encode", cls=Command)
@click.argument("images", metavar="IMAGE...", nargs=-1, required=True, type=click.Path())
@output_option(
    "File to write, or - for stdout; a folder if there are several images or the path ends with "
    "/. Default: beside each image."
)
@options_of(EncodeOptions, FilePreviews)
@option(
    "--orient / --no-orient",
    help="Rotate the texels according to the EXIF orientation of the image instead of storing the "
    "orientation.",
)
@option(
    "--shard",
    type=ShardOf(),
    metavar="K/N",
    help="Encode only the K-th of N parts of the images, K from 1 to N: one for each task of a "
    "batch array. The name of an image decides its part.",
)
@option(
    "--scheduler",
    metavar="ADDRESS",
    callback=scheduler_address,
    help="Encode on the cluster of this Dask scheduler, such as tcp://10.0.0.1:8786, whose workers "
    "see the files under the same paths; -j then limits the images at a time.",
)
@many_files
def encode(
    batch: Batch,
    images: tuple[str, ...],
    output: str | None,
    orient: bool,
    shard: Shard | None,
    scheduler: str | None,
    **values: Any,
) -> int:
    """Encode images as progressive textures (.ptm).

    IMAGE is a file, a pattern such as 'scans/*.tif', a folder (all images in it), or - for stdin.
    After an image that cannot be read, the command continues with the others.
    """
    from ptmtools.texture.images import SUFFIXES

    options, previews = take(EncodeOptions, values), take(FilePreviews, values)
    if previews.wanted and output == STANDARD:
        raise InputError(
            "PTM-I111", "previews are files beside the .ptm", remedy="use -o FILE instead of -o -"
        )
    jobs = jobs_for(images, SUFFIXES, output, ".ptm", (".ptm", *SUFFIXES))
    if output and any(job.target and not job.folder for job in jobs):
        _refuse_image_suffix(output)
    if (shard or scheduler) and any(job.streams for job in jobs):
        raise click.UsageError("--shard and --scheduler need named files, not -")
    coding = FileCoding(options, previews, orient, batch)

    lines = partial(_encode_lines, max_side=options.max_side)
    if shard:
        total, jobs = len(jobs), shard.jobs(jobs)
        if not batch.console.as_json:
            batch.console.print(f"shard {shard}: {len(jobs):,} of {count(total, 'image')}")
    if scheduler:
        results = encoded_by_cluster(coding, jobs, scheduler)
        status, reports = batch.report(results, len(jobs), lines)
    else:
        status, reports = batch.each(jobs, partial(encoded_file, coding), lines)
    if not batch.console.as_json and (hint := _hint_on_lossy(reports, options)):
        batch.console.print(hint)
    return status


def _encode_lines(report: Report, max_side: int) -> Iterator[str]:
    """What `encode` prints on an image."""
    if report["skipped"]:
        yield f"{report['file']}: exists and was skipped"
        return
    raw, stored, image = (report[f"{what}_bytes"] for what in ("raw", "ptm", "image"))
    name = "the input" if report["image"] == STANDARD else os.path.basename(report["image"])
    compared = f", {_share(stored, image)} the size of {name} ({size(image)})" if image else ""
    yield (
        f"{report['file']}: {count(report['levels'], 'level')}, {size(stored)}: "
        f"{_share(stored, raw)} the uncompressed size ({size(raw)}){compared}"
    )
    if previews := report.get("previews"):
        yield (
            f"  {count(len(previews), 'preview')}, {size(sum(row['bytes'] for row in previews))}: "
            f"{', '.join(os.path.basename(row['file']) for row in previews)}"
        )
    elif note := _note_on_sides(report, max_side):
        yield f"  {note}"


def _note_on_sides(report: Report, max_side: int) -> str | None:
    """A note on the size of the finest level, if the sides do not halve to ``--max-side``."""
    width, height = report["finest"]
    if not max_side or max(width, height) == max_side:
        return None
    if max(width, height) > max_side:
        return f"all levels exceed --max-side {max_side}; the coarsest, {width} x {height}, is kept"
    if not (above := report["left_out"]):
        return None
    return (
        f"width and height halve from level to level: the finest within --max-side {max_side} is "
        f"{width} x {height}; the next, {above['width']} x {above['height']}, would add about "
        f"{size(above['bytes'])}"
    )


def _hint_on_lossy(reports: list[Report], options: EncodeOptions) -> str | None:
    """Advice for lossless files that are larger than their lossy sources."""
    grown = [
        report
        for report in reports
        if not report["skipped"]
        and report["lossy"]
        and report["ptm_bytes"] > report["image_bytes"] > 0
    ]
    if not grown or options.max_error or not PROFILES[options.profile].lossy:
        return None
    kinds = " and ".join(sorted({report["lossy"] for report in grown}))
    return (
        f"hint: {kinds} files discard detail; a lossless .ptm keeps every decoded texel, noise "
        "included. --exact lossless-sources keeps the image itself as the finest level. Or "
        "--max-error 4 about halves the .ptm: errors of up to 4 per sample (range 0 to 255) are "
        "hard to see. Keep 0 where texels are data, such as normals, masks or heights."
    )


def _share(part: int, whole: int) -> str:
    """``85.3% of``, ``4.2 times``."""
    return f"{part / whole:.1%} of" if part < 2 * whole else f"{part / whole:.1f} times"


@click.command("decode", cls=Command)
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=click.Path())
@option(
    "--level",
    type=int,
    help="Level to decode; 0 is the coarsest. Default: the finest complete one.",
)
@option(
    "--window",
    type=Numbers([4], int),
    metavar="X,Y,W,H",
    help="Decode only W x H texels of the level, from column X and row Y on.",
)
@output_option(
    "Image to write (.png, .npy, .tif, .hdr, .exr); - for stdout; a folder if there are several "
    "files or the path ends with /. Default: a .png beside each file, or an .npy for floats."
)
@many_files
def decode(
    batch: Batch,
    files: tuple[str, ...],
    level: int | None,
    window: tuple[int, int, int, int] | None,
    output: str | None,
) -> int:
    """Decode .ptm files to images.

    FILE is a .ptm file, or the beginning of one; a pattern such as 'textures/*.ptm'; a folder (all
    .ptm files in it); or - for stdin. After a file that cannot be decoded, the command continues
    with the others.
    """
    from ptmtools.texture.images import WRITTEN
    from ptmtools.texture.images.files import writer

    jobs = jobs_for(files, (".ptm",), output, "", tuple(WRITTEN))
    # A single output has the suffix that the user gave; others get one.
    named = output is not None and any(job.target and not job.folder for job in jobs)
    if named:
        with naming(output):
            writer(Path(str(output)).suffix)

    work = partial(_decode_file, batch, level=level, window=window, named=named)
    return batch.each(jobs, work, _decode_lines)[0]


def _decode_file(
    batch: Batch,
    job: FileJob,
    threads: int,
    *,
    level: int | None,
    window: tuple[int, int, int, int] | None,
    named: bool,
) -> Report:
    """Decodes a file; ``named``: the user has given the name of its image."""
    from ptmtools.texture.images import write_to
    from ptmtools.texture.reader import open

    source, target = job.source, job.target
    where = standard_input() if source == STANDARD else source
    with naming(source), open(where, limits=batch.limits, threads=threads) as ptm:
        suffix = ".npy" if ptm.dtype.kind == "f" else ".png"
        if target and named:
            suffix = target.suffix
        elif target:
            target = target.with_name(target.name + suffix)
        report: Report = {
            "file": source,
            "image": os.fspath(target) if target else STANDARD,
            "skipped": batch.skips(target),
        }
        if report["skipped"]:
            return report
        number = max(0, ptm.whole - 1) if level is None else level
        texels = ptm.window(number, *window) if window else ptm.level(number)
        description, warning = Description(), None
        try:
            description = ptm.description()
        except InputError as error:  # the texels are intact
            warning = f"written without colour and orientation: {error.message} [{error.code}]"
    replace(job, target=target).put(
        lambda file: write_to(file, suffix, texels, description), batch.force
    )
    height, width, components = texels.shape
    return report | {
        "level": number,
        "width": width,
        "height": height,
        "components": components,
        "kind": texels.dtype.name,
        "warning": warning,
    }


def _decode_lines(report: Report) -> Iterator[str]:
    """What `decode` prints on a file."""
    if report["skipped"]:
        yield f"{report['image']}: exists and was skipped"
        return
    kind = "" if report["kind"] == "uint8" else f" of {report['kind']}"
    yield (
        f"{report['image']}: {report['width']} x {report['height']}, "
        f"{count(report['components'], 'component')}{kind}, level {report['level']}"
    )


def _refuse_image_suffix(output: str) -> None:
    """Raises OutputError PTM-O101 if the name of a .ptm has the suffix of an image format."""
    from ptmtools.texture.images import SUFFIXES, WRITTEN
    from ptmtools.texture.images.files import LOSSY

    suffix = Path(output).suffix.lower()
    if suffix in (*SUFFIXES, *WRITTEN, *LOSSY):
        raise OutputError(
            "PTM-O101",
            f"{suffix!r} is a suffix of images, but the output is a .ptm file",
            file=output,
            remedy="name the output .ptm",
        )
