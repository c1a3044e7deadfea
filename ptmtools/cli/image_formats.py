"""Commands for other image formats: `ptm compare`, `interlace`, `deinterlace`."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ptmtools.cli.batch import check_writable, expanded, no_name
from ptmtools.cli.console import Console
from ptmtools.cli.parameters import (
    Command,
    Named,
    force_option,
    json_option,
    limit_option,
    option,
    options_of,
    output_option,
    take,
    with_console,
)
from ptmtools.errors import naming
from ptmtools.neighbours.interlace.model import InterlaceOptions
from ptmtools.quantities import count, size
from ptmtools.texture.model import Limits
from ptmtools.texture.profiles import PROFILES

if TYPE_CHECKING:
    from ptmtools.texture.comparison import Measured


def _profiles(context: click.Context, parameter: click.Parameter, value: str) -> tuple[str, ...]:
    """Names of profiles, separated by commas."""
    one = Named(PROFILES)
    return tuple(one.convert(name, parameter, context) for name in value.split(","))


@click.command("compare", cls=Command)
@click.argument("images", metavar="IMAGE...", nargs=-1, required=True, type=click.Path())
@option(
    "--profiles",
    callback=_profiles,
    default=",".join(PROFILES),
    metavar="NAME[,NAME]",
    help="Profiles of .ptm to compare.",
)
@option(
    "--repeat",
    type=click.IntRange(1, 100),
    default=2,
    help="Runs of each measurement; the shortest time counts.",
)
@limit_option
@json_option
@with_console
def compare(
    console: Console,
    images: tuple[str, ...],
    profiles: tuple[str, ...],
    repeat: int,
    limits: Limits,
) -> None:
    """Compare the size and speed of .ptm with other lossless image formats.

    IMAGE is a file, a pattern such as 'scans/*.tif' or a folder (all images in it). A .ptm holds
    all levels; other formats are measured with one file of the finest level, and with one file for
    each level. Speeds are MB of raw texels of the finest level per second, on one thread.
    """
    from ptmtools.texture.comparison import codecs, measure, total
    from ptmtools.texture.images import SUFFIXES, load_image

    contenders = codecs(profiles)
    sources = expanded(images, SUFFIXES)
    measured = []
    for source in sources:
        if not source:
            raise no_name()
        with naming(source):
            texels = load_image(source, limits).array()
            measured.append(measure(texels, contenders, repeat))
        if not console.as_json:
            height, width, components = texels.shape
            what = f"{width} x {height}, {count(components, 'component')} of {texels.dtype}"
            for line in _table(f"{source}: {what}, {size(texels.nbytes)}", measured[-1]):
                console.print(line)
    sums = total(measured)
    each = [[asdict(one) for one in rows] for rows in measured]
    tables = [{"image": name, "codecs": codecs} for name, codecs in zip(sources, each, strict=True)]
    lines = ["", *_table(f"all {len(sources)} images", sums)] if len(sources) > 1 else []
    console.result({"images": tables, "total": [asdict(one) for one in sums]}, lines)


def _table(title: str, rows: list[Measured]) -> Iterator[str]:
    """The lines of a table of sizes, also as multiples of the finest level as PNG, and speeds."""
    png = next((one.finest_bytes for one in rows if one.codec == "PNG"), None)
    yield title
    yield (
        f"{'':<20}{'finest level':>14}{'/ PNG':>8}{'all levels':>14}{'/ PNG':>8}"
        f"{'encode':>12}{'decode':>12}"
    )
    for one in rows:
        if one.problem:
            yield f"{one.codec:<20}{one.problem}"
            continue
        finest = "–" if one.finest_bytes is None else f"{one.finest_bytes:,}"
        yield (
            f"{one.codec:<20}{finest:>14}{_ratio(one.finest_bytes, png):>8}"
            f"{one.all_bytes:>14,}{_ratio(one.all_bytes, png):>8}"
            f"{_speed(one.raw_bytes, one.encode_seconds):>12}"
            f"{_speed(one.raw_bytes, one.decode_seconds):>12}"
        )


def _ratio(part: int | None, whole: int | None) -> str:
    return f"{part / whole:.3f}" if part and whole else "–"


def _speed(done: int, seconds: float) -> str:
    return f"{done / 1e6 / max(seconds, 1e-9):.1f} MB/s"


@click.command("interlace", cls=Command)
@click.argument("image", metavar="IMAGE", type=click.Path())
@output_option("Folder to write.", "folder", required=True)
@options_of(InterlaceOptions)
@force_option("Replace a folder that this command wrote.")
@limit_option
@json_option
@with_console
def interlace(
    console: Console,
    image: str,
    folder: str,
    force: bool,
    limits: Limits,
    **values: Any,
) -> None:
    """Split an image into files that sharpen it step by step (GPU image interlacing).

    The first file is a small picture; each further one doubles the rows or the columns, up to the
    whole image. Sides are scaled to the nearest power of two.
    """
    from ptmtools.neighbours.interlace.writing import FORM, interlace as split, write_folder
    from ptmtools.texture.images import load_image

    options = take(InterlaceOptions, values)
    if not image or not folder:
        raise no_name()
    FORM.check(folder, force=force)
    picture = load_image(image, limits)
    with naming(image):
        written = split(picture, options, limits)
    write_folder(folder, written, force=force)
    interlaced = written.interlaced
    image_bytes = os.path.getsize(image) if os.path.isfile(image) else None
    document = {
        "image": image,
        "image_bytes": image_bytes,
        "folder": folder,
        "notes": list(written.notes),
        "manifest": interlaced.document(),
    }
    first = interlaced.parts[0]
    compared = ""
    if image_bytes:
        share, name = interlaced.bytes / image_bytes, os.path.basename(image)
        compared = f": {share:.1%} of {name} ({size(image_bytes)})"
    line = (
        f"{folder}: {interlaced.width} x {interlaced.height}, "
        f"{count(len(interlaced.parts), 'file')}, {size(interlaced.bytes)}{compared}; first file "
        f"{first.width} x {first.height}, {size(first.bytes)}"
    )
    console.result(document, [line, *(f"  {note}" for note in written.notes)])


@click.command("deinterlace", cls=Command)
@click.argument("folder", metavar="DIR", type=click.Path())
@option(
    "--step",
    type=int,
    metavar="K",
    help="Read and join the first K files only. Default: all.",
)
@output_option("Image to write (.png, .npy or .tif). Default: DIR.png, beside the folder.")
@force_option("Replace an existing file.")
@limit_option
@with_console
def deinterlace(
    console: Console, folder: str, step: int | None, output: str | None, force: bool, limits: Limits
) -> None:
    """Join the files of an interlaced image, or the first few of them."""
    from ptmtools.neighbours.interlace.reading import deinterlace as joined, read_manifest
    from ptmtools.texture.images import write_image
    from ptmtools.texture.images.files import writer

    if not folder or output == "":
        raise no_name()
    interlaced = read_manifest(folder)
    path = Path(folder).resolve()
    target = output or os.fspath(path.with_name(f"{path.name}.png"))
    with naming(target):
        writer(Path(target).suffix)
    check_writable(target, force=force)
    image = joined(folder, step, limits)
    write_image(target, image, force=force)
    height, width, components = image.shape
    kind = "" if interlaced.kind == "uint8" else f" of {interlaced.kind}"
    most = len(interlaced.parts)
    console.print(
        f"{target}: {width} x {height}, {count(components, 'component')}{kind}, "
        f"{most if step is None else step} of {count(most, 'file')}"
    )
    old = interlaced.original
    if old != (interlaced.width, interlaced.height):
        console.print(
            f"  the source image had {old[0]} x {old[1]} texels and was scaled to "
            f"{interlaced.width} x {interlaced.height}"
        )
