"""`ptm compare`: the profiles beside other image formats."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING

import click

from ptmtools.cli.batch import expanded, no_name
from ptmtools.cli.common import as_json, limited, voiced
from ptmtools.cli.output import Voice
from ptmtools.cli.parameters import Named
from ptmtools.errors import naming
from ptmtools.quantities import count, size
from ptmtools.texture.profiles import PROFILES

if TYPE_CHECKING:
    from ptmtools.texture.comparison import Measured
    from ptmtools.texture.model import Limits


def _profiles(context: click.Context, parameter: click.Parameter, value: str) -> tuple[str, ...]:
    """Names of profiles, separated by commas."""
    one = Named(PROFILES)
    return tuple(one.convert(name, parameter, context) for name in value.split(","))


@click.command("compare")
@click.argument("images", metavar="IMAGE...", nargs=-1, required=True, type=click.Path())
@click.option(
    "--profiles",
    callback=_profiles,
    default=",".join(PROFILES),
    show_default=True,
    metavar="NAME,...",
    help="The profiles to compare with the other formats.",
)
@click.option(
    "--repeat",
    type=click.IntRange(1, 100),
    default=2,
    show_default=True,
    metavar="N",
    help="Time each image this many times; the shortest time counts.",
)
@limited
@as_json
@voiced
def compare(
    voice: Voice,
    images: tuple[str, ...],
    profiles: tuple[str, ...],
    repeat: int,
    limits: Limits,
    as_json: bool,
) -> None:
    """Compare the size and speed of .ptm with other lossless image formats.

    An IMAGE may be a file, a pattern such as 'scans/*.tif' or a folder (all images in it). A .ptm
    holds all levels; with other formats, sizes are given for one file of the finest level and for
    one file for each level.
    Speeds are those of one thread, in MB of raw texels of the finest level per second.
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
        if not as_json:
            height, width, components = texels.shape
            what = f"{width} x {height}, {count(components, 'component')} of {texels.dtype}"
            _print_table(voice, f"{source}: {what}, {size(texels.nbytes)}", measured[-1])
    sums = total(measured)
    if as_json:
        voice.emit_json(
            {
                "images": [
                    {"image": source, "codecs": [asdict(one) for one in found]}
                    for source, found in zip(sources, measured, strict=True)
                ],
                "total": [asdict(one) for one in sums],
            }
        )
    elif len(sources) > 1:
        voice.say("")
        _print_table(voice, f"all {len(sources)} images", sums)


def _print_table(voice: Voice, title: str, found: list[Measured]) -> None:
    """A table, sizes as they are and over that of the finest level as PNG."""
    png = next((one.finest_bytes for one in found if one.codec == "PNG"), None)
    voice.say(title)
    voice.say(
        f"{'':<20}{'finest level':>14}{'/ PNG':>8}{'all levels':>14}{'/ PNG':>8}"
        f"{'encode':>12}{'decode':>12}"
    )
    for one in found:
        if one.problem:
            voice.say(f"{one.codec:<20}{one.problem}")
            continue
        finest = "–" if one.finest_bytes is None else f"{one.finest_bytes:,}"
        voice.say(
            f"{one.codec:<20}{finest:>14}{_ratio(one.finest_bytes, png):>8}"
            f"{one.all_bytes:>14,}{_ratio(one.all_bytes, png):>8}"
            f"{_speed(one.raw_bytes, one.encode_seconds):>12}"
            f"{_speed(one.raw_bytes, one.decode_seconds):>12}"
        )


def _ratio(part: int | None, whole: int | None) -> str:
    return f"{part / whole:.3f}" if part and whole else "–"


def _speed(done: int, seconds: float) -> str:
    return f"{done / 1e6 / max(seconds, 1e-9):.1f} MB/s"
