"""What a run was worth to the walker, and what it cost, as a few numbers."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.walkthrough.simulation import Run
from ptmtools.walkthrough.world import World

#: Of the way from nothing to the full picture.
SHARES = (0.5, 0.9, 0.99)
#: How long the walker stands for it, s.
STANDS = 60.0


@dataclass(frozen=True)
class Summary:
    """A measure over the frames: the mean of all, what 95 % of them do not exceed, and the means of
    those in which the viewpoint is still and in which it is not; NaN where there are none."""

    mean: float
    p95: float
    still: float
    moving: float


@dataclass(frozen=True)
class Measures:
    """
    Attributes
    ----------
    e: see `Run.error`. rmse: its squares, averaged before the root is taken. missing, quality: see
        `Run`; of the quality, ``p95`` is what 95 % of the frames reach.
    bytes: received of bodies. overhead, cancelled: received of headers, and after cancellations.
    waste: the share of what was received of textures, of geometry and after cancellations that was
        never on the screen; 0 if nothing was received.
    requests: how many. stalls: s in which the cell that the walker is in was not there.
    uploads: bytes that went to texture memory. switches: of finest levels, a minute.
    overruns: frames above the budget.
    final: s after which, of a walker who stands where the walk begins, e has fallen to what
        `SHARES` leave of that of nothing; None: not within `STANDS`.
    """

    e: Summary
    rmse: Summary
    missing: Summary
    quality: Summary
    bytes: int
    overhead: int
    cancelled: int
    waste: float
    requests: int
    stalls: float
    uploads: float
    switches: float
    overruns: int
    final: tuple[float | None, ...]


def measure(run: Run, world: World, standing: Run) -> Measures:
    """The measures of a run through a world; ``standing`` is the same client in
    `World.standing` for `STANDS`."""
    received = run.body - run.documents + run.cancelled
    return Measures(
        e=_summary(run, run.error),
        rmse=_summary(run, run.square, math.sqrt),
        missing=_summary(run, run.missing),
        quality=_summary(run, run.quality, high_is_good=True),
        bytes=round(run.body),
        overhead=round(run.overhead),
        cancelled=round(run.cancelled),
        waste=max(0.0, 1 - run.useful / received) if received else 0.0,
        requests=run.requests,
        stalls=run.stalls / world.rate,
        uploads=run.uploads,
        switches=run.switches * 60 * world.rate / world.frames,
        overruns=run.overruns,
        final=seconds_to(standing, nothing_there(world, 0)),
    )


def nothing_there(world: World, frame: int) -> float:
    """The e of a frame where nothing has arrived."""
    rows = world.views.rows(int(world.view[frame]))
    return float(world.views.error[rows, 0].sum())


def _summary(
    run: Run,
    values: Floats,
    after: Callable[[float], float] = float,
    *,
    high_is_good: bool = False,
) -> Summary:
    """Of (F,) values; ``after`` is applied to the means."""

    def mean(some: Floats) -> float:
        return after(float(some.mean())) if len(some) else math.nan

    return Summary(
        mean(values),
        after(float(np.percentile(values, 5 if high_is_good else 95))),
        mean(values[run.still]),
        mean(values[~run.still]),
    )


def seconds_to(standing: Run, nothing: float) -> tuple[float | None, ...]:
    """`Measures.final` of who stands, where e of nothing is as given."""
    # A table of float32 may leave a little of an error that is none.
    rounding = nothing * float(np.finfo(np.float32).eps)
    reached = [standing.error <= (1 - share) * nothing + rounding for share in SHARES]
    return tuple(float(standing.time[r.argmax()]) if r.any() else None for r in reached)
