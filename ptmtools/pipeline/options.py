"""The options of the textures stage; those of the others are with the rooms that do them."""

from __future__ import annotations

from dataclasses import dataclass, field

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
    limit: refuse an image that takes more memory than this once decoded, in MiB.
    """

    fallback: bool = True
    fallback_size: int = 0
    limit: int = field(default=1024, compare=False)

    def __post_init__(self) -> None:
        """Raises InputError PTM-I111 for what no image can be encoded with."""
        from ptmtools.texture.options import check_options

        check_options(self)
