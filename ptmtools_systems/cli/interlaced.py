"""Commands for interlaced images: `ptm interlace` and `ptm deinterlace`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import click

from ptmtools.cli.batch import check_writable, no_name
from ptmtools.cli.console import Console
from ptmtools.cli.parameters import (
    Command,
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
from ptmtools.quantities import count, size
from ptmtools.texture.model import Limits
from ptmtools_systems.interlace.model import InterlaceOptions


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
    """Split an image into files that add detail step by step (GPU image interlacing).

    The first file is a small picture; each further one doubles the rows or the columns, up to the
    whole image. Width and height are scaled to the nearest powers of two.
    """
    from ptmtools.texture.images import load_image
    from ptmtools_systems.interlace.writing import FORM, interlace as split, write_folder

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
        compared = f": {share:.1%} of the size of {name} ({size(image_bytes)})"
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
    from ptmtools.texture.images import write_image
    from ptmtools.texture.images.files import writer
    from ptmtools_systems.interlace.reading import deinterlace as joined, read_manifest

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
    file_count = len(interlaced.parts)
    console.print(
        f"{target}: {width} x {height}, {count(components, 'component')}{kind}, "
        f"{file_count if step is None else step} of {count(file_count, 'file')}"
    )
    old = interlaced.original
    if old != (interlaced.width, interlaced.height):
        console.print(
            f"  the source image had {old[0]} x {old[1]} texels and was scaled to "
            f"{interlaced.width} x {interlaced.height}"
        )
