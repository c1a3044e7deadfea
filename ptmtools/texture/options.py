"""Which options are possible, and which levels they keep."""

from __future__ import annotations

from dataclasses import fields

from ptmtools.errors import InputError
from ptmtools.texture.model import TILE_SIDES, EncodeOptions, PtmHeader
from ptmtools.texture.profiles import PROFILES, Coder
from ptmtools.texture.pyramid import level_sizes
from ptmtools.texture.rows import ImageRows
from ptmtools.texture.samples import KINDS


def check_options(options: EncodeOptions) -> None:
    """Raises InputError PTM-I111 for what no image can be encoded with."""
    for field in fields(options):
        value = getattr(options, field.name)
        if isinstance(field.default, int) and type(value) is not type(field.default):
            raise _impossible(f"{field.name} is {value!r}", "give a whole number")
    if options.profile not in PROFILES:
        raise _impossible(
            f"there is no profile {options.profile!r}", f"use one of {', '.join(PROFILES)}"
        )
    if options.min_side < 1 or options.max_side < 0:
        raise _impossible(
            "min_side or max_side is impossible",
            "min_side must be at least 1, max_side at least 1 or 0 for no limit",
        )
    first, last = options.min_level, options.max_level
    if (first < 0) == (last < 0) and first > last:
        raise _impossible(
            f"there are no levels {first} to {last}", "min_level must be the coarser one"
        )
    low, high = TILE_SIDES
    if options.tile and not (low <= options.tile <= high and options.tile % 2 == 0):
        raise _impossible(
            f"tiles of {options.tile} texels are impossible",
            f"use an even number from {low} to {high}, or 0 for none",
        )
    if options.max_error < 0:
        raise _impossible("max_error is below 0", "use 0 for none")
    if options.max_error and not PROFILES[options.profile].lossy:
        others = " or ".join(name for name, profile in PROFILES.items() if profile.lossy)
        raise _impossible(
            f"profile {options.profile!r} is always exact", f"for an allowed error use {others}"
        )


def checked_coder(options: EncodeOptions, image: ImageRows) -> Coder:
    """What codes an image as the options say. Raises InputError PTM-I111 for what cannot be."""
    check_options(options)
    top = KINDS[image.dtype.name].top_error
    if options.max_error > top:
        raise _impossible(
            f"an error of {options.max_error} cannot be allowed for {image.dtype.name} samples",
            f"use a number from 0 to {top}" if top else "use 0: floats are kept exactly",
        )
    return PROFILES[options.profile].coder


def _impossible(what: str, remedy: str) -> InputError:
    return InputError("PTM-I111", what, remedy=remedy)


def kept_levels(width: int, height: int, options: EncodeOptions) -> list[int]:
    """Numbers, in the complete pyramid, of the levels to store; there is always one."""
    sizes = level_sizes(width, height)
    count = len(sizes)

    def number(asked: int) -> int:
        return min(max(asked + count if asked < 0 else asked, 0), count - 1)

    last = number(options.max_level)
    first = min(number(options.min_level), last)
    kept = [n for n in range(first, last + 1) if min(sizes[n]) >= options.min_side] or [last]
    small = [n for n in kept if not options.max_side or max(sizes[n]) <= options.max_side]
    return small or kept[:1]


def level_above(header: PtmHeader) -> tuple[int, int, int] | None:
    """Of the coarsest level that was left out on purpose above those in the file: width, height,
    and about how many bytes it would take, judged by the level below it. None if there is none."""
    if not header.trimmed:
        return None
    width, height = level_sizes(header.width, header.height)[-header.trimmed]
    finest = header.levels[-1]
    return width, height, finest.length * width * height // (finest.width * finest.height)
