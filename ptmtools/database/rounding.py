"""Rounding to significant digits, as text would: the double nearest to the nearest decimal."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: 10^22 is the greatest power of ten that is a double, so that one operation rounds once.
_EXACT = 22
#: Nearer to the middle between two decimals than this share of their distance, text decides.
_DOUBT = 1e-6


def significant(values: NDArray[np.float64], digits: int) -> NDArray[np.float64]:
    """``values``, of any shape, with at most so many (up to 8) significant digits; half to even in
    the exact value, as ``float(f"{v:.{digits}g}")``. NaN and infinities stay.

    Text alone takes 0.8 µs a number, this 0.05.
    """
    size = abs(values)
    with np.errstate(divide="ignore", invalid="ignore"):
        power = np.where(np.isfinite(size) & (size > 0), np.floor(np.log10(size)), 0.0)
    power = power.astype(np.int64) - (digits - 1)
    ten = 10.0 ** np.minimum(abs(power), _EXACT)
    with np.errstate(over="ignore", invalid="ignore"):
        scaled = np.where(power < 0, size * ten, size / ten)
        whole = np.rint(scaled)
        rounded = np.where(power < 0, whole / ten, whole * ten)
        clear = abs(scaled - np.floor(scaled) - 0.5) > _DOUBT
    found: NDArray[np.float64] = np.copysign(rounded, values)
    clear &= (abs(power) <= _EXACT) & (scaled >= 10.0 ** (digits - 1)) & (scaled < 10.0**digits)
    for place in zip(*np.nonzero(~clear & (size > 0)), strict=True):
        found[place] = float(f"{values[place]:.{digits}g}")
    return np.where(np.isfinite(values), found, values)
