"""Numbers of the texel coder that encoder and decoder share without sending them: the neighbours
that predict a texel, the built-in weights and the built-in tables. They are part of the format.

An encoder may fit the predictors' weights to one group, the same on every machine: least squares
over a sample of block rows, one system of ten to twelve unknowns for each plane and each of p, q,
r, s, solved exactly (`group.solve_normal_equations`). Each sample is divided by the spread of its
neighbours first: the cost is bits, the logarithm of an error. The candidates include the weights
that continue drawn and computed images exactly (the texel above, the one to the left, the plane
through both): a depth map of 512² texels takes 44 kB with them, 98 kB without. On photographs they
never win.

Where only some values occur in a plane, numbers replace them (``docs/formats/ptm-kinds.md``,
"Numbering"): a lattice (8 bits widened to 16, halves widened to singles), a list of few values
(palettes, 8 bits taken through a transfer function to floats), or a bit per number that says
whether its low bits are 0 (singles that were halves or came from a Radiance file).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coders import rans as tables
from ptmtools.texture.coders.group import (
    GroupReader,
    group_error,
    pack_varints,
    plane_order,
    reference_counts,
    solve_normal_equations,
)

#: Rows and columns, from p, of the ten neighbours of p, q, r and s; the first three are those to
#: the left, above, and left above. What is not yet known there reads as the texel below it.
NEIGHBOURS = (
    ((0, -1), (-1, 0), (-1, -1), (-1, 1), (0, 2), (2, 0), (1, -1), (2, 2), (2, -1), (-1, 2)),
    ((0, 0), (-1, 1), (-1, 0), (-1, 2), (0, 2), (2, 0), (0, -1), (2, 2), (-1, 3), (1, -1)),
    ((1, -1), (0, 0), (0, -1), (0, 1), (0, 2), (2, 0), (-1, 0), (2, 2), (2, -1), (1, -2)),
    ((1, 0), (0, 1), (0, 0), (0, 2), (1, -1), (2, 0), (-1, 1), (2, 2), (2, -1), (-1, 2)),
)
#: Tokens of numbers up to 2^33.
TOKENS = 132
POWER = 4
#: Weights are in 1/4096 and stay within ± this …
WEIGHT_BITS = 12
WEIGHT_TOP = 32767
#: … as do the magnitudes of all weights of a texel together, so that a prediction of 16-bit samples
#: fits in 32 bits.
WEIGHT_SUM = 32767


def offsets(stride: int) -> NDArray[np.uint64]:
    """`NEIGHBOURS` (4, 10) as distances in a plane with rows so far apart, modulo 2^64."""
    return np.array([[y * stride + x for y, x in k] for k in NEIGHBOURS], np.int64).view(np.uint64)


#: Symbol counts of the built-in uniform tables; the other built-in tables follow.
EVEN = (2, 3, 4, 5, 6, 9, 16)


@cache
def table_family() -> tables.Family:
    """The built-in frequency tables.

    First even ones, for the fourth texels of few possible values. Then, of mean magnitude M = 1, 2,
    3, 4, 6, 8, 12 … sixteenths, weights that fall as (M / (M + 16·m))^POWER with the magnitude m.
    """
    rows = [[1 << 24] * n for n in EVEN]
    spans = [token_span(token) for token in range(TOKENS)]
    for mean in (1, *(m << i for i in range(35) for m in (2, 3))):
        magnitudes = [8 * (2 * first + count) for first, count in spans]
        rows.append(
            [
                (count * mean**POWER << 40) // (mean + magnitude) ** POWER
                for (_, count), magnitude in zip(spans, magnitudes, strict=True)
            ]
        )
    return tables.family(rows)


def token_span(token: int) -> tuple[int, int]:
    """The lowest number that a token stands for, and how many it does."""
    if token < 16:
        return token, 1
    bits = ((token - 16) >> 2) + 2
    return (4 + (token & 3)) << bits, 1 << bits


def sent_mask(components: int) -> NDArray[np.bool_]:
    """Which weights (c, 4, 12) are sent, in this order."""
    mask = np.zeros((components, 4, 12), np.bool_)
    for c, others in enumerate(reference_counts(components)):
        mask[c, :, : 10 + others] = True
    return mask


#: Weights in 1/4096 for a plane with 0, 1, 2 references: p, q, r, s by ten neighbours and the
#: errors of the references.
BUILT_IN_WEIGHTS = np.array(
    [
        [
            [1283, 850, -177, -296, -434, -352, -446, 35, 70, 100, 0, 0],
            [227, 949, -216, 82, 496, -332, 6, -60, -59, -430, 0, 0],
            [879, -1135, -63, -2041, -306, 64, 1, -37, 8, -95, 0, 0],
            [-2398, -2582, -3112, 124, -69, 120, -19, 49, -39, -26, 0, 0],
        ],
        [
            [1302, 842, -162, -324, -425, -337, -495, 16, 83, 120, 3189, 0],
            [230, 930, -202, 72, 490, -288, 23, -77, -47, -508, 3090, 0],
            [876, -1136, -54, -2058, -275, 82, 6, -56, 2, -102, 2994, 0],
            [-2437, -2642, -3130, 141, -51, 107, -6, 37, -42, -28, 2463, 0],
        ],
        [
            [1278, 772, -108, -294, -437, -329, -484, 26, 74, 114, 2451, 650],
            [223, 904, -195, 78, 452, -299, 22, -59, -38, -496, 2489, 512],
            [895, -1126, -42, -2016, -293, 62, 10, -31, 16, -108, 2541, 958],
            [-2226, -2459, -2986, 142, -50, 129, -2, 48, -46, -35, 3242, 869],
        ],
    ],
    np.int64,
)


#: Blocks sampled, about.
SAMPLED_BLOCKS = 6144
#: Features are brought to about ± this, and cut off at the other.
SCALE = 1 << 9
FEATURE_TOP = 1 << 12
#: Least spread of the neighbours that is assumed for a sample.
LEAST_SPREAD = 4
#: From this error on, the sample is fitted with neighbours that are as wrong as they will be. It
#: saves 4 % at an error of 8 in photographs and costs 0.4 % at one of 1.
ROUGH_ERROR = 3

Array = NDArray[np.int64]


def fit_weights(work: NDArray[np.uint32], level: NDArray[np.uint32], max_error: int) -> Array:
    """Weights (c, 4, 12) in coding order.

    work: (c, rows, columns), the level below enlarged, with a frame. level: (h, w, c), numbers of
    what is to be predicted.
    """
    nc = level.shape[2]
    bh, bw = level.shape[0] >> 1, level.shape[1] >> 1
    apart = max(1, bh * bw // SAMPLED_BLOCKS)
    y = np.arange(apart // 2, bh, apart)
    weights = np.zeros((nc, 4, 12), np.int64)
    errors = np.zeros((nc, 4, len(y), bw), np.int64)
    rough = max_error if max_error >= ROUGH_ERROR else 0
    for c, (plane, others) in enumerate(zip(plane_order(nc), reference_counts(nc), strict=True)):
        sample = _RowSample(work[plane], level[:, :, plane], y, rough)
        for k in range(4):
            neighbours, target = sample.features(k)
            f = np.stack([*neighbours, *errors[:others, k]])
            candidates = [_solve(f, target, LEAST_SPREAD + max_error), *_continuations(len(f))]
            residuals_of = [target - _predict(w, f) for w in candidates]
            costs = [_cost(residual) for residual in residuals_of]
            # The others have to be better by a sixteenth of a bit each.
            costs[0] -= target.size // 16
            best = costs.index(min(costs))
            weights[c, k, : len(f)] = candidates[best]
            errors[c, k] = _round(residuals_of[best], rough)
    return weights


class _RowSample:
    """Some block rows of a plane, as they look when each of their texels is to be predicted."""

    def __init__(
        self, work: NDArray[np.uint32], level: NDArray[np.uint32], y: Array, max_error: int
    ) -> None:
        width = 2 * (level.shape[1] >> 1)
        self._exact = level.astype(np.int64)[:, :width]
        self._y = y
        # Rows and columns -2 … 3 of every block, with all texels of the blocks unknown, and known.
        self._unknown = work[2 * y[:, None] + np.arange(6)].astype(np.int64)
        known = _round(self._exact, max_error)
        above = y > 0
        for row in (0, 1):
            self._unknown[above, row, 2 : 2 + width] = known[2 * y[above] - 2 + row]
        self._known = self._unknown.copy()
        self._known[:, 2:4, 2 : 2 + width] = known[2 * y[:, None] + np.arange(2)]

    def features(self, k: int) -> tuple[list[Array], Array]:
        """The ten neighbours of texel k of each block and itself, less the block's mean."""
        base = self._take(self._unknown, 0, 0)
        target = self._exact[2 * self._y + (k >> 1), k & 1 :: 2]
        return [self._neighbour(k, *place) - base for place in NEIGHBOURS[k]], target - base

    def _neighbour(self, k: int, dy: int, dx: int) -> Array:
        # To the left in the rows of the block, or in the block itself: known by now.
        known = 0 <= dy <= 1 and (dx < 0 or (dx <= 1 and 2 * dy + dx < k))
        return self._take(self._known if known else self._unknown, dy, dx)

    def _take(self, rows: Array, dy: int, dx: int) -> Array:
        end = 2 + dx + self._exact.shape[1]
        return rows[:, dy + 2, 2 + dx : end : 2]


def _round(values: Array, max_error: int) -> Array:
    """Values with the errors to be expected."""
    step = 2 * max_error + 1
    return (values + max_error) // step * step if max_error else values


def _predict(weights: Array, features: Array) -> Array:
    total = np.tensordot(weights, features, axes=1)
    half: int = 1 << WEIGHT_BITS - 1
    return np.asarray((total + half) >> WEIGHT_BITS)


def _solve(f: Array, target: Array, least: int) -> Array:
    """Weights of the features f (m, rows, blocks) that fit the target (rows, blocks)."""
    # Single operations of float64 on whole numbers, rounded as IEEE says: alike on every machine.
    scale = SCALE / (np.abs(f[:6]).sum(axis=0) / 4 + least)
    g = np.clip(np.rint(np.stack([*f, target]) * scale), -FEATURE_TOP, FEATURE_TOP)
    g = g.reshape(len(f) + 1, -1)
    weights = solve_normal_equations(
        g[:-1] @ g.T, WEIGHT_BITS, WEIGHT_TOP, ridge=SCALE * SCALE, share=12
    )
    total = int(np.abs(weights).sum())
    if total <= WEIGHT_SUM:
        return weights
    return np.asarray(np.sign(weights) * (np.abs(weights) * WEIGHT_SUM // total))


def _continuations(used: int) -> list[Array]:
    """Weights for the texel to the left, the one above, and the plane through both and a third."""
    weights = np.zeros((3, used), np.int64)
    weights[0, 0] = weights[1, 1] = 1 << WEIGHT_BITS
    weights[2, :3] = np.array([1, 1, -1]) << WEIGHT_BITS
    return list(weights)


def _cost(residual: Array) -> int:
    """Estimated bits of the residuals: one more for each doubling."""
    return int(np.frexp(np.abs(residual).astype(np.float64))[1].sum())


ITSELF, LATTICE, LIST, GRID = 0, 1, 2, 3
#: A list is sent if it holds less than this percentage of the points of the lattice …
LIST_SHARE = 88
#: … and there are this many samples for each entry.
LIST_SAMPLES = 64
#: If more than three quarters of this many samples differ, no list is tried.
PROBE = 4096
#: A flag for low bits of 0 has to save at least this many bits a sample.
GRID_GAIN = 3

Numbers = NDArray[np.uint32]


@dataclass(frozen=True)
class PlaneNumbering:
    """The numbering of the values of one component.

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
        """Numbers of the occurring values nearest to any values."""
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

    def pack(self) -> bytes:
        """The bytes that follow its kind in a file."""
        if self.kind == LIST:
            return pack_varints(self.top, *np.diff(self.used, prepend=0).tolist())
        if self.kind == LATTICE:
            return pack_varints(self.offset, self.step, self.top)
        return pack_varints(self.grid) if self.kind == GRID else b""


class NumberingArrays(NamedTuple):
    """The same for the pass: by component, int64."""

    steps: Any  # (c,)
    offsets: Any  # (c,)
    tops: Any  # (c,)
    grids: Any  # (c,)
    lists: Any  # (c, n), what is behind the top is the largest


class Numbering:
    """The numbering of the values of all components."""

    def __init__(self, planes: Iterable[PlaneNumbering]) -> None:
        self._planes = list(planes)
        longest = max(len(plane.used) for plane in self._planes)
        lists = [np.pad(p.used, (0, longest - len(p.used)), "edge") for p in self._planes]
        numbers = np.array([(p.step, p.offset, p.top, p.grid) for p in self._planes], np.int64)
        steps, offsets, tops, grids = np.ascontiguousarray(numbers.T)
        self.arrays = NumberingArrays(steps, offsets, tops, grids, np.stack(lists))
        #: Whether each value is its own number.
        self.plain = all(plane.kind == ITSELF for plane in self._planes)
        #: Most symbols of a sample.
        self.symbols = 2 if self.arrays.grids.any() else 1

    def nearest(self, values: Numbers) -> Numbers:
        """Numbers of the occurring values nearest to any values (h, w, c)."""
        return self._each(PlaneNumbering.nearest, values)

    def values(self, numbers: Numbers) -> Numbers:
        """Values (h, w, c) of numbers up to the top."""
        return self._each(PlaneNumbering.values, numbers)

    def pack(self) -> bytes:
        """Two bits for the kind of each component, then the data of each."""
        kinds = sum(plane.kind << 2 * c for c, plane in enumerate(self._planes))
        return bytes([kinds]) + b"".join(plane.pack() for plane in self._planes)

    def _each(
        self, change: Callable[[PlaneNumbering, Numbers], NDArray[Any]], numbers: Numbers
    ) -> Numbers:
        if self.plain:
            return numbers
        planes = [change(plane, numbers[:, :, c]) for c, plane in enumerate(self._planes)]
        return np.stack(planes, axis=2).astype(np.uint32)


def number_planes(values: Numbers, largest: int, max_error: int = 0) -> Numbering:
    """The numbering of values (h, w, c); each its own number if an error is allowed."""
    if max_error:
        return Numbering([PlaneNumbering(ITSELF, largest)] * values.shape[2])
    return Numbering(_number_plane(plane, largest) for plane in np.moveaxis(values, 2, 0))


def _number_plane(values: Numbers, largest: int) -> PlaneNumbering:
    plane = np.ascontiguousarray(values).reshape(-1)
    low, high = int(plane.min()), int(plane.max())
    if low == high:
        return PlaneNumbering(LATTICE, top=0, offset=low)
    step = int(np.gcd.reduce(plane - np.uint32(low)))
    used = _few_values(plane, 1 + (high - low) // step)
    if used is not None:
        return PlaneNumbering(LIST, len(used) - 1, step=0, used=used)
    grid = _grid(plane, largest)
    if grid >= step.bit_length():
        return PlaneNumbering(GRID, largest, grid=grid)
    if step > 1:
        return PlaneNumbering(LATTICE, (high - low) // step, step, low)
    return PlaneNumbering(ITSELF, largest)


def _few_values(plane: Numbers, points: int) -> NDArray[np.int64] | None:
    spread = plane[:: max(1, plane.size // PROBE)]
    if 4 * len(np.unique(spread)) > 3 * PROBE:
        return None
    used = np.unique(plane)
    few = 100 * len(used) < LIST_SHARE * points and plane.size >= LIST_SAMPLES * len(used)
    return used.astype(np.int64) if few else None


def _grid(plane: Numbers, largest: int) -> int:
    """Number of low bits that are 0 often enough for a flag."""
    # Each value once: what fills an area costs nothing anyway.
    spread = np.unique(plane[:: max(1, plane.size // PROBE)])
    best, grid = GRID_GAIN * max(spread.size, PROBE // 16), 0
    for bits in range(2, largest.bit_length()):
        gain = (bits + 1) * int(np.count_nonzero(spread & np.uint32((1 << bits) - 1) == 0))
        if gain > best:
            best, grid = gain, bits
    return grid


def read_numbering(reader: GroupReader, components: int, largest: int) -> Numbering:
    """The inverse of `Numbering.pack`. Raises InputError PTM-I112."""
    kinds = reader.number(1)
    if kinds >> 2 * components:
        raise group_error("a numbering is unknown")
    return Numbering(_read_plane(reader, kinds >> 2 * c & 3, largest) for c in range(components))


def _read_plane(reader: GroupReader, kind: int, largest: int) -> PlaneNumbering:
    if kind == LATTICE:
        offset, step, top = (reader.varint() for _ in range(3))
        if step == 0 or offset + step * top > largest:
            raise group_error("a lattice is impossible")
        return PlaneNumbering(LATTICE, top, step, offset)
    if kind == LIST:
        top = reader.varint()
        gaps = [reader.varint() for _ in range(top + 1)]
        used = np.cumsum(np.array(gaps, np.int64))
        if top == 0 or used[-1] > largest or min(gaps[1:]) == 0:
            raise group_error("a list of values is impossible")
        return PlaneNumbering(LIST, top, step=0, used=used)
    if kind == GRID:
        grid = reader.varint()
        if not 1 <= grid < largest.bit_length():
            raise group_error("a grid is impossible")
        return PlaneNumbering(GRID, largest, grid=grid)
    return PlaneNumbering(ITSELF, largest)
