"""Detail of each level: its difference from the level below, its offset, and the mean colour.

Each texel of level n differs from the texel of level n-1 that covers its 2×2 block (an odd last row
or column, which has no block, from the texel beside it) by a root mean square over its colour
components; the detail of a level is the mean of these over its texels, as the error of a picture is
the mean over its pixels. A client that has level k is off by Σ differences[n], n > k, at most, but
for odd sides.

(Tried: the root mean square over the texels, too, whose squares do add up. A few strong edges carry
it, and clients that go by it show worse pictures, see `ptmtools_lab.policies.shares`.)

Levels are means of blocks, rounded down, so each is darker than the one above, by 0.375 on average
where all remainders are equally likely, and not at all where the image is flat. The *offset* of a
level is what makes it as bright as the image again; clients add it to the colours that they show.
Without it, a view of the sample museum is 1.5 of 255 darker than the same view with levels of a
graphics card, which the eye notices (FLIP 0.048; with it 0.017).

The encoder holds both levels, a tile at a time, and takes the sums: 15 ms for a
texture of 2048² RGB that takes 200 to 400 to encode.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.jit import kernel


@kernel
def integer_lengths(level: NDArray[Any], below: NDArray[Any], colours: int) -> float:
    """The sum for integers of up to 16 bits. The squares are exact; the roots of a row are summed
    up before they are added to the rest, so the sum over a million texels is off by less than 1e-12
    of it. Two texels at a time take half the time of one."""
    height, width = below.shape[:2]
    total = 0.0
    for y in range(level.shape[0]):
        row = min(y >> 1, height - 1)
        of_row = 0.0
        for x in range(width):
            even, uneven = np.int64(0), np.int64(0)
            for c in range(colours):
                under = np.int64(below[row, x, c])
                even_change = np.int64(level[y, 2 * x, c]) - under
                odd_change = np.int64(level[y, 2 * x + 1, c]) - under
                even += even_change * even_change
                uneven += odd_change * odd_change
            of_row += math.sqrt(float(even)) + math.sqrt(float(uneven))
        for x in range(2 * width, level.shape[1]):
            odd = np.int64(0)
            for c in range(colours):
                change = np.int64(level[y, x, c]) - np.int64(below[row, width - 1, c])
                odd += change * change
            of_row += math.sqrt(float(odd))
        total += of_row
    return total


@kernel
def float_lengths(level: NDArray[Any], below: NDArray[Any], colours: int) -> float:
    """The sum for floats; values that are not finite count as no difference."""
    height, width = below.shape[:2]
    total = 0.0
    for y in range(level.shape[0]):
        row = min(y >> 1, height - 1)
        for x in range(level.shape[1]):
            column = min(x >> 1, width - 1)
            squares = 0.0
            for c in range(colours):
                difference = float(level[y, x, c]) - float(below[row, column, c])
                if math.isfinite(difference):
                    squares += difference * difference
            total += math.sqrt(squares)
    return total


@kernel
def integer_squares(level: NDArray[Any], below: NDArray[Any], colours: int) -> float:
    """As `integer_lengths`, the sum of the squares."""
    height, width = below.shape[:2]
    total = 0.0
    for y in range(level.shape[0]):
        row = min(y >> 1, height - 1)
        of_row = np.int64(0)
        for x in range(level.shape[1]):
            column = min(x >> 1, width - 1)
            for c in range(colours):
                difference = np.int64(level[y, x, c]) - np.int64(below[row, column, c])
                of_row += difference * difference
        total += of_row
    return total


Samples = NDArray[Any]

#: Significant digits of the differences.
DIGITS = 3
#: Rows of which a sum is taken at a time; levels may be read as they are needed.
_STRIP = 256
#: Colours are scaled as if samples went from 0 to this.
_WHITE = 255


@dataclass(frozen=True)
class Detail:
    """
    Attributes
    ----------
    differences: for each level, coarsest first, the average difference of its texels from the level
        below, 0 to 255 for integers of any size; floats count as 255 for 1. The first is 0.
    color: red, green and blue of the coarsest level's mean with its offset, 0 to 255, as they are
        stored.
    offsets: for each level the whole number, of 255, by which its colours are less than those of
        the image on average, without what odd sides leave out; 0 for floats. () is 0 for all.
    """

    differences: tuple[float, ...]
    color: tuple[int, int, int]
    offsets: tuple[int, ...] = ()


def round_difference(value: float) -> float:
    """A difference with `DIGITS`."""
    return float(f"{value:.{DIGITS}g}")


def colours_of(components: int) -> int:
    """Number of components that are colours; the last of 2 and of 4 is alpha."""
    return components - (components in (2, 4))


def difference_between(level: Samples, below: Samples) -> float:
    """By how much (h, w, c) texels differ from (h >> 1, w >> 1, c) enlarged, in their own units:
    the sum over the texels of the root mean square over the components without alpha. Values that
    are not finite count as no difference."""
    if level.dtype == np.float16:  # the compiler does not know
        level, below = level.astype(np.float32), below.astype(np.float32)
    lengths = integer_lengths if level.dtype.kind == "u" else float_lengths
    colours = colours_of(level.shape[2])
    return lengths(level, below, colours) / math.sqrt(colours)


def surplus_between(level: Samples, below: Samples) -> float:
    """By how much (h, w, c) texels exceed (h >> 1, w >> 1, c) means of their blocks, in their own
    units: the sum over the means, of the average over the components without alpha; 0 for floats.
    """
    if level.dtype.kind != "u":
        return 0.0
    colours, (height, width) = colours_of(level.shape[2]), below.shape[:2]
    total = -4 * int(below[..., :colours].sum(dtype=np.int64))
    for y in range(0, height, _STRIP):
        strip = np.asarray(level[2 * y : 2 * min(y + _STRIP, height)])
        total += int(strip[:, : 2 * width, :colours].sum(dtype=np.int64))
    return total / (4 * colours)


def squares_between(level: Samples, below: Samples) -> float:
    """As `difference_between`, of uint8 texels: the sum over the texels of the mean square over the
    components without alpha."""
    colours = colours_of(level.shape[2])
    return integer_squares(level, below, colours) / colours


@dataclass(frozen=True)
class LevelPair:
    """A level and the one below, or a part of both; parts are added.

    Attributes
    ----------
    difference, surplus: see `difference_between` and `surplus_between`.
    texels, blocks: numbers of texels of the level, and of the one below.
    """

    difference: float
    surplus: float
    texels: int
    blocks: int

    def __add__(self, pair: LevelPair) -> LevelPair:
        return LevelPair(
            self.difference + pair.difference,
            self.surplus + pair.surplus,
            self.texels + pair.texels,
            self.blocks + pair.blocks,
        )


def compare_levels(level: Samples, below: Samples) -> LevelPair:
    """What `detail_of` needs of (h, w, c) texels and those of the level below."""
    texels, blocks = (shape[0] * shape[1] for shape in (level.shape, below.shape))
    return LevelPair(
        difference_between(level, below), surplus_between(level, below), texels, blocks
    )


def mean_surplus(levels: Sequence[Any]) -> float:
    """By how much the last of successive levels, coarsest first, exceeds the first on average."""
    pairs = pairwise(levels)
    return math.fsum(
        surplus_between(level, below) / math.prod(below.shape[:2]) for below, level in pairs
    )


def detail_of(coarsest: Samples, above: Iterable[LevelPair], beyond: float = 0.0) -> Detail:
    """The `Detail` of an image.

    Parameters
    ----------
    coarsest: (h, w, c) texels of level 0.
    above: of each further level and the one below.
    beyond: the `mean_surplus` of the image over the finest level, of one that lacks the finest.
    """
    colours = colours_of(coarsest.shape[2])
    whole = coarsest.dtype.kind == "u"
    scale = _WHITE / (np.iinfo(coarsest.dtype).max if whole else 1)
    pairs = list(above)
    means = (scale * pair.difference / pair.texels for pair in pairs)
    losses = [scale * pair.surplus / max(1, pair.blocks) for pair in pairs]
    missing = [scale * beyond + math.fsum(losses[n:]) for n in range(len(losses) + 1)]
    mean = coarsest[..., :colours].reshape(-1, colours).mean(axis=0, dtype=np.float64)
    seen = np.clip(np.nan_to_num(mean * scale + missing[0]), 0, _WHITE)
    red, green, blue = np.floor(np.broadcast_to(seen, 3) + 0.5).astype(int).tolist()
    offsets = tuple(math.floor(value + 0.5) for value in missing)
    return Detail((0.0, *map(round_difference, means)), (red, green, blue), offsets)


def with_offset(level: NDArray[np.uint8], offset: int) -> NDArray[np.uint8]:
    """(h, w, c) texels with an offset added to their colours, as a client shows them."""
    if not offset:
        return level
    colours, result = colours_of(level.shape[2]), level.copy()
    raised = level[..., :colours].astype(np.int16) + offset
    result[..., :colours] = np.clip(raised, 0, _WHITE)
    return result
