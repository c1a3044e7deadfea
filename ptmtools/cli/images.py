"""The commands for images and their `.ptm` files."""

from __future__ import annotations

import os
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import click

from ptmtools.cli.batch import STANDARD, Job, expanded, for_each, jobs_for, standard_input
from ptmtools.cli.batch import to_standard_output as to_stdout
from ptmtools.cli.common import as_json, forced, limited, voiced, workers
from ptmtools.cli.output import Voice
from ptmtools.cli.parameters import Numbers, options_of, take
from ptmtools.errors import InputError, OutputError, naming
from ptmtools.files import refuse_existing, write_with
from ptmtools.quantities import count, size
from ptmtools.texture.model import Description, EncodeOptions

if TYPE_CHECKING:
    from ptmtools.texture.model import Limits


@click.command("encode")
@click.argument("images", metavar="IMAGE...", nargs=-1, required=True, type=click.Path())
@click.option(
    "-o",
    "--output",
    type=click.Path(),
    help="The .ptm, a folder for several, or - for stdout. By default beside each image.",
)
@options_of(EncodeOptions)
@click.option(
    "--orient / --no-orient",
    help="Turn the texels as the image's EXIF orientation says, instead of recording it.",
)
@limited
@workers
@forced
@as_json
@voiced
def encode(
    voice: Voice,
    images: tuple[str, ...],
    output: str | None,
    orient: bool,
    limits: Limits,
    workers: int,
    force: bool,
    as_json: bool,
    **values: Any,
) -> int:
    """Encode images as progressive textures.

    An IMAGE may be a pattern, a folder (all images in it), or - for stdin. A bad one is reported
    and the others are encoded.
    """
    from ptmtools.texture.container import HEAD_MAX, read_header
    from ptmtools.texture.encoder import encode_to
    from ptmtools.texture.images import SUFFIXES, load_image
    from ptmtools.texture.options import check_options

    options = take(EncodeOptions, values)
    check_options(options)
    sources = expanded(images, SUFFIXES)
    jobs = jobs_for(sources, output, images, ".ptm")
    voice.aside = any(job.to_stdout for job in jobs)
    if output and not os.path.isdir(output):
        _refuse_image_suffix(output)
    told: list[dict[str, object]] = []

    def work(job: Job, threads: int) -> dict[str, object]:
        source, target = job.source, job.target
        if target and not force:
            refuse_existing(target)
        report: dict[str, object] = {
            "image": source,
            "file": os.fspath(target) if target else STANDARD,
        }

        def write(file: IO[bytes]) -> None:
            encode_to(
                file, picture.texels, options, description=picture.description, threads=threads
            )
            report["ptm_bytes"] = file.tell()
            file.seek(0)
            header = read_header(file.read(HEAD_MAX))
            report["raw_bytes"] = header.width * header.height * header.texel_bytes
            report["levels"] = len(header.levels)
            file.seek(0, os.SEEK_END)

        with naming(source):
            picture = load_image(standard_input() if source == STANDARD else source, limits)
            if orient:
                picture = picture.upright()
            if target:
                write_with(target, write, force=force)
            else:
                to_stdout(write)
        return report

    def tell(report: dict[str, Any]) -> None:
        told.append(report)
        if not as_json:
            raw, stored = report["raw_bytes"], report["ptm_bytes"]
            voice.say(
                f"{report['file']}: {count(report['levels'], 'level')}, {size(raw)} → "
                f"{size(stored)} ({stored / raw:.1%})"
            )

    status = for_each(voice, jobs, work, tell, workers, "images")
    if as_json:
        voice.emit_json(told)
    return status


@click.command("decode")
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=click.Path())
@click.option(
    "--level", type=int, help="The level, 0 is the coarsest. By default the finest that is whole."
)
@click.option(
    "--window",
    type=Numbers([4], int),
    metavar="X,Y,W,H",
    help="Only these texels of the level: from column X and row Y on, W wide and H high.",
)
@click.option(
    "-o",
    "--output",
    type=click.Path(),
    help="The image (.png, .npy, .tif, .hdr or .exr), a folder, or - for stdout. By default "
    "beside each file: a .png, or for floats an .npy.",
)
@limited
@workers
@forced
@as_json
@voiced
def decode(
    voice: Voice,
    files: tuple[str, ...],
    level: int | None,
    window: tuple[int, int, int, int] | None,
    output: str | None,
    limits: Limits,
    workers: int,
    force: bool,
    as_json: bool,
) -> int:
    """Decode .ptm files, or their beginnings, to images.

    A FILE may be a pattern, a folder (all .ptm files in it), or - for stdin. A bad one is reported
    and the others are decoded.
    """
    from ptmtools.texture.images import write_to
    from ptmtools.texture.images.writing import writer
    from ptmtools.texture.reader import open

    sources = expanded(files, (".ptm",))
    jobs = jobs_for(sources, output, files, "")
    voice.aside = any(job.to_stdout for job in jobs)
    # One name is an image's; what goes into a folder, or beside its file, gets a suffix.
    named = output is not None and output != STANDARD and not Path(output).is_dir()
    if named:
        with naming(output):
            writer(Path(str(output)).suffix)
    told: list[dict[str, object]] = []

    def work(job: Job, threads: int) -> dict[str, Any]:
        source, target = job.source, job.target
        where = standard_input() if source == STANDARD else source
        with naming(source), open(where, limits=limits, threads=threads) as ptm:
            suffix = ".npy" if ptm.dtype.kind == "f" else ".png"
            if target and named:
                suffix = target.suffix
            elif target:
                target = target.with_name(target.name + suffix)
            if target and not force:
                refuse_existing(target)
            # The sizes of files and of stdin are known, and so is what is whole.
            number = max(0, ptm.whole - 1) if level is None else level
            texels = ptm.window(number, *window) if window else ptm.level(number)
            description, warning = Description(), None
            try:
                description = ptm.description()
            except InputError as error:  # the texels are intact
                warning = error

        def write(file: IO[bytes]) -> None:
            write_to(file, suffix, texels, description)

        if target:
            with naming(target):
                write_with(target, write, force=force)
        else:
            to_stdout(write)
        height, width, components = texels.shape
        return {
            "file": source,
            "image": os.fspath(target) if target else STANDARD,
            "level": number,
            "width": width,
            "height": height,
            "components": components,
            "kind": texels.dtype.name,
            "warning": warning and f"{warning.message} [{warning.code}]",
        }

    def tell(report: dict[str, Any]) -> None:
        told.append(report)
        if report["warning"]:
            voice.warn(
                f"{report['file']}: written without colour and orientation: {report['warning']}"
            )
        if not as_json:
            kind = "" if report["kind"] == "uint8" else f" of {report['kind']}"
            voice.say(
                f"{report['image']}: {report['width']} x {report['height']}, "
                f"{count(report['components'], 'component')}{kind}"
            )

    status = for_each(voice, jobs, work, tell, workers, "files")
    if as_json:
        voice.emit_json(told)
    return status


def _refuse_image_suffix(output: str) -> None:
    """Raise OutputError PTM-O101 if what is written would pass for an image of another format."""
    from ptmtools.texture.images import SUFFIXES, WRITTEN
    from ptmtools.texture.images.writing import LOSSY

    suffix = Path(output).suffix.lower()
    if suffix in (*SUFFIXES, *WRITTEN, *LOSSY):
        raise OutputError(
            "PTM-O101",
            f"the suffix {suffix!r} is that of an image; a .ptm is written",
            file=output,
            remedy="name the output .ptm",
        )
