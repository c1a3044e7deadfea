"""The policy `oracle`, which knows the walk: the worth of a level is the error that it will remove,
discounted.

It is greedy like the others: the same engine, with the true tables instead of an estimate. A lower
bound by linear programming is separate (benchmarks/RESULTS.md).
"""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Singles
from ptmtools_lab.policies.engine import EngineClient, Worth
from ptmtools_lab.world import World

#: Seconds after which errors count 1/e, in the near and the far future, and the weight of the
#: latter.
SOON, LATER = 3.0, 60.0
_LATER_SHARE, _SOON_HELD = 0.003, 1e-4


class Oracle:
    """A policy for one walk; with ``exchanging`` it exchanges steps, see
    `ptmtools_lab.allocation.exchange`."""

    def __init__(self, world: World, *, exchanging: bool = False) -> None:
        self._exchanging = exchanging
        self._now, self._cells = _drops(world)
        self._soon = [_discounted(table, SOON * world.rate) for table in (self._now, self._cells)]
        self._later = [_discounted(t, LATER * world.rate) for t in (self._now, self._cells)]

    def __call__(self, client: EngineClient) -> Worth:
        """See `Policy`."""
        f = client.frame
        soon, later = (tables[0][f].astype(np.float64) for tables in (self._soon, self._later))
        cells = self._soon[1][f] + _LATER_SHARE * self._later[1][f]
        return Worth(
            hold=self._now[f] + _SOON_HELD * soon,
            fetch=soon + _LATER_SHARE * later,
            geometry=cells.astype(np.float64),
            ahead=later,
            exact=self._exchanging,
        )


def _drops(world: World) -> tuple[Singles, Singles]:
    """(F, R, K) the reduction of each frame's error by each column of each source, and (F, C) the
    error without each cell's geometry."""
    stock, views = world.catalogue, world.views
    count, textures, previews = views.frames, stock.texture_count, stock.previews
    columns = np.zeros((count, *stock.gains.shape), np.float32)
    cells = np.zeros((count, stock.cell_count), np.float32)
    frame = np.repeat(np.arange(count), np.diff(views.start))
    np.add.at(cells, (frame, views.cell), views.error[:, 0])
    of = np.concatenate([np.arange(textures), previews.texture])
    first = np.concatenate([np.zeros(textures, np.int64), previews.state])
    last = np.concatenate([stock.levels, previews.column])
    for row, (t, before, until) in enumerate(zip(of, first, last, strict=True)):
        shown = np.flatnonzero(views.texture == t)
        error = views.error[shown, before + 1 : before + until + 2]
        error[:, 0] = views.error[shown, 1]
        np.add.at(columns[:, row, 1 : until + 1], frame[shown], error[:, :-1] - error[:, 1:])
    return columns[world.view], cells[world.view]


def _discounted(table: Singles, frames: float) -> Singles:
    """Discounted sums over future frames; each frame counts less than the one before."""
    result, kept = np.empty_like(table), np.exp(-1 / frames)
    total = np.zeros_like(table[0])
    for f in range(len(table) - 1, -1, -1):
        total = total * kept + table[f]
        result[f] = total
    return result
