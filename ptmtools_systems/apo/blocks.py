"""Builds the octree of normals from a mesh and its simplification (paper 2, §3.1).

The simplified mesh is sampled in blocks of the octree, each an independent task: memory stays
bounded and processors share the work. The result of a block does not depend on the worker. Blocks
begin at the depth of their cells; the levels above are divided by the sums of these.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ptmtools.arrays import Floats, Ints, Singles, areas
from ptmtools.executor import Executor
from ptmtools.progress import Progress, silent
from ptmtools_systems.apo.octree import (
    Bounds,
    Codes,
    OctreeLevel,
    Samples,
    average_levels,
    check_count,
    codes_of,
    columns,
    divide,
    join_levels,
    prune,
)
from ptmtools_systems.apo.sampling import Points, Source, interpolate, nearest, spread

#: Depths of the cells of blocks: 1/16 of the cube wide, or 1/1024 where a block would be too large.
DEPTHS = (4, 10)
#: Samples of a block, unless a single cell has more.
MOST = 1 << 19


@dataclass(frozen=True)
class Surface:
    """The sampled surface, in the cube.

    Attributes
    ----------
    corner, normal: (m, 3, 3) float64 corners, and their unit normals, of triangles.
    """

    corner: Floats
    normal: Floats

    def cut_up(self, longest: float) -> Surface:
        """The surface with triangles cut until no edge is longer than ``longest``."""
        corner, normal, done = self.corner, self.normal, []
        while len(corner):
            edges = np.linalg.norm(np.roll(corner, -1, axis=1) - corner, axis=2)
            large = edges.max(axis=1) > longest
            done.append((corner[~large], normal[~large]))
            side = edges[large].argmax(axis=1)
            corner, normal = (_halve(values[large], side) for values in (corner, normal))
        return Surface(*(np.concatenate(part) for part in zip(*done, strict=True)))


@dataclass(frozen=True)
class BlockSource:
    """Data shared by all blocks.

    Attributes
    ----------
    source, surface: the source of normals, and the sampled surface. spacing: distance of samples.
    bounds: bounds of the leaves. top: depth of the cells.
    """

    source: Source
    surface: Surface
    spacing: float
    bounds: Bounds
    top: int = 0


@dataclass(frozen=True)
class Block:
    """A range of cells, and the triangles that have samples in it."""

    first: int
    last: int
    triangles: Ints


@dataclass(frozen=True)
class BlockLevels:
    """The part of the octree in a block.

    Attributes
    ----------
    levels: levels from the cells down. cells: sums of each cell, as samples of the depth of the
        cells.
    missed: samples whose rays do not hit the source.
    """

    levels: list[OctreeLevel]
    cells: Samples
    missed: int


def build(
    work: BlockSource, executor: Executor, progress: Progress = silent
) -> tuple[list[OctreeLevel], float]:
    """The levels of the octree, from the root on, and the share of samples whose rays do not hit
    the source; these have the normals of the simplified mesh.

    Raises LimitError PTM-L400: too many texels.
    """
    work, blocks = divide_work(work)
    results, texels = [], 0
    for done, block in enumerate(executor.each(_block, work, blocks)):
        progress(done, len(blocks), "casting rays")
        results.append(block)
        texels += texel_count(block.levels)
        check_count(texels)
    progress(len(blocks), len(blocks), "casting rays")
    cells = Samples(*columns([block.cells for block in results]))
    width = cells.value.shape[1]
    # Cells are divided by their own samples, independently of the levels above.
    above = divide(cells, 0, work.top, work.bounds)
    kept = above[work.top].code if len(above) > work.top else np.zeros(0, np.uint64)
    below = join_levels([prune(block.levels, kept) for block in results], width)
    levels = [*above[: work.top], *(level for level in below if len(level.code))]
    total = int(cells.count.sum())
    return average_levels(levels), sum(block.missed for block in results) / max(total, 1)


def _halve(values: Floats, side: Ints) -> Floats:
    """(2m, 3, 3) corner values of the halves of triangles, cut in the middle of the edges ``side``;
    0 is the first corner's edge."""
    triangle = np.arange(len(values))
    a, b, c = (values[triangle, (side + k) % 3] for k in range(3))
    middle = (a + b) / 2
    result: Floats = np.stack([a, middle, c, middle, b, c], axis=1).reshape(-1, 3, 3)
    return result


def divide_work(work: BlockSource) -> tuple[BlockSource, list[Block]]:
    """The work with cells that are small enough, and its blocks."""
    for depth in DEPTHS:
        work = replace(work, top=min(depth, work.bounds.depth))
        pairs, samples = _count_samples(work)
        cells, place = np.unique(pairs[:, 1], return_inverse=True)
        counts = np.bincount(place, samples, len(cells))
        if counts.max() <= MOST:
            break
    # Runs of cells with about equal numbers of samples.
    first = np.flatnonzero(np.diff(np.cumsum(counts) // MOST, prepend=-1))
    begin = cells[first]
    end = np.append(begin[1:], cells[-1] + 1)
    order = np.argsort(pairs[:, 1], kind="stable")
    triangle, cell = pairs[order].T
    low, high = np.searchsorted(cell, begin), np.searchsorted(cell, end)
    return work, [
        Block(int(a), int(b), np.unique(triangle[i:j]))
        for a, b, i, j in zip(begin, end, low, high, strict=True)
    ]


def _count_samples(work: BlockSource) -> tuple[Ints, Ints]:
    """(p, 2) pairs of a triangle and the code of a cell with samples of it, and (p,) the number of
    samples."""
    corner, bits = work.surface.corner, 3 * work.top
    pairs, counts = [], []
    for chosen in _batches(corner, work.spacing):
        points = spread(corner[chosen], work.spacing)
        code = codes_of(interpolate(corner[chosen], points), work.top).astype(np.int64)
        both, count = np.unique(chosen[points.triangle] << bits | code, return_counts=True)
        pairs.append(np.stack([both >> bits, both & ((1 << bits) - 1)], axis=1))
        counts.append(count)
    return np.concatenate(pairs), np.concatenate(counts)


def _batches(corner: Floats, spacing: float) -> Iterator[Ints]:
    """Runs of triangles with about `MOST` samples; thin triangles have those of a row."""
    edges = np.linalg.norm(np.roll(corner, -1, axis=1) - corner, axis=2)
    samples = np.maximum(areas(corner) / spacing**2, edges.max(axis=1) / spacing) + 1
    run = (np.cumsum(samples) // MOST).astype(np.int64)
    yield from np.split(np.arange(len(corner)), np.flatnonzero(np.diff(run)) + 1)


def _block(work: BlockSource, block: Block) -> BlockLevels:
    corner, normal = (v[block.triangles] for v in (work.surface.corner, work.surface.normal))
    points = spread(corner, work.spacing)
    q = interpolate(corner, points)
    code = codes_of(q, work.bounds.depth)
    cell = (code >> np.uint64(3 * (work.bounds.depth - work.top))).astype(np.int64)
    inner = np.flatnonzero((cell >= block.first) & (cell < block.last))
    inner = inner[np.argsort(code[inner], kind="stable")]
    code, q = code[inner], q[inner]
    direction = _unit(interpolate(normal, Points(points.triangle[inner], points.weight[inner])))
    hits = nearest(work.source, q, direction)
    value = _values(work, hits.triangle, hits.weight, direction)
    square = (value[:, 3:] ** 2).sum(axis=1)
    ones = np.ones(len(code), np.int64)
    samples = Samples(code, ones, value, square)
    levels = divide(samples, work.top, work.bounds.depth, work.bounds)
    return BlockLevels(levels, _sum_by_cell(samples, work), int((hits.triangle < 0).sum()))


def _values(work: BlockSource, triangle: Ints, weight: Singles, direction: Floats) -> Floats:
    """(n, k) unit normals and colours of the source; without a hit the mesh's own normal and
    mid-grey."""
    hit, source = triangle >= 0, work.source
    result = np.full((len(triangle), 6 if source.paint else 3), 0.5)
    result[:, :3] = direction
    hit_triangle, share = triangle[hit], weight[hit].astype(np.float64)
    normal = np.einsum("ij,ijk->ik", share, source.normals[hit_triangle].astype(np.float64))
    result[hit, :3] = _unit(normal, direction[hit])
    if source.paint:
        result[hit, 3:] = source.paint.colors(hit_triangle, share)
    return result


def _unit(vectors: Floats, otherwise: Floats | None = None) -> Floats:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    fallback = np.array([0.0, 1.0, 0.0]) if otherwise is None else otherwise
    result: Floats = np.where(length > 0, vectors / np.where(length > 0, length, 1), fallback)
    return result


def _sum_by_cell(samples: Samples, work: BlockSource) -> Samples:
    """The sums of the samples of each cell."""
    cell: Codes = samples.code >> np.uint64(3 * (work.bounds.depth - work.top))
    first = np.flatnonzero(np.diff(cell, prepend=~np.uint64(0)))
    if not len(first):
        return samples
    return Samples(
        cell[first],
        np.add.reduceat(samples.count, first),
        np.add.reduceat(samples.value, first, axis=0),
        np.add.reduceat(samples.square, first),
    )


def texel_count(levels: list[OctreeLevel]) -> int:
    """Number of texels of an octree."""
    return sum(len(level.code) + int((level.children > 0).sum()) for level in levels)
