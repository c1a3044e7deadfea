"""Tests whether a PVS is conservative, with random segments and Embree, independently of portals.

A segment that begins where an eye can be, ends in a leaf and is blocked by no structural triangle
proves that the cell of its start sees the cell of its end, so the pair must be in the PVS, and that
the leaf must not have been dropped. The converse proves nothing: the check detects missing pairs,
never superfluous ones. ``docs/design/visibility.md`` ("The check") describes the four kinds of
segments.

Embree computes in float32 around the middle of the model, real models have cracks between polygons
that were meant to touch, and an end may lie on the wrong side of a wall by a rounding. A miss is
therefore shot again as `COPIES` parallel copies, each displaced by the jitter; a copy counts if its
own ends lie in cells that do not see each other and nothing blocks it. The miss is believed if at
least half of the copies count, else it is a hairline. Asking for all copies would let a narrow
opening that is truly missing pass as a hairline.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, Singles, areas, fans, volumes
from ptmtools.cells.doors import THICK
from ptmtools.cells.model import Cells
from ptmtools.embree import ray_tree
from ptmtools.errors import InputError
from ptmtools.progress import Progress, silent
from ptmtools.visibility.model import Pvs

#: Segments drawn and shot at a time.
BATCH = 1 << 17
#: Parallel copies by which a miss is tried again.
COPIES = 16
#: Displacement of the copies in widths of a hairline, `Tolerance.hairline`: 1 mm in a building of
#: 50 m.
JITTER = 2.5
#: Lengths of short segments and of those through portals, as shares of the extent.
SHORTEST, LONGEST = 1e-3, 0.5
#: Draws for each segment asked for before giving up: those that begin where no eye can be, or end
#: in no leaf, do not count.
PATIENCE = 64


@dataclass(frozen=True)
class MissedPair:
    """Two cells that see each other but are not in each other's PVS.

    Attributes
    ----------
    cells: the two, the lower first; -1 for a leaf that was dropped.
    start, end: (x, y, z) in metres, the ends of an example, in `cells`' order.
    segments: the number of segments that showed it.
    """

    cells: tuple[int, int]
    start: tuple[float, float, float]
    end: tuple[float, float, float]
    segments: int


@dataclass(frozen=True)
class SegmentReport:
    """The result of `check_conservative`.

    Attributes
    ----------
    tried: segments that begin where an eye can be and end in a leaf.
    unoccluded: the number of those that nothing blocks.
    missed: the pairs of cells that the PVS misses, ascending; empty if it is conservative.
    hairlines: unoccluded segments outside the PVS that did not survive the jitter.
    """

    tried: int
    unoccluded: int
    missed: tuple[MissedPair, ...]
    hairlines: int

    @property
    def missed_segments(self) -> int:
        """Segments that showed a missed pair."""
        return sum(pair.segments for pair in self.missed)


def check_conservative(
    structural: Floats,
    cells: Cells,
    pvs: Pvs,
    segments: int = 1_000_000,
    seed: int = 0,
    progress: Progress = silent,
) -> SegmentReport:
    """Shoots random segments and reports the cells that see each other outside the PVS.

    Parameters
    ----------
    structural: (T, 3, 3) the triangles that occlude, metres: those from which the cells were made.
    segments: the number to try; fewer are tried if too few ends fall into cells.

    Deterministic for a seed. Raises InputError PTM-I400 if the triangles are not (T, 3, 3) or not
    finite, or if cells and PVS are not of the same subdivision.
    """
    structural = np.asarray(structural, dtype=np.float64)
    if structural.shape[1:] != (3, 3) or not np.isfinite(structural).all():
        raise InputError("PTM-I400", "the triangles are not finite corners of shape (T, 3, 3)")
    if pvs.cell_count != cells.cell_count:
        raise InputError(
            "PTM-I400",
            f"the PVS has {pvs.cell_count} cells, the subdivision {cells.cell_count}",
            remedy="compute the PVS again",
        )
    if cells.cell_count == 0:
        return SegmentReport(0, 0, (), 0)

    visible = np.zeros((cells.cell_count + 1,) * 2, dtype=np.bool_)  # the last one was dropped
    visible[:-1, :-1] = pvs.to_matrix()
    draw, eyes, blockers = Sampler(cells), _Eyes(cells), Blockers(structural, cells.root_box)
    tried = unoccluded = hairlines = drawn = batch = 0
    pairs: dict[tuple[int, int], MissedPair] = {}
    while tried < segments and drawn < PATIENCE * segments:
        rng = np.random.default_rng([seed, batch])
        # Where eyes have little room the last few would come one by one.
        size = min(BATCH, max(segments - tried, drawn // 4 - segments))
        start, end = draw.segments(rng, size)
        drawn, batch = drawn + size, batch + 1
        start, end = eyes.first(start, end)
        if len(start) > segments - tried:
            some = rng.permutation(len(start))[: segments - tried]
            start, end = start[some], end[some]
        tried += len(start)
        a, b = cells.locate(start), cells.locate(end)
        clear = ~blockers.block(start, end)
        unoccluded += int(clear.sum())
        missed = np.flatnonzero(clear & ~visible[a, b])
        share = _missed_share(rng, cells, visible, blockers, start[missed], end[missed])
        hairlines += int((share < 0.5).sum())
        for m in missed[share >= 0.5]:
            ends = (int(a[m]), _place(start[m])), (int(b[m]), _place(end[m]))
            (first, first_end), (second, second_end) = sorted(ends)
            pair = pairs.get(key := (first, second)) or MissedPair(key, first_end, second_end, 0)
            pairs[key] = replace(pair, segments=pair.segments + 1)
        progress(tried, segments, "segments")
    missing = tuple(pairs[pair] for pair in sorted(pairs))
    return SegmentReport(tried, unoccluded, missing, hairlines)


def _missed_share(
    rng: np.random.Generator,
    cells: Cells,
    visible: Bools,
    blockers: Blockers,
    start: Floats,
    end: Floats,
) -> Floats:
    """(n,) the share of jittered copies of segments that nothing blocks, but the (C + 1, C + 1)
    ``visible`` pairs of cells lack."""
    jitter, share = JITTER * cells.tolerance.hairline, np.zeros(len(start))
    for _ in range(COPIES):
        shift = rng.normal(size=(len(start), 3))
        shift *= jitter / np.linalg.norm(shift, axis=1, keepdims=True)
        p, q = start + shift, end + shift
        seen = visible[cells.locate(p), cells.locate(q)]
        missed = (cells.locate_leaf(p) >= 0) & (cells.locate_leaf(q) >= 0) & ~seen
        share += (missed & ~blockers.block(p, q)) / COPIES
    return share


class _Eyes:
    """The places of eyes: the eye region, regardless of leaves but for those inside a door leaf,
    where an eye belongs to the cells on both sides; and all of a leaf that is standing without a
    floor, because of a camera or a viewpoint."""

    def __init__(self, cells: Cells) -> None:
        self._cells, self._eyes = cells, cells.eyes
        bodies = [cells.leaf_points(leaf) for leaf in range(cells.leaf_count)]
        floored = [self._eyes.is_near(body.min(axis=0), body.max(axis=0)) for body in bodies]
        self._whole = cells.leaf_standing & ~np.array(floored, dtype=np.bool_)
        passages = cells.portal_leaf[cells.portal_passage]
        self._doors = np.bincount(passages.ravel(), minlength=cells.leaf_count) > 1
        self._doors &= ~cells.leaf_standing
        thin = np.zeros(cells.leaf_count, dtype=np.bool_)
        normals = cells.portal_plane[cells.portal_passage, :3]
        for leaves, normal in zip(passages.tolist(), normals, strict=True):
            for leaf in leaves:
                thin[leaf] |= np.ptp(bodies[leaf] @ normal) <= THICK + cells.tolerance.plane
        self._doors &= thin

    def may_be_at(self, points: Floats, leaf: NDArray[np.int32]) -> Bools:
        """(n,) whether an eye can be at the (n, 3) points, in (n,) leaves or -1."""
        inside = leaf >= 0
        standing = inside & self._whole[leaf]
        if not self._eyes.everywhere:
            inside[inside] = ~self._doors[leaf[inside]]
            standing[inside] |= self._eyes.contains(points[inside])
        return np.asarray(standing)

    def first(self, start: Floats, end: Floats) -> tuple[Floats, Floats]:
        """The segments between (n, 3) points that begin where an eye can be and end in a leaf;
        reversed if only the end is such a place."""
        leaf, end_leaf = self._cells.locate_leaf(start), self._cells.locate_leaf(end)
        eye = self.may_be_at(start, leaf)
        kept = (leaf >= 0) & (end_leaf >= 0) & (eye | self.may_be_at(end, end_leaf))
        start, end, turned = start[kept], end[kept], ~eye[kept, None]
        return np.where(turned, end, start), np.where(turned, start, end)


class Sampler:
    """Draws segments in and around the cells; the kinds are those of the module's head."""

    def __init__(self, cells: Cells) -> None:
        corners, leaf = cells.tetrahedra()
        volume = volumes(corners)
        self.by_volume = _Inside(corners, volume)
        self.by_leaf = _Inside(corners, _shares(volume, leaf))
        rows, portal = fans(cells.portal_start)
        triangles = cells.portal_point[rows]
        self.by_portal = _Inside(triangles, _shares(areas(triangles), portal))
        self.extent = float(np.ptp(cells.root_box, axis=0).max())

    def segments(self, rng: np.random.Generator, count: int) -> tuple[Floats, Floats]:
        """(count, 3) starts and ends."""
        a, b, c, d = (count // 4 + (i < count % 4) for i in range(4))
        anywhere, leaf = self.by_volume, self.by_leaf
        ends = [
            (anywhere.draw(rng, a), anywhere.draw(rng, a)),
            (leaf.draw(rng, b), leaf.draw(rng, b)),
        ]
        start = leaf.draw(rng, c)
        ends.append((start, start + self._arm(rng, _direction(rng, c))))
        if len(self.by_portal.corners):
            middle, along = self.by_portal.draw(rng, d), _direction(rng, d)
            ends.append((middle - self._arm(rng, along), middle + self._arm(rng, along)))
        starts, others = zip(*ends, strict=True)
        return np.concatenate(starts), np.concatenate(others)

    def _arm(self, rng: np.random.Generator, along: Floats) -> Floats:
        exponent = rng.uniform(np.log(SHORTEST), np.log(LONGEST), size=(len(along), 1))
        return along * (np.exp(exponent) * self.extent)


class _Inside:
    """Draws points in (n, k, 3) simplices, from each in proportion to its (n,) weight."""

    def __init__(self, corners: Floats, weight: Floats) -> None:
        self.corners = corners
        total = np.cumsum(weight if weight.any() else np.ones(len(corners)))
        self._until = total / total[-1:]

    def draw(self, rng: np.random.Generator, count: int) -> Floats:
        """(count, 3) points."""
        corner = self.corners[np.searchsorted(self._until, rng.random(count), side="right")]
        weight = rng.exponential(size=(*corner.shape[:2], 1))
        mixed: Floats = (corner * weight).sum(axis=1) / weight.sum(axis=1)
        return mixed


def _shares(size: Floats, owner: Ints) -> Floats:
    """(n,) sizes as shares of those of their owners."""
    total = np.bincount(owner, size)[owner]
    return size / np.maximum(total, np.finfo(np.float64).tiny)


class Blockers:
    """The structural triangles in Embree, brought to the unit cube in float64 first."""

    def __init__(self, structural: Floats, box: Floats) -> None:
        corners = np.concatenate([structural.reshape(-1, 3), box])
        self._middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
        self._scale = 1 / (float(np.ptp(corners, axis=0).max()) or 1.0)
        self._scene: Any = None
        if len(structural):
            self._scene = ray_tree(self._local(structural))

    def _local(self, points: Floats) -> Singles:
        local = (points - self._middle) * self._scale
        return np.ascontiguousarray(local, dtype=np.float32)

    def block(self, start: Floats, end: Floats) -> Bools:
        """(n,) whether a triangle blocks the segment between two (n, 3) points."""
        if self._scene is None or len(start) == 0:
            return np.zeros(len(start), dtype=np.bool_)
        origin, along = self._local(start), self._local(end)
        along -= origin
        reach = np.ones(len(start), dtype=np.float32)
        hit = self._scene.run(origin, along, dists=reach, query="OCCLUDED")
        return np.asarray(hit >= 0, dtype=np.bool_)


def _direction(rng: np.random.Generator, count: int) -> Floats:
    """(count, 3) unit vectors, uniform on the sphere."""
    vector = rng.normal(size=(count, 3))
    unit: Floats = vector / np.linalg.norm(vector, axis=1, keepdims=True)
    return unit


def _place(point: Floats) -> tuple[float, float, float]:
    return float(point[0]), float(point[1]), float(point[2])
