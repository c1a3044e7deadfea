"""The commands for single images and their `.ptm` files."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import click

from ptmtools.cli.common import as_json, forced, voiced, workers
from ptmtools.cli.output import Voice, size
from ptmtools.cli.parameters import options_of, take
from ptmtools.files import refuse_existing, write_bytes
from ptmtools.texture import EncodeOptions


@click.command("encode")
@click.argument("images", metavar="IMAGE...", nargs=-1, required=True, type=click.Path())
@click.option(
    "-o",
    "--output",
    type=click.Path(),
    help="The .ptm, or a folder for several. By default beside each image.",
)
@options_of(EncodeOptions)
@workers
@forced
@as_json
@voiced
def encode(
    voice: Voice,
    images: tuple[str, ...],
    output: str | None,
    workers: int,
    force: bool,
    as_json: bool,
    **values: Any,
) -> None:
    """Encode images as progressive textures, losslessly."""
    from ptmtools.errors import naming
    from ptmtools.texture import encode as encode_texels
    from ptmtools.texture import read_header, read_image

    options = take(EncodeOptions, values)
    targets = _targets(images, output)
    if not force:
        for target in targets:
            refuse_existing(target)

    def work(image: str) -> tuple[bytes, int]:
        texels = read_image(image)
        with naming(image):
            return encode_texels(texels, options), texels.size

    told = []
    pool = ThreadPoolExecutor(workers or os.cpu_count() or 1)
    try:
        with voice.progress() as progress:
            for done, (data, raw) in enumerate(pool.map(work, images)):
                progress(done, len(images), "images")
                image, target = images[done], targets[done]
                write_bytes(target, data, force=force)
                levels = len(read_header(data).levels)
                told.append(
                    {
                        "image": image,
                        "file": os.fspath(target),
                        "raw_bytes": raw,
                        "ptm_bytes": len(data),
                        "levels": levels,
                    }
                )
                if not as_json:
                    voice.say(
                        f"{target}: {levels} levels, {size(raw)} → {size(len(data))} "
                        f"({len(data) / raw:.1%})"
                    )
    finally:
        pool.shutdown(cancel_futures=True)
    if as_json:
        voice.emit_json(told)


@click.command("decode")
@click.argument("file", type=click.Path())
@click.option(
    "--level", type=int, help="The level, 0 is the coarsest. By default the finest that is whole."
)
@click.option("-o", "--output", type=click.Path(), help="The PNG. By default beside the file.")
@forced
@voiced
def decode(voice: Voice, file: str, level: int | None, output: str | None, force: bool) -> None:
    """Decode a .ptm file, or its beginning, to PNG."""
    from ptmtools.errors import naming
    from ptmtools.texture import decode as decode_texels
    from ptmtools.texture import read_ptm, write_png

    target = Path(output) if output else Path(file).with_suffix(".png")
    if not force:
        refuse_existing(target)
    data = read_ptm(file)
    with naming(file):
        texels = decode_texels(data, level)
    write_png(target, texels, force=force)
    height, width, components = texels.shape
    voice.say(f"{target}: {width} x {height}, {components} components")


def _targets(images: tuple[str, ...], output: str | None) -> list[Path]:
    """Where each `.ptm` goes."""
    beside = [Path(image).with_suffix(".ptm") for image in images]
    if output is None:
        targets = beside
    elif Path(output).is_dir():
        targets = [Path(output) / path.name for path in beside]
    elif len(images) == 1:
        targets = [Path(output)]
    else:
        raise click.BadParameter(
            "for several images it must be a folder that exists", None, None, "-o"
        )
    if len(set(targets)) < len(targets):
        raise click.UsageError("two of the images would be written to the same file")
    return targets
