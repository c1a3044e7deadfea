"""One image to one `.ptm` and back (paper §4)."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from typing import TYPE_CHECKING

from ptmtools.errors import InputError, LimitError
from ptmtools.texture.container import assemble, read_header, whole_levels
from ptmtools.texture.model import (
    MAX_COMPONENTS,
    MAX_SIDE,
    EncodeOptions,
    Level,
    Limits,
    PtmHeader,
)
from ptmtools.texture.profiles import PROFILE_NUMBERS, Profile, profile_named
from ptmtools.texture.pyramid import build_pyramid

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_DEFAULTS = EncodeOptions()
_LIMITS = Limits()


def encode(image: NDArray[np.uint8], options: EncodeOptions = _DEFAULTS) -> bytes:
    """The bytes of a `.ptm` that holds ``image`` and the levels below it, losslessly.

    Parameters
    ----------
    image: (h, w) or (h, w, c) uint8, rows from the top, 1 to 4 components: grey, grey and alpha,
        RGB, RGB and alpha.

    Raises
    ------
    InputError: PTM-I110 another shape or type, PTM-I111 impossible options.
    LimitError: PTM-L102 a side above 65,536 texels.
    """
    import numpy as np

    if options.profile not in PROFILE_NUMBERS:
        raise InputError(
            "PTM-I111",
            f"there is no profile {options.profile!r}",
            remedy=f"use one of {', '.join(PROFILE_NUMBERS)}",
        )
    if options.min_side < 1 or (options.max_side is not None and options.max_side < 1):
        raise InputError("PTM-I111", "a side of less than 1 texel was asked for")
    if image.dtype != np.uint8 or image.ndim not in (2, 3) or image.size == 0:
        raise _unfit(image)
    if image.ndim == 2:
        image = image[:, :, None]
    height, width, components = image.shape
    if components > MAX_COMPONENTS:
        raise _unfit(image)
    if max(width, height) > MAX_SIDE:
        raise LimitError(
            "PTM-L102",
            f"the image is {width} x {height} texels; the format allows {MAX_SIDE} a side",
            remedy="scale it down",
        )
    # The kernels are compiled for writable, contiguous arrays only.
    levels = build_pyramid(np.require(image, requirements=["C", "W"]), options.min_side)
    trimmed = 0
    while (
        options.max_side is not None
        and len(levels) > 1
        and max(levels[-1].shape[:2]) > options.max_side
    ):
        levels.pop()
        trimmed += 1
    profile = profile_named(options.profile)
    groups = [profile.encode_base(levels[0])]
    groups += [profile.encode_group(levels[n], levels[n - 1]) for n in range(1, len(levels))]
    return assemble(width, height, components, options.profile, trimmed, groups)


def decode(data: bytes, level: int | None = None, limits: Limits = _LIMITS) -> NDArray[np.uint8]:
    """Level ``level`` of a `.ptm`, exactly: (h, w, c) uint8, rows from the top.

    ``level`` None is the finest level that is whole: of a complete file the finest, of a file cut
    short the finest before the cut. Damage is never passed over: a group whose checksum is wrong
    is an error, also where coarser levels could be had by naming them.

    Raises
    ------
    InputError: those of `read_header`; PTM-I106 no such level, PTM-I107 the level is not whole in
        the data (the message names the last one that is), PTM-I108 wrong checksum, PTM-I112 a
        group that no encoder writes.
    LimitError: PTM-L103 the level is larger than ``limits`` allow.
    """
    header = read_header(data)
    whole = whole_levels(header, len(data))
    if level is None:
        # Nothing whole: asking for level 0 gives the error for that.
        level = max(0, whole - 1)
    if not 0 <= level < len(header.levels):
        raise InputError(
            "PTM-I106",
            f"there is no level {level}",
            place=f"level {level}",
            remedy=f"it has levels 0 to {len(header.levels) - 1}",
        )
    if level >= whole:
        raise InputError(
            "PTM-I107",
            f"is cut after {len(data)} of {header.file_size} bytes, inside or before this level",
            place=f"level {level}",
            remedy=f"the last whole level is {whole - 1}" if whole else "no level is whole",
        )
    _check_limit(header, level, limits)
    *_, image = _refine(header, data, level + 1)
    return image


def decode_levels(data: bytes, limits: Limits = _LIMITS) -> Iterator[NDArray[np.uint8]]:
    """All whole levels of a `.ptm`, coarsest first, each decoded once: as `decode` of each.

    Stops where the file is cut. Raises as `decode`, when the level in question comes up; the
    limit is that of the finest whole level.
    """
    header = read_header(data)
    whole = whole_levels(header, len(data))
    if whole:
        _check_limit(header, whole - 1, limits)
    yield from _refine(header, data, whole)


def check(data: bytes) -> list[str]:
    """What is wrong with a `.ptm`, one line each; nothing if all of it is as it should be.

    Also decodes every level, so that a group is found whose checksum is right and contents wrong.
    """
    try:
        header = read_header(data)
    except InputError as error:
        return [str(error)]
    whole = whole_levels(header, len(data))
    problems: list[str] = []
    if whole < len(header.levels):
        what = f"the last whole level is {whole - 1}" if whole else "no level is whole"
        problems.append(f"cut after {len(data)} of {header.file_size} bytes: {what}")
    if len(data) > header.file_size:
        problems.append(f"{len(data) - header.file_size} bytes behind the last group")
    wrong = [
        n
        for n in range(whole)
        if zlib.crc32(_group(data, header.levels[n])) != header.levels[n].crc32
    ]
    problems += [f"level {n}: its group's checksum is wrong" for n in wrong]
    if not problems:
        try:
            decode(data)
        except InputError as error:
            problems.append(str(error))
    return problems


def _check_limit(header: PtmHeader, level: int, limits: Limits) -> None:
    target = header.levels[level]
    if target.width * target.height * header.components > limits.decoded_bytes:
        raise LimitError(
            "PTM-L103",
            f"{target.width} x {target.height} texels of {header.components} bytes are more than "
            f"the limit of {limits.decoded_bytes} bytes",
            place=f"level {level}",
            remedy="ask for a coarser level or raise the limit",
        )


def _refine(header: PtmHeader, data: bytes, count: int) -> Iterator[NDArray[np.uint8]]:
    """The first ``count`` levels."""
    profile = profile_named(header.profile)
    image = None
    for n in range(count):
        image = _decode_one(profile, header, data, n, image)
        yield image


def _decode_one(
    profile: Profile, header: PtmHeader, data: bytes, n: int, below: NDArray[np.uint8] | None
) -> NDArray[np.uint8]:
    level = header.levels[n]
    group = _group(data, level)
    if zlib.crc32(group) != level.crc32:
        raise InputError(
            "PTM-I108",
            "the checksum of the group is wrong",
            place=f"level {n}",
            remedy="the file is damaged: fetch or encode it again"
            + (f"; level {n - 1} is intact" if n else ""),
        )
    shape = (level.height, level.width, header.components)
    try:
        if below is None:
            return profile.decode_base(group, shape)
        return profile.decode_group(group, below, shape)
    except InputError as error:
        raise InputError(
            error.code, error.message, place=f"level {n}", remedy=error.remedy
        ) from None


def _group(data: bytes, level: Level) -> bytes:
    return data[level.offset : level.end]


def _unfit(image: NDArray[np.uint8]) -> InputError:
    return InputError(
        "PTM-I110",
        f"an array of shape {image.shape} and type {image.dtype} is not an image",
        remedy="it must be (height, width) or (height, width, 1 to 4) of uint8, and not empty",
    )
