"""`ptm compare`: the profiles of `.ptm` beside other image formats."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING

import click

from ptmtools.cli.batch import expand_patterns, no_name
from ptmtools.cli.console import Console
from ptmtools.cli.parameters import (
    Command,
    Named,
    json_option,
    limit_option,
    option,
    with_console,
)
from ptmtools.errors import naming
from ptmtools.quantities import count, size
from ptmtools.texture.model import Limits
from ptmtools.texture.profiles import PROFILES

if TYPE_CHECKING:
    from ptmtools_lab.codecs import CodecFigures


def _profiles(context: click.Context, parameter: click.Parameter, value: str) -> tuple[str, ...]:
    """Names of profiles, separated by commas."""
    choice = Named(PROFILES)
    return tuple(choice.convert(name, parameter, context) for name in value.split(","))


@click.command("compare", cls=Command)
@click.argument("images", metavar="IMAGE...", nargs=-1, required=True, type=click.Path())
@option(
    "--profiles",
    callback=_profiles,
    default=lambda: ",".join(PROFILES),
    metavar="NAME[,NAME]",
    help="Profiles of .ptm to compare; all by default.",
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

    IMAGE is a file, a pattern such as 'scans/*.tif' or a folder (all images in it). A .ptm file
    holds all levels; other formats are measured with one file of the finest level, and with one
    file for each level. Speeds are in MB/s of uncompressed texels of the finest level, on one
    thread.
    """
    from ptmtools.texture.images import SUFFIXES, load_image
    from ptmtools_lab.codecs import codecs, measure, total

    contenders = codecs(profiles)
    sources = expand_patterns(images, SUFFIXES)
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
    tables = [
        {"image": name, "codecs": [asdict(figures) for figures in rows]}
        for name, rows in zip(sources, measured, strict=True)
    ]
    lines = ["", *_table(f"total of {len(sources)} images", sums)] if len(sources) > 1 else []
    console.result({"images": tables, "total": [asdict(figures) for figures in sums]}, lines)


def _table(title: str, rows: list[CodecFigures]) -> Iterator[str]:
    """The lines of a table of sizes, also as multiples of the finest level as PNG, and speeds."""
    png = next((row.finest_bytes for row in rows if row.codec == "PNG"), None)
    yield title
    yield (
        f"{'':<26}{'finest level':>14}{'ratio to PNG':>14}"
        f"{'all levels':>14}{'ratio to PNG':>14}{'encode':>12}{'decode':>12}"
    )
    for row in rows:
        if row.problem:
            yield f"{row.codec:<26}{row.problem}"
            continue
        finest = "–" if row.finest_bytes is None else f"{row.finest_bytes:,}"
        yield (
            f"{row.codec:<26}{finest:>14}{_ratio(row.finest_bytes, png):>14}"
            f"{row.all_bytes:>14,}{_ratio(row.all_bytes, png):>14}"
            f"{_speed(row.raw_bytes, row.encode_seconds):>12}"
            f"{_speed(row.raw_bytes, row.decode_seconds):>12}"
        )


def _ratio(part: int | None, whole: int | None) -> str:
    return f"{part / whole:.3f}" if part and whole else "–"


def _speed(done: int, seconds: float) -> str:
    return f"{done / 1e6 / max(seconds, 1e-9):.1f} MB/s"
