"""What may be asked of a walk."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ptmtools.cells.options import Walker
from ptmtools.errors import InputError
from ptmtools.output.model import EmitOptions

#: Nobody walks longer, seconds.
DAY = 86_400.0


@dataclass(frozen=True)
class PathOptions:
    """
    Attributes
    ----------
    seed: another seed is another walk: 1 begins at the first viewpoint, 2 at the next, and so on;
        each looks at other pictures first, and glances elsewhere.
    duration: seconds. A shorter walk ends before it has been everywhere, a longer one goes round
        again and looks at other pictures. By default as long as every room takes.
    speed: of walking, in m/s.
    rate: samples a second.
    stop: how long to stand before a picture, in seconds, on average.
    eye: height of the eyes above the floor, in metres. By default 0.94 of the height of the
        --walker of the cells, as in the hints.
    field_of_view: vertical, in radians.
    aspect: width of the picture by its height.
    """

    seed: int = 1
    duration: float | None = None
    speed: float = 1.4
    rate: float = 10.0
    stop: float = 5.0
    eye: float | None = None
    field_of_view: float = 1.0472
    aspect: float = 1.7778

    def __post_init__(self) -> None:
        wrong = None
        if self.seed < 0:
            wrong = f"--seed {self.seed} is below 0"
        elif self.duration is not None and not 1 <= self.duration <= DAY:
            wrong = f"--duration {self.duration:g} is not between 1 and {DAY:g} seconds"
        elif not 0.1 <= self.speed <= 10:
            wrong = f"--speed {self.speed:g} is not between 0.1 and 10 m/s"
        elif not 1 <= self.rate <= 240:
            wrong = f"--rate {self.rate:g} is not between 1 and 240 samples a second"
        elif not 0 <= self.stop <= DAY:
            wrong = f"--stop {self.stop:g} is not between 0 and {DAY:g} seconds"
        elif not 0 < self.field_of_view < math.pi:
            wrong = f"a field of view of {self.field_of_view:g} is not between 0 and pi radians"
        elif not 0 < self.aspect < math.inf:
            wrong = f"an aspect of {self.aspect:g} is not above 0"
        if wrong:
            raise _out_of_range(wrong)

    def eye_height(self, walker: Walker) -> float:
        """Metres above the floor, of whoever walks in the cells.

        Raises InputError PTM-I810: his eyes cannot be there.
        """
        eye = EmitOptions().avatar(walker)[1] if self.eye is None else self.eye
        if not walker.step < eye <= walker.reach:
            raise _out_of_range(
                f"--eye {eye:g} is not between a step, {walker.step:g} m, and the reach of eyes, "
                f"{walker.reach:g} m"
            )
        return eye


def _out_of_range(what: str) -> InputError:
    return InputError("PTM-I810", what, remedy="leave the option out for its default")
