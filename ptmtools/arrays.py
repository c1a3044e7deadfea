"""Short names of array types by their elements.

Products of vectors, and the triangles and tetrahedra that they span; gaps of images."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Ints = NDArray[np.int64]
Bits = NDArray[np.uint64]
Bools = NDArray[np.bool_]


def cross(a: Floats, b: Floats) -> Floats:
    """The cross product of (…, 3) vectors. `numpy.cross` spends four fifths of its time for a few
    of them on the axes that it supports."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    result = np.empty(np.broadcast_shapes(a.shape, b.shape))
    result[..., 0] = ay * bz - az * by
    result[..., 1] = az * bx - ax * bz
    result[..., 2] = ax * by - ay * bx
    return result


def normals(corners: Floats) -> Floats:
    """(n, 3) vectors perpendicular to (n, 3, 3) triangles, twice as long as these are large."""
    return cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def units(vectors: Floats) -> Floats:
    """(..., 3) vectors of length 1, or 0 where that is 0."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0))


def polygon_planes(
    start_point: Floats, following: Floats, start: Ints, thinnest: float
) -> tuple[Floats, Bools]:
    """The planes of polygons, (k, 4) unit normals and offsets, and (k,) whether each is sound:
    thicker than ``thinnest``, metres. The normal of a sliver is arbitrary, and not of length 1.

    ``start_point``, ``following``: (n, 3) ends of their edges; ``start``: (k,) the first of each.
    """
    size = np.diff([*start, len(start_point)])
    first = np.repeat(start_point[start], size, axis=0)
    normal = np.add.reduceat(cross(start_point - first, following - first), start, axis=0)
    longest = np.maximum.reduceat(np.linalg.norm(following - start_point, axis=1), start)
    twice_area = np.linalg.norm(normal, axis=1)
    sound = twice_area > 2 * thinnest * longest
    normal /= np.where(sound, twice_area, 1.0)[:, None]
    middle = np.add.reduceat(start_point, start, axis=0) / size[:, None]
    return np.column_stack([normal, -np.einsum("ij,ij->i", normal, middle)]), sound


def areas(corners: Floats) -> Floats:
    """(n,) areas of (n, 3, 3) triangles, m²."""
    return np.asarray(np.linalg.norm(normals(corners), axis=1) / 2)


def plane_areas(uv: Floats) -> Floats:
    """(n,) the areas of (n, 3, 2) triangles."""
    first, second = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    return np.asarray(np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / 2)


def volumes(corners: Floats) -> Floats:
    """(n,) volumes of (n, 4, 3) tetrahedra, m³."""
    a, b, c = (corners[:, 1:] - corners[:, :1]).transpose(1, 0, 2)
    return np.asarray(np.abs(np.einsum("ij,ij->i", a, cross(b, c))) / 6)


def sum_by_group(group: NDArray[np.integer], weights: NDArray[Any], count: int) -> Floats:
    """(count,) the sum of the (n,) weights of each group."""
    return np.asarray(np.bincount(group, weights, count), dtype=np.float64)


def fans(start: Ints) -> tuple[Ints, Ints]:
    """(m, 3) corners, by row, of the triangles that fan out from the first corner of each polygon
    of the CSR ``start``, and (m,) the polygon of each."""
    size = np.maximum(np.diff(start) - 2, 0)
    polygon = np.repeat(np.arange(len(size)), size)
    second = ranges(start[:-1] + 1, size)
    return np.stack([start[polygon], second, second + 1], axis=1), polygon


def ranges(first: Ints, count: Ints) -> Ints:
    """(m,) of each of the (n,) rows ``first``, and as many after it as to make ``count``."""
    return np.repeat(first - (np.cumsum(count) - count), count) + np.arange(int(count.sum()))


def fill_gaps(value: NDArray[Any], weight: NDArray[Any]) -> NDArray[Any]:
    """(h, w, k) values, those of (h, w) weight 0 from nearby ones, by a pyramid of weighted means;
    1 if all weights are 0."""
    if weight.all() or not weight.any():
        return value if weight.all() else np.ones_like(value)
    total = _sums(weight.astype(np.float32))
    mean = np.empty((*total.shape, value.shape[2]), value.dtype)
    for k in range(value.shape[2]):
        sums = _sums(np.multiply(value[..., k], weight, dtype=np.float32))
        np.divide(sums, total, out=sums, where=total > 0)
        mean[..., k] = sums if value.dtype.kind == "f" else np.rint(sums)
    coarse = fill_gaps(mean, total).repeat(2, axis=0).repeat(2, axis=1)
    height, width = weight.shape
    return np.asarray(np.where(weight[..., None] > 0, value, coarse[:height, :width]))


def _sums(values: Singles) -> Singles:
    """Of 2 × 2 values, in one order on all machines; a last odd row or column has no others."""
    even = np.pad(values, [(0, side % 2) for side in values.shape])
    return (even[::2, ::2] + even[::2, 1::2]) + (even[1::2, ::2] + even[1::2, 1::2])
