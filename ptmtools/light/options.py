"""Options of the light stage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from ptmtools.options import option, require, require_ranges

#: Field → (least, most).
RANGES = {"light_density": (0.1, 1000.0), "light_samples": (1, 4096)}


@dataclass(frozen=True)
class LightOptions:
    """The light of a building. Raises InputError PTM-I111 for values out of range."""

    heading: ClassVar[str] = "Light"

    light: Literal["auto", "bake", "model", "none"] = option(
        "auto",
        "Light of the surfaces, in one lightmap for each cell: bake (lamps, the sun and the sky, "
        "and what surfaces reflect; of ceilings where there is none), model (the lightmaps of a "
        "glTF, its occlusion textures) or none (colours as in the model). auto: model if there are "
        "any, else bake, within 400 kB or a tenth of the bytes of the images.",
        basic=True,
    )
    light_density: float = option(
        10.0, "Texels of a lightmap for each metre of surface.", metavar="TEXELS"
    )
    light_samples: int = option(32, "Number of rays for each texel of a lightmap.")

    true_colours: Literal["works", "none"] = option(
        "works",
        "Surfaces that are shown in the colours of their files, whatever the light: works "
        "(pictures that hang before a wall) or none. Other surfaces reflect the light that is "
        "baked.",
    )

    def __post_init__(self) -> None:
        require_ranges(
            self, RANGES, "--{name} {value:g} is not possible", "use {least:g} to {most:g}"
        )
        for field in (*RANGES, "true_colours"):
            used = ["auto", "bake"] + ["model"] * (field == "light_density")
            require(
                (
                    self.light in used or getattr(self, field) == getattr(type(self), field),
                    f"--{field.replace('_', '-')} does nothing with --light {self.light}",
                    f"leave it out, or use --light {' or '.join(used)}",
                )
            )
