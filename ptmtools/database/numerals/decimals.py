"""float32 → the shortest decimal that reads back to it; where several are, the nearest.

What NumPy's own conversion (Dragon4) gives, down to a tie, which goes to the even digit; there a
number takes 4 µs with its text, here 0.5. The method is Schubfach's, see `tables`; unlike the
paper's, a single digit is as good as two (1e-45, not 1.4e-45).

A number is written plainly ("0.5", "120") or, where that is shorter, as a whole number with an
exponent ("1e3", "12e-7"); NumPy's "1.2e-06" and "16777216.0" never are. (Rejected: ".5", which
VRML97 allows but JSON does not, and which not every reader's pattern for a number has; it would
save 1 % of a database.)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ptmtools.database.numerals.tables import EXPONENT, HIGH, LOW, SHIFT
from ptmtools.errors import DatabaseError

#: Characters of the longest numeral: a sign, nine digits, an exponent of two digits.
LONGEST = 14
#: Numbers at a time: what they need stays in the cache.
_CHUNK = 4096
_DIGITS = 9
_TWO, _HALF = np.uint64(2), np.uint64(0xFFFFFFFF)
_TEN, _ONE = np.uint32(10), np.uint32(1)


def single(values: ArrayLike, what: str) -> NDArray[np.float32]:
    """``values`` rounded to float32, without negative zeros.

    Raises
    ------
    DatabaseError: PTM-D601 if one of them is not finite there; ``what`` says whose they are.
    """
    with np.errstate(over="ignore"):
        rounded = np.asarray(values, dtype=np.float64).astype(np.float32)
    if not np.isfinite(rounded).all():
        raise DatabaseError(
            "PTM-D601",
            f"{what}: a number is not finite in single precision",
            remedy="check the model for NaN, infinite or huge values",
        )
    return rounded + np.float32(0)


def numeral(value: float | np.float32) -> str:
    """One finite number as text: by Dragon4, the reference for all else here."""
    scientific = np.format_float_scientific(np.float32(value), unique=True, trim="-")
    mantissa, _, power = scientific.partition("e")
    sign = "-" if mantissa.startswith("-") else ""
    digits = mantissa.lstrip("-").replace(".", "").rstrip("0")
    if not digits:
        return "0"
    exponent = int(power) - len(digits) + 1
    if exponent >= 0:
        plain = digits + "0" * exponent
    elif len(digits) > -exponent:
        plain = f"{digits[:exponent]}.{digits[exponent:]}"
    else:
        plain = f"0.{digits:0>{-exponent}}"
    return sign + min(plain, f"{digits}e{exponent}", key=len)


def numerals(values: NDArray[np.float32]) -> list[str]:
    """Every number of a (n,) array as text; each distinct one is converted once, since a room's
    coordinates repeat."""
    distinct, place = np.unique(values, return_inverse=True)
    text = written(distinct)
    return [text[i] for i in place.ravel().tolist()]


def shortest(values: NDArray[np.float32]) -> tuple[NDArray[np.uint32], NDArray[np.int64]]:
    """(digits, exponent), both (n,): the absolute values of finite numbers are digits ·
    10^exponent; digits below 10^9 that end in no 0, (0, 0) for zero."""
    bits = values.view(np.uint32)
    fraction, binade = bits & np.uint32(0x7FFFFF), (bits >> np.uint32(23)) & np.uint32(0xFF)
    c = fraction | np.where(binade > 0, np.uint32(1 << 23), np.uint32(0))
    lone = (fraction == 0) & (binade > 1)
    row = 2 * binade.astype(np.int64) + lone
    high, low, shift = HIGH[row], LOW[row], SHIFT[row]
    below = (np.uint64(1) << shift) - np.uint64(1)

    def quotient(c4: NDArray[np.uint64]) -> NDArray[np.int64]:
        """Twice ``c4`` · 2^q / 10^k, plus 1 for whatever is behind the point: as good as exact in
        comparison with even numbers."""
        part = c4 * low
        whole = c4 * high + (part >> np.uint64(32))
        # g is too large by less than 1, so a rest of up to c4 is none.
        rest = ((whole & below) != 0) | ((part & _HALF) > c4)
        found: NDArray[np.int64] = ((whole >> shift << np.uint64(1)) | rest).view(np.int64)
        return found

    # In units of 10^k / 8. The ends of the interval belong to even floats only.
    odd = (c & _ONE).astype(np.int64)
    c4 = c.astype(np.uint64) << _TWO
    value = quotient(c4)
    least, most = quotient(c4 - _TWO + lone) + odd, quotient(c4 + _TWO) - odd
    unit = (value >> 3).astype(np.uint32)
    rest = value & 7
    near = unit + ((rest > 4) | ((rest == 4) & (unit & _ONE == _ONE)))
    at = value - rest
    down, up = least <= at, at + 8 <= most
    digits = np.where(down == up, near, unit + up)
    ten = unit // _TEN * _TEN
    at = 8 * ten.astype(np.int64)
    digits = np.where(at + 80 <= most, ten + _TEN, digits)
    digits = np.where((least <= at) & (ten > 0), ten, digits)
    exponent = EXPONENT[row]
    digits[c == 0] = exponent[c == 0] = 0
    long = np.flatnonzero((digits % _TEN == 0) & (digits > 0))
    while len(long):
        digits[long] //= _TEN
        exponent[long] += 1
        long = long[digits[long] % _TEN == 0]
    return digits, exponent


def written(values: NDArray[np.float32]) -> list[str]:
    """`numeral` of each of (n,) finite numbers."""
    found: list[str] = []
    for first in range(0, len(values), _CHUNK):
        characters = _characters(values[first : first + _CHUNK])
        found += characters[characters != 0].tobytes().decode().split("\n")[:-1]
    return found


def _characters(values: NDArray[np.float32]) -> NDArray[np.uint8]:
    """(n, k) the text of each number with a line's end, and zeros in between."""
    digits, exponent = shortest(values)
    count = np.searchsorted(10 ** np.arange(1, _DIGITS), digits, side="right") + 1
    zeros = -exponent - count  # between the point and the digits
    # As long with an exponent counts as plain.
    plain = np.where(exponent < 0, zeros <= 1 + (exponent <= -10), exponent <= 2)
    small = plain & (exponent < 0) & (zeros >= 0)
    point = np.where(plain & ~small, -exponent, 0)  # how many digits are behind it
    size = abs(exponent)

    columns: list[NDArray[np.uint8]] = []

    def put(where: NDArray[np.bool_], character: str) -> None:
        columns.append(np.where(where, np.uint8(ord(character)), np.uint8(0)))

    def put_digit(where: NDArray[np.bool_], digit: NDArray[np.integer]) -> None:
        columns.append(np.where(where, (digit + 48).astype(np.uint8), np.uint8(0)))

    put(np.signbit(values) & (digits > 0), "-")
    put(small, "0")
    put(small, ".")
    put(small & (zeros > 0), "0")
    put(small & (zeros > 1), "0")
    behind = []
    rest = digits
    for _ in range(_DIGITS):
        following = rest // _TEN
        behind.append(rest - following * _TEN)
        rest = following
    for i in range(_DIGITS - 1, -1, -1):
        put_digit(i < count, behind[i])
        if i:
            put(point == i, ".")
    put(plain & (exponent > 0), "0")
    put(plain & (exponent > 1), "0")
    put(~plain, "e")
    put(~plain & (exponent < 0), "-")
    put_digit(~plain & (size >= 10), size // 10)
    put_digit(~plain, size % 10)
    put(np.ones(len(values), dtype=np.bool_), "\n")
    return np.stack(columns, axis=1)
