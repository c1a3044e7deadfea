"""The hints of one cell: where to look from, how often, and what comes of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells.model import Cells
from ptmtools.coverage.estimate import GROUPS, Row, estimate, grouped, shares, spread
from ptmtools.coverage.eyes import Eyes, Places, Sequence
from ptmtools.coverage.item_buffer import Renderer, Surfaces
from ptmtools.coverage.looking import Looker, Owners, Seen
from ptmtools.coverage.matter import Surroundings
from ptmtools.coverage.options import AchOptions
from ptmtools.coverage.placement import Tetrahedra, Volume
from ptmtools.scene.model import Scene
from ptmtools.visibility.model import Pvs

#: The default clearance as a share of the thinnest that a cell may be, so that even such a cell
#: has usable points.
CLEARANCE = 0.25
#: Sees from sample points what a row of the PVS asks for.
Look = Callable[[Eyes], Seen]
#: Points of each of the groups that a tolerance is first tried with.
FIRST = 8
#: What a bound falls by, about, as the points are doubled (K^-0.6): one that falls faster has luck,
#: and stopping at every piece of luck makes bounds too small.
FALL = 2**-0.6


@dataclass(frozen=True)
class TextureShares:
    """Shares of the owners within the entries of a row: (n,) int64 how many each entry has, and
    for all of them (m,) int64 `owner` and (m,) float64 `share` of the row."""

    count: NDArray[np.int64]
    owner: NDArray[np.int64]
    share: NDArray[np.float64]


@dataclass(frozen=True)
class CellHints:
    """What was found out about one cell; see `Ach`."""

    row: Row
    missed: float
    samples: int
    rejected: int
    textures: TextureShares


class Sampler:
    """Ready to sample any cell of a scene."""

    def __init__(
        self,
        scene: Scene,
        cells: Cells,
        pvs: Pvs,
        options: AchOptions,
        surfaces: Surfaces,
        renderer: Renderer,
    ) -> None:
        self._cells, self._pvs, self._options = cells, pvs, options
        self._around = Surroundings.of(scene, cells)
        self._tetrahedra = Tetrahedra.of(cells)
        self._clearance = options.clearance or CLEARANCE * scene.tolerance.thin
        self._owners = Owners.of(surfaces, options.per_texture)
        by_angle = options.weighting == "solid-angle"
        self._looker = Looker(renderer, surfaces, cells, options.side, by_angle=by_angle)

    def of_cell(self, cell: int) -> CellHints:
        """The hints of one cell."""
        places = Places(Volume(self._cells, self._tetrahedra, cell), self._around, self._clearance)
        wanted, begin = self._owners.in_cells(self._pvs.row(cell))

        def look(eyes: Eyes) -> Seen:
            return self._looker.look(eyes, self._owners, wanted)

        if self._options.tolerance is None:
            eyes = self._eyes(places)
            eyes = eyes if len(eyes) else places.least_bad()
            spread_out = self._options.placed != "kd"
            seen, group = look(eyes), grouped(len(eyes), spread_out)
        else:
            seen, group = self._until_certain(places, look, begin, self._options.tolerance)
        owned = shares(seen.in_views.sum(axis=0))
        met = np.flatnonzero(owned)
        entry = np.searchsorted(begin, met, "right") - 1
        total = int(seen.in_views.sum()) + int(seen.missed.sum())
        by_cell = seen.grouped(begin)
        return CellHints(
            row=estimate(by_cell.at_points, by_cell.in_views, group, self._looker.unit),
            missed=int(seen.missed.sum()) / max(total, 1),
            samples=len(group),
            rejected=places.rejected,
            textures=TextureShares(
                np.bincount(entry, minlength=len(begin)), wanted[met], owned[met]
            ),
        )

    def _eyes(self, places: Places) -> Eyes:
        options = self._options
        if options.placed == "kd":
            return places.of_parts(options.points, options.seed)
        return Sequence(places, options.placed, options.seed).take(options.points)

    def _until_certain(
        self, places: Places, look: Look, begin: NDArray[np.int64], tolerance: float
    ) -> tuple[Seen, NDArray[np.int64]]:
        """What is seen, and the (K,) group of each point: of eight independent sequences as many
        points as make the hints certain, doubled until they are."""
        options = self._options
        seeds = ((options.seed << 3) + g + (1 << 35) for g in range(GROUPS))
        sequences = [Sequence(places, options.placed, seed) for seed in seeds]
        found: list[Seen] = []
        group = np.zeros(0, dtype=np.int64)
        before = np.inf
        more = max(1, min(FIRST, options.points // GROUPS))
        while True:
            eyes = [sequence.take(more) for sequence in sequences]
            added = np.repeat(np.arange(GROUPS), [len(e) for e in eyes])
            every = Eyes.join(eyes)
            if not len(added) and not found:
                every, added = places.least_bad(), np.zeros(1, dtype=np.int64)
                return look(every), added[: len(every)]
            found = [Seen.join([*found, look(every)])]
            group = np.concatenate([group, added])
            by_cell = found[0].grouped(begin).at_points
            now = spread(by_cell, group)[1]
            bound, before = max(now, before * FALL), now
            more = min(len(group) // GROUPS, (options.points - len(group)) // GROUPS)
            if bound <= tolerance or more < 1 or not len(added):
                return found[0], group
