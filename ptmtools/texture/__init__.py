"""One image and one `.ptm`: the progressive texture map codec (paper §4).

The names below are loaded when first used, so that importing this package costs nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import names

if TYPE_CHECKING:
    from ptmtools.texture.codec import check as check
    from ptmtools.texture.codec import decode as decode
    from ptmtools.texture.codec import decode_levels as decode_levels
    from ptmtools.texture.container import read_header as read_header
    from ptmtools.texture.container import whole_levels as whole_levels
    from ptmtools.texture.encoder import encode as encode
    from ptmtools.texture.encoder import encode_to as encode_to
    from ptmtools.texture.images import Picture as Picture
    from ptmtools.texture.images import load_image as load_image
    from ptmtools.texture.images import read_image as read_image
    from ptmtools.texture.images import read_ptm as read_ptm
    from ptmtools.texture.images import write_image as write_image
    from ptmtools.texture.model import Description as Description
    from ptmtools.texture.model import EncodeOptions as EncodeOptions
    from ptmtools.texture.model import Level as Level
    from ptmtools.texture.model import Limits as Limits
    from ptmtools.texture.model import PtmHeader as PtmHeader
    from ptmtools.texture.pyramid import build_pyramid as build_pyramid
    from ptmtools.texture.reader import PtmReader as PtmReader
    from ptmtools.texture.reader import open as open

__getattr__ = names(__name__)
