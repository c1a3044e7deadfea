"""The knobs of the coverage hints."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, get_args

from ptmtools.coverage.backends import AUTO, CHOICES
from ptmtools.errors import InputError

Preset = Literal["paper", "fast", "default", "high"]
Placement = Literal["sobol", "kd", "uniform"]
Weighting = Literal["pixel", "solid-angle"]

#: The widest view in pixels a side: a point's six fit into a target of 6144 by 4096.
MAX_FACE = 2048
#: Sample points a cell: the counts of all of them are held at once.
MAX_SAMPLES = 2**14
#: Of each preset: sample points a cell, pixels a side of a view, and how the points are placed.
PRESETS: dict[Preset, tuple[int, int, Placement]] = {
    "paper": (8, 256, "uniform"),
    "fast": (32, 4, "sobol"),
    "default": (512, 4, "sobol"),
    "high": (4096, 4, "sobol"),
}


@dataclass(frozen=True)
class AchOptions:
    """How coverage is sampled.

    Attributes
    ----------
    preset: defaults for --samples, --face and --placement: "fast", "default", "high", or "paper",
        which is what Marvie & Bouatouch (2003) used: 8 points with views of 256 x 256 pixels, slow
        and less accurate than "fast".
    samples: sample points in each cell; with --tolerance, the most that may be used.
    face: side of each sample point's six square views, in pixels. More points help far more than
        larger views.
    placement: how sample points are spread over a cell: "sobol", evenly (a scrambled Sobol
        sequence); "kd", in the middles of equal parts, best for fewer than 16; or "uniform", at
        random.
    tolerance: add sample points in each cell until its hints are within this of the truth (total
        variation, with about 95 % confidence), or until --samples is reached.
    weighting: "pixel" counts every pixel of a view equally; "solid-angle" weights each by how much
        of the sphere it covers, which is less near the edges and corners.
    backend: what draws the views
    gpu: number of the graphics device to draw with. By default the first.
    clearance: smallest distance of a sample point from any surface, in metres. By default a quarter
        of the thickness of the thinnest cell that the subdivision allows.
    seed: random seed: another number gives other sample points.
    per_texture: also measure how much of the view each texture of each visible cell covers.
    """

    preset: Preset = "default"
    samples: int | None = None
    face: int | None = None
    placement: Placement | None = None
    tolerance: float | None = None
    weighting: Weighting = "pixel"
    backend: str = field(default=AUTO, metadata={"choices": CHOICES})
    gpu: int | None = None
    clearance: float | None = None
    seed: int = 0
    per_texture: bool = False

    def __post_init__(self) -> None:
        """Raises `InputError` PTM-I500 for a value that makes no sense."""
        for name, choice, known in (
            ("preset", self.preset, PRESETS),
            ("backend", self.backend, CHOICES),
            ("weighting", self.weighting, get_args(Weighting)),
            ("placement", self.placement or "sobol", get_args(Placement)),
        ):
            if choice not in known:
                raise _refused(f"no {name} '{choice}'", f"one of {', '.join(known)}")
        for name, value, low, high in (
            ("samples", self.points, 1, MAX_SAMPLES),
            ("face", self.side, 1, MAX_FACE),
            ("seed", self.seed, 0, 2**32 - 1),
            ("gpu", self.gpu or 0, 0, 255),
        ):
            if not low <= value <= high:
                raise _refused(f"{name} is {value}", f"give a number from {low} to {high}")
        if self.clearance is not None and not 0 < self.clearance < float("inf"):
            raise _refused(
                f"a clearance of {self.clearance} m makes no sense", "give a distance above 0"
            )
        if self.tolerance is not None:
            self._check_tolerance(self.tolerance)

    @property
    def points(self) -> int:
        """Sample points a cell, or the most of them."""
        if self.samples is not None:
            return self.samples
        return PRESETS[self.preset][0] if self.tolerance is None else MAX_SAMPLES

    @property
    def side(self) -> int:
        """Pixels a side of a view."""
        return PRESETS[self.preset][1] if self.face is None else self.face

    @property
    def placed(self) -> Placement:
        """How sample points are placed."""
        return PRESETS[self.preset][2] if self.placement is None else self.placement

    def _check_tolerance(self, tolerance: float) -> None:
        from ptmtools.coverage.sampling import GROUPS

        if not 0 < tolerance < 1:
            raise _refused(
                f"a tolerance of {tolerance} makes no sense",
                "give a total variation above 0 and below 1, such as 0.01",
            )
        if self.points < GROUPS:  # of which each needs one
            raise _refused(
                f"{self.points} sample points are too few to estimate their error",
                f"allow {GROUPS} or more, or omit --samples",
            )
        if self.placed == "kd":
            raise _refused(
                "--tolerance adds points step by step, which --placement kd does not support",
                "use --placement sobol",
            )


def _refused(problem: str, remedy: str) -> InputError:
    return InputError("PTM-I500", problem, remedy=remedy)
