"""What `decimals` and `lists` do, one number after the other, straight into a buffer of bytes.

The buffer is large enough: `LONGEST` and a separator for each number.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.compiled import plain_kernel
from ptmtools.database.numerals.tables import EXPONENT, HIGH, LOW, SHIFT

Bytes = NDArray[np.uint8]

_COMMA, _LINE, _SPACE = np.uint8(44), np.uint8(10), np.uint8(32)
_MINUS, _POINT, _ZERO, _E = np.uint8(45), np.uint8(46), np.uint8(48), np.uint8(101)
_HALF, _32 = np.uint64(0xFFFFFFFF), np.uint64(32)
#: Two digits for each number below 100.
_PAIRS = np.array([[48 + i // 10, 48 + i % 10] for i in range(100)], dtype=np.uint8)


@plain_kernel
def _quotient(c4: np.uint64, row: np.int64) -> np.int64:
    """`decimals.shortest`'s."""
    part = c4 * LOW[row]
    whole = c4 * HIGH[row] + (part >> _32)
    shift = SHIFT[row]
    below = (np.uint64(1) << shift) - np.uint64(1)
    rest = ((whole & below) != np.uint64(0)) | ((part & _HALF) > c4)
    return np.int64(2) * np.int64(whole >> shift) + np.int64(rest)


@plain_kernel
def shortest(bits: np.uint32) -> tuple[np.int64, np.int64]:
    """(digits, exponent) of one number; `decimals.shortest`'s."""
    fraction = np.int64(bits & np.uint32(0x7FFFFF))
    binade = np.int64((bits >> np.uint32(23)) & np.uint32(0xFF))
    c = fraction + (np.int64(1 << 23) if binade > 0 else np.int64(0))
    if c == 0:
        return np.int64(0), np.int64(0)
    if np.int64(127) <= binade <= np.int64(150):
        behind = np.int64(150) - binade
        whole = c >> behind
        if whole << behind == c:  # a whole number below 2^24, of which there is none nearby
            return _trimmed(np.uint32(whole), np.int64(0))
    lone = np.int64(fraction == 0 and binade > 1)
    row = 2 * binade + lone
    odd = c & 1
    value = _quotient(np.uint64(4 * c), row)
    least = _quotient(np.uint64(4 * c - 2 + lone), row) + odd
    most = _quotient(np.uint64(4 * c + 2), row) - odd
    exponent = np.int64(EXPONENT[row])
    unit = np.uint32(value >> 3)
    ten = unit // np.uint32(10)
    at = 80 * np.int64(ten)
    digits = unit
    shorter = True
    if ten > np.uint32(0) and least <= at:
        digits = ten
    elif at + 80 <= most:
        digits = ten + np.uint32(1)
    else:
        shorter = False
        rest = value & 7
        at = value - rest
        down, up = least <= at, at + 8 <= most
        nearer = rest > 4 or (rest == 4 and (value & 8) != 0)
        digits = unit + np.uint32(nearer if down == up else up)
    if shorter or digits == np.uint32(10):
        return _trimmed(digits, exponent + np.int64(shorter))
    return np.int64(digits), exponent


@plain_kernel
def _trimmed(digits: np.uint32, exponent: np.int64) -> tuple[np.int64, np.int64]:
    """Without zeros at the end."""
    following = digits // np.uint32(10000)
    while digits == following * np.uint32(10000):
        digits = following
        exponent += np.int64(4)
        following = digits // np.uint32(10000)
    following = digits // np.uint32(100)
    if digits == following * np.uint32(100):
        digits = following
        exponent += np.int64(2)
    following = digits // np.uint32(10)
    if digits == following * np.uint32(10):
        digits = following
        exponent += np.int64(1)
    return np.int64(digits), exponent


@plain_kernel
def _count(digits: np.int64) -> int:
    """How many decimal digits a number below 10^10 has."""
    if digits < 100:
        return 1 if digits < 10 else 2
    count, least = 3, 1000
    while digits >= least:
        count += 1
        least *= 10
    return count


@plain_kernel
def _put_whole(digits: np.int64, end: int, out: Bytes) -> None:
    """Writes the digits of a number >= 0 up to ``end``."""
    rest = np.uint32(digits)
    while rest >= np.uint32(100):
        following = rest // np.uint32(100)
        pair = rest - following * np.uint32(100)
        out[end - 1] = _PAIRS[pair, 1]
        out[end - 2] = _PAIRS[pair, 0]
        end -= 2
        rest = following
    out[end - 1] = _PAIRS[rest, 1]
    if rest >= np.uint32(10):
        out[end - 2] = _PAIRS[rest, 0]


@plain_kernel
def put_number(bits: np.uint32, at: int, out: Bytes) -> int:
    """Writes one number; returns where it ends. `decimals.written`'s."""
    digits, exponent = shortest(bits)
    if digits == 0:
        out[at] = _ZERO
        return at + 1
    if bits >> np.uint32(31):
        out[at] = _MINUS
        at += 1
    count = _count(digits)
    zeros = -exponent - count
    if exponent >= 0:
        if exponent <= 2:
            _put_whole(digits, at + count, out)
            at += count
            for _ in range(exponent):
                out[at] = _ZERO
                at += 1
            return at
    elif zeros < 0:
        # The whole part is written one place too far to the right for its point, then moved.
        _put_whole(digits, at + count + 1, out)
        for i in range(at, at - zeros):
            out[i] = out[i + 1]
        out[at - zeros] = _POINT
        return at + count + 1
    elif zeros <= 1 + np.int64(exponent <= -10):
        out[at] = _ZERO
        out[at + 1] = _POINT
        at += 2
        for _ in range(zeros):
            out[at] = _ZERO
            at += 1
        _put_whole(digits, at + count, out)
        return at + count
    _put_whole(digits, at + count, out)
    at += count
    out[at] = _E
    at += 1
    if exponent < 0:
        out[at] = _MINUS
        at += 1
        exponent = -exponent
    if exponent >= 10:
        out[at] = _ZERO + np.uint8(exponent // 10)
        at += 1
    out[at] = _ZERO + np.uint8(exponent % 10)
    return at + 1


@plain_kernel
def put_rows(
    bits: NDArray[np.uint32],
    index: NDArray[np.int64],
    start: NDArray[np.int64],
    per_line: int,
    out: Bytes,
    end: NDArray[np.int64],
) -> None:
    """`lists.Rows.lists`: the rows ``index`` of (n, k) numbers, in lists that begin at ``start``
    (s + 1,); after each row a comma or a line's end. ``end`` (s,) is where each list ends."""
    at = 0
    columns = bits.shape[1]
    for i in range(len(start) - 1):
        left = per_line
        for j in range(start[i], start[i + 1]):
            row = index[j]
            for column in range(columns):
                at = put_number(bits[row, column], at, out)
                out[at] = _SPACE
                at += 1
            left -= 1
            out[at - 1] = _COMMA if left else _LINE
            if left == 0:
                left = per_line
        end[i] = at


@plain_kernel
def put_loops(
    loop: NDArray[np.int64],
    start: NDArray[np.int64],
    per_line: int,
    out: Bytes,
    end: NDArray[np.int64],
) -> None:
    """`lists.loops`: (n, k) indices >= 0 below 2^32, each row closed by -1."""
    at = 0
    columns = loop.shape[1]
    for i in range(len(start) - 1):
        left = per_line
        for j in range(start[i], start[i + 1]):
            for column in range(columns):
                value = loop[j, column]
                count = _count(value)
                _put_whole(value, at + count, out)
                at += count
                out[at] = _SPACE
                at += 1
            out[at] = _MINUS
            out[at + 1] = _ZERO + np.uint8(1)
            left -= 1
            out[at + 2] = _COMMA if left else _LINE
            at += 3
            if left == 0:
                left = per_line
        end[i] = at
