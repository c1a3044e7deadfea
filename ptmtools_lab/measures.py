"""The quality and the cost of a run as a few numbers, and FLIP of a few of its frames.

FLIP is the difference from the full picture as people see it when they flip between the two
(Andersson et al. 2020), 0 to 1; it needs flip-evaluator (extra ``measures``).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.lazy import component
from ptmtools.rendering.records import Sight
from ptmtools_lab.renderer import FrameRenderer
from ptmtools_lab.simulation import WalkRun
from ptmtools_lab.world import World

#: Shares of the error removed, between no data and the full picture.
SHARES = (0.5, 0.9, 0.99)
#: Duration of the standing run, s.
STANDS = 60.0


@dataclass(frozen=True)
class Summary:
    """A measure over the frames: its mean, its 95th percentile, and its means over frames with a
    still and a moving viewpoint; NaN without such frames."""

    mean: float
    p95: float
    still: float
    moving: float


@dataclass(frozen=True)
class Measures:
    """
    Attributes
    ----------
    e: see `WalkRun.error`. rmse: root of the mean squared error. missing, quality: see `WalkRun`;
        the ``p95`` of the quality is what 95 % of the frames reach.
    bytes, overhead: received of bodies and of headers.
    waste: the share of received textures and geometry that was never displayed; 0 if nothing was
        received.
    requests: number of requests. stalls: s in which the geometry of the current cell was missing.
    uploads: bytes uploaded to texture memory. switches: changes of finest levels per minute.
    overruns: frames above the budget.
    final: s until `SHARES` of the initial e are gone, for a visitor who stands where the walk
        begins; None: not within `STANDS`.
    """

    e: Summary
    rmse: Summary
    missing: Summary
    quality: Summary
    bytes: int
    overhead: int
    waste: float
    requests: int
    stalls: float
    uploads: float
    switches: float
    overruns: int
    final: tuple[float | None, ...]


def measure(run: WalkRun, world: World, standing: WalkRun) -> Measures:
    """The measures of a run through a world; ``standing`` is the same client in
    `World.standing` for `STANDS`."""
    received = run.body - run.documents
    return Measures(
        e=_summary(run, run.error),
        rmse=_summary(run, run.square, math.sqrt),
        missing=_summary(run, run.missing),
        quality=_summary(run, run.quality, high_is_good=True),
        bytes=round(run.body),
        overhead=round(run.overhead),
        waste=max(0.0, 1 - run.useful / received) if received else 0.0,
        requests=run.requests,
        stalls=run.stalls / world.track.rate,
        uploads=run.uploads,
        switches=run.switches * 60 * world.track.rate / world.frames,
        overruns=run.overruns,
        final=seconds_to(standing, empty_error(world, 0)),
    )


def empty_error(world: World, frame: int) -> float:
    """The e of a frame before any arrival."""
    rows = world.views.rows(int(world.track.view[frame]))
    return float(world.views.error[rows, 0].sum())


def _summary(
    run: WalkRun,
    values: Floats,
    after: Callable[[float], float] = float,
    *,
    high_is_good: bool = False,
) -> Summary:
    """The summary of (F,) values; ``after`` is applied to the means."""

    def mean(some: Floats) -> float:
        return after(float(some.mean())) if len(some) else math.nan

    return Summary(
        mean(values),
        after(float(np.percentile(values, 5 if high_is_good else 95))),
        mean(values[run.still]),
        mean(values[~run.still]),
    )


def seconds_to(standing: WalkRun, nothing: float) -> tuple[float | None, ...]:
    """`Measures.final` of a standing run, with the e before any arrival."""
    # A table of float32 may leave a rounding error.
    rounding = nothing * float(np.finfo(np.float32).eps)
    reached = [standing.error <= (1 - share) * nothing + rounding for share in SHARES]
    return tuple(float(standing.time[r.argmax()]) if r.any() else None for r in reached)


#: Number of compared frames, and the seed of their choice.
FRAMES, SEED = 12, 1
#: Pixels of a picture (320 × 240) with the aspect of the walk; pixels per degree of the eye, for a
#: screen of 3840 pixels, 0.7 m wide, 0.7 m away.
PIXELS, PER_DEGREE = 76_800, 67.0
_SAMPLES = 3


def require() -> None:
    """Raises `MissingComponentError` PTM-M100 without flip-evaluator."""
    component("flip_evaluator", "PTM-M100", "flip-evaluator is missing", "measures")


class Flip:
    """Compares some frames of a world, the same in all runs through it.

    Attributes
    ----------
    frame: (n,) numbers of the frames. height, width: of the pictures.
    """

    def __init__(self, world: World, count: int = FRAMES) -> None:
        require()
        random = np.random.default_rng(SEED)
        self.frame: Ints = np.sort(
            random.choice(world.frames, min(count, world.frames), replace=False)
        )
        self._renderer = FrameRenderer(
            world, max(1, round(math.sqrt(PIXELS / world.camera.aspect))), _SAMPLES
        )
        self.height, self.width = self._renderer.height, self._renderer.width
        self._sights: list[Sight] = [
            self._renderer.look(world.track.eye[f], world.track.direction[f]) for f in self.frame
        ]
        self._full = [self._renderer.full(sight) for sight in self._sights]

    def each(self, run: WalkRun) -> Floats:
        """(n,) the mean FLIP of each of the frames."""
        return np.array(
            [
                self._difference(k, run.loaded[f], run.state[f])
                for k, f in enumerate(self.frame.tolist())
            ]
        )  # fmt: skip

    def _difference(self, k: int, loaded: Bools, state: Ints) -> float:
        return flip(self._full[k], self._renderer.colors(self._sights[k], loaded, state))


def flip(reference: Floats, test: Floats) -> float:
    """The mean FLIP of two pictures (h, w, 3), 0 to 255; `MissingComponentError` as `require`."""
    require()
    import flip_evaluator

    shown = [np.clip(picture / 255, 0, 1).astype(np.float32) for picture in (reference, test)]
    difference, _, _ = flip_evaluator.evaluate(
        *shown, "LDR", applyMagma=False, parameters={"ppd": PER_DEGREE}
    )
    # The mean of flip-evaluator is summed up by several threads in any order.
    return float(np.mean(difference, dtype=np.float64))
