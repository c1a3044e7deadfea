"""Compiled loops of the static entropy coder: interleaved rANS.

rANS (Duda, "Asymmetric numeral systems", arXiv:1311.2540), four states that take turns, renewed by
16-bit words, tables of 11 bits: everything fits in unsigned 32-bit integers. The decoder works on
a row of symbols at a time, whose tables are all known before; so four chains of table look-ups are
under way at once.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ptmtools.compiled import plain_kernel as kernel
from ptmtools.texture.coders.rans.sizes import ESCAPE, TABLE_BITS, TABLE_SIZE

#: A state stays at or above this and below 2^31.
STATE_LOW = 1 << 15
#: Numbers of 32 bits of a table for `decode_single`: symbols by slot, intervals by symbol.
SINGLE_SIZE = TABLE_SIZE // 4 + 256
#: Words that must be readable behind the last one of a stream, besides the length of a row.
PADDING = 8

_MASK = np.uint64(TABLE_SIZE - 1)
_LOW = np.uint64(STATE_LOW)
_BITS = np.uint64(TABLE_BITS)


@kernel
def start_states(words: Any, state: Any) -> None:
    """The four states (uint64) from the first eight words."""
    for lane in range(4):
        state[lane] = np.uint64(words[2 * lane]) | (
            np.uint64(words[2 * lane + 1] & 0x7FFF) << np.uint64(16)
        )


@kernel
def decode_row(
    state: Any, words: Any, at: int, table: Any, starts: Any, contexts: Any, n: int, out: Any
) -> Any:
    """Decode n symbols into ``out``; symbol i uses state i & 3. Returns the next word's index.

    Parameters
    ----------
    state: (4,) uint64. words: uint16, with n + `PADDING` words behind the last that may be read.
    table: uint32 from `tables.row_tables`: symbol << 24 | frequency << 12 | offset.
    starts: uint64, where in ``table`` the table of each context begins. contexts: of each symbol.
    """
    sixteen, twelve, part = np.uint64(16), np.uint64(12), np.uint64(4095)
    zero, one, two, three = np.uint64(0), np.uint64(1), np.uint64(2), np.uint64(3)
    x0, x1, x2, x3 = state[0], state[1], state[2], state[3]
    i, k = zero, np.uint64(at)
    whole = np.uint64(n & ~3)
    while i < whole:
        e0 = np.uint64(table[starts[np.uint64(contexts[i])] + (x0 & _MASK)])
        e1 = np.uint64(table[starts[np.uint64(contexts[i + one])] + (x1 & _MASK)])
        e2 = np.uint64(table[starts[np.uint64(contexts[i + two])] + (x2 & _MASK)])
        e3 = np.uint64(table[starts[np.uint64(contexts[i + three])] + (x3 & _MASK)])
        x0 = ((e0 >> twelve) & part) * (x0 >> _BITS) + (e0 & part)
        x1 = ((e1 >> twelve) & part) * (x1 >> _BITS) + (e1 & part)
        x2 = ((e2 >> twelve) & part) * (x2 >> _BITS) + (e2 & part)
        x3 = ((e3 >> twelve) & part) * (x3 >> _BITS) + (e3 & part)
        out[i] = e0 >> np.uint64(24)
        out[i + one] = e1 >> np.uint64(24)
        out[i + two] = e2 >> np.uint64(24)
        out[i + three] = e3 >> np.uint64(24)
        refill = x0 < _LOW
        word = np.uint64(words[k])
        x0 = (x0 << sixteen) | word if refill else x0
        k += one if refill else zero
        refill = x1 < _LOW
        word = np.uint64(words[k])
        x1 = (x1 << sixteen) | word if refill else x1
        k += one if refill else zero
        refill = x2 < _LOW
        word = np.uint64(words[k])
        x2 = (x2 << sixteen) | word if refill else x2
        k += one if refill else zero
        refill = x3 < _LOW
        word = np.uint64(words[k])
        x3 = (x3 << sixteen) | word if refill else x3
        k += one if refill else zero
        i += np.uint64(4)
    state[0], state[1], state[2], state[3] = x0, x1, x2, x3
    while i < np.uint64(n):
        lane = i & three
        x = state[lane]
        e = np.uint64(table[starts[np.uint64(contexts[i])] + (x & _MASK)])
        x = ((e >> twelve) & part) * (x >> _BITS) + (e & part)
        out[i] = e >> np.uint64(24)
        if x < _LOW:
            x = (x << sixteen) | np.uint64(words[k])
            k += one
        state[lane] = x
        i += one
    # Signed: with a plain integer an unsigned one would become a float.
    return np.int64(k)


@kernel
def rotate_states(state: Any, n: int) -> None:
    """After a row of n symbols: the state of the next symbol becomes the first."""
    for _ in range(n & 3):
        first = state[0]
        state[0], state[1], state[2] = state[1], state[2], state[3]
        state[3] = first


@kernel
def fill_escapes(out: Any, n: int, escapes: Any, at: int) -> int:
    """Escaped symbols replaced by their values; returns the next one's index.

    -1 if there are not enough of them.
    """
    seen = False
    for x in range(n):
        seen |= out[x] == ESCAPE
    if seen:
        for x in range(n):
            if out[x] == ESCAPE:
                if at == escapes.size:
                    return -1
                out[x] = escapes[at]
                at += 1
    return at


@kernel
def split_numbers(numbers: Any, symbols: Any, contexts: Any, counts: Any) -> None:
    """symbol | context << 16 taken apart, and counted; all above 254 count as 255."""
    for i in range(numbers.size):
        z, t = numbers[i] & 0xFFFF, numbers[i] >> 16
        symbols[i] = z
        contexts[i] = t
        counts[t, min(z, ESCAPE)] += 1


@kernel
def decode_single(table: Any, context: Any, state: Any, lane: Any, word: Any) -> Any:
    """The next symbol where its table is known only once the one before is; whether ``word``, the
    next one, was used. ``table``: from `tables.single_tables`.
    """
    x = state[lane]
    slot = x & _MASK
    own = np.uint64(context) * np.uint64(SINGLE_SIZE)
    # Four symbols to a number.
    four = np.uint64(table[own + (slot >> np.uint64(2))])
    z = (four >> ((slot & np.uint64(3)) << np.uint64(3))) & np.uint64(255)
    interval = np.uint64(table[own + np.uint64(TABLE_SIZE // 4) + z])
    x = (interval >> np.uint64(12)) * (x >> _BITS) + slot - (interval & np.uint64(4095))
    # Without a branch, which would be guessed wrong half of the time.
    refill = x < _LOW
    state[lane] = (x << np.uint64(16)) | np.uint64(word) if refill else x
    return np.int64(z), refill


@kernel
def encode(
    symbols: Any, contexts: Any, plain: int, frequency: Any, work: Any, state: Any, words: Any,
    escapes: Any,
) -> Any:  # fmt: skip
    """Code ``symbols`` from the last to the first, so that the decoder goes forwards.

    Parameters
    ----------
    symbols: (n,) uint16. contexts: (n,) uint8, the table of each. Symbol i uses state i & 3.
    plain: tables from this on have no escape: all their symbols have a frequency.
    frequency: (tables, 256) int64. A symbol without one, or from 255 on, escapes.
    work: (tables, 256) and state: (4,), uint64, overwritten.
    words, escapes: uint16 of n + 8 and of n, filled from the end; returns where each begins.
    """
    for t in range(frequency.shape[0]):
        start = 0
        for s in range(256):
            f = frequency[t, s]
            entry = np.uint64(0)
            if f > 0:
                bits = 0
                while (1 << bits) < f:
                    bits += 1
                # x // f == x * reciprocal >> (bits + 31) for every x below 2^31. All that is to be
                # known of a symbol in 59 bits: reciprocal, frequency, start, bits.
                entry = np.uint64(((1 << (bits + 31)) + f - 1) // f) << np.uint64(27)
                entry |= np.uint64(f << 15 | start << 4 | bits)
                start += f
            work[t, s] = entry
    for last in range(4):
        state[last] = _LOW
    at, escaped = np.uint64(words.size - 1), np.uint64(escapes.size)
    i = np.uint64(symbols.size)
    one, four = np.uint64(1), np.uint64(4)
    while i > np.uint64(0):
        i -= one
        context, z = np.uint64(contexts[i]), np.uint64(symbols[i])
        symbol = work[context, min(z, np.uint64(ESCAPE))]
        if context < np.uint64(plain) and (z >= np.uint64(ESCAPE) or symbol == 0):
            escaped -= one
            escapes[escaped] = z
            symbol = work[context, np.uint64(ESCAPE)]
        lane = i & np.uint64(3)
        x = state[lane]
        share = (symbol >> np.uint64(15)) & np.uint64(4095)
        # Without a branch, which would be guessed wrong often: the word is written in any case.
        full = x >= share << np.uint64(20)
        words[at] = x & np.uint64(0xFFFF)
        at -= one if full else np.uint64(0)
        x = x >> np.uint64(16) if full else x
        q = (x * (symbol >> np.uint64(27))) >> ((symbol & np.uint64(15)) + np.uint64(31))
        state[lane] = (q << _BITS) + (x - q * share) + ((symbol >> four) & _MASK)
    first = np.int64(at) + 1
    for last in range(3, -1, -1):
        first -= 2
        words[first] = state[last] & np.uint64(0xFFFF)
        words[first + 1] = state[last] >> np.uint64(16)
    return first, np.int64(escaped)
