"""The options of the textures stage; those of the others are with the rooms that do them."""

from __future__ import annotations

from dataclasses import dataclass, field

from ptmtools.texture.model import EncodeOptions


@dataclass(frozen=True)
class TextureOptions(EncodeOptions):
    """How the images of a scene are encoded.

    Attributes
    ----------
    fallback: write a PNG of each texture, for clients that cannot read `.ptm`.
    fallback_size: the fallback image holds the finest level whose longer side is at most this many
        texels, or the coarsest if none is: a browser that cannot read `.ptm` loads all of them. 0
        is the finest.
    limit: as in `IngestOptions`.
    """

    fallback: bool = True
    fallback_size: int = 0
    limit: int = field(default=1024, compare=False)
