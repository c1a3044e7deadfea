"""Options of a walk through a database."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from ptmtools.cells.options import Walker
from ptmtools.errors import InputError
from ptmtools.options import degrees_text, option
from ptmtools.output.model import WriterOptions

#: Longest walk, seconds.
DAY = 86_400.0


@dataclass(frozen=True)
class PathOptions:
    """Options of `path_through`. Raises InputError PTM-I111 for values out of range."""

    heading: ClassVar[str] = "Walk"

    seed: int = option(
        1,
        "Seed of the walk: seed 1 starts at the first viewpoint, 2 at the next, and so on; each "
        "seed gives a different order of the pictures.",
    )
    duration: float | None = option(
        None,
        "Duration of the walk. A walk that has visited all rooms earlier starts again. Default: "
        "the time needed to visit all rooms.",
        metavar="SECONDS",
    )
    speed: float = option(1.4, "Walking speed.", metavar="M/S")
    rate: float = option(10.0, "Samples per second.")
    stop: float = option(5.0, "Average stop before a picture.", metavar="SECONDS")
    eye: float | None = option(
        None,
        "Height of the eyes above the floor. Default: 0.94 times the height of --walker.",
        metavar="METRES",
    )
    field_of_view: float = option(
        1.0472, "Vertical field of view.", metavar="DEGREES", degrees=True
    )
    aspect: float = option(1.7778, "Width of the picture divided by its height.")

    def __post_init__(self) -> None:
        problem = None
        if self.seed < 0:
            problem = f"--seed {self.seed} is below 0"
        elif self.duration is not None and not 1 <= self.duration <= DAY:
            problem = f"--duration {self.duration:g} is not between 1 and {DAY:g} seconds"
        elif not 0.1 <= self.speed <= 10:
            problem = f"--speed {self.speed:g} is not between 0.1 and 10 m/s"
        elif not 1 <= self.rate <= 240:
            problem = f"--rate {self.rate:g} is not between 1 and 240 samples a second"
        elif not 0 <= self.stop <= DAY:
            problem = f"--stop {self.stop:g} is not between 0 and {DAY:g} seconds"
        elif not 0 < self.field_of_view < math.pi:
            problem = (
                f"a field of view of {degrees_text(self.field_of_view)}° is not between 0 and 180"
            )
        elif not 0 < self.aspect < math.inf:
            problem = f"an aspect of {self.aspect:g} is not above 0"
        if problem:
            raise _out_of_range(problem)

    def eye_height(self, walker: Walker) -> float:
        """Height of the eyes above the floor, metres, for the visitor of the cells.

        Raises InputError PTM-I111 if it is not above a step, or too high for the visitor.
        """
        eye = WriterOptions().avatar(walker)[1] if self.eye is None else self.eye
        if not walker.step < eye <= walker.reach:
            raise _out_of_range(
                f"--eye {eye:g} is not between a step, {walker.step:g} m, and the reach of eyes, "
                f"{walker.reach:g} m"
            )
        return eye


def _out_of_range(what: str) -> InputError:
    return InputError("PTM-I111", what, remedy="leave the option out for its default")
