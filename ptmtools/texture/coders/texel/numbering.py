"""Numbers in place of the values of a plane, where only some values occur.

Each component of a group is numbered by itself. Mostly a value is its own number. Where all values
lie on a lattice (8 bits widened to 16, halves widened to singles, constant alpha) they are counted
along it; where they are few (palettes, 8 bits taken through a transfer function to floats) the
sorted list of them is sent. Where most values have low bits that are 0 (singles that were halves or
came from a Radiance file, and their means) it is said of each whether they are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coders.reading import Reader, damaged, pack_varints

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
class Plane:
    """How the values of one component are numbered.

    Attributes
    ----------
    kind: ITSELF, LATTICE, LIST, GRID.
    top: the largest number.
    step, offset: value i is offset + i * step; with a list, step is 0.
    grid: low bits that are 0 in most numbers.
    used: (top + 1,) int64, rising: the values of a list.
    """

    kind: int
    top: int
    step: int = 1
    offset: int = 0
    grid: int = 0
    used: NDArray[np.int64] = field(default_factory=lambda: np.zeros(1, np.int64))

    def nearest(self, values: Numbers) -> NDArray[Any]:
        """Numbers of the nearest values that occur, of any values."""
        if self.kind == LIST:
            return np.searchsorted((self.used[:-1] + self.used[1:]) >> 1, values)
        if self.kind == LATTICE:
            steps = (values.astype(np.int64) - self.offset + (self.step >> 1)) // self.step
            return np.clip(steps, 0, self.top)
        return values

    def values(self, numbers: Numbers) -> NDArray[Any]:
        """Values of numbers up to the top."""
        if self.kind == LIST:
            return self.used[numbers]
        return self.offset + numbers.astype(np.int64) * self.step

    def packed(self) -> bytes:
        """What a file says of it behind its kind."""
        if self.kind == LIST:
            return pack_varints(self.top, *np.diff(self.used, prepend=0).tolist())
        if self.kind == LATTICE:
            return pack_varints(self.offset, self.step, self.top)
        return pack_varints(self.grid) if self.kind == GRID else b""


class Arrays(NamedTuple):
    """The same for the pass: by component, int64."""

    steps: Any  # (c,)
    offsets: Any  # (c,)
    tops: Any  # (c,)
    grids: Any  # (c,)
    lists: Any  # (c, n), what is behind the top is the largest


class Numbering:
    """How the values of all components are numbered."""

    def __init__(self, planes: Iterable[Plane]) -> None:
        self._planes = list(planes)
        longest = max(len(plane.used) for plane in self._planes)
        lists = [np.pad(p.used, (0, longest - len(p.used)), "edge") for p in self._planes]
        numbers = np.array([(p.step, p.offset, p.top, p.grid) for p in self._planes], np.int64)
        steps, offsets, tops, grids = np.ascontiguousarray(numbers.T)
        self.arrays = Arrays(steps, offsets, tops, grids, np.stack(lists))
        #: Whether each value is its own number.
        self.plain = all(plane.kind == ITSELF for plane in self._planes)
        #: How many symbols a sample may take.
        self.symbols = 2 if self.arrays.grids.any() else 1

    def nearest(self, values: Numbers) -> Numbers:
        """Numbers of the nearest values that occur, of any values (h, w, c)."""
        return self._each(Plane.nearest, values)

    def values(self, numbers: Numbers) -> Numbers:
        """Values (h, w, c) of numbers up to the top."""
        return self._each(Plane.values, numbers)

    def packed(self) -> bytes:
        """Two bits for each component that tell its kind, then what each needs."""
        kinds = sum(plane.kind << 2 * c for c, plane in enumerate(self._planes))
        return bytes([kinds]) + b"".join(plane.packed() for plane in self._planes)

    def _each(self, change: Callable[[Plane, Numbers], NDArray[Any]], numbers: Numbers) -> Numbers:
        if self.plain:
            return numbers
        planes = [change(plane, numbers[:, :, c]) for c, plane in enumerate(self._planes)]
        return np.stack(planes, axis=2).astype(np.uint32)


def number_planes(values: Numbers, largest: int, max_error: int = 0) -> Numbering:
    """The numbering of values (h, w, c); each its own number if an error is allowed."""
    if max_error:
        return Numbering([Plane(ITSELF, largest)] * values.shape[2])
    return Numbering(_number_plane(plane, largest) for plane in np.moveaxis(values, 2, 0))


def _number_plane(values: Numbers, largest: int) -> Plane:
    plane = np.ascontiguousarray(values).reshape(-1)
    low, high = int(plane.min()), int(plane.max())
    if low == high:
        return Plane(LATTICE, top=0, offset=low)
    step = int(np.gcd.reduce(plane - np.uint32(low)))
    used = _few_values(plane, 1 + (high - low) // step)
    if used is not None:
        return Plane(LIST, len(used) - 1, step=0, used=used)
    grid = _grid(plane, largest)
    if grid >= step.bit_length():
        return Plane(GRID, largest, grid=grid)
    if step > 1:
        return Plane(LATTICE, (high - low) // step, step, low)
    return Plane(ITSELF, largest)


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


def read_numbering(reader: Reader, components: int, largest: int) -> Numbering:
    """The inverse of `Numbering.packed`. Raises InputError PTM-I112."""
    kinds = reader.number(1)
    if kinds >> 2 * components:
        raise damaged("a numbering is unknown")
    return Numbering(_read_plane(reader, kinds >> 2 * c & 3, largest) for c in range(components))


def _read_plane(reader: Reader, kind: int, largest: int) -> Plane:
    if kind == LATTICE:
        offset, step, top = (reader.varint() for _ in range(3))
        if step == 0 or offset + step * top > largest:
            raise damaged("a lattice is impossible")
        return Plane(LATTICE, top, step, offset)
    if kind == LIST:
        top = reader.varint()
        gaps = [reader.varint() for _ in range(top + 1)]
        used = np.cumsum(np.array(gaps, np.int64))
        if top == 0 or used[-1] > largest or min(gaps[1:]) == 0:
            raise damaged("a list of values is impossible")
        return Plane(LIST, top, step=0, used=used)
    if kind == GRID:
        grid = reader.varint()
        if not 1 <= grid < largest.bit_length():
            raise damaged("a grid is impossible")
        return Plane(GRID, largest, grid=grid)
    return Plane(ITSELF, largest)
