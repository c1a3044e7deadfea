"""The powers of ten by which binary32 numbers become decimal ones, one entry per binade.

Raffaele Giulietti, "The Schubfach way to render doubles" (2020): between the two numbers half way
to its neighbours, every float has decimals of a length that depends only on its binade. With
c · 2^q the float (c an integer below 2^24), 10^k is the greatest power of ten that is not greater
than the distance of those two numbers, and what is looked for lies among the four multiples of
10^k and 10^(k+1) around c · 2^q / 10^k.

That quotient is c · g / 2^s with g = ⌈2^q / 10^k · 2^s⌉ of 64 bits. Its error is below 2^-34, and
no c, nor any number half way between two, comes nearer than 2^-31.7 to a whole number without
being one (found by continued fractions over all binades), so comparisons with whole numbers are
exact.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

_ROWS = 2 * 255
#: Entry 2 · e + b, with e the biased exponent and b whether the float is a power of two, whose
#: lower neighbour is nearer: k; the high and the low half of g; s - 32.
EXPONENT = np.zeros(_ROWS, dtype=np.int64)
HIGH = np.zeros(_ROWS, dtype=np.uint64)
LOW = np.zeros(_ROWS, dtype=np.uint64)
SHIFT = np.zeros(_ROWS, dtype=np.uint64)


def _fill() -> None:
    k = -46
    for row in range(_ROWS):
        unit = Fraction(2) ** (max(row >> 1, 1) - 150)
        width = unit * Fraction(3, 4) if row & 1 else unit
        while Fraction(10) ** k > width:
            k -= 1
        while Fraction(10) ** (k + 1) <= width:
            k += 1
        quotient = unit / Fraction(10) ** k
        shift = 64 - (quotient.numerator // quotient.denominator).bit_length()
        g = -(-(quotient.numerator << shift) // quotient.denominator)
        EXPONENT[row], SHIFT[row] = k, shift - 32
        HIGH[row], LOW[row] = g >> 32, g & 0xFFFFFFFF


_fill()
