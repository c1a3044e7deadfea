"""The octree of samples of a normal field, and its texels (paper 2, §3.1 and §3.2).

A node is divided while its samples deviate from their mean by more than the bound, as a root mean
square, and it has `ENOUGH` samples or its normals cancel out (docs/design/apo.md).

All steps work level by level on whole arrays. The Morton code of a node interleaves the bits of its
place in the `Cube`: three bits a level, x the lowest, the root's level first. Samples are sorted by
their codes, so a subtree is a range of them, and its sums are differences of running sums.

`octree_of` encodes the nodes as texels, and `fault_of` checks them (docs/formats/apo.md).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, Singles
from ptmtools.errors import LimitError
from ptmtools_systems.apo.model import ADDRESS_BITS, Octree

#: Relative margin of the cube, so that points stay inside after rounding to float32.
MARGIN = 2.0**-12

#: Shifts and masks that insert two zero bits after each of 21.
_SPREAD = (
    (32, 0x1F00000000FFFF),
    (16, 0x1F0000FF0000FF),
    (8, 0x100F00F00F00F00F),
    (4, 0x10C30C30C30C30C3),
    (2, 0x1249249249249249),
)

Codes = NDArray[np.uint64]


@dataclass(frozen=True)
class Cube:
    """Corner (3,) and side of a cube, in the units of the mesh."""

    low: Floats
    side: float

    def coordinates(self, points: Floats) -> Floats:
        """(n, 3) points in the coordinates of the cube, 0 to less than 1."""
        last = np.nextafter(1.0, 0.0)
        result: Floats = np.clip((points - self.low) / self.side, 0.0, last)
        return result


def cube_around(points: Floats) -> Cube:
    """The cube around (n, 3) points, which are not all equal."""
    low, high = points.min(axis=0), points.max(axis=0)
    side = float((high - low).max()) * (1 + MARGIN)
    return Cube((low + high) / 2 - side / 2, side)


def codes_of(q: Floats, depth: int) -> Codes:
    """(n,) codes of the nodes of a depth, up to 20, that contain (n, 3) points of the cube."""
    place = (q * float(1 << depth)).astype(np.uint64)
    x, y, z = (_spread(place[:, k]) for k in range(3))
    result: Codes = x | y << np.uint64(1) | z << np.uint64(2)
    return result


def _spread(value: Codes) -> Codes:
    for shift, mask in _SPREAD:
        value = (value | value << np.uint64(shift)) & np.uint64(mask)
    return value


#: Least samples of a node to divide.
ENOUGH = 8


@dataclass(frozen=True)
class Bounds:
    """Largest deviation of the samples of a leaf; see `ApoOptions`."""

    error: float
    color_error: float
    depth: int


@dataclass(frozen=True)
class Samples:
    """Samples, or groups of them, sorted by their codes.

    Attributes
    ----------
    code: (n,) codes of their nodes of a depth.
    count: (n,) number of samples of each.
    value: (n, k) sums of unit normals, and with k = 6 of colours, 0 to 1.
    square: (n,) sums of the squares of colours; 0 without.
    """

    code: Codes
    count: Ints
    value: Floats
    square: Floats


@dataclass(frozen=True)
class OctreeLevel:
    """The nodes of a level, in the order of their codes.

    Attributes
    ----------
    code: (m,). value: (m, k) unit normals, and with k = 6 colours, 0 to 1.
    children: (m,) uint8, bit c for existing child c; 0 for leaves.
    """

    code: Codes
    value: Singles
    children: NDArray[np.uint8]


def divide(samples: Samples, top: int, bottom: int, bounds: Bounds) -> list[OctreeLevel]:
    """The levels ``top`` to ``bottom``, with every node of ``top`` that holds samples; the codes of
    these have the depth ``bottom``. Nodes of the last level have no children."""
    below = np.uint64(3 * (bottom - top))
    first = np.flatnonzero(np.diff(samples.code >> below, prepend=~np.uint64(0)))
    begin, end = first, np.append(first[1:], len(samples.code))
    total, count, square = (_running(v) for v in (samples.value, samples.count, samples.square))
    levels: list[OctreeLevel] = []
    for depth in range(top, bottom + 1):
        n, sums = count[end] - count[begin], total[end] - total[begin]
        code = samples.code[begin] >> np.uint64(3 * (bottom - depth))
        parted = np.zeros(len(begin), dtype=bool)
        if depth < bottom:
            parted = _deviates(n, sums, square[end] - square[begin], bounds)
            opposed = 2 * np.linalg.norm(sums[:, :3], axis=1) < n
            parted &= (n >= ENOUGH) | (opposed & (n > 1))
        children = np.zeros(len(begin), np.uint8)
        edges = _edges(samples.code, code[parted], begin[parted], end[parted], bottom - depth)
        occupied = edges[:, 1:] > edges[:, :-1]
        children[parted] = np.packbits(occupied, axis=1, bitorder="little")[:, 0]
        levels.append(OctreeLevel(code, _means(sums, n), children))
        begin, end = edges[:, :-1][occupied], edges[:, 1:][occupied]
        if not len(begin):
            break
    return levels


def average_levels(levels: list[OctreeLevel]) -> list[OctreeLevel]:
    """The levels with each inner node the mean of its children (paper 2, §3.1), normals scaled to
    length 1; from the deepest level up."""
    result = [levels[-1]] if levels else []
    for level in reversed(levels[:-1]):
        inner = level.children > 0
        child_count = popcount(level.children[inner])
        first = np.cumsum(child_count) - child_count
        value = level.value.copy()
        if inner.any():
            below = np.add.reduceat(result[0].value.astype(np.float64), first, axis=0)
            value[inner] = _means(below, child_count, otherwise=level.value[inner])
        result.insert(0, OctreeLevel(level.code, value, level.children))
    return result


def prune(levels: list[OctreeLevel], kept: Codes) -> list[OctreeLevel]:
    """The parts of levels below the nodes ``kept``, sorted, of the first one."""
    result = []
    for k, level in enumerate(levels):
        root = level.code >> np.uint64(3 * k)
        at = np.minimum(np.searchsorted(kept, root), max(len(kept) - 1, 0))
        below = kept[at] == root if len(kept) else np.zeros(len(root), dtype=bool)
        result.append(OctreeLevel(level.code[below], level.value[below], level.children[below]))
    return result


def join_levels(parts: list[list[OctreeLevel]], width: int) -> list[OctreeLevel]:
    """Joins levels of parts that follow each other in the order of codes."""
    empty = OctreeLevel(
        np.zeros(0, np.uint64), np.zeros((0, width), np.float32), np.zeros(0, np.uint8)
    )
    rows = itertools.zip_longest(*parts, fillvalue=empty)
    return [OctreeLevel(*columns(row)) for row in rows]


def columns(rows: Sequence[OctreeLevel] | Sequence[Samples]) -> Iterator[NDArray[Any]]:
    """The joined arrays of records, attribute by attribute."""
    return map(np.concatenate, zip(*(vars(row).values() for row in rows), strict=True))


def popcount(bits: NDArray[np.uint8]) -> Ints:
    """(n,) number of set bits."""
    result: Ints = np.unpackbits(bits[:, None], axis=1).sum(axis=1, dtype=np.int64)
    return result


def _running(values: NDArray[np.generic]) -> NDArray[np.generic]:
    zero = np.zeros((1, *values.shape[1:]), values.dtype)
    return np.concatenate([zero, np.cumsum(values, axis=0)])


def _deviates(n: Ints, sums: Floats, square: Floats, bounds: Bounds) -> Bools:
    """(m,) which nodes exceed the bounds.

    The mean of ‖v − m‖² over unit vectors v is 2 − 2 |mean of v| for the unit vector m along it.
    """
    normal = np.linalg.norm(sums[:, :3], axis=1) / n
    result: Bools = 2 - 2 * normal > bounds.error**2
    if sums.shape[1] > 3:
        mean = sums[:, 3:] / n[:, None]
        result |= square / n - (mean**2).sum(axis=1) > bounds.color_error**2
    return result


def _means(sums: Floats, n: Ints, otherwise: Singles | None = None) -> Singles:
    """(m, k) means, normals of length 1; where normals cancel out, ``otherwise`` or up."""
    result = (sums / n[:, None]).astype(np.float32)
    length = np.linalg.norm(sums[:, :3], axis=1)
    some = length > 0
    up = np.array([0, 1, 0], np.float32) if otherwise is None else otherwise[~some, :3]
    result[~some, :3] = up
    result[some, :3] = sums[some, :3] / length[some, None]
    return result


def _edges(codes: Codes, node: Codes, begin: Ints, end: Ints, remaining: int) -> Ints:
    """(m, 9) boundaries of the samples of each child of nodes; ``remaining`` levels are below."""
    if not len(node):
        return np.zeros((0, 9), np.int64)
    shift = np.uint64(3 * (remaining - 1)) if remaining else np.uint64(0)
    children = np.arange(1, 8).astype(np.uint64)
    child = (node[:, None] << np.uint64(3)) + children
    inner = np.searchsorted(codes, child << shift)
    return np.concatenate([begin[:, None], inner, end[:, None]], axis=1)


_BYTE = np.array([1, 1 << 8, 1 << 16])


def normal_bytes(normal: Singles) -> NDArray[np.uint8]:
    """(n, 3) bytes of (n, 3) unit normals."""
    result: NDArray[np.uint8] = np.rint((normal / 2 + 0.5).clip(0, 1) * 255).astype(np.uint8)
    return result


def check_count(texels: int) -> None:
    """Raises LimitError PTM-L400 if ``texels`` exceeds the number of addresses."""
    if texels > 1 << ADDRESS_BITS:
        raise LimitError(
            "PTM-L400",
            f"the octree has {texels:,} texels, more than the {1 << ADDRESS_BITS:,} that addresses "
            f"of {ADDRESS_BITS} bits can tell apart",
            remedy="use a greater --error, a smaller --depth or a smaller --density",
        )


def octree_of(levels: list[OctreeLevel], cube: Cube) -> Octree:
    """The octree texture of levels, from the root on.

    Raises LimitError PTM-L400: too many texels.
    """
    inner = [level.children > 0 for level in levels]
    counts = [len(level.code) + int(some.sum()) for level, some in zip(levels, inner, strict=True)]
    start: Ints = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    check_count(int(start[-1]))
    colored = levels[0].value.shape[1] > 3
    texels = np.zeros((int(start[-1]), 4), np.uint8)
    colors = np.zeros_like(texels) if colored else None
    for k, level in enumerate(levels):
        at = start[k] + addresses(inner[k])
        texels[at, :3] = normal_bytes(level.value[:, :3])
        texels[at, 3] = level.children
        if colors is not None:
            colors[at, :3] = np.rint(level.value[:, 3:].clip(0, 1) * 255)
            colors[at, 3] = 255
        if inner[k].any():
            children = level.children[inner[k]]
            child_count = popcount(children)
            first = np.cumsum(child_count) - child_count
            below = inner[k + 1]
            address = start[k + 1] + addresses(below)[first]
            flags = np.zeros((len(children), 8), bool)
            flags[np.unpackbits(children[:, None], axis=1, bitorder="little") > 0] = below
            pointer = at[inner[k]] + 1
            texels[pointer, :3] = address[:, None] // _BYTE % 256
            texels[pointer, 3] = np.packbits(flags, axis=1, bitorder="little")[:, 0]
    return Octree(texels, start, cube.low, cube.side, colors)


def addresses(inner: NDArray[np.bool_]) -> Ints:
    """(n,) address of each node of a level, in texels from the level's first."""
    size = 1 + inner.astype(np.int64)
    result: Ints = np.cumsum(size) - size
    return result


def fault_of(octree: Octree) -> tuple[str, str] | None:
    """The first fault of an octree's texels as (place, problem), or None."""
    texels, start = octree.texels, octree.start
    inner = np.array([texels[0, 3] > 0])
    for k in range(octree.levels):
        at = start[k] + addresses(inner)
        end = int(at[-1]) + 1 + int(inner[-1])
        if end != start[k + 1]:
            return (
                f"level {k}",
                f"takes {end - start[k]} texels instead of {start[k + 1] - start[k]}",
            )
        if ((texels[at, 3] > 0) != inner).any():
            return f"level {k}", "a node is a leaf, but its parent marks it as an inner node"
        if not inner.any():
            last = k == octree.levels - 1
            return None if last else (f"level {k + 1}", "is below leaves only")
        children, pointer = texels[at[inner], 3], texels[at[inner] + 1]
        present, flags = (
            np.unpackbits(bits[:, None], axis=1, bitorder="little") > 0
            for bits in (children, pointer[:, 3])
        )
        if (flags & ~present).any():
            return f"level {k}", "a missing child is marked as an inner node"
        below = flags[present]
        child_count = popcount(children)
        first = start[k + 1] + addresses(below)[np.cumsum(child_count) - child_count]
        if (pointer[:, :3].astype(np.int64) @ _BYTE != first).any():
            return f"level {k}", "an address does not point to the first child"
        if k == octree.levels - 1:
            return f"level {k}", "has inner nodes, and there is no level below"
        inner = below
    return None
