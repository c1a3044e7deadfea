"""Frequency tables and rANS in plain Python, written line by line from ``docs/formats/ptm.md``."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

import numpy as np

from ptmtools.texture.coders.group import GroupReader
from ptmtools.texture.coders.rans import BUILT_IN_MEANS

Row = list[int]


class Symbols:
    """The four rANS states over their words, and the escapes."""

    def __init__(
        self, reader: GroupReader, tables: list[Row], plain: int = 256, version_1: bool = False
    ) -> None:
        self._escapes = iter(reader.numbers("<u2", reader.number(4)).tolist())
        words = np.frombuffer(reader.rest(), "<u2").tolist()
        self._states = [words[2 * i] | words[2 * i + 1] << 16 for i in range(4)]
        self._words = iter(words[8:])
        self._tables = tables
        self._version_1 = version_1
        self._plain = plain
        self._i = 0

    def begin_row(self) -> None:
        """In version 1 every row begins with the first state."""
        if self._version_1:
            self._i = 0

    def next(self, table: int) -> int:
        """The next symbol, by that table."""
        lane = self._i & 3
        self._i += 1
        state = self._states[lane]
        slot, start, z = state & 2047, 0, 0
        f = self._tables[table]
        while start + f[z] <= slot:
            start += f[z]
            z += 1
        state = f[z] * (state >> 11) + slot - start
        if state < 1 << 15:
            state = state << 16 | next(self._words)
        self._states[lane] = state
        return next(self._escapes) if z == 255 and table < self._plain else z

    def signed(self, table: int) -> int:
        """The next symbol as a residual: 0, -1, 1, -2, 2 …"""
        z = self.next(table)
        return -((z + 1) >> 1) if z & 1 else z >> 1


def built_in(kind: int) -> Row:
    """Built-in table number ``kind``, from 1, of the coders of 8 bits."""
    return _geometric(BUILT_IN_MEANS[kind - 1])


def read_tables(
    reader: GroupReader,
    count: int,
    version_1: bool = False,
    family: Callable[[int], Row] = built_in,
) -> list[Row]:
    """Frequency tables; ``family`` makes the built-in ones."""
    kinds = list(reader.take(count)) if version_1 else []
    numbers: Row = []
    n, shift = 0, 0
    for byte in reader.take(reader.number(2)):
        for nibble in (byte & 15, byte >> 4):
            n |= (nibble & 7) << shift
            shift += 3
            if nibble < 8:
                numbers.append(n)
                n, shift = 0, 0
    tables: list[Row] = []
    sent = iter(numbers)
    last = 4
    while len(kinds) < count:
        number = next(sent)
        if number == 0:
            kinds += [0] * (1 + next(sent))
        elif number == 1:
            kinds.append(255)
        else:
            last += -(number - 1) // 2 if number & 1 else (number - 2) // 2
            kinds.append(last)
    for kind in kinds:
        table = [0] * 256
        if kind == 255:
            table[255] = next(sent)
            for z in range(next(sent)):
                table[z] = next(sent)
        elif kind:
            table = family(kind)
        tables.append(table)
    return tables


def _geometric(mean: int) -> Row:
    u = [1 << 24]
    for z in range(1, 255):
        u.append(u[-1] * (65536 * mean // (16 + mean)) >> 16 if z & 1 else u[-1])
    total = sum(u)
    u = [0 if 4096 * n < total else n for n in u]
    return normalised([*u, sum(u) >> 10])


def normalised(weights: Row) -> Row:
    """Frequencies that sum to 2048, by the rule of the specification."""
    total = sum(weights)
    f = [max(1, (2048 * u + total // 2) // total) if u else 0 for u in weights]
    while sum(f) > 2048:
        most = (z for z in range(256) if f[z] > 1)
        f[min(most, key=lambda z: Fraction(weights[z], 2 * f[z] - 1))] -= 1
    while sum(f) < 2048:
        least = (z for z in range(256) if f[z])
        f[max(least, key=lambda z: Fraction(weights[z], 2 * f[z] + 1))] += 1
    return f
