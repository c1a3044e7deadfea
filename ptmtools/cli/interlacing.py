"""The commands for images that are sent as interlaced files."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import click

from ptmtools.cli.batch import no_name
from ptmtools.cli.common import as_json, limited, voiced, writable
from ptmtools.cli.output import Voice
from ptmtools.cli.parameters import options_of, take
from ptmtools.errors import naming
from ptmtools.neighbours.interlace.model import InterlaceOptions
from ptmtools.quantities import count, size
from ptmtools.texture.model import Limits


@click.command("interlace")
@click.argument("image", metavar="IMAGE", type=click.Path())
@click.option(
    "-o", "--output", "folder", type=click.Path(), required=True, help="The folder to write."
)
@options_of(InterlaceOptions)
@click.option("--force", is_flag=True, help="Replace a folder that this command wrote.")
@limited
@as_json
@voiced
def interlace(
    voice: Voice,
    image: str,
    folder: str,
    force: bool,
    limits: Limits,
    as_json: bool,
    **values: Any,
) -> None:
    """Split an image into files that sharpen it step by step (GPU image interlacing).

    The first file is a small picture by itself; each further one doubles the rows or the columns,
    until the last completes the image. Sides that are no powers of two are scaled to the nearest.
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
    if as_json:
        voice.emit_json(
            {
                "image": image,
                "image_bytes": image_bytes,
                "folder": folder,
                "notes": list(written.notes),
                "manifest": interlaced.document(),
            }
        )
        return
    first = interlaced.parts[0]
    compared = ""
    if image_bytes:
        share, name = interlaced.bytes / image_bytes, os.path.basename(image)
        compared = f": {share:.1%} of {name} ({size(image_bytes)})"
    voice.say(
        f"{folder}: {interlaced.width} x {interlaced.height}, "
        f"{count(len(interlaced.parts), 'file')}, {size(interlaced.bytes)}{compared}; the first, "
        f"{first.width} x {first.height}, has {size(first.bytes)}"
    )
    for note in written.notes:
        voice.say(f"  {note}")


@click.command("deinterlace")
@click.argument("folder", metavar="DIR", type=click.Path())
@click.option(
    "--step",
    type=int,
    metavar="K",
    help="Join the first K files only, and read no others. By default all.",
)
@click.option(
    "-o",
    "--output",
    type=click.Path(),
    help="The image to write (.png, .npy or .tif). By default DIR.png, beside the folder.",
)
@click.option("--force", is_flag=True, help="Replace an existing file.")
@limited
@voiced
def deinterlace(
    voice: Voice, folder: str, step: int | None, output: str | None, force: bool, limits: Limits
) -> None:
    """Join the files of an interlaced image, all of them or the first few."""
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
    writable(target, force)
    image = joined(folder, step, limits)
    write_image(target, image, force=force)
    height, width, components = image.shape
    kind = "" if interlaced.kind == "uint8" else f" of {interlaced.kind}"
    most = len(interlaced.parts)
    voice.say(
        f"{target}: {width} x {height}, {count(components, 'component')}{kind}, "
        f"{most if step is None else step} of {count(most, 'file')}"
    )
    old = interlaced.original
    if old != (interlaced.width, interlaced.height):
        voice.say(
            f"  the image that was interlaced had {old[0]} x {old[1]} texels; it was scaled to "
            f"{interlaced.width} x {interlaced.height}"
        )
