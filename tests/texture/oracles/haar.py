"""A decoder of the Haar coder in plain Python, written line by line from ``docs/formats/ptm.md``.

It shares nothing with the compiled decoder but the numbers of `layout`, the order of planes and how
bytes are read. The tests compare the two; whoever ports the format can step through it. Thousands
of times slower; no damage is looked for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coders import haar_layout as layout
from ptmtools.texture.coders.group import GroupReader, plane_order, reference_counts
from tests.texture.oracles.rans import Symbols, read_tables

Row = list[int]
Plane = list[Row]
At = Callable[[int, int], int]


def decode_haar(
    group: bytes, below: NDArray[np.uint8], shape: tuple[int, int, int], version_1: bool = False
) -> NDArray[np.uint8]:
    """The level (h, w, c) that a Haar-coded group (without its first byte) refines ``below`` to."""
    height, width, components = shape
    bh, bw = height >> 1, width >> 1
    reader = GroupReader(group)
    flags = reader.number(1)
    values: list[Row] = []
    for c in range(components):
        bitmap = reader.number(32 if flags >> (4 + c) & 1 else 0)
        values.append([v for v in range(256) if bitmap >> v & 1])
    order, count = plane_order(components).tolist(), reference_counts(components).tolist()
    weights = [[list(map(int, layout.BUILT_IN_WEIGHTS[n][k])) for k in range(3)] for n in count]
    if flags & 1:
        for c, n in enumerate(count):
            for k in range(3):
                for i in [*range(5 if k == 2 else 4), *range(5, 5 + n)]:
                    weights[c][k][i] = int(reader.numbers("<i2", 1)[0])
    symbols = Symbols(reader, read_tables(reader, 29, version_1), 28, version_1)

    texels = np.zeros(shape, np.int64)
    v, h, g = ([_zeros(bh, bw) for _ in order] for _ in range(3))
    residuals = [[_zeros(bh, bw) for _ in order] for _ in range(3)]
    lower = [_ranked(below[:, :, plane], values[plane]) for plane in order]

    def code_row(k: int, c: int, y: int, out: Plane) -> None:
        """One row of coefficient k of plane c."""
        symbols.begin_row()
        for x in range(bw):

            def i(dx: int, dy: int, x: int = x) -> int:
                return lower[c][min(max(y + dy, 0), bh - 1)][min(max(x + dx, 0), bw - 1)]

            slope = _outside(v[c][y], x + 1) - _outside(v[c][y], x - 1)
            under = h[c][min(y + 1, bh - 1)][x]
            e1 = residuals[k][0][y][x] if count[c] > 0 else 0
            e2 = residuals[k][1][y][x] if count[c] > 1 else 0
            f = [_features_v(i), _features_h(i, slope), _features_g(i, h[c][y][x], under, slope)][k]
            total = sum(a * b for a, b in zip(weights[c][k], [*f, e1, e2], strict=True))
            prediction = min(max((total + 128) >> 8, -1020), 1020)
            above = residuals[k][c][y - 1] if y else [0] * bw
            near = [abs(_outside(above, x + d)) for d in (-1, 0, 1)]
            activity = [
                abs(i(1, 0) - i(-1, 0)) + abs(i(0, 1) - i(0, -1)),
                2 * near[1] + near[0] + near[2],
                abs(e1),
                abs(e2),
                abs(residuals[0][c][y][x]) if k > 0 else 0,
                abs(residuals[1][c][y][x]) if k > 1 else 0,
                abs(residuals[1][c][y + 1][x]) if k > 1 and y + 1 < bh else 0,
            ]
            factors = map(int, layout.ACTIVITY_WEIGHTS[count[c]][k])
            a = min(sum(m * n for m, n in zip(factors, activity, strict=True)) >> 6, 1023)
            klass = sum(bound <= a for bound in layout.CLASS_BOUNDS)
            e = symbols.signed(klass + 14 * (k == 2))
            residuals[k][c][y][x] = e
            out[y][x] = prediction + e

    for y in range(bh + 1):
        for c, plane in enumerate(order):
            if y < bh:
                code_row(0, c, y, v[c])
                code_row(1, c, y, h[c])
            if y:
                code_row(2, c, y - 1, g[c])
                for x in range(bw):
                    block = (v[c][y - 1][x], h[c][y - 1][x], g[c][y - 1][x])
                    mean = int(below[y - 1, x, plane])
                    four = _by_rank(*block, mean, values[plane]) or by_value(*block, mean)
                    texels[2 * y - 2 : 2 * y, 2 * x : 2 * x + 2, plane] = np.reshape(four, (2, 2))
    symbols.begin_row()
    for y, x in edge(height, width):
        for plane in range(components):
            guess = _median(texels[:, :, plane], y, x)
            texels[y, x, plane] = (guess + symbols.signed(28)) & 255
    return texels.astype(np.uint8)


def _features_v(i: At) -> Row:
    return [
        i(0, 1) - i(0, -1),
        i(-1, 1) - i(-1, -1) + i(1, 1) - i(1, -1),
        i(0, 2) - i(0, 0),
        i(0, 0) - i(0, -2),
        0,
    ]


def _features_h(i: At, slope: int) -> Row:
    return [i(1, 0) - i(-1, 0), i(1, -1) - i(-1, -1), i(1, 1) - i(-1, 1), slope, 0]


def _features_g(i: At, h: int, under: int, slope: int) -> Row:
    return [i(1, 0) - i(-1, 0), i(1, 1) - i(-1, 1), h, under, slope]


def by_value(v: int, h: int, g: int, mean: int) -> Row:
    """p, q, r, s of a block from its Haar differences and its mean."""
    t = (v + (v & 1)) >> 1
    upper = 2 * mean + ((h ^ t) & 1) + t
    lower = upper - v
    p = (upper + h) >> 1
    d = 2 * g + (lower & 1)
    r = (lower + d) >> 1
    return [p, p - h, r, r - d]


def _by_rank(v: int, h: int, g: int, mean: int, values: Row) -> Row | None:
    if not values:
        return None
    d = 2 * g + ((v ^ h) & 1)
    a = (d + v + h) >> 1
    for u in range(len(values)):
        ranks = [u + a, u + a - h, u + d, u]
        if min(ranks) >= 0 and max(ranks) < len(values):
            four = [values[rank] for rank in ranks]
            if sum(four) >> 2 == mean:
                return four
    return None


def _ranked(plane: NDArray[np.uint8], values: Row) -> Plane:
    bounds = [(a + b) >> 1 for a, b in pairwise(values)]
    rank = [sum(bound < i for bound in bounds) if values else i for i in range(256)]
    return [[rank[int(i)] for i in row] for row in plane]


def _zeros(bh: int, bw: int) -> Plane:
    return [[0] * bw for _ in range(bh)]


def _outside(row: Row, x: int) -> int:
    return row[x] if 0 <= x < len(row) else 0


def edge(height: int, width: int) -> Iterator[tuple[int, int]]:
    """The texels that belong to no block: the odd last column, then the odd last row."""
    if width & 1:
        yield from ((y, width - 1) for y in range(height & ~1))
    if height & 1:
        yield from ((height - 1, x) for x in range(width))


def _median(plane: NDArray[np.int64], y: int, x: int) -> int:
    if y == 0:
        return int(plane[y, x - 1]) if x else 0
    if x == 0:
        return int(plane[y - 1, x])
    w, n = int(plane[y, x - 1]), int(plane[y - 1, x])
    return sorted((w, n, w + n - int(plane[y - 1, x - 1])))[1]
