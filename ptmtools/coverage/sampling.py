"""The hints of one cell: at which points, at how many, and what comes of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints
from ptmtools.cells.model import Cells
from ptmtools.coverage.backends import Backend
from ptmtools.coverage.estimate import GROUPS, Row, estimate, grouped, shares, spread
from ptmtools.coverage.item_buffer import Surfaces
from ptmtools.coverage.options import AchOptions
from ptmtools.coverage.placement import Volume
from ptmtools.coverage.sample_points import PointFinder, PointSequence, SamplePoints
from ptmtools.coverage.solids import Obstacles
from ptmtools.coverage.tally import PixelCounter, Tally
from ptmtools.scene.model import Scene
from ptmtools.visibility.model import Pvs

#: The default clearance as a share of the thinnest that a cell may be, so that even such a cell
#: has usable points.
CLEARANCE = 0.25
#: Points of each of the groups that a tolerance is first tried with.
FIRST = 8
#: What a bound falls by, about, as the points are doubled (K^-0.6): one that falls faster has luck,
#: and stopping at every piece of luck makes bounds too small.
FALL = 2**-0.6


@dataclass(frozen=True)
class CellHints:
    """What was found out about one cell; see `Ach`. Of the images within the entries of its row,
    how many each has, (n,), which, (m,), -1 for none, and their (m,) shares of the row."""

    row: Row
    missed: float
    samples: int
    rejected: int
    texture_count: Ints
    texture: NDArray[np.int32]
    texture_value: Floats


class Sampler:
    """Ready to sample any cell of a scene, with an open `renderer`. It travels to other processes
    as what it is made of, without the images, whose bytes are not needed."""

    def __init__(
        self, scene: Scene, cells: Cells, pvs: Pvs, options: AchOptions, backend: Backend
    ) -> None:
        self.scene, self.cells, self.pvs = scene, cells, pvs
        self.options, self.backend = options, backend
        self._obstacles = Obstacles.of(scene, cells)
        self._volumes = Volume.of_cells(cells)
        self._clearance = options.clearance or CLEARANCE * scene.tolerance.thin
        surfaces = Surfaces.of(scene, cells)
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
        return Sampler, (scene, self.cells, self.pvs, self.options, self.backend)

    def of_cell(self, cell: int) -> CellHints:
        """The hints of one cell."""
        finder = PointFinder(self._volumes[cell], self._obstacles, self._clearance)
        owners = self._counter.owners
        wanted, begin = owners.in_cells(self.pvs.row(cell))

        def count(points: SamplePoints) -> Tally:
            return self._counter.count(points, wanted)

        found = self._tallied(finder, count, begin)
        if found is None and not finder.volume.everywhere:  # hardly anywhere in it eyes can be
            finder = replace(finder, volume=finder.volume.anywhere())
            found = self._tallied(finder, count, begin)
        if found is None:
            points = finder.least_bad()
            found = count(points), np.zeros(len(points), dtype=np.int64)
        tally, group = found
        owned = shares(tally.in_views.sum(axis=0))
        met = np.flatnonzero(owned)
        entry = np.searchsorted(begin, met, "right") - 1
        total = int(tally.in_views.sum()) + int(tally.missed.sum())
        by_cell = tally.grouped(begin)
        return CellHints(
            row=estimate(by_cell.at_points, by_cell.in_views, group, self._counter.unit),
            missed=int(tally.missed.sum()) / max(total, 1),
            samples=len(group),
            rejected=finder.rejected,
            texture_count=np.bincount(entry, minlength=len(begin)),
            texture=owners.image[wanted[met]],
            texture_value=owned[met],
        )

    def _tallied(
        self, finder: PointFinder, count: Callable[[SamplePoints], Tally], begin: Ints
    ) -> tuple[Tally, Ints] | None:
        """What is seen, and the (K,) group of each point; None if there is none."""
        if self.options.tolerance is not None:
            return self._until_certain(finder, count, begin, self.options.tolerance)
        points = self._points(finder)
        if not len(points):
            return None
        return count(points), grouped(len(points), self.options.placed != "kd")

    def points_of(self, cell: int) -> SamplePoints:
        """Where one cell is sampled, without a tolerance."""
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
        if options.placed == "kd":
            return finder.of_parts(options.points, options.seed)
        return PointSequence(finder, options.placed, options.seed).take(options.points)

    def _until_certain(
        self,
        finder: PointFinder,
        count: Callable[[SamplePoints], Tally],
        begin: Ints,
        tolerance: float,
    ) -> tuple[Tally, Ints] | None:
        """`_tallied` at points of eight independent sequences, as many as make the hints certain,
        doubled until they are."""
        options = self.options
        seeds = ((options.seed << 3) + g + (1 << 35) for g in range(GROUPS))
        sequences = [PointSequence(finder, options.placed, seed) for seed in seeds]
        found: list[Tally] = []
        group = np.zeros(0, dtype=np.int64)
        before = np.inf
        more = max(1, min(FIRST, options.points // GROUPS))
        while True:
            parts = [sequence.take(more) for sequence in sequences]
            added = np.repeat(np.arange(GROUPS), [len(part) for part in parts])
            points = SamplePoints.join(parts)
            if not len(added) and not found:
                return None
            found = [Tally.join([*found, count(points)])]
            group = np.concatenate([group, added])
            by_cell = found[0].grouped(begin).at_points
            now = spread(by_cell, group)[1]
            bound, before = max(now, before * FALL), now
            more = min(len(group) // GROUPS, (options.points - len(group)) // GROUPS)
            if bound <= tolerance or more < 1 or not len(added):
                return found[0], group
