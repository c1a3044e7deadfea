"""FLIP of a few frames of a run: the difference from the full picture as people see it when they
flip between the two (Andersson et al. 2020), 0 to 1; needs flip-evaluator (extra ``measures``)."""

from __future__ import annotations

import math

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.lazy import component
from ptmtools.walkthrough.simulation import Run
from ptmtools.walkthrough.view.records import Sight
from ptmtools.walkthrough.view.render import Renderer
from ptmtools.walkthrough.world import World

#: Frames that are looked at, and the seed by which they are drawn.
FRAMES, SEED = 12, 1
#: Pixels of a picture (320 × 240), as wide as the walk's view is; pixels a degree of the eye: those
#: of a screen of 3840 pixels, 0.7 m wide, 0.7 m away.
PIXELS, PER_DEGREE = 76_800, 67.0
_SAMPLES = 3


def require() -> None:
    """Raises `MissingComponentError` PTM-M702 without flip-evaluator."""
    component("flip_evaluator", "PTM-M702", "flip-evaluator is missing", "measures")


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
                self._of(k, run.there[f], run.column[f])
                for k, f in enumerate(self.frame.tolist())
            ]
        )  # fmt: skip

    def _of(self, k: int, there: Bools, column: Ints) -> float:
        return flip(self._full[k], self._renderer.colors(self._sights[k], there, column))


def flip(reference: Floats, test: Floats) -> float:
    """The mean FLIP of two pictures (h, w, 3), 0 to 255; `MissingComponentError` as `require`."""
    require()
    import flip_evaluator

    shown = [np.clip(picture / 255, 0, 1).astype(np.float32) for picture in (reference, test)]
    found, _, _ = flip_evaluator.evaluate(
        *shown, "LDR", applyMagma=False, parameters={"ppd": PER_DEGREE}
    )
    # Its own mean is summed up by several threads, in any order.
    return float(np.mean(found, dtype=np.float64))
