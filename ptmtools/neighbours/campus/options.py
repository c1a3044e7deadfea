"""The knobs of `ptm campus`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ptmtools.errors import InputError

#: Most levels of detail, and most rays for a point of a lightmap.
MAX_LODS, MAX_SAMPLES = 8, 4096


@dataclass(frozen=True)
class CampusOptions:
    """How a model becomes a campus.

    Attributes
    ----------
    lods: meshes of each object, from the coarsest to the finest. The finest is the model's own.
    ratio: faces of a mesh, as a share of those of the next finer one.
    faces: no mesh is simplified to fewer faces than this.
    error: the greatest error of a step of a simplification, as a share of the diagonal of the
        object's box; more faces are left where it would be exceeded.
    small: objects smaller than this, the diagonal of their box in metres, are joined with their
        small neighbours; 0 joins none.
    lightmaps: where they come from: bake computes how much of the sky each point sees, model takes
        those of a glTF model, none leaves them out.
    samples: rays for each point of a baked lightmap.
    reach: what is farther away than this, in metres, takes no light; inf is plain ambient
        occlusion.
    quality: of the JPEG files, 1 to 95.
    """

    lods: int = 2
    ratio: float = 0.1
    faces: int = 100
    error: float = 0.01
    small: float = 10.0
    lightmaps: Literal["bake", "model", "none"] = "bake"
    samples: int = 64
    reach: float = 20.0
    quality: int = 85

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
            if not sound:
                raise InputError(
                    "PTM-I830",
                    f"{name} of {getattr(self, name)} is out of range",
                    remedy=f"give --{name} {wanted}",
                )
