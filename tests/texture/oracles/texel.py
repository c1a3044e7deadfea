"""Decodes the texel coder in plain Python; written line by line from ``docs/formats/ptm-kinds.md``.

It shares nothing with the compiled decoder but the numbers of `layout`, the order of planes and how
bytes are read. The tests compare the two; whoever ports the format can step through it. Thousands
of times slower; no damage is looked for.
"""

from __future__ import annotations

import math
import struct
from bisect import bisect_left
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coders import texel_layout as layout
from ptmtools.texture.coders.group import GroupReader, plane_order, reference_counts
from tests.texture.oracles.rans import Symbols, normalised, read_tables

CLASSES, NARROW, GRID, TABLES = 18, 216, 232, 236


def decode_texels(
    group: bytes, below: NDArray[Any], shape: tuple[int, int, int], max_error: int = 0
) -> NDArray[Any]:
    """The level (h, w, c) that a coded group (with its first byte, 2 or 3) refines ``below`` to."""
    return _Decoder(group, below, shape, max_error).level()


class _Decoder:
    def __init__(
        self, group: bytes, below: NDArray[Any], shape: tuple[int, int, int], max_error: int
    ) -> None:
        self.shape, self.max_error, self.dtype = shape, max_error, below.dtype
        self.letter = {"float16": "e", "float32": "f"}.get(below.dtype.name, "")
        self.bits = 8 * below.dtype.itemsize
        read = GroupReader(group)
        sent = read.number(1) == 3
        components = shape[2]
        kinds = read.number(1)
        self.grids = [0] * components
        self.values: list[Sequence[int]] = [range(1 << self.bits)] * components
        for c in range(components):
            kind = kinds >> 2 * c & 3
            if kind == 1:
                offset, step, top = read.varint(), read.varint(), read.varint()
                self.values[c] = range(offset, offset + step * top + 1, step)
            elif kind == 2:
                gaps = [read.varint() for _ in range(read.varint() + 1)]
                self.values[c] = np.cumsum(gaps).tolist()
            elif kind == 3:
                self.grids[c] = read.varint()
        self.window = read.number(1)
        self.order = plane_order(components).tolist()
        self.references = reference_counts(components).tolist()
        self.weights = [layout.BUILT_IN_WEIGHTS[n].tolist() for n in self.references]
        if sent:
            for c, n in enumerate(self.references):
                for k in range(4):
                    self.weights[c][k][: 10 + n] = read.numbers("<i2", 10 + n).tolist()
        tables = read_tables(read, TABLES, family=built_in)
        self.plain = read.number(read.number(4))
        self.symbols = Symbols(read, tables)
        self.means = [[[self._ordered(v) for v in texel] for texel in row] for row in below]

        #: Numbers and the magnitudes of their errors so far, by plane, row and column.
        self.numbers: dict[tuple[int, int, int], int] = {}
        self.errors: dict[tuple[int, int, int], int] = {}
        self.off = [0] * components

    def level(self) -> NDArray[Any]:
        height, width, components = self.shape
        for y in range(0, height, 2):
            for x in range(0, width, 2):
                signed = [[0] * 4 for _ in range(components)]
                for c in range(components):
                    for k in range(4):
                        if y + k // 2 < height and x + k % 2 < width:
                            self._texel(y, x, c, k, signed)
        out = np.empty(self.shape, f"u{self.bits // 8}")
        for (plane, y, x), number in self.numbers.items():
            out[y, x, plane] = self._bits(self.values[plane][number])
        return out.view(self.dtype)

    def _texel(self, y: int, x: int, c: int, k: int, signed: list[list[int]]) -> None:
        """Texel k of the block whose p is at y, x; ``signed``: the errors of the block so far."""
        plane, n = self.order[c], self.references[c]
        ty, tx = y + k // 2, x + k % 2

        def error(dy: int, dx: int) -> int:
            return self.errors.get((plane, ty + dy, tx + dx), 0)

        base = self._look(plane, ty, tx)
        f = [self._look(plane, y + dy, x + dx) - base for dy, dx in layout.NEIGHBOURS[k]]
        e = [signed[i][k] if n > i else 0 for i in range(2)]
        total = sum(a * b for a, b in zip(self.weights[c][k], f + e, strict=True))
        top = len(self.values[plane]) - 1
        guess = min(max(base + ((total + 2048) >> 12), 0), top)
        slope = sum(map(abs, f[:6]))
        east = error(-1, 1) if k < 3 else error(0, -1)
        around = 2 * (error(0, -1) + error(-1, 0)) + error(-1, -1) + east
        activity = [
            16 * around + 2 * slope,
            8 * around + slope + 16 * abs(e[0]),
            8 * around + slope + 8 * abs(e[0]) + 24 * abs(e[1]),
        ][n] >> ((2 * self.max_error + 1).bit_length() - 1)
        low, high, target = 0, top, guess
        last = k == 3 and not self.max_error
        if last:
            three = [self.numbers[plane, y + i // 2, x + i % 2] for i in range(3)]
            low, high = self._range(plane, three, self.means[y // 2][x // 2][plane])
            target = min(max(guess, low), high)
        shift = self.grids[plane]
        if shift:
            lowest, highest = -(-low >> shift), high >> shift
            before = 2 * self.off[plane] + (self.off[self.order[0]] if c > 0 else 0)
            self.off[plane] = self.symbols.next(GRID + before) if lowest <= highest else 1
            if self.off[plane]:
                shift = 0
            else:
                target = (target + ((1 << shift) - 1 >> 1)) >> shift
                low, high, activity = lowest, highest, activity >> shift
                target = min(max(target, low), high)
        if last and high - low < 16:
            grade = min(((activity >> 4).bit_length() + 1) // 2, 3)
            table = NARROW + 4 * ((high - low).bit_length() - 1) + grade
        else:
            octave = activity.bit_length() - self.window
            table = min(max(octave, 1), CLASSES - 1) if activity else 0
            table += CLASSES * (4 * n + k)
        z = self._number(table) if high > low else 0
        change = -(z + 1) // 2 if z & 1 else z // 2
        if self.max_error:
            number = target + change * (2 * self.max_error + 1)
            number = min(max(number, 0), top)
        else:
            near = min(target - low, high - target)
            if z > 2 * near:
                change = z - near if target - low == near else near - z
            number = (target + change) << shift
        self.numbers[plane, ty, tx] = number
        signed[c][k] = number - guess
        self.errors[plane, ty, tx] = abs(number - guess)

    def _look(self, plane: int, y: int, x: int) -> int:
        """The number there, or of the texel below it."""
        if (plane, y, x) in self.numbers:
            return self.numbers[plane, y, x]
        row, column = (
            min(max(at >> 1, 0), side // 2 - 1)
            for at, side in zip((y, x), self.shape[:2], strict=True)
        )
        return self._nearest(self.means[row][column][plane], plane)

    def _range(self, c: int, numbers: list[int], mean: int) -> tuple[int, int]:
        """Lowest and highest number of s."""
        p, q, r = (self.values[c][i] for i in numbers)
        low, high = 4 * mean - p - q - r, 4 * mean - p - q - r + 3
        if self.letter:
            low, high = 0, (1 << self.bits) - 1
            a, b, d, m = (self._real(v) for v in (p, q, r, mean))
            value = 4.0 * m - ((a + b) + d)
            if math.isfinite(value):
                mantissa, least = (10, -14) if self.letter == "e" else (23, -126)
                unit = 2.0 ** (max(math.frexp(m)[1] - 1, least) - mantissa)
                wide = 4.0 * abs(m) + ((abs(a) + abs(b)) + abs(d))
                margin = 2.0 * unit + wide * 2.0**-50
                low, high = (self._rounded(v) for v in (value - margin, value + margin))
        first = bisect_left(self.values[c], low)
        return first, bisect_left(self.values[c], high + 1) - 1

    def _nearest(self, value: int, c: int) -> int:
        values = self.values[c]
        if isinstance(values, range):
            number = (value - values.start + values.step // 2) // values.step
            return min(max(number, 0), len(values) - 1)
        middles = [a + b >> 1 for a, b in pairwise(values)]
        return bisect_left(middles, value)

    def _real(self, ordered: int) -> float:
        bits = self._bits(ordered).to_bytes(self.bits // 8, "little")
        return float(struct.unpack("<" + self.letter, bits)[0])

    def _rounded(self, value: float) -> int:
        try:
            data = struct.pack("<" + self.letter, value)
        except OverflowError:
            data = struct.pack("<" + self.letter, math.copysign(math.inf, value))
        return self._ordered_bits(int.from_bytes(data, "little"))

    def _ordered(self, sample: Any) -> int:
        bits = int.from_bytes(sample.tobytes(), "little")
        return self._ordered_bits(bits) if self.letter else bits

    def _ordered_bits(self, bits: int) -> int:
        sign = 1 << (self.bits - 1)
        return bits ^ (2 * sign - 1) if bits & sign else bits | sign

    def _bits(self, ordered: int) -> int:
        sign = 1 << (self.bits - 1)
        if not self.letter:
            return ordered
        return ordered ^ sign if ordered & sign else ordered ^ (2 * sign - 1)

    def _number(self, table: int) -> int:
        token = self.symbols.next(table)
        if token < 16:
            return token
        bits = (token - 16 >> 2) + 2
        rest = self.plain & ((1 << bits) - 1)
        self.plain >>= bits
        return (4 + (token & 3)) << bits | rest


def built_in(kind: int) -> list[int]:
    """Built-in table number ``kind``, from 1."""
    even = (2, 3, 4, 5, 6, 9, 16)
    if kind <= len(even):
        weights = [1] * even[kind - 1]
    else:
        i = kind - len(even) - 1
        mean = 1 if i == 0 else (2 + (i - 1) % 2) << (i - 1) // 2
        weights = []
        for token in range(132):
            bits = 0 if token < 16 else (token - 16 >> 2) + 2
            first = token if token < 16 else (4 + (token & 3)) << bits
            magnitude = 8 * (2 * first + (1 << bits))
            weights.append((mean**4 << bits + 40) // (mean + magnitude) ** 4)
    total = sum(weights)
    scaled = [(w << 24) // total for w in weights]
    kept = [w if w >= 1 << 12 else 0 for w in scaled]
    return normalised([*kept, *[0] * (255 - len(kept)), sum(kept) >> 10])
