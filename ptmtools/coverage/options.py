"""The knobs of the coverage hints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from ptmtools.errors import InputError

Preset = Literal["paper", "fast", "default", "high"]
Placement = Literal["sobol", "kd", "uniform"]
Weighting = Literal["pixel", "solid-angle"]
Backend = Literal["auto", "gl", "embree"]

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
    preset: "paper" (8 points, 256 pixels a side), "fast", "default" or "high": how many sample
        points, how large the views and how the points are placed, where that is not given.
    samples: sample points a cell; with tolerance, the most.
    face: pixels a side of each of the six views. Positions matter far more: ask for more samples
        before a larger face.
    placement: of sample points: "sobol" (a scrambled sequence), "kd" (the middles of equal parts,
        best for fewer than 16) or "uniform" (at random, as in the paper).
    tolerance: in each cell, points are added until the hints are this near to the truth (total
        variation, at about 95 %), or there are as many as samples allows.
    weighting: "pixel" counts every pixel of a view alike, as the paper; "solid-angle" counts less
        towards the edges and corners of a view, by how much of the sphere a pixel covers.
    backend: "gl" (OpenGL), "embree" (rays on the processor), or "auto": whichever is there and
        expected to be faster.
    gpu: which of the machine's graphics devices "gl" draws with; if not given, the first.
    clearance: metres that a sample point keeps from every surface; if not given, a quarter of
        the least thickness that a cell may have.
    seed: which sequence of sample points is taken.
    per_texture: also measures how much of the view each texture of each visible cell covers.
    """

    preset: Preset = "default"
    samples: int | None = None
    face: int | None = None
    placement: Placement | None = None
    tolerance: float | None = None
    weighting: Weighting = "pixel"
    backend: Backend = "auto"
    gpu: int | None = None
    clearance: float | None = None
    seed: int = 0
    per_texture: bool = False

    def __post_init__(self) -> None:
        """Raises `InputError` PTM-I500 for a value that makes no sense."""
        self._among("preset", self.preset, get_args(Preset))
        self._among("backend", self.backend, get_args(Backend))
        self._among("weighting", self.weighting, get_args(Weighting))
        self._among("placement", self.placed, get_args(Placement))
        self._within("samples", self.points, 1, MAX_SAMPLES)
        self._within("face", self.side, 1, MAX_FACE)
        self._within("seed", self.seed, 0, 2**32 - 1)
        self._within("gpu", self.gpu or 0, 0, 255)
        if self.clearance is not None and not 0 < self.clearance < float("inf"):
            raise InputError(
                "PTM-I500",
                f"a clearance of {self.clearance} m makes no sense",
                remedy="give a distance above 0",
            )
        if self.tolerance is not None:
            self._for_tolerance(self.tolerance)

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

    def _for_tolerance(self, tolerance: float) -> None:
        if not 0 < tolerance < 1:
            raise InputError(
                "PTM-I500",
                f"a tolerance of {tolerance} makes no sense",
                remedy="give a total variation above 0 and below 1, such as 0.01",
            )
        from ptmtools.coverage.estimate import GROUPS

        if self.points < GROUPS:  # of which each needs one
            raise InputError(
                "PTM-I500",
                f"{self.points} sample points do not tell how far they are from a tolerance",
                remedy=f"allow {GROUPS} or more, or leave --samples out",
            )
        if self.placed == "kd":
            raise InputError(
                "PTM-I500",
                "with a tolerance points are added one by one, which parts of a cell do not allow",
                remedy="take --placement sobol",
            )

    @staticmethod
    def _among(name: str, value: str, known: tuple[str, ...]) -> None:
        if value not in known:
            raise InputError(
                "PTM-I500", f"no {name} '{value}'", remedy=f"one of {', '.join(known)}"
            )

    @staticmethod
    def _within(name: str, value: int, low: int, high: int) -> None:
        if not low <= value <= high:
            raise InputError(
                "PTM-I500", f"{name} is {value}", remedy=f"give a number from {low} to {high}"
            )
