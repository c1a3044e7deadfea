"""Compiled loops of the static entropy coder: interleaved rANS.

rANS (Duda, "Asymmetric numeral systems", arXiv:1311.2540), four states that take turns, renewed by
16-bit words, tables of 11 bits: everything fits in unsigned 32-bit integers. The decoder works on
a row of symbols at a time, whose tables are all known before; so four chains of table look-ups are
under way at once.

Also normalises, chooses, writes, reads and looks up frequency tables.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ptmtools.jit import plain_kernel as kernel
from ptmtools.texture.coders.group import ESCAPE, TABLE_BITS, TABLE_SIZE

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
    table: uint32 from `rans.row_tables`: symbol << 24 | frequency << 12 | offset.
    starts: uint64, where in ``table`` the table of each context begins. contexts: of each symbol.
    """
    sixteen, twelve, part = np.uint64(16), np.uint64(12), np.uint64(4095)
    zero, unit, two, three = np.uint64(0), np.uint64(1), np.uint64(2), np.uint64(3)
    x0, x1, x2, x3 = state[0], state[1], state[2], state[3]
    i, k = zero, np.uint64(at)
    whole = np.uint64(n & ~3)
    while i < whole:
        e0 = np.uint64(table[starts[np.uint64(contexts[i])] + (x0 & _MASK)])
        e1 = np.uint64(table[starts[np.uint64(contexts[i + unit])] + (x1 & _MASK)])
        e2 = np.uint64(table[starts[np.uint64(contexts[i + two])] + (x2 & _MASK)])
        e3 = np.uint64(table[starts[np.uint64(contexts[i + three])] + (x3 & _MASK)])
        x0 = ((e0 >> twelve) & part) * (x0 >> _BITS) + (e0 & part)
        x1 = ((e1 >> twelve) & part) * (x1 >> _BITS) + (e1 & part)
        x2 = ((e2 >> twelve) & part) * (x2 >> _BITS) + (e2 & part)
        x3 = ((e3 >> twelve) & part) * (x3 >> _BITS) + (e3 & part)
        out[i] = e0 >> np.uint64(24)
        out[i + unit] = e1 >> np.uint64(24)
        out[i + two] = e2 >> np.uint64(24)
        out[i + three] = e3 >> np.uint64(24)
        refill = x0 < _LOW
        word = np.uint64(words[k])
        x0 = (x0 << sixteen) | word if refill else x0
        k += unit if refill else zero
        refill = x1 < _LOW
        word = np.uint64(words[k])
        x1 = (x1 << sixteen) | word if refill else x1
        k += unit if refill else zero
        refill = x2 < _LOW
        word = np.uint64(words[k])
        x2 = (x2 << sixteen) | word if refill else x2
        k += unit if refill else zero
        refill = x3 < _LOW
        word = np.uint64(words[k])
        x3 = (x3 << sixteen) | word if refill else x3
        k += unit if refill else zero
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
            k += unit
        state[lane] = x
        i += unit
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
    next one, was used. ``table``: from `rans.single_tables`.
    """
    x = state[lane]
    slot = x & _MASK
    begin = np.uint64(context) * np.uint64(SINGLE_SIZE)
    # Four symbols to a number.
    four = np.uint64(table[begin + (slot >> np.uint64(2))])
    z = (four >> ((slot & np.uint64(3)) << np.uint64(3))) & np.uint64(255)
    interval = np.uint64(table[begin + np.uint64(TABLE_SIZE // 4) + z])
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
                # x // f == x * reciprocal >> (bits + 31) for every x below 2^31. All data of a
                # symbol in 59 bits: reciprocal, frequency, start, bits.
                entry = np.uint64(((1 << (bits + 31)) + f - 1) // f) << np.uint64(27)
                entry |= np.uint64(f << 15 | start << 4 | bits)
                start += f
            work[t, s] = entry
    for last in range(4):
        state[last] = _LOW
    at, escaped = np.uint64(words.size - 1), np.uint64(escapes.size)
    i = np.uint64(symbols.size)
    unit, four = np.uint64(1), np.uint64(4)
    while i > np.uint64(0):
        i -= unit
        context, z = np.uint64(contexts[i]), np.uint64(symbols[i])
        symbol = work[context, min(z, np.uint64(ESCAPE))]
        if context < np.uint64(plain) and (z >= np.uint64(ESCAPE) or symbol == 0):
            escaped -= unit
            escapes[escaped] = z
            symbol = work[context, np.uint64(ESCAPE)]
        lane = i & np.uint64(3)
        x = state[lane]
        share = (symbol >> np.uint64(15)) & np.uint64(4095)
        # Without a branch, which would be guessed wrong often: the word is written in any case.
        full = x >= share << np.uint64(20)
        words[at] = x & np.uint64(0xFFFF)
        at -= unit if full else np.uint64(0)
        x = x >> np.uint64(16) if full else x
        q = (x * (symbol >> np.uint64(27))) >> ((symbol & np.uint64(15)) + np.uint64(31))
        state[lane] = (q << _BITS) + (x - q * share) + ((symbol >> four) & _MASK)
    first = np.int64(at) + 1
    for last in range(3, -1, -1):
        first -= 2
        words[first] = state[last] & np.uint64(0xFFFF)
        words[first + 1] = state[last] >> np.uint64(16)
    return first, np.int64(escaped)


@kernel
def normalise(counts: Any, frequency: Any, used: Any) -> None:
    """Frequencies (t, 256) int64 that sum to 2048 in each row of ``counts`` (t, 256) that has any.

    Rounds, at least 1 where a count is positive; then moves single units where the length changes
    least, which is by about count / (frequency ± ½). Ties go to the lower symbol.
    ``used``: (256,) int64, overwritten.
    """
    for t in range(counts.shape[0]):
        total = 0
        many = 0
        for s in range(256):
            if counts[t, s] > 0:
                total += counts[t, s]
                used[many] = s
                many += 1
        missing = TABLE_SIZE if many > 0 else 0
        for i in range(many):
            s = used[i]
            f = max(1, (counts[t, s] * TABLE_SIZE + total // 2) // total)
            frequency[t, s] = f
            missing -= f
        step = 1 if missing > 0 else -1
        while missing != 0:
            best, best_count, best_f = -1, 0, 0
            for i in range(many):
                s = used[i]
                n, f = counts[t, s], frequency[t, s]
                if f + step == 0:
                    continue
                gain, best_gain = n * (2 * best_f + step), best_count * (2 * f + step)
                if best < 0 or ((gain > best_gain) if step > 0 else (gain < best_gain)):
                    best, best_count, best_f = s, n, f
            frequency[t, best] += step
            missing -= step


@kernel
def _nibbles(n: Any) -> Any:
    """How many nibbles a number takes in the serialised form."""
    return 1 + (1 if n > 7 else 0) + (1 if n > 63 else 0) + (1 if n > 511 else 0)


@kernel
def choose_kinds(
    counts: Any, exact: Any, family: Any, lengths: Any, logs: Any, plain: int, sent: int,
    kinds: Any, occurring: Any,
) -> None:  # fmt: skip
    """The kind of each table (t,) that makes table and symbols shortest.

    counts, exact: (t, 256) int64, and the frequencies they normalise to. family: (n, 256) int64,
    an empty table first. lengths: (n - 1, 256) int64, in 1/256 bits, of each symbol under each kind
    from 1 on. logs: (2049,) int64, of each frequency. plain: tables from this on have no escape.
    occurring: (256,) int64, overwritten.
    """
    for t in range(counts.shape[0]):
        used, total, size, many = 0, 0, 0, 0
        for s in range(256):
            n = counts[t, s]
            if n > 0:
                total += n
                size += n * logs[exact[t, s]]
                occurring[many] = s
                many += 1
                if s < ESCAPE:
                    used = s + 1
        if total == 0:
            continue
        nibbles = _nibbles(used) + _nibbles(exact[t, ESCAPE])
        for s in range(used):
            nibbles += _nibbles(exact[t, s])
        size += nibbles * 4 * 256
        least, kind = np.int64(1) << 62, sent
        for k in range(1, family.shape[0]):
            cost = np.int64(0)
            for i in range(many):
                s = occurring[i]
                cost += counts[t, s] * lengths[k - 1, s]
                if t >= plain and family[k, s] == 0:
                    cost = np.int64(1) << 62
                if cost >= least:
                    break
            if cost < least:
                least, kind = cost, k
        kinds[t] = sent if size < least else kind


@kernel
def _put(number: Any, packed: Any, at: Any) -> Any:
    """``number`` as nibbles of three bits and a flag from nibble ``at`` on; returns the next."""
    while True:
        nibble = number & 7
        number >>= 3
        if number > 0:
            nibble |= 8
        packed[at >> 1] |= nibble << (4 * (at & 1))
        at += 1
        if number == 0:
            return at


@kernel
def write_tables(kinds: Any, first_kind: int, sent: int, exact: Any, packed: Any) -> Any:
    """The serialised form of tables, which `read_tables` reads, without its length.

    kinds: (t,) int64. exact: (t, 256) int64, the frequencies of those that are sent.
    packed: uint8, zeros before. Returns the number of bytes.
    """
    tables = kinds.size
    at = np.int64(0)
    t, last = 0, np.int64(first_kind)
    while t < tables:
        kind = kinds[t]
        if kind == 0:
            begin = t
            while t + 1 < tables and kinds[t + 1] == 0:
                t += 1
            at = _put(np.int64(0), packed, at)
            at = _put(np.int64(t - begin), packed, at)
        elif kind == sent:
            at = _put(np.int64(1), packed, at)
        else:
            change = kind - last
            at = _put(2 + (2 * change if change >= 0 else -2 * change - 1), packed, at)
            last = kind
        t += 1
    for t in range(tables):
        if kinds[t] == sent:
            used = np.int64(ESCAPE)
            while used > 0 and exact[t, used - 1] == 0:
                used -= 1
            at = _put(exact[t, ESCAPE], packed, at)
            at = _put(used, packed, at)
            for s in range(used):
                at = _put(exact[t, s], packed, at)
    return (at + 1) >> 1


@kernel
def _number(packed: Any, at: Any) -> Any:
    """The next number from nibbles of three bits and a flag; at: (2,) next nibble, error."""
    n, shift = 0, 0
    while True:
        i = at[0]
        if i >= 2 * packed.size or shift > 9:
            at[1] = 1
            return 0
        at[0] = i + 1
        nibble = int(packed[i >> 1]) >> (4 * (i & 1))
        n |= (nibble & 7) << shift
        shift += 3
        if nibble & 8 == 0:
            return n


@kernel
def read_tables(
    packed: Any, named: bool, kinds: Any, first_kind: int, sent: int, family: Any, frequency: Any,
    at: Any,
) -> int:  # fmt: skip
    """Tables (t, 256) int64, zeros before, from their serialised form; 0 or what is wrong.

    packed: uint8. named: ``kinds`` (t,) int64 are given; else they stand first.
    family: (kinds + 1, 256) int64, the built-in tables. at: (2,) int64, zeros.
    """
    tables = frequency.shape[0]
    t, last = 0, first_kind
    while not named and t < tables:
        n = _number(packed, at)
        if n == 0:
            t += 1 + _number(packed, at)
        else:
            if n == 1:
                kinds[t] = sent
            else:
                last += -((n - 1) >> 1) if n & 1 else (n - 2) >> 1
                if last < 1 or last >= family.shape[0]:
                    return 2
                kinds[t] = last
            t += 1
        if at[1] != 0:
            return 1
    if t > tables:
        return 3
    for t in range(tables):
        kind = kinds[t]
        if kind == sent:
            frequency[t, ESCAPE] = _number(packed, at)
            used = _number(packed, at)
            if used > ESCAPE:
                return 1
            total = frequency[t, ESCAPE]
            for z in range(used):
                n = _number(packed, at)
                frequency[t, z] = n
                total += n
            if at[1] != 0:
                return 1
            if total != TABLE_SIZE:
                return 4
        elif kind != 0:
            if kind >= family.shape[0]:
                return 2
            for z in range(256):
                frequency[t, z] = family[kind, z]
    return 0


@kernel
def fill_row_tables(frequency: Any, begins: Any, table: Any) -> None:
    """symbol << 24 | frequency << 12 | offset for every slot of every table that is in use, from
    ``begins`` of it on.
    """
    for t in range(frequency.shape[0]):
        at = np.int64(begins[t])
        if at == 0:
            continue
        for z in range(256):
            f = frequency[t, z]
            if f > 0:
                entry = z << 24 | f << 12
                for j in range(f):
                    table[at + j] = entry + j
                at += f


@kernel
def fill_single_tables(frequency: Any, slots: Any, intervals: Any) -> None:
    """The symbol of every slot and the frequency << 12 | start of every symbol, table by table."""
    for t in range(frequency.shape[0]):
        at = 0
        for z in range(256):
            f = frequency[t, z]
            if f > 0:
                intervals[t, z] = f << 12 | at
                for j in range(at, at + f):
                    slots[t, j] = z
                at += f
