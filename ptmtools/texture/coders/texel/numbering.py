"""Numbers in place of the values of a plane, where only some values occur.

Each component of a group is numbered by itself. Mostly a value is its own number. Where all values
lie on a lattice (8 bits widened to 16, halves widened to singles, constant alpha) they are counted
along it; where they are few (palettes, 8 bits taken through a transfer function to floats) the
sorted list of them is sent. Where most values have low bits that are 0 (singles that were halves or
came from a Radiance file, and their means) it is said of each whether they are.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coders.damage import damaged
from ptmtools.texture.coders.varints import pack_varints, read_varints

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

    def nearest(self, values: Numbers) -> Numbers:
        """Numbers of the nearest values that occur, of any values (h, w, c)."""
        out = values
        for c, step in enumerate(self.steps.tolist()):
            offset, top = int(self.offsets[c]), int(self.tops[c])
            if step == 1 and offset == 0 and top == self.largest:
                continue
            if out is values:
                out = values.copy()
            plane = values[:, :, c].astype(np.int64)
            if step:
                out[:, :, c] = np.clip((plane - offset + (step >> 1)) // step, 0, top)
            else:
                used = self._list(c)
                out[:, :, c] = np.searchsorted((used[:-1] + used[1:]) >> 1, plane)
        return out

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
                parts += pack_varints(int(self.grids[c]))
            elif step == 0:
                kinds |= LIST << 2 * c
                used = self._list(c).tolist()
                gaps = [b - a for a, b in pairwise(used)]
                parts += pack_varints(top, used[0], *gaps)
            elif step > 1 or top < self.largest:
                kinds |= LATTICE << 2 * c
                parts += pack_varints(int(self.offsets[c]), step, top)
        return bytes([kinds]) + parts

    def _list(self, c: int) -> NDArray[np.int64]:
        return self.lists[c, : int(self.tops[c]) + 1]


def number_planes(values: Numbers, largest: int, max_error: int = 0) -> Numbering:
    """The numbering of values (h, w, c); each its own number if an error is allowed."""
    if max_error:
        return _numbering([_Plane(top=largest)] * values.shape[2], largest)
    return _numbering(
        [_number_plane(plane, largest) for plane in np.moveaxis(values, 2, 0)], largest
    )


@dataclass(frozen=True)
class _Plane:
    """How the values of one component are numbered, as in `Numbering`."""

    top: int
    step: int = 1
    offset: int = 0
    grid: int = 0
    used: NDArray[np.int64] = field(default_factory=lambda: np.zeros(1, np.int64))


def _numbering(planes: list[_Plane], largest: int) -> Numbering:
    longest = max(len(plane.used) for plane in planes)
    return Numbering(
        steps=np.array([plane.step for plane in planes], np.int64),
        offsets=np.array([plane.offset for plane in planes], np.int64),
        tops=np.array([plane.top for plane in planes], np.int64),
        lists=np.stack([np.pad(p.used, (0, longest - len(p.used)), "edge") for p in planes]),
        grids=np.array([plane.grid for plane in planes], np.int64),
        largest=largest,
    )


def _number_plane(values: Numbers, largest: int) -> _Plane:
    plane = np.ascontiguousarray(values).reshape(-1)
    low, high = int(plane.min()), int(plane.max())
    if low == high:
        return _Plane(top=0, offset=low)
    step = int(np.gcd.reduce(plane - np.uint32(low)))
    used = _few_values(plane, 1 + (high - low) // step)
    if used is not None:
        return _Plane(top=len(used) - 1, step=0, used=used)
    grid = _grid(plane, largest)
    if grid >= step.bit_length():
        return _Plane(top=largest, grid=grid)
    if step > 1:
        return _Plane(top=(high - low) // step, step=step, offset=low)
    return _Plane(top=largest)


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
    kinds, at, planes = data[0], 1, []
    for c in range(components):
        kind, plane = kinds >> 2 * c & 3, _Plane(top=largest)
        if kind == LATTICE:
            (offset, step, top), at = read_varints(data, at, 3)
            if step == 0 or offset + step * top > largest:
                raise damaged("a lattice is impossible")
            plane = _Plane(top, step, offset)
        elif kind == LIST:
            (top,), at = read_varints(data, at, 1)
            gaps, at = read_varints(data, at, top + 1)
            used = np.cumsum(np.array(gaps, np.int64))
            if top == 0 or used[-1] > largest or min(gaps[1:]) == 0:
                raise damaged("a list of values is impossible")
            plane = _Plane(top, step=0, used=used)
        elif kind == GRID:
            (grid,), at = read_varints(data, at, 1)
            if not 1 <= grid < largest.bit_length():
                raise damaged("a grid is impossible")
            plane = _Plane(largest, grid=grid)
        planes.append(plane)
    if kinds >> 2 * components:
        raise damaged("a numbering is unknown")
    return _numbering(planes, largest), at
