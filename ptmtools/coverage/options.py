"""Options of the coverage hints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal, get_args

from ptmtools.coverage.backends import AUTO, CHOICES
from ptmtools.options import option, require, require_ranges

Preset = Literal["paper", "fast", "default", "high"]
Placement = Literal["sobol", "kd", "uniform"]
Weighting = Literal["pixel", "solid-angle"]

#: The widest view in pixels a side: a point's six fit into a target of 6144 by 4096.
MAX_FACE = 2048
#: Sample points a cell: the counts of all of them are held at once.
MAX_SAMPLES = 2**14
#: Preset → (sample points per cell, pixels per side of a view, placement of the points).
PRESETS: dict[Preset, tuple[int, int, Placement]] = {
    "paper": (8, 256, "uniform"),
    "fast": (32, 4, "sobol"),
    "default": (512, 4, "sobol"),
    "high": (4096, 4, "sobol"),
}


#: Groups of sample points that the standard error is taken from.
GROUPS = 8


@dataclass(frozen=True)
class AchOptions:
    """Options of `compute_ach`."""

    heading: ClassVar[str] = "Coverage hints"

    preset: Preset = option(
        "default",
        "Defaults for --samples, --face and --placement. paper takes them from Marvie & "
        "Bouatouch (2003), 8 points with views of 256 x 256 pixels, and is slower and less "
        "accurate than fast.",
        basic=True,
    )
    samples: int | None = option(
        None,
        "Number of sample points per cell; with --tolerance, the maximum. Default: set by "
        "--preset.",
    )
    face: int | None = option(
        None,
        "Width and height of the six square views of a sample point. More sample points improve "
        "the hints far more than larger views. Default: set by --preset.",
        metavar="PIXELS",
    )
    placement: Placement | None = option(
        None,
        "Distribution of the sample points in a cell: sobol, evenly spread; kd, at the centres of "
        "parts of equal size, best for fewer than 16 points; uniform, at random. Default: set by "
        "--preset.",
    )
    tolerance: float | None = option(
        None,
        "Maximum error of the hints of a cell, as total variation, with about 95 % confidence. "
        "Sample points are added until the error is below this or --samples is reached.",
    )
    weighting: Weighting = option(
        "pixel",
        "Weight of each pixel: the same for all pixels, or its solid angle, which is smaller "
        "near the edges of a view.",
    )
    backend: str = option(AUTO, "Renderer of the views", choices=CHOICES)
    gpu: int | None = option(None, "Graphics device to use, by number. Default: the first.")
    clearance: float | None = option(
        None,
        "Minimum distance between a sample point and any surface. Default: a quarter of the "
        "minimum thickness of a cell.",
        metavar="METRES",
    )
    seed: int = option(0, "Seed of the random sample points.")
    per_texture: bool = option(
        False, "Also measure the share of the view that each texture of a visible cell covers."
    )

    def __post_init__(self) -> None:
        """Raises `InputError` PTM-I111 for a value out of range."""
        for name, choice, known in (
            ("preset", self.preset, PRESETS),
            ("backend", self.backend, CHOICES),
            ("weighting", self.weighting, get_args(Weighting)),
            ("placement", self.placement or "sobol", get_args(Placement)),
        ):
            require((choice in known, f"unknown {name} '{choice}'", f"one of {', '.join(known)}"))
        ranges = {
            "samples": (1, MAX_SAMPLES),
            "face": (1, MAX_FACE),
            "seed": (0, 2**32 - 1),
            "gpu": (0, 255),
        }
        require_ranges(self, ranges, "{name} is {value}", "use a number from {least} to {most}")
        require(
            (
                self.clearance is None or 0 < self.clearance < float("inf"),
                f"a clearance of {self.clearance} m is out of range",
                "use a distance above 0",
            )
        )
        if self.tolerance is None:
            return
        require(
            (
                0 < self.tolerance < 1,
                f"a tolerance of {self.tolerance} is out of range",
                "use a total variation above 0 and below 1, such as 0.01",
            ),
            (
                self.points >= GROUPS,  # each group needs one
                f"{self.points} sample points are too few to estimate their error",
                f"allow {GROUPS} or more, or omit --samples",
            ),
            (
                self.chosen_placement != "kd",
                "--tolerance adds points step by step, which --placement kd does not support",
                "use --placement sobol",
            ),
        )

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
    def chosen_placement(self) -> Placement:
        """Placement of the sample points."""
        return PRESETS[self.preset][2] if self.placement is None else self.placement
