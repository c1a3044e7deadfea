"""What a run was worth to the walker, and what it cost, as a few numbers.

FLIP of a few frames of a run: the difference from the full picture as people see it when they
flip between the two (Andersson et al. 2020), 0 to 1; needs flip-evaluator (extra ``measures``).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.lab.renderer import Renderer
from ptmtools.lab.simulation import Run
from ptmtools.lab.world import World
from ptmtools.lazy import component
from ptmtools.rendering.records import Sight

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


#: Frames that are looked at, and the seed by which they are drawn.
FRAMES, SEED = 12, 1
#: Pixels of a picture (320 × 240), as wide as the walk's view is; pixels a degree of the eye: those
#: of a screen of 3840 pixels, 0.7 m wide, 0.7 m away.
PIXELS, PER_DEGREE = 76_800, 67.0
_SAMPLES = 3


def require() -> None:
    """Raises `MissingComponentError` PTM-M100 without flip-evaluator."""
    component("flip_evaluator", "PTM-M100", "flip-evaluator is missing", "measures")


class Flip:
    """Looks at some frames of a world, the same in all runs through it.

    Attributes
    ----------
    frame: (n,) which. height, width: of the pictures.
    """

    def __init__(self, world: World, count: int = FRAMES, seed: int = SEED) -> None:
        require()
        random = np.random.default_rng(seed)
        self.frame: Ints = np.sort(
            random.choice(world.frames, min(count, world.frames), replace=False)
        )
        self._renderer = Renderer(
            world, max(1, round(math.sqrt(PIXELS / world.camera.aspect))), _SAMPLES
        )
        self.height, self.width = self._renderer.height, self._renderer.width
        self._sights: list[Sight] = [
            self._renderer.look(world.eye[f], world.direction[f]) for f in self.frame
        ]
        self._full = [self._renderer.full(sight) for sight in self._sights]

    def each(self, run: Run) -> Floats:
        """(n,) the mean FLIP of each of the frames."""
        return np.array(
            [
                self._of(k, run.loaded[f], run.column[f])
                for k, f in enumerate(self.frame.tolist())
            ]
        )  # fmt: skip

    def _of(self, k: int, loaded: Bools, column: Ints) -> float:
        return flip(self._full[k], self._renderer.colors(self._sights[k], loaded, column))


def flip(reference: Floats, test: Floats) -> float:
    """The mean FLIP of two pictures (h, w, 3), 0 to 255; `MissingComponentError` as `require`."""
    require()
    import flip_evaluator

    shown = [np.clip(picture / 255, 0, 1).astype(np.float32) for picture in (reference, test)]
    difference, _, _ = flip_evaluator.evaluate(
        *shown, "LDR", applyMagma=False, parameters={"ppd": PER_DEGREE}
    )
    # Its own mean is summed up by several threads, in any order.
    return float(np.mean(difference, dtype=np.float64))
