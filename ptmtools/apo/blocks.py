"""From a mesh and its simplification to the octree of its normals (paper 2, §3.1).

The simplified mesh is sampled in blocks of the octree, each a task that needs no other: so memory
stays bounded and processors share the work. What a block holds does not depend on who does it.
Blocks begin at a fixed depth; the levels above are divided by the sums of the cells there.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ptmtools.apo.casting import Source, nearest
from ptmtools.apo.cube import Codes, codes_of
from ptmtools.apo.octree import (
    Bounds,
    Level,
    Samples,
    averaged,
    divide,
    joined,
    pruned,
)
from ptmtools.apo.sampling import Points, areas, at, spread
from ptmtools.apo.texels import check_count
from ptmtools.arrays import Floats, Ints, Singles
from ptmtools.executors import Executor
from ptmtools.progress import Progress, silent

#: Depth of the cells that blocks are made of: 1/16 of the cube wide.
CELLS = 4
#: Samples of a block, unless a single cell has more.
MOST = 1 << 19


@dataclass(frozen=True)
class Surface:
    """What is sampled, in the cube.

    Attributes
    ----------
    corner, normal: (m, 3, 3) float64 corners, and their unit normals, of triangles.
    """

    corner: Floats
    normal: Floats

    def cut_up(self, longest: float) -> Surface:
        """The same of triangles none of whose edges is longer."""
        corner, normal, done = self.corner, self.normal, []
        while len(corner):
            edges = np.linalg.norm(np.roll(corner, -1, axis=1) - corner, axis=2)
            large = edges.max(axis=1) > longest
            done.append((corner[~large], normal[~large]))
            corner, normal = (_quartered(values[large]) for values in (corner, normal))
        return Surface(*(np.concatenate(part) for part in zip(*done, strict=True)))


@dataclass(frozen=True)
class Work:
    """What all blocks share.

    Attributes
    ----------
    source, surface: where normals come from, and what is sampled. spacing: of samples.
    bounds: of the leaves.
    """

    source: Source
    surface: Surface
    spacing: float
    bounds: Bounds

    @property
    def top(self) -> int:
        """Depth of the cells."""
        return min(CELLS, self.bounds.depth)


@dataclass(frozen=True)
class Block:
    """A range of cells, and the triangles that have samples in it."""

    first: int
    last: int
    triangles: Ints


@dataclass(frozen=True)
class Found:
    """What a block holds.

    Attributes
    ----------
    levels: from the cells down. cells: sums of each, as samples of the depth of the cells.
    missed: samples that no ray found the source from.
    """

    levels: list[Level]
    cells: Samples
    missed: int


def build(work: Work, executor: Executor, progress: Progress = silent) -> tuple[list[Level], float]:
    """The levels of the octree, from the root on, and the share of the samples that no ray found
    the source from, whose normals are the simplified mesh's own.

    Raises LimitError PTM-L840: too many texels.
    """
    blocks = list(_blocks(work))
    found, held = [], 0
    for done, each in enumerate(executor.each(_block, work, blocks)):
        progress(done, len(blocks), "casting rays")
        found.append(each)
        held += texel_count(each.levels)
        check_count(held)
    progress(len(blocks), len(blocks), "casting rays")
    parts = [each.cells for each in found]
    cells = Samples(
        np.concatenate([part.code for part in parts]),
        np.concatenate([part.count for part in parts]),
        np.concatenate([part.value for part in parts]),
        np.concatenate([part.square for part in parts]),
    )
    width = cells.value.shape[1]
    # The cells themselves are divided by their own samples, whatever is done above them.
    above = divide(cells, 0, work.top, work.bounds)
    kept = above[work.top].code if len(above) > work.top else np.zeros(0, np.uint64)
    below = joined([pruned(each.levels, kept, 0) for each in found], width)
    levels = [*above[: work.top], *(level for level in below if len(level.code))]
    total = int(cells.count.sum())
    return averaged(levels), sum(each.missed for each in found) / max(total, 1)


def _quartered(values: Floats) -> Floats:
    """(4m, 3, 3) values of the corners of the quarters of triangles."""
    a, b, c = values[:, 0], values[:, 1], values[:, 2]
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    found: Floats = np.stack([np.stack(p, axis=1) for p in parts], axis=1).reshape(-1, 3, 3)
    return found


def _blocks(work: Work) -> Iterator[Block]:
    corner = work.surface.corner
    triangle, cell, count = [], [], []
    for chosen in _batches(corner, work.spacing):
        points = spread(corner[chosen], work.spacing)
        code = codes_of(at(corner[chosen], points), work.top).astype(np.int64)
        pairs = chosen[points.triangle] << (3 * CELLS) | code
        both, n = np.unique(pairs, return_counts=True)
        triangle.append(both >> (3 * CELLS))
        cell.append(both & ((1 << 3 * CELLS) - 1))
        count.append(n)
    triangles, cells = np.concatenate(triangle), np.concatenate(cell)
    held = np.bincount(cells, np.concatenate(count), 1 << 3 * work.top).tolist()
    begin, taken = 0, 0.0
    for end, samples in enumerate([*held, np.inf]):
        if taken and taken + samples > MOST:
            here = triangles[(cells >= begin) & (cells < end)]
            yield Block(begin, end, np.unique(here))
            begin, taken = end, 0.0
        taken += samples


def _batches(corner: Floats, spacing: float) -> Iterator[Ints]:
    """Triangles in runs of about `MOST` samples."""
    run = (np.cumsum(areas(corner) / spacing**2 + 1) // MOST).astype(np.int64)
    yield from np.split(np.arange(len(corner)), np.flatnonzero(np.diff(run)) + 1)


def _block(work: Work, block: Block) -> Found:
    corner, normal = (v[block.triangles] for v in (work.surface.corner, work.surface.normal))
    points = spread(corner, work.spacing)
    q = at(corner, points)
    code = codes_of(q, work.bounds.depth)
    cell = (code >> np.uint64(3 * (work.bounds.depth - work.top))).astype(np.int64)
    here = np.flatnonzero((cell >= block.first) & (cell < block.last))
    here = here[np.argsort(code[here], kind="stable")]
    code, q = code[here], q[here]
    own = _unit(at(normal, Points(points.triangle[here], points.weight[here])))
    hits = nearest(work.source, q, own)
    value = _values(work, hits.triangle, hits.weight, own)
    square = (value[:, 3:] ** 2).sum(axis=1)
    ones = np.ones(len(code), np.int64)
    samples = Samples(code, ones, value, square)
    levels = divide(samples, work.top, work.bounds.depth, work.bounds)
    return Found(levels, _summed(samples, work), int((hits.triangle < 0).sum()))


def _values(work: Work, triangle: Ints, weight: Singles, own: Floats) -> Floats:
    """(n, k) unit normals and colours of the source; where no ray has hit, the mesh's own normal
    and mid-grey."""
    hit, source = triangle >= 0, work.source
    found = np.full((len(triangle), 6 if source.paint else 3), 0.5)
    found[:, :3] = own
    of, share = triangle[hit], weight[hit].astype(np.float64)
    normal = np.einsum("ij,ijk->ik", share, source.normals[of].astype(np.float64))
    found[hit, :3] = _unit(normal, own[hit])
    if source.paint:
        found[hit, 3:] = source.paint.colors(of, share)
    return found


def _unit(vectors: Floats, otherwise: Floats | None = None) -> Floats:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    other = np.array([0.0, 1.0, 0.0]) if otherwise is None else otherwise
    found: Floats = np.where(length > 0, vectors / np.where(length > 0, length, 1), other)
    return found


def _summed(samples: Samples, work: Work) -> Samples:
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


def texel_count(levels: list[Level]) -> int:
    """How many texels an octree takes."""
    return sum(len(level.code) + int((level.children > 0).sum()) for level in levels)
