"""A scrambled Sobol' sequence: points that fill the unit cube evenly, at any number of them.

Direction numbers are those of Joe and Kuo (2008), "Constructing Sobol sequences with better
two-dimensional projections"; scrambling is Owen's nested uniform one (1995): every digit is turned
over or not by a hash of the digits before it, so each point alone is uniform and aligned blocks of
the sequence stay nets. Only integers are used, so the points are the same on every machine and
for every version of every library.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bits, Floats

#: Binary digits of a coordinate.
DIGITS = 32
#: Dimensions: three for the position, a fourth for the choice among parts, two for the shift
#: within a pixel.
DIMENSIONS = 6
#: Primitive polynomials (degree, coefficients between the ends) and first direction numbers of
#: the dimensions after the first.
_POLYNOMIALS = (
    (1, 0, (1,)),
    (2, 1, (1, 3)),
    (3, 1, (1, 3, 1)),
    (3, 2, (1, 1, 1)),
    (4, 1, (1, 1, 3, 3)),
)


def _directions() -> NDArray[np.uint32]:
    """(DIMENSIONS, DIGITS) direction numbers, scaled by 2^32."""
    found = [[1 << (DIGITS - 1 - k) for k in range(DIGITS)]]
    for degree, middle, first in _POLYNOMIALS:
        m = [v << (DIGITS - 1 - k) for k, v in enumerate(first)]
        for k in range(degree, DIGITS):
            v = m[k - degree] ^ (m[k - degree] >> degree)
            for i in range(1, degree):
                if middle >> (degree - 1 - i) & 1:
                    v ^= m[k - i]
            m.append(v)
        found.append(m)
    return np.array(found, dtype=np.uint32)


_DIRECTIONS = _directions()


@lru_cache(maxsize=256)
def sobol(first: int, count: int, seed: int) -> Floats:
    """(count, DIMENSIONS) points ``first`` … of the sequence scrambled by ``seed``, in (0, 1); not
    to be written to, since every cell asks for the same ones.

    Stretches of one seed belong to one sequence; two seeds are independent.
    """
    index = np.arange(first, first + count, dtype=np.uint64)
    point = np.zeros((count, DIMENSIONS), dtype=np.uint32)
    for k in range(max(1, int(first + count).bit_length())):
        bit = (index >> np.uint64(k) & np.uint64(1)).astype(bool)
        point[bit] ^= _DIRECTIONS[:, k]
    found = (_scrambled(point, seed) + 0.5) * 2.0**-DIGITS
    found.setflags(write=False)
    return np.asarray(found)


def uniform(first: int, count: int, seed: int) -> Floats:
    """(count, DIMENSIONS) independent random points ``first`` … in (0, 1), by hashing numbers."""
    number = np.arange(DIMENSIONS * first, DIMENSIONS * (first + count), dtype=np.uint64)
    drawn = _hashed(number.reshape(count, DIMENSIONS), _hashed_seed(seed, 1))
    return np.asarray(((drawn >> np.uint64(11)).astype(np.float64) + 0.5) * 2.0**-53)


def _scrambled(point: NDArray[np.uint32], seed: int) -> NDArray[np.uint32]:
    dimension = _hashed(np.arange(DIMENSIONS, dtype=np.uint64), _hashed_seed(seed, 0))
    turned = np.zeros_like(point)
    before = np.zeros(point.shape, dtype=np.uint64)
    for digit in range(DIGITS):
        # The digits before this one, a leading 1 to tell their number, and the dimension.
        place = before | np.uint64(1) << np.uint64(digit)
        flip = (_hashed(place, dimension) >> np.uint64(63)).astype(np.uint32)
        turned |= flip << np.uint32(DIGITS - 1 - digit)
        bit = point >> np.uint32(DIGITS - 1 - digit) & np.uint32(1)
        before = before << np.uint64(1) | bit
    return point ^ turned


def _hashed_seed(seed: int, stream: int) -> Bits:
    return _hashed(np.array([seed], dtype=np.uint64), np.array([stream], dtype=np.uint64))


def _hashed(value: Bits, key: Bits) -> Bits:
    """The finaliser of SplitMix64 (Steele, Lea and Flood 2014), twice, the key between."""

    def mixed(x: Bits) -> Bits:
        x = x + np.uint64(0x9E3779B97F4A7C15)
        x = (x ^ x >> np.uint64(30)) * np.uint64(0xBF58476D1CE4E5B9)
        x = (x ^ x >> np.uint64(27)) * np.uint64(0x94D049BB133111EB)
        return x ^ x >> np.uint64(31)

    return mixed(mixed(value) ^ key)
