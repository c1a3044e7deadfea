"""Options of the textures stage; those of the other stages are in the packages that do them."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ptmtools.errors import InputError
from ptmtools.options import option
from ptmtools.texture.model import EncodeOptions


@dataclass(frozen=True)
class TextureOptions(EncodeOptions):
    """Options of the textures stage."""

    fallback: bool = option(
        True, "Also write a PNG of each texture, for clients that cannot read .ptm."
    )
    fallback_size: int = option(
        0,
        "Largest side of the PNGs, which hold the finest level within it; 0 for the finest level.",
        metavar="TEXELS",
    )
    trim: bool = option(
        False,
        "Leave out levels that no screen of --trim-height resolves from any place where a visitor "
        "can stand. Larger screens and flying cameras see them blurred.",
        basic=True,
    )
    trim_height: int = option(
        1080, "Height of the screen that --trim assumes; it is 16:9.", metavar="PIXELS"
    )
    trim_fov: float = option(60.0, "Vertical field of view that --trim assumes.", metavar="DEGREES")
    trim_distance: float = option(
        0.25, "Smallest distance of an eye from a surface that --trim assumes.", metavar="METRES"
    )
    limit: int = option(1024, "Largest decoded size of an image.", metavar="MIB", compare=False)

    def __post_init__(self) -> None:
        """Raises InputError PTM-I111 for values out of range."""
        from ptmtools.texture.encoder import check_options

        check_options(self)
        possible = {
            "trim_height": self.trim_height > 0,
            "trim_fov": 0 < self.trim_fov < 180,
            "trim_distance": 0 < self.trim_distance < math.inf,
        }
        for name in (name for name, fits in possible.items() if not fits):
            raise InputError(
                "PTM-I111",
                f"{name} is {getattr(self, name):g}",
                remedy="give a number above 0, and for an angle below 180",
            )
