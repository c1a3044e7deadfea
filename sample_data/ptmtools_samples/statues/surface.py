"""Meshes an implicit solid: a closed manifold surface of triangles of even size.

Marching tetrahedra on a body-centred cubic lattice, whose tetrahedra are congruent: each
tetrahedron with corners inside and outside gives one or two triangles. Neighbours share the
vertices on their common edges, so the surface is closed and each edge has two triangles, for any
function. Tangential smoothing then moves vertices towards the centroid of their neighbours, and
Newton's method projects them back onto the surface, which removes slivers.

The function is evaluated only near the surface: a block lies on one side if the distance at its
centre exceeds `MAX_GRADIENT` times the distance to its corners.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from ptmtools_samples.statues.fields import Points, Values

Field = Callable[[Points], Values]
Ints = NDArray[np.int64]

#: Points per evaluation of the function.
BATCH = 1 << 13
#: Cubes along the side of a block; maximum gradient of the function.
BLOCK, MAX_GRADIENT = 4, 2.2
#: Tolerance of the number of triangles, as a share; maximum number of attempts.
TOLERANCE, TRIES = 0.07, 5
#: Smoothing: iterations, step as a share of the way, and maximum step as a share of a cube.
SMOOTHING_STEPS, STEP_SHARE, MAX_STEP = 3, 0.6, 0.25
#: Distance of gradient samples as a share of a cube: keeps points from jumping across sharp edges.
GRADIENT_STEP = 0.3


def evaluate(field: Field, p: Points) -> Values:
    """Evaluates the function at (3, n) points in batches, on all processors."""
    parts = [p[:, first : first + BATCH] for first in range(0, p.shape[1], BATCH)]
    if not parts:
        return np.zeros(0)
    with ThreadPoolExecutor(os.cpu_count()) as threads:
        return np.concatenate(list(threads.map(field, parts)))


def mesh(
    field: Field, low: tuple[float, ...], high: tuple[float, ...], triangles: int
) -> tuple[Values, Ints]:
    """Returns (P, 3) points and (T, 3) triangles, approximately ``triangles``, of the solid in a
    box."""
    extent = np.array(high) - np.array(low)
    cube = float(extent.max()) / 40
    best: tuple[Values, Ints, float] | None = None
    for _ in range(TRIES):
        points, actual = _march(field, np.array(low), extent, cube)
        if best is None or abs(len(actual) - triangles) < abs(len(best[1]) - triangles):
            best = points, actual, cube
        if abs(len(actual) - triangles) <= TOLERANCE * triangles:
            break
        cube *= (len(actual) / triangles) ** 0.5
    assert best is not None
    points, actual = _main_part(*best[:2])
    return _slid(field, points, actual, best[2]), actual


def _main_part(points: Values, triangles: Ints) -> tuple[Values, Ints]:
    """Returns the largest connected component; drops the others."""
    label = np.arange(len(points))
    while True:
        parent = np.arange(len(points))
        least = label[triangles].min(axis=1)
        for k in range(3):
            np.minimum.at(parent, label[triangles[:, k]], least)
        if np.array_equal(parent[label], label):
            break
        while not np.array_equal(parent, above := parent[parent]):
            parent = above
        label = parent[label]
    kept = label == np.argmax(np.bincount(label))
    number = np.cumsum(kept) - 1
    return points[kept], number[triangles[kept[triangles[:, 0]]]]


def _march(field: Field, low: Values, extent: Values, cube: float) -> tuple[Values, Ints]:
    blocks = np.ceil((extent + 2 * cube) / (cube * BLOCK)).astype(np.int64)
    count = blocks * BLOCK
    low = low - (count * cube - extent) / 2
    corner, middle = _values(field, low, cube, blocks)
    inside = (corner < 0, middle < 0)
    first = int(np.prod(count + 1))

    def number(at: Ints) -> Ints:
        """Of corners (n, 3), in the lattice of all corners and then all middles."""
        return np.asarray((at[:, 0] * (count[1] + 1) + at[:, 1]) * (count[2] + 1) + at[:, 2])

    def middle_number(at: Ints) -> Ints:
        return np.asarray(first + (at[:, 0] * count[1] + at[:, 1]) * count[2] + at[:, 2])

    value = np.concatenate([corner.ravel(), middle.ravel()])
    ends = []
    for tetrahedra in _tetrahedra(inside, number, middle_number):
        mask = (value[tetrahedra] < 0) @ np.array([1, 2, 4, 8])
        for case, rows in CASES.items():
            chosen = tetrahedra[mask == case]
            ends += [chosen[:, np.array(row)] for row in rows]
    edge = np.concatenate(ends).reshape(-1, 2)
    edge.sort(axis=1)
    key, triangles = np.unique(edge[:, 0] * len(value) + edge[:, 1], return_inverse=True)
    a, b = np.divmod(key, len(value))
    share = value[a] / (value[a] - value[b])
    share = np.clip(share, 0.1, 0.9)[:, None]
    pa, pb = (_places(ids, first, count, low, cube) for ids in (a, b))
    return pa + share * (pb - pa), triangles.reshape(-1, 3)


def _places(ids: Ints, first: int, count: Ints, low: Values, cube: float) -> Values:
    of_corner = np.stack(np.unravel_index(np.minimum(ids, first - 1), count + 1), axis=1)
    of_middle = np.stack(np.unravel_index(np.maximum(ids - first, 0), count), axis=1) + 0.5
    at = np.where((ids < first)[:, None], of_corner, of_middle)
    return np.asarray(low + at * cube)


def _values(field: Field, low: Values, cube: float, blocks: Ints) -> tuple[Values, Values]:
    """Evaluates the function at the corners and centres of all cubes; border values are outside."""
    side = BLOCK * cube
    at = np.stack(list(np.indices(blocks.tolist())), axis=-1).reshape(-1, 3)
    centre = evaluate(field, (low + (at + 0.5) * side).T)
    near = at[np.abs(centre) < MAX_GRADIENT * side * 3**0.5 / 2] * BLOCK
    whole = centre.reshape(blocks)
    for axis in range(3):
        whole = np.repeat(whole, BLOCK, axis=axis)
    middle = whole.copy()
    corner = np.pad(whole, ((0, 1),) * 3, mode="edge")
    for array, offset, size in ((middle, 0.5, BLOCK), (corner, 0.0, BLOCK + 1)):
        steps = np.stack(list(np.indices((size,) * 3)), axis=-1).reshape(-1, 3)
        asked = np.zeros(array.shape, dtype=bool)
        near_lattice = (near[:, None] + steps).reshape(-1, 3)
        asked[tuple(near_lattice.T)] = True
        near_lattice = np.argwhere(asked)
        array[asked] = evaluate(field, (low + (near_lattice + offset) * cube).T)
    for axis in range(3):
        for end in (0, -1):
            edge: list[int | slice] = [slice(None)] * 3
            edge[axis] = end
            corner[tuple(edge)] = np.maximum(np.abs(corner[tuple(edge)]), 1e-9)
            middle[tuple(edge)] = np.maximum(np.abs(middle[tuple(edge)]), 1e-9)
    return corner, middle


def _tetrahedra(
    inside: tuple[NDArray[np.bool_], NDArray[np.bool_]],
    number: Callable[[Ints], Ints],
    middle_number: Callable[[Ints], Ints],
) -> Iterator[Ints]:
    """(n, 4) lattice points of the tetrahedra that may cross the surface: the centres of two
    adjacent cubes, and two adjacent corners of their common face."""
    corner, middle = inside
    for axis in range(3):
        second_axis, third_axis = (axis + 1) % 3, (axis + 2) % 3
        shape = np.array(middle.shape)
        shape[axis] -= 1

        def part(array: NDArray[np.bool_], offset: Ints, shape: Ints = shape) -> Ints:
            return array[tuple(slice(o, o + n) for o, n in zip(offset, shape, strict=True))] * 1

        along, across, up = (np.eye(3, dtype=np.int64)[k] for k in (axis, second_axis, third_axis))
        zero = np.zeros(3, dtype=np.int64)
        around = [along, along + across, along + across + up, along + up]
        total = part(middle, zero) + part(middle, along)
        for offset in around:
            total = total + part(corner, offset)
        at = np.argwhere((total > 0) & (total < 6))
        a, b = middle_number(at), middle_number(at + along)
        for k in range(4):
            p, q = number(at + around[k]), number(at + around[(k + 1) % 4])
            yield np.stack([a, b, p, q], axis=1)


def _cases() -> dict[int, list[list[list[int]]]]:
    """Returns, for each set of corners inside, outward triangles as triples of edges."""
    # Centres along x and corners around it, see `_tetrahedra`; the same for every axis.
    place = np.array([[-0.5, 0, 0], [0.5, 0, 0], [0, -0.5, -0.5], [0, 0.5, -0.5]])
    cases = {}
    for mask in range(1, 15):
        within = [k for k in range(4) if mask >> k & 1]
        without = [k for k in range(4) if not mask >> k & 1]
        edges = [[a, b] for a in within for b in without]
        if len(edges) == 4:  # a0, a1, b0, b1 around in order
            edges = [edges[0], edges[1], edges[3], edges[2]]
        middles = np.array([(place[a] + place[b]) / 2 for a, b in edges])
        normal = np.cross(middles[1] - middles[0], middles[2] - middles[0])
        if normal @ (place[without].mean(axis=0) - place[within].mean(axis=0)) < 0:
            edges.reverse()
        cases[mask] = [[edges[0], edges[k], edges[k + 1]] for k in range(1, len(edges) - 1)]
    return cases


CASES = _cases()


def _gradient(field: Field, p: Values, step: float) -> tuple[Values, Values]:
    """Returns the function and its gradient at (n, 3) points, by differences at four points."""
    ways = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=np.float64)
    asked = np.concatenate([p + step * way for way in ways]).T
    values = evaluate(field, np.ascontiguousarray(asked)).reshape(4, -1)
    gradient = np.stack(
        [(values[0] + ways[1, k] * values[1] + ways[2, k] * values[2] + ways[3, k] * values[3])
         for k in range(3)], axis=1) / (4 * step)  # fmt: skip
    return (values[0] + values[1] + values[2] + values[3]) / 4, gradient


def _slid(field: Field, points: Values, triangles: Ints, cube: float) -> Values:
    a, b = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]).T
    count = np.bincount(a, minlength=len(points))[:, None]
    for share in (*[STEP_SHARE] * SMOOTHING_STEPS, 0.0):
        value, gradient = _gradient(field, points, GRADIENT_STEP * cube)
        square = (gradient[:, 0] ** 2 + gradient[:, 1] ** 2 + gradient[:, 2] ** 2)[:, None]
        square = np.maximum(square, 1e-6)
        means = np.stack(
            [np.bincount(a, points[b, k], len(points)) for k in range(3)], axis=1
        ) / np.maximum(count, 1)
        way = share * (means - points)
        dot = way[:, 0] * gradient[:, 0] + way[:, 1] * gradient[:, 1] + way[:, 2] * gradient[:, 2]
        way -= gradient * dot[:, None] / square
        way -= gradient * value[:, None] / square
        length = np.sqrt(way[:, 0] ** 2 + way[:, 1] ** 2 + way[:, 2] ** 2)[:, None]
        points = points + way * np.minimum(1.0, MAX_STEP * cube / np.maximum(length, 1e-12))
    return points
