"""Numbers in place of the values of a plane, where only some values occur.

Each component of a group is numbered by itself. Mostly a value is its own number. Where all values
lie on a lattice (8 bits widened to 16, halves widened to singles, constant alpha) they are counted
along it; where they are few (palettes, 8 bits taken through a transfer function to floats) the
sorted list of them is sent. Where most values have low bits that are 0 (singles that were halves or
came from a Radiance file, and their means) it is said of each whether they are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coders.damage import damaged

ITSELF, LATTICE, LIST, GRID = 0, 1, 2, 3
#: A list is sent if it holds fewer than so many of a hundred points of the lattice …
LIST_SHARE = 88
#: … and there are so many samples for each entry.
LIST_SAMPLES = 64
#: If of this many samples more than three quarters differ, a list is out of the question.
PROBE = 4096
#: Low bits of which it is asked whether they are 0 save at least so many bits a sample.
GRID_GAIN = 3

Numbers = NDArray[np.uint32]


@dataclass(frozen=True)
class Numbering:
    """How the values of each component are numbered.

    Attributes
    ----------
    steps, offsets, tops: (c,) int64. Value i is offset + i * step, for i up to top; where the step
        is 0, it stands in the list.
    lists: (c, n) int64, rising; what is behind the top is the largest.
    grids: (c,) int64, low bits that are 0 in most numbers; 0 where there are no such.
    largest: of all values that can be.
    """

    steps: NDArray[np.int64]
    offsets: NDArray[np.int64]
    tops: NDArray[np.int64]
    lists: NDArray[np.int64]
    grids: NDArray[np.int64]
    largest: int

    @property
    def symbols(self) -> int:
        """How many symbols a sample may take."""
        return 2 if self.grids.any() else 1

    @property
    def plain(self) -> bool:
        """Whether each value is its own number."""
        itself = (self.steps == 1) & (self.tops == self.largest) & (self.grids == 0)
        return bool(itself.all())

    def numbers(self, values: Numbers) -> Numbers:
        """Numbers of values (h, w, c) that all occur."""
        return self._map(values, lambda plane, c: np.searchsorted(self._list(c), plane), 0)

    def nearest(self, values: Numbers) -> Numbers:
        """Numbers of the nearest values that occur, of any values (h, w, c)."""

        def from_list(plane: NDArray[Any], c: int) -> NDArray[np.intp]:
            used = self._list(c)
            return np.searchsorted((used[:-1] + used[1:]) >> 1, plane)

        return self._map(values, from_list, 1)

    def values(self, numbers: Numbers) -> Numbers:
        """Values (h, w, c) of numbers up to the top."""
        out = numbers
        for c, step in enumerate(self.steps.tolist()):
            if step == 1 and self.offsets[c] == 0:
                continue
            if out is numbers:
                out = numbers.copy()
            plane = numbers[:, :, c].astype(np.int64)
            out[:, :, c] = plane * step + self.offsets[c] if step else self.lists[c, plane]
        return out

    def packed(self) -> bytes:
        """Two bits for each component that tell its numbering, then what each needs."""
        kinds, parts = 0, b""
        for c, step in enumerate(self.steps.tolist()):
            top = int(self.tops[c])
            if self.grids[c]:
                kinds |= GRID << 2 * c
                parts += _varint(int(self.grids[c]))
            elif step == 0:
                kinds |= LIST << 2 * c
                used = self._list(c).tolist()
                gaps = [b - a for a, b in pairwise(used)]
                parts += _varint(top) + _varint(used[0]) + b"".join(map(_varint, gaps))
            elif step > 1 or top < self.largest:
                kinds |= LATTICE << 2 * c
                parts += _varint(int(self.offsets[c])) + _varint(step) + _varint(top)
        return bytes([kinds]) + parts

    def _list(self, c: int) -> NDArray[np.int64]:
        return self.lists[c, : int(self.tops[c]) + 1]

    def _map(
        self, values: Numbers, from_list: Callable[[NDArray[Any], int], NDArray[Any]], rounding: int
    ) -> Numbers:
        out = values
        for c, step in enumerate(self.steps.tolist()):
            offset, top = int(self.offsets[c]), int(self.tops[c])
            if step == 1 and offset == 0 and top == self.largest:
                continue
            if out is values:
                out = values.copy()
            plane: NDArray[Any] = values[:, :, c].astype(np.int64)
            if step:
                plane = np.clip((plane - offset + rounding * (step >> 1)) // step, 0, top)
            else:
                plane = from_list(plane, c)
            out[:, :, c] = plane
        return out


def number_planes(values: Numbers, largest: int, max_error: int = 0) -> Numbering:
    """The numbering of values (h, w, c); each its own number if an error is allowed."""
    nc = values.shape[2]
    steps, offsets = np.ones(nc, np.int64), np.zeros(nc, np.int64)
    tops, grids = np.full(nc, largest, np.int64), np.zeros(nc, np.int64)
    lists: list[NDArray[np.int64]] = [np.zeros(1, np.int64)] * nc
    for c in range(nc if not max_error else 0):
        plane = np.ascontiguousarray(values[:, :, c]).reshape(-1)
        low, high = int(plane.min()), int(plane.max())
        if low == high:
            offsets[c], tops[c] = low, 0
            continue
        step = int(np.gcd.reduce(plane - np.uint32(low)))
        if step > 1:
            steps[c], offsets[c], tops[c] = step, low, (high - low) // step
        used = _few_values(plane, 1 + (high - low) // step)
        if used is not None:
            lists[c], steps[c], offsets[c], tops[c] = used, 0, 0, len(used) - 1
            continue
        grid = _grid(plane, largest)
        if grid >= step.bit_length():
            grids[c], steps[c], offsets[c], tops[c] = grid, 1, 0, largest
    return Numbering(steps, offsets, tops, _stacked(lists), grids, largest)


def _few_values(plane: Numbers, points: int) -> NDArray[np.int64] | None:
    spread = plane[:: max(1, plane.size // PROBE)]
    if 4 * len(np.unique(spread)) > 3 * PROBE:
        return None
    used = np.unique(plane)
    few = 100 * len(used) < LIST_SHARE * points and plane.size >= LIST_SAMPLES * len(used)
    return used.astype(np.int64) if few else None


def _grid(plane: Numbers, largest: int) -> int:
    """How many low bits are 0 so often that it pays to ask."""
    # Each value once: what fills an area costs nothing anyway.
    spread = np.unique(plane[:: max(1, plane.size // PROBE)])
    best, grid = GRID_GAIN * max(spread.size, PROBE // 16), 0
    for bits in range(2, largest.bit_length()):
        gain = (bits + 1) * int(np.count_nonzero(spread & np.uint32((1 << bits) - 1) == 0))
        if gain > best:
            best, grid = gain, bits
    return grid


def read_numbering(data: bytes, components: int, largest: int) -> tuple[Numbering, int]:
    """The inverse of `Numbering.packed`, and how many bytes it took.

    Raises InputError PTM-I112.
    """
    if not data:
        raise damaged("it is cut short")
    kinds, at = data[0], 1
    steps, offsets = np.ones(components, np.int64), np.zeros(components, np.int64)
    tops, grids = np.full(components, largest, np.int64), np.zeros(components, np.int64)
    lists: list[NDArray[np.int64]] = [np.zeros(1, np.int64)] * components
    for c in range(4):
        kind = kinds >> 2 * c & 3
        if kind == LATTICE and c < components:
            (offset, step, top), at = _read_varints(data, at, 3)
            if step == 0 or offset + step * top > largest:
                raise damaged("a lattice is impossible")
            steps[c], offsets[c], tops[c] = step, offset, top
        elif kind == LIST and c < components:
            (top,), at = _read_varints(data, at, 1)
            gaps, at = _read_varints(data, at, top + 1)
            used = np.cumsum(np.array(gaps, np.int64))
            if top == 0 or used[-1] > largest or min(gaps[1:]) == 0:
                raise damaged("a list of values is impossible")
            steps[c], offsets[c], tops[c], lists[c] = 0, 0, top, used
        elif kind == GRID and c < components:
            (grid,), at = _read_varints(data, at, 1)
            if not 1 <= grid < largest.bit_length():
                raise damaged("a grid is impossible")
            grids[c] = grid
        elif kind:
            raise damaged("a numbering is unknown")
    return Numbering(steps, offsets, tops, _stacked(lists), grids, largest), at


def _stacked(lists: list[NDArray[np.int64]]) -> NDArray[np.int64]:
    longest = max(map(len, lists))
    return np.stack([np.pad(one, (0, longest - len(one)), "edge") for one in lists])


def _varint(number: int) -> bytes:
    """Seven bits a byte, lowest first, 128 added where more follow."""
    out = bytearray()
    while number > 127:
        out.append(128 | number & 127)
        number >>= 7
    out.append(number)
    return bytes(out)


def _read_varints(data: bytes, at: int, n: int) -> tuple[list[int], int]:
    """n numbers below 2^35."""
    if n > len(data) - at:
        raise damaged("it is cut short")
    out: list[int] = []
    for _ in range(n):
        number = 0
        for shift in range(0, 35, 7):
            if at >= len(data):
                raise damaged("it is cut short")
            number |= (data[at] & 127) << shift
            at += 1
            if data[at - 1] < 128:
                break
        else:
            raise damaged("a number is too long")
        out.append(number)
    return out, at
