"""Numeric tables of the context mixing coder, the same on every machine.

Exponentials and logarithms of float64 differ between libraries in their last bits. Here they are
rounded to integers, and no value lies within 9 · 10^-5 of a half: a million times as far as those
bits go.

Numbers in the *logit* domain, x = ln(p / (1 - p)), have 8 fractional bits and lie within ±12.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

Table = NDArray[np.int32]


#: A logit of 12: larger ones count as this. 256 units are 1.
LOGIT_TOP = 12 * 256
#: Quantised magnitudes: 24 levels, of which the last holds everything from here on.
MAGNITUDES = 24
MAGNITUDE_TOP = 1023
#: e^-x for x = -12 … 12.
_TAIL = np.exp(np.arange(LOGIT_TOP, -LOGIT_TOP - 1, -1) / 256)


def _round(values: NDArray[np.float64]) -> Table:
    return np.rint(values).astype(np.int32)


@cache
def squash() -> Table:
    """1 / (1 + e^-x) with 16 fractional bits, for x = -3072 … 3072 in units of 1/256."""
    return _round(65536 / (1 + _TAIL))


def stretch(squashed: Table) -> Table:
    """The inverse of `squash` for 4096 probabilities (i + ½) / 4096: the least logit that is
    not below."""
    wanted = np.arange(4096) * 16 + 8
    return (np.searchsorted(squashed, wanted) - LOGIT_TOP).astype(np.int32)


def soft_plus() -> Table:
    """ln(1 + e^x), 12 fractional bits, x as in `squash`: minus the logarithm of a logistic tail."""
    return _round(4096 * np.log1p(_TAIL[::-1]))


def survival() -> Table:
    """Logit of e^-L: -ln(e^L - 1), for L = 0 … 12 in units of 1/256, 8 fractional bits.

    L is read at the middle of its step, (i + ½) / 256.
    """
    return _round(-256 * np.log(np.expm1((np.arange(LOGIT_TOP + 1) + 0.5) / 256)))


@cache
def magnitude() -> Table:
    """Level 0 … 23 of a magnitude 0 … 1023: 2.4 log2(1 + ¾ a), rounded, at most 23."""
    levels = _round(2.4 * np.log2(1 + 0.75 * np.arange(MAGNITUDE_TOP + 1)))
    return np.minimum(levels, np.int32(MAGNITUDES - 1))


def rates() -> Table:
    """Adaptation rate after n observations, 16 fractional bits: 1 / (n + 1.6), n = 0 … 1023."""
    return np.array([655360 // (10 * n + 16) for n in range(1024)], np.int32)
