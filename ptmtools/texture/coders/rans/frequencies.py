"""Compiled loops over frequency tables: normalised, chosen, written and read, and looked up in."""

from __future__ import annotations

from typing import Any

import numpy as np

from ptmtools.compiled import plain_kernel as kernel
from ptmtools.texture.coders.rans.sizes import ESCAPE, TABLE_SIZE


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
        left = TABLE_SIZE if many > 0 else 0
        for i in range(many):
            s = used[i]
            f = max(1, (counts[t, s] * TABLE_SIZE + total // 2) // total)
            frequency[t, s] = f
            left -= f
        step = 1 if left > 0 else -1
        while left != 0:
            best, n, f = -1, 0, 0
            for i in range(many):
                s = used[i]
                mine, own = counts[t, s], frequency[t, s]
                if own + step == 0:
                    continue
                one, other = n * (2 * own + step), mine * (2 * f + step)
                if best < 0 or ((one < other) if step > 0 else (one > other)):
                    best, n, f = s, mine, own
            frequency[t, best] += step
            left -= step


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
