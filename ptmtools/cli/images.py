"""The commands for images and their `.ptm` files."""

from __future__ import annotations

import os
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import click

from ptmtools.cli.batch import STANDARD, expanded, for_each, standard_input, targets
from ptmtools.cli.batch import to_standard_output as to_stdout
from ptmtools.cli.common import as_json, forced, limited, voiced, workers
from ptmtools.cli.output import Voice, count, size
from ptmtools.cli.parameters import Numbers, options_of, take
from ptmtools.errors import naming
from ptmtools.files import refuse_existing, write_with
from ptmtools.texture.model import EncodeOptions

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
    jobs = list(zip(sources, targets(sources, output, images, ".ptm"), strict=True))
    voice.aside = jobs[0][1] is None
    told: list[dict[str, object]] = []

    def work(job: tuple[str, Path | None], threads: int) -> dict[str, object]:
        source, target = job
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
    type=Numbers([4]),
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
@voiced
def decode(
    voice: Voice,
    files: tuple[str, ...],
    level: int | None,
    window: tuple[float, ...] | None,
    output: str | None,
    limits: Limits,
    workers: int,
    force: bool,
) -> int:
    """Decode .ptm files, or their beginnings, to images.

    A FILE may be a pattern, a folder (all .ptm files in it), or - for stdin. A bad one is reported
    and the others are decoded.
    """
    from ptmtools.texture.images import write_to
    from ptmtools.texture.images.writing import writer
    from ptmtools.texture.reader import open

    sources = expanded(files, (".ptm",))
    jobs = list(zip(sources, targets(sources, output, files, ""), strict=True))
    voice.aside = jobs[0][1] is None
    # One name is an image's; what goes into a folder, or beside its file, gets a suffix.
    named = output is not None and output != STANDARD and not Path(output).is_dir()
    if named:
        with naming(output):
            writer(Path(str(output)).suffix)
    box = _whole_numbers(window)

    def work(job: tuple[str, Path | None], threads: int) -> str:
        source, target = job
        where = standard_input() if source == STANDARD else source
        with naming(source), open(where, limits=limits, threads=threads) as ptm:
            suffix = ".npy" if ptm.dtype.kind == "f" else ".png"
            if target and named:
                suffix = target.suffix
            elif target:
                target = target.with_name(target.name + suffix)
            if target and not force:
                refuse_existing(target)
            if box:
                number = max(0, ptm.whole - 1) if level is None else level
                texels = ptm.window(number, *box)
            else:
                texels = ptm.level(level)
            description = ptm.description()

        def write(file: IO[bytes]) -> None:
            write_to(file, suffix, texels, description)

        if target:
            with naming(target):
                write_with(target, write, force=force)
        else:
            to_stdout(write)
        height, width, components = texels.shape
        kind = "" if texels.dtype.itemsize == 1 else f" of {texels.dtype}"
        name = target or STANDARD
        return f"{name}: {width} x {height}, {count(components, 'component')}{kind}"

    return for_each(voice, jobs, work, voice.say, workers, "files")


def _whole_numbers(window: tuple[float, ...] | None) -> tuple[int, int, int, int] | None:
    """The window in texels. Raises click.BadParameter."""
    if window is None:
        return None
    if not all(number.is_integer() for number in window):
        raise click.BadParameter("it must be four whole numbers", None, None, "--window")
    x, y, width, height = map(int, window)
    return x, y, width, height
