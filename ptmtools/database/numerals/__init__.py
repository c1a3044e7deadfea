"""Numbers and strings as text: the shortest decimals that read back to the same float32, in lists.

VRML97 readers hold single precision, so nothing beyond it is written. (Tried: "%.9g", 1.6 times
the bytes.)

`decimals` tells which decimal a float is and writes it, `lists` writes rows of them; `kernels` does
both for large scenes.
"""

from __future__ import annotations

from ptmtools.database.numerals.decimals import numeral, numerals, single
from ptmtools.database.numerals.lists import (
    WORTHWHILE,
    Rows,
    field,
    lines,
    listed,
    loops,
    quoted,
)

__all__ = [
    "WORTHWHILE",
    "Rows",
    "field",
    "lines",
    "listed",
    "loops",
    "numeral",
    "numerals",
    "quoted",
    "single",
]
