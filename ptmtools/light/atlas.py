"""The atlas of a lightmap: every face of a mesh in a place of its own, by xatlas.

No texel that a bilinear look-up on one chart reads is read on another, in any size; all sizes have
the same layout. xatlas packs with fewer and fewer texels to the metre until all charts fit into the
least size. If the edges of charts would take nearly all of it, the next larger one is packed, and
neighbours run into each other in the smaller ones. (With two more texels between charts, a
building with 5,700 charts had texels of 1.3 m instead of 0.2 m in the least size.)
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints, Singles, areas
from ptmtools.cells.search import connect
from ptmtools.jit import kernel
from ptmtools.lazy import component
from ptmtools.light.packing import pack

#: Half the size of an unwrapped mesh, in a unit of its own. (With 64 xatlas takes faces of some
#: centimetres in a kilometre for empty.)
_LARGE = 1024.0
#: The share of a lightmap that the first packing aims at.
FILLED = 0.6
#: Most packings, the part of the side that each aims at, and the least next density of one before.
_TRIES, _AIM, _STEP = 8, 0.98, 0.3
#: An atlas with less than this share of the intended density is mostly edges,
_WORTH = 0.4
#: unless a chart, such as a street, is as long as this share of the side.
_LONG = 0.7


@dataclass(frozen=True)
class Atlas:
    """The places of faces.

    Attributes
    ----------
    uv: (T, 3, 2) in [0, 1] per corner, origin at the lower left.
    chart: (T,) numbers; faces of one chart are connected.
    side: the least size in which no two charts read the same texel; None without one.
    """

    uv: Floats
    chart: Ints
    side: int | None


def unwrap(
    points: Floats,
    triangles: NDArray[np.integer[Any]],
    sizes: Sequence[int],
    *,
    padding: int = 0,
    group: Ints | None = None,
    purpose: str = "baking lightmaps",
) -> Atlas:
    """An atlas of (T, 3) triangles over (V, 3) points, for square lightmaps of ascending ``sizes``,
    texels; ``padding`` more texels lie between charts.

    ``padding``: texels between charts beyond those that are read. ``group``: (T,) numbers; faces of
    different groups share no chart.

    Raises MissingComponentError: PTM-M100 xatlas is not installed.
    """
    component("xatlas", "PTM-M100", f"{purpose} needs xatlas", "light")
    # Far from the origin float32 has no texels, and xatlas drops faces that it takes for empty.
    near = points - points.mean(axis=0)
    largest = float(np.abs(near).max(initial=0.0))
    unit = _LARGE / largest if largest else 1.0
    moved = (near * unit).astype(np.float32)
    parts = _parts(np.zeros(len(triangles), np.int64) if group is None else group)
    area = max(areas(moved[triangles].astype(np.float64)).sum(), np.finfo(np.float32).tiny)
    for side in sizes:
        wanted = side * math.sqrt(FILLED / area)
        packed, density = _pack(moved, triangles, parts, side, wanted, padding)
        if density >= _WORTH * wanted or _longest(packed) >= _LONG * side:
            break
    placed = packed.texel / max(packed.size, side)
    placed[..., 1] = 1 - placed[..., 1]
    fits = packed.size <= side
    return Atlas(np.clip(placed, 0.0, 1.0), packed.chart, side if fits else None)


def _parts(group: Ints) -> list[Ints]:
    """The faces of each group."""
    order = np.argsort(group, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(group[order])) + 1)


class _Layout(NamedTuple):
    """(T, 3, 2) the corners of faces, texels from the upper left; (T,) the chart of each; the
    larger side of the atlas."""

    texel: Floats
    chart: Ints
    size: int


def _pack(
    points: Singles,
    triangles: NDArray[np.integer[Any]],
    parts: list[Ints],
    side: int,
    density: float,
    padding: int,
) -> tuple[_Layout, float]:
    """An atlas for a lightmap of that side, a mesh for each part, and its texels to the metre,
    ``density`` at most."""
    before: tuple[float, int] | None = None
    meshes = []
    for faces in parts:
        used, index = np.unique(triangles[faces], return_inverse=True)
        meshes.append((points[used], index.reshape(-1, 3).astype(np.uint32)))
    for _ in range(_TRIES):
        packed = pack(meshes, density, padding)
        got = max(packed.width, packed.height)
        if got <= side:
            break
        less = _AIM * side / got * density
        if before is not None and before[1] > got:
            # The edges of charts have a width of their own: the side is nearly linear in density.
            slope = (before[1] - got) / (before[0] - density)
            less = min(less, density - (got - _AIM * side) / slope)
        before = density, got
        density = max(less, _STEP * density)
    texel, chart = np.zeros((len(triangles), 3, 2)), np.zeros(len(triangles), np.int64)
    charts = 0
    for faces, uv, index in zip(parts, packed.uv, packed.index, strict=True):
        texel[faces] = uv.astype(np.float64)[index] * [packed.width, packed.height]
        chart[faces] = charts + connect(len(uv), index)[index[:, 0]]
        charts += len(uv)
    return _Layout(texel, chart, got), density


def _longest(packed: _Layout) -> float:
    """The longest side of the box of a chart, texels."""
    _, chart = np.unique(packed.chart, return_inverse=True)
    low, high = (np.full((int(chart.max()) + 1, 2), end) for end in (np.inf, -np.inf))
    np.minimum.at(low, chart, packed.texel.min(axis=1))
    np.maximum.at(high, chart, packed.texel.max(axis=1))
    return float((high - low).max())


@kernel
def cover(uv: Floats, size: int) -> NDArray[np.int32]:
    """(size, size) the first face that holds the centre of each texel, rows from the top; -1 for
    none. ``uv`` is (T, 3, 2), from the lower left."""
    owner = np.full((size, size), -1, np.int32)
    for t in range(len(uv)):
        ax, ay = uv[t, 0, 0] * size, (1 - uv[t, 0, 1]) * size
        bx, by = uv[t, 1, 0] * size, (1 - uv[t, 1, 1]) * size
        cx, cy = uv[t, 2, 0] * size, (1 - uv[t, 2, 1]) * size
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0:
            continue
        first_column = max(0, int(np.ceil(min(ax, bx, cx) - 0.5)))
        last_column = min(size - 1, int(np.floor(max(ax, bx, cx) - 0.5)))
        first_row = max(0, int(np.ceil(min(ay, by, cy) - 0.5)))
        last_row = min(size - 1, int(np.floor(max(ay, by, cy) - 0.5)))
        for row in range(first_row, last_row + 1):
            y = row + 0.5
            for column in range(first_column, last_column + 1):
                x = column + 0.5
                u = ((bx - x) * (cy - y) - (by - y) * (cx - x)) / area
                v = ((cx - x) * (ay - y) - (cy - y) * (ax - x)) / area
                if u >= 0 and v >= 0 and u + v <= 1 and owner[row, column] < 0:
                    owner[row, column] = t
    return owner


@kernel
def claim(uv: Floats, owner: NDArray[np.int32]) -> NDArray[np.int32]:
    """(size, size) as `cover`; a texel whose centre no face holds belongs to the nearest face with
    a point less than a texel away along both axes, which reads it with bilinear filtering. So a
    face thinner than a texel has texels, too."""
    size = len(owner)
    claimed = owner.copy()
    near = np.full((size, size), np.inf)
    x, y = np.empty(3), np.empty(3)
    for t in range(len(uv)):
        for k in range(3):
            x[k], y[k] = uv[t, k, 0] * size - 0.5, (1 - uv[t, k, 1]) * size - 0.5
        first_column, last_column = (
            max(0, int(np.ceil(x.min() - 1))),
            min(size - 1, int(x.max() + 1)),
        )
        first_row, last_row = max(0, int(np.ceil(y.min() - 1))), min(size - 1, int(y.max() + 1))
        for row in range(first_row, last_row + 1):
            for column in range(first_column, last_column + 1):
                if owner[row, column] >= 0:
                    continue
                least = np.inf
                apart = not (x.min() < column + 1 and x.max() > column - 1)
                apart = apart or not (y.min() < row + 1 and y.max() > row - 1)
                for k in range(3):
                    across, down = x[(k + 1) % 3] - x[k], y[(k + 1) % 3] - y[k]
                    # Along the normal of a side: the face, and the square that reads the texel.
                    low = high = 0.0
                    for j in range(3):
                        distance = down * (x[j] - x[k]) - across * (y[j] - y[k])
                        low, high = min(low, distance), max(high, distance)
                    offset = down * (column - x[k]) - across * (row - y[k])
                    wide = abs(across) + abs(down)
                    apart = apart or (wide > 0 and (offset + wide <= low or offset - wide >= high))
                    long = across * across + down * down
                    share = 0.0
                    if long > 0:
                        share = ((column - x[k]) * across + (row - y[k]) * down) / long
                        share = min(1.0, max(0.0, share))
                    aside, above = x[k] + share * across - column, y[k] + share * down - row
                    least = min(least, aside * aside + above * above)
                if not apart and least < near[row, column]:
                    near[row, column], claimed[row, column] = least, t
    return claimed


def coordinates(uv: Floats, at: Floats) -> Floats:
    """(n, 3) barycentric coordinates of (n, 2) places in the planes of (n, 3, 2) triangles; of
    triangles without area some outside of them."""
    a, b, c = np.moveaxis(uv, 1, 0)
    area = _cross(b - a, c - a)
    second, third = (
        np.divide(part, area, out=np.full(len(at), -1.0), where=area != 0)
        for part in (_cross(at - a, c - a), _cross(b - a, at - a))
    )
    return np.stack([1 - second - third, second, third], axis=1)


def nearest(uv: Floats, at: Floats) -> Floats:
    """(n, 3) barycentric coordinates of the points of (n, 3, 2) triangles nearest to (n, 2)
    places."""
    result = coordinates(uv, at)
    outside = np.flatnonzero((result < 0).any(axis=1))
    best = np.full(len(outside), np.inf)
    for k in range(3):
        start, end = uv[outside, k], uv[outside, (k + 1) % 3]
        way, place = end - start, at[outside]
        long = np.einsum("nx,nx->n", way, way)
        along = np.einsum("nx,nx->n", place - start, way)
        along = np.clip(np.divide(along, long, out=np.zeros_like(long), where=long > 0), 0, 1)
        distance = np.linalg.norm(start + along[:, None] * way - place, axis=1)
        nearer = distance < best
        rows = outside[nearer]
        best[nearer], result[rows] = distance[nearer], 0.0
        result[rows, k], result[rows, (k + 1) % 3] = 1 - along[nearer], along[nearer]
    return result


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
