"""`ptm encode` and `ptm decode`."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import IO, Any

import click

from ptmtools.cli.batch import (
    STANDARD,
    Batch,
    Job,
    Report,
    jobs_for,
    many_files,
    standard_input,
)
from ptmtools.cli.parameters import Command, Numbers, option, options_of, output_option, take
from ptmtools.errors import InputError, OutputError, naming
from ptmtools.quantities import count, size
from ptmtools.texture.model import Description, EncodeOptions
from ptmtools.texture.profiles import PROFILES


@click.command("encode", cls=Command)
@click.argument("images", metavar="IMAGE...", nargs=-1, required=True, type=click.Path())
@output_option(
    "File to write, or - for stdout; a folder for several images or if it ends with /. "
    "Default: beside each image."
)
@options_of(EncodeOptions)
@option(
    "--orient / --no-orient",
    help="Rotate the texels by the EXIF orientation of the image instead of storing the "
    "orientation.",
)
@many_files
def encode(
    batch: Batch, images: tuple[str, ...], output: str | None, orient: bool, **values: Any
) -> int:
    """Encode images as progressive textures (.ptm).

    IMAGE is a file, a pattern such as 'scans/*.tif', a folder (all images in it), or - for stdin.
    After an image that cannot be read, the command continues with the others.
    """
    from ptmtools.texture.container import HEAD_MAX, read_header
    from ptmtools.texture.encoder import check_options, encode_to, level_above
    from ptmtools.texture.images import SUFFIXES, load_image

    options = take(EncodeOptions, values)
    check_options(options)
    jobs = jobs_for(images, SUFFIXES, output, ".ptm", (".ptm", *SUFFIXES))
    if output and any(job.target and not job.folder for job in jobs):
        _refuse_image_suffix(output)

    def work(job: Job, threads: int) -> Report:
        source, target = job.source, job.target
        report: Report = {
            "image": source,
            "file": os.fspath(target) if target else STANDARD,
            "skipped": batch.skips(target),
        }
        if report["skipped"]:
            return report

        def write(file: IO[bytes]) -> None:
            encode_to(
                file, picture.texels, options, description=picture.description, threads=threads
            )
            report["ptm_bytes"] = file.tell()
            file.seek(0)
            header = read_header(file.read(HEAD_MAX))
            file.seek(0, os.SEEK_END)
            report["raw_bytes"] = header.width * header.height * header.texel_bytes
            report["levels"] = len(header.levels)
            finest, above = header.levels[-1], level_above(header)
            report["finest"] = finest.width, finest.height
            report["left_out"] = above and dict(
                zip(("width", "height", "bytes"), above, strict=True)
            )

        with naming(source):
            data = standard_input() if source == STANDARD else source
            picture = load_image(data, batch.limits)
            report["image_bytes"] = len(data) if isinstance(data, bytes) else os.path.getsize(data)
            report["lossy"] = picture.lossy
            if orient:
                picture = picture.upright()
            job.put(write, batch.force)
        return report

    def lines(report: Report) -> Iterator[str]:
        if report["skipped"]:
            yield f"{report['file']}: exists and was skipped"
            return
        raw, stored, image = (report[f"{what}_bytes"] for what in ("raw", "ptm", "image"))
        name = "the input" if report["image"] == STANDARD else os.path.basename(report["image"])
        compared = f", {_share(stored, image)} {name} ({size(image)})" if image else ""
        yield (
            f"{report['file']}: {count(report['levels'], 'level')}, {size(stored)}: "
            f"{_share(stored, raw)} the raw texels ({size(raw)}){compared}"
        )
        if note := _note_on_sides(report, options.max_side):
            yield f"  {note}"

    status, reports = batch.each(jobs, work, lines)
    if not batch.console.as_json and (hint := _hint_on_lossy(reports, options)):
        batch.console.print(hint)
    return status


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
        f"sides halve from level to level: the finest within --max-side {max_side} is {width} x "
        f"{height}; the next, {above['width']} x {above['height']}, would add about "
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
        "included. For pictures, --max-error 4 about halves the .ptm: errors of up to 4 (of 255) "
        "are hard to see. Keep 0 where texels are data, such as normals, masks or heights."
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
    "Image to write (.png, .npy, .tif, .hdr, .exr); - for stdout; a folder for several "
    "files or if it ends with /. Default: a .png beside each file, or an .npy for floats."
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

    FILE is a .ptm, or the beginning of one; a pattern such as 'textures/*.ptm'; a folder (all .ptm
    files in it); or - for stdin. After a file that cannot be decoded, the command continues with
    the others.
    """
    from ptmtools.texture.images import WRITTEN, write_to
    from ptmtools.texture.images.files import writer
    from ptmtools.texture.reader import open

    jobs = jobs_for(files, (".ptm",), output, "", tuple(WRITTEN))
    # A single output has the suffix that the user gave; others get one.
    named = output is not None and any(job.target and not job.folder for job in jobs)
    if named:
        with naming(output):
            writer(Path(str(output)).suffix)

    def work(job: Job, threads: int) -> Report:
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
                warning = error
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
            "warning": warning
            and f"written without colour and orientation: {warning.message} [{warning.code}]",
        }

    def lines(report: Report) -> Iterator[str]:
        if report["skipped"]:
            yield f"{report['image']}: exists and was skipped"
            return
        kind = "" if report["kind"] == "uint8" else f" of {report['kind']}"
        yield (
            f"{report['image']}: {report['width']} x {report['height']}, "
            f"{count(report['components'], 'component')}{kind}, level {report['level']}"
        )

    return batch.each(jobs, work, lines)[0]


def _refuse_image_suffix(output: str) -> None:
    """Raises OutputError PTM-O101 if the name of a .ptm has the suffix of an image format."""
    from ptmtools.texture.images import SUFFIXES, WRITTEN
    from ptmtools.texture.images.files import LOSSY

    suffix = Path(output).suffix.lower()
    if suffix in (*SUFFIXES, *WRITTEN, *LOSSY):
        raise OutputError(
            "PTM-O101",
            f"the suffix {suffix!r} is that of an image, but a .ptm would be written",
            file=output,
            remedy="name the output .ptm",
        )
