"""The options of the textures stage; those of the others are with the rooms that do them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from ptmtools.errors import InputError
from ptmtools.texture.model import EncodeOptions


@dataclass(frozen=True)
class TextureOptions(EncodeOptions):
    """How the images of a scene are encoded.

    Attributes
    ----------
    fallback: also write a PNG of each texture, for clients that cannot read `.ptm`.
    fallback_size: the PNG holds the finest level whose longer side is at most this many texels, or
        the coarsest if there is none; 0 is the finest. Browsers that cannot read `.ptm` load the
        PNGs of all textures.
    trim: leave out the levels that no visitor's screen resolves, wherever one can stand and
        whatever one looks at; judged by the distance of eyes from what they may see, and on the
        safe side. Somebody with a larger screen or who flies to a ceiling sees it blurred.
    trim_height: how many pixels high the screen is that --trim goes by; it is 16:9.
    trim_fov: the angle from top to bottom of a picture that --trim goes by, in degrees.
    trim_distance: how near to a surface an eye comes that --trim goes by, in metres, at the least.
    limit: refuse an image that takes more memory than this once decoded, in MiB.
    """

    fallback: bool = True
    fallback_size: int = 0
    trim: bool = False
    trim_height: int = 1080
    trim_fov: float = 60.0
    trim_distance: float = 0.25
    limit: int = field(default=1024, compare=False)

    def __post_init__(self) -> None:
        """Raises InputError PTM-I111 for what no image can be encoded with."""
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
