"""Numeric tables of the context mixing coder, exact on every machine.

All are made with Python's integers; none with a floating-point exponential or logarithm, whose
last bit differs between libraries. A value said to be rounded is the integer nearest to the exact
real number: 200 bits of working precision leave no doubt about any of them.

Numbers in the *logit* domain, x = ln(p / (1 - p)), have 8 fractional bits and lie within ±12.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from math import isqrt

import numpy as np
from numpy.typing import NDArray

Table = NDArray[np.int32]

#: A logit of 12: larger ones count as this. 256 units are 1.
LOGIT_TOP = 12 * 256
#: Quantised magnitudes: 24 levels, of which the last holds everything from here on.
MAGNITUDES = 24
MAGNITUDE_TOP = 1023

_PRECISION = 200
_ONE = 1 << _PRECISION


def _exponentials(count: int) -> list[int]:
    """e^(-i / 256) for i = 0 … count - 1 with 200 fractional bits."""
    step, term = Fraction(0), Fraction(1)
    for n in range(1, 60):
        step += term
        term *= Fraction(-1, 256 * n)
    factor = int(step * _ONE)
    powers = [_ONE]
    for _ in range(count - 1):
        powers.append(powers[-1] * factor >> _PRECISION)
    return powers


def _logarithm(value: int) -> int:
    """ln(value / 2^200) with 200 fractional bits, for value > 0, by Σ 2/(2n+1) z^(2n+1)."""
    shift = value.bit_length() - 1 - _PRECISION
    m = value << -shift if shift < 0 else value >> shift
    return _atanh_series(m) + shift * _LN2


def _atanh_series(m: int) -> int:
    z = ((m - _ONE) << _PRECISION) // (m + _ONE)
    square, total, power, n = z * z >> _PRECISION, 0, z, 1
    while power:
        total += power // n
        power = power * square >> _PRECISION
        n += 2
    return 2 * total


_LN2 = _atanh_series(2 * _ONE)


def _rounded(value: int, bits: int) -> int:
    """``value`` / 2^200, with ``bits`` fractional bits, to the nearest integer."""
    shift = _PRECISION - bits
    return (value + (1 << (shift - 1))) >> shift


@cache
def squash() -> Table:
    """1 / (1 + e^-x) with 16 fractional bits, for x = -3072 … 3072 in units of 1/256."""
    tails = _exponentials(LOGIT_TOP + 1)
    upper = [_rounded((_ONE << _PRECISION) // (_ONE + e), 16) for e in tails]
    lower = [65536 - p for p in upper[:0:-1]]
    return np.array(lower + upper, np.int32)


def stretch(squashed: Table) -> Table:
    """The inverse of `squash` for 4096 probabilities (i + ½) / 4096: the least logit that is
    not below."""
    wanted = np.arange(4096) * 16 + 8
    return (np.searchsorted(squashed, wanted) - LOGIT_TOP).astype(np.int32)


def soft_plus() -> Table:
    """ln(1 + e^x), 12 fractional bits, x as in `squash`: minus the logarithm of a logistic tail."""
    # ln(1 + e^x) = x + ln(1 + e^-x), so half of them are computed.
    lower = [_rounded(_logarithm(_ONE + e), 12) for e in _exponentials(LOGIT_TOP + 1)]
    upper = [lower[i] + 16 * i for i in range(LOGIT_TOP + 1)]
    return np.array(lower[:0:-1] + upper, np.int32)


def survival() -> Table:
    """Logit of e^-L: -ln(e^L - 1), for L = 0 … 12 in units of 1/256, 8 fractional bits.

    L is read at the middle of its step, (i + ½) / 256.
    """
    half = _exponentials(2)[1]
    # e^(-1/512): the square root of e^(-1/256), by integers.
    root = isqrt(half << _PRECISION)
    middles = [e * root >> _PRECISION for e in _exponentials(LOGIT_TOP + 1)]
    odds = [(middle << _PRECISION) // (_ONE - middle) for middle in middles]
    return np.array([_rounded(_logarithm(each), 8) for each in odds], np.int32)


@cache
def magnitude() -> Table:
    """Level 0 … 23 of a magnitude 0 … 1023: 2.4 log2(1 + ¾ a), rounded, at most 23."""
    # 2.4 log2(y) >= L - ½ with y = (4 + 3a) / 4 is (4 + 3a)^24 >= 2^(10 L + 43).
    bits = [((4 + 3 * a) ** 24).bit_length() - 1 for a in range(MAGNITUDE_TOP + 1)]
    return np.minimum((np.array(bits, np.int32) - 43) // 10, MAGNITUDES - 1)


def rates() -> Table:
    """Adaptation rate after n observations, 16 fractional bits: 1 / (n + 1.6), n = 0 … 1023."""
    return np.array([655360 // (10 * n + 16) for n in range(1024)], np.int32)
