"""Options of `ptm campus`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from ptmtools.options import option, require

#: Most levels of detail, and most rays for a point of a lightmap.
MAX_LODS, MAX_SAMPLES = 8, 4096


@dataclass(frozen=True)
class CampusOptions:
    """Options of `make_campus`. Raises InputError PTM-I111 for values out of range."""

    heading: ClassVar[str] = "Campus"

    lods: int = option(2, "Number of meshes of each object. The finest mesh is the original.")
    ratio: float = option(
        0.1,
        "Face count of each mesh divided by the face count of the next finer mesh.",
        metavar="SHARE",
    )
    faces: int = option(100, "Minimum number of faces of a simplified mesh.")
    error: float = option(
        0.01,
        "Maximum error of each step of the simplification, as a share of the diagonal of the "
        "object's bounding box.",
        metavar="SHARE",
    )
    small: float = option(
        10.0,
        "Merge nearby objects whose bounding-box diagonals are all below this length; 0 merges "
        "none.",
        metavar="METRES",
    )
    lightmaps: Literal["bake", "model", "none"] = option(
        "bake",
        "Lightmaps: computed from the share of the sky that each point sees, taken from a glTF "
        "model, or none.",
    )
    samples: int = option(64, "Number of rays for each point of a baked lightmap.")
    reach: float = option(
        20.0,
        "Distance beyond which surfaces cast no shadow; inf gives plain ambient occlusion.",
        metavar="METRES",
    )
    quality: int = option(85, "Quality of the JPEG files, 1 to 95.")

    def __post_init__(self) -> None:
        no_end = self.reach == float("inf")
        for name, sound, wanted in (
            ("lods", 1 <= self.lods <= MAX_LODS, f"1 to {MAX_LODS}"),
            ("ratio", 0 < self.ratio <= 1, "more than 0 and at most 1"),
            ("faces", self.faces >= 1, "1 or more"),
            ("error", self.error >= 0, "0 or more"),
            ("small", 0 <= self.small < float("inf"), "0 or more, finite"),
            ("lightmaps", self.lightmaps in ("bake", "model", "none"), "bake, model or none"),
            ("samples", 1 <= self.samples <= MAX_SAMPLES, f"1 to {MAX_SAMPLES}"),
            ("reach", 1e-3 <= self.reach <= 1e6 or no_end, "0.001 to 1000000, or inf"),
            ("quality", 1 <= self.quality <= 95, "1 to 95"),
        ):
            text = f"{name} of {getattr(self, name)} is out of range"
            require((sound, text, f"use --{name} {wanted}"))
