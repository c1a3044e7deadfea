"""The hints of one cell: the choice and number of its sample points, and the estimate with its
error (``docs/design/coverage.md``, "Statistics").

A hint is a ratio, the pixels of one cell over all pixels, both summed over the sample points. Its
standard error comes from eight groups of points, by the linearised ratio (Cochran, *Sampling
Techniques*, 1977, §6.4). With eight single points it is sometimes too small.

The error of a whole row is its total variation, half the sum of absolute differences. The distances
of the groups' own hints from the mean estimate its distribution: a mean of R groups is closer to
the truth than a group to the mean by the square root of R - 1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints
from ptmtools.cells.model import Cells
from ptmtools.coverage.backends import Backend
from ptmtools.coverage.item_buffer import ItemSurfaces
from ptmtools.coverage.options import GROUPS, AchOptions
from ptmtools.coverage.placement import CellVolume
from ptmtools.coverage.sample_points import PointFinder, PointSequence, SamplePoints
from ptmtools.coverage.solids import SampleObstacles
from ptmtools.coverage.tally import PixelCounter, PixelTally
from ptmtools.scene.model import Scene
from ptmtools.visibility.model import Pvs

#: Student's t for GROUPS - 1 degrees of freedom, two-sided 95 %. One-sided would be 1.895, but
#: distances are skewed: where two cells share the view, that bound held in 91 % of the cases.
STUDENT_T = 2.365
#: Rule of three: an event absent from K trials has a probability below 3/K, at 95 %.
RULE_OF_THREE = 3.0


@dataclass(frozen=True)
class HintRow:
    """The hints of one cell, for each of the n cells of its PVS: see `Ach`.

    `uncertain` is NaN with fewer than eight points, which are too few: with two the bound held in
        half of the cases.
    """

    value: Floats
    pixels: Floats
    error: Floats
    p95: Floats
    seen: Floats
    views: Floats
    uncertain: float


def shares(counts: Ints) -> Floats:
    """(…, n) counts over their sums; where that is 0, 1 for the first of the n.

    Each quotient is off by half a unit in its last place at most, so the exact sum of a row is
    within 1.2e-16 of 1.
    """
    total = counts.sum(axis=-1, keepdims=True)
    share = counts / np.maximum(total, 1)
    if share.shape[-1]:
        share[..., 0] += total[..., 0] == 0
    return np.asarray(share)


def estimate(at_points: Ints, in_views: Ints, group: Ints, unit: int) -> HintRow:
    """The hints from (K, n) weighted pixels at K points, each of the (K,) ``group``, and (6, n) of
    the same in each view; a pixel in the middle of a view weighs ``unit``."""
    total = in_views.sum(axis=0)
    value = shares(total)
    error, uncertain = spread(at_points, group)
    return HintRow(
        value=value,
        pixels=total / unit,
        error=np.where(total > 0, error, np.nan),
        p95=ninety_fifth(at_points),
        seen=np.count_nonzero(at_points, axis=0) / max(len(at_points), 1),
        views=shares(in_views).T,
        uncertain=uncertain,
    )


def spread(counts: Ints, group: Ints) -> tuple[Floats, float]:
    """(n,) standard errors of the shares of (K, n) counts, and a bound, at about 95 %, of the total
    variation between them and the truth; NaN where there is one group only, or for the bound fewer
    than `GROUPS`."""
    groups = int(group.max()) + 1 if len(group) else 0
    if groups < 2:
        return np.full(counts.shape[1], np.nan), float("nan")
    summed = np.zeros((groups, counts.shape[1]), dtype=np.int64)
    np.add.at(summed, group, counts)
    value, size = shares(summed.sum(axis=0)), summed.sum(axis=1)
    away = summed - value * size[:, None]
    mean = max(size.mean(), 1.0)
    error = np.sqrt((away**2).sum(axis=0) / (groups * (groups - 1))) / mean
    if groups < GROUPS:
        return error, float("nan")
    distance = np.abs(away).sum(axis=1) / (2 * mean)
    likely = distance.mean() + STUDENT_T * distance.std(ddof=1) * np.sqrt(1 + 1 / groups)
    return error, float(likely / np.sqrt(groups - 1))


def ninety_fifth(counts: Ints) -> Floats:
    """(n,) the least share that at least 95 % of the (K, n) points do not exceed."""
    if len(counts) == 0:
        return np.zeros(counts.shape[1])
    at_points = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    rank = -(-19 * len(counts) // 20) - 1
    return np.asarray(np.partition(at_points, rank, axis=0)[rank])


def group_numbers(count: int, in_stretches: bool = True) -> Ints:
    """(count,) the group of each of a sequence of points: eight stretches of equal length; or,
    where neighbours follow one another, every eighth point."""
    groups = min(GROUPS, count)
    if in_stretches:
        return np.arange(count) * groups // max(count, 1)
    return np.arange(count) % max(groups, 1)


#: The default clearance as a share of the thinnest that a cell may be, so that even such a cell
#: has usable points.
CLEARANCE = 0.25
#: Points of each group in the first round of a tolerance.
FIRST = 8
#: Expected ratio of a bound as the points are doubled (K^-0.6): one that falls faster does so by
#: chance, and stopping at chance minima makes bounds too small.
FALL = 2**-0.6


@dataclass(frozen=True)
class CellHints:
    """The results for one cell; see `Ach`. For the images within the entries of its row: the number
    in each entry, (n,), the images, (m,), -1 for none, and their (m,) shares of the row."""

    row: HintRow
    missed: float
    samples: int
    rejected: int
    texture_count: Ints
    texture: NDArray[np.int32]
    texture_value: Floats


class HintSampler:
    """Samples any cell of a scene with an open `renderer`. Pickled as its arguments, without the
    images, whose bytes are not needed."""

    def __init__(
        self, scene: Scene, cells: Cells, pvs: Pvs, options: AchOptions, backend: Backend
    ) -> None:
        self.scene, self.cells, self.pvs = scene, cells, pvs
        self.options, self.backend = options, backend
        self._volumes = CellVolume.of_cells(cells)
        self._obstacles = SampleObstacles.from_scene(scene, cells, self._volumes)
        self._clearance = options.clearance or CLEARANCE * scene.tolerance.thin
        surfaces = ItemSurfaces.from_scene(scene, cells)
        self.renderer = backend.open(surfaces, options.side, options.gpu)
        self._counter = PixelCounter(
            self.renderer,
            surfaces,
            cells,
            options.side,
            by_angle=options.weighting == "solid-angle",
            by_image=options.per_texture,
        )

    def __reduce__(self) -> tuple[Any, ...]:
        scene = replace(self.scene, images=())
        return HintSampler, (scene, self.cells, self.pvs, self.options, self.backend)

    def of_cell(self, cell: int) -> CellHints:
        """The hints of one cell."""
        finder = PointFinder(self._volumes[cell], self._obstacles, self._clearance)
        owners = self._counter.owners
        wanted, begin = owners.in_cells(self.pvs.row(cell))

        def count(points: SamplePoints) -> PixelTally:
            return self._counter.count(points, wanted)

        counted = self._tally(finder, count, begin)
        if counted is None and not finder.volume.everywhere:  # eyes fit almost nowhere in the cell
            finder = replace(finder, volume=finder.volume.anywhere())
            counted = self._tally(finder, count, begin)
        if counted is None:
            points = finder.least_bad()
            counted = count(points), np.zeros(len(points), dtype=np.int64)
        tally, group = counted
        owned = shares(tally.in_views.sum(axis=0))
        met = np.flatnonzero(owned)
        entry = np.searchsorted(begin, met, "right") - 1
        total = int(tally.in_views.sum()) + int(tally.missed.sum())
        by_cell = tally.group(begin)
        return CellHints(
            row=estimate(by_cell.at_points, by_cell.in_views, group, self._counter.unit),
            missed=int(tally.missed.sum()) / max(total, 1),
            samples=len(group),
            rejected=finder.rejected,
            texture_count=np.bincount(entry, minlength=len(begin)),
            texture=owners.image[wanted[met]],
            texture_value=owned[met],
        )

    def _tally(
        self, finder: PointFinder, count: Callable[[SamplePoints], PixelTally], begin: Ints
    ) -> tuple[PixelTally, Ints] | None:
        """The tally, and the (K,) group of each point; None without points."""
        if self.options.tolerance is not None:
            return self._until_certain(finder, count, begin, self.options.tolerance)
        points = self._points(finder)
        if not len(points):
            return None
        return count(points), group_numbers(len(points), self.options.chosen_placement != "kd")

    def points_of(self, cell: int) -> SamplePoints:
        """The sample points of one cell, without a tolerance."""
        finder = PointFinder(self._volumes[cell], self._obstacles, self._clearance)
        points = self._points(finder)
        if not len(points) and not finder.volume.everywhere:
            finder = replace(finder, volume=finder.volume.anywhere())
            points = self._points(finder)
        return points if len(points) else finder.least_bad()

    @property
    def weight(self) -> Callable[[SamplePoints], Ints]:
        """See `PixelCounter.weight`."""
        return self._counter.weight

    def _points(self, finder: PointFinder) -> SamplePoints:
        options = self.options
        if options.chosen_placement == "kd":
            return finder.of_parts(options.points, options.seed)
        return PointSequence(finder, options.chosen_placement, options.seed).take(options.points)

    def _until_certain(
        self,
        finder: PointFinder,
        count: Callable[[SamplePoints], PixelTally],
        begin: Ints,
        tolerance: float,
    ) -> tuple[PixelTally, Ints] | None:
        """`_tallied` at points of eight independent sequences, doubled until the hints are
        certain."""
        options = self.options
        seeds = ((options.seed << 3) + g + (1 << 35) for g in range(GROUPS))
        sequences = [PointSequence(finder, options.chosen_placement, seed) for seed in seeds]
        tallies: list[PixelTally] = []
        group = np.zeros(0, dtype=np.int64)
        before = np.inf
        more = max(1, min(FIRST, options.points // GROUPS))
        while True:
            parts = [sequence.take(more) for sequence in sequences]
            added = np.repeat(np.arange(GROUPS), [len(part) for part in parts])
            points = SamplePoints.join(parts)
            if not len(added) and not tallies:
                return None
            tallies = [PixelTally.join([*tallies, count(points)])]
            group = np.concatenate([group, added])
            by_cell = tallies[0].group(begin).at_points
            now = spread(by_cell, group)[1]
            bound, before = max(now, before * FALL), now
            more = min(len(group) // GROUPS, (options.points - len(group)) // GROUPS)
            if bound <= tolerance or more < 1 or not len(added):
                return tallies[0], group
