"""One image and one `.ptm`: the progressive texture map codec (paper §4).

The names below are loaded when first used, so that importing this package costs nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import names

if TYPE_CHECKING:
    from ptmtools.texture.codec import check, decode, decode_levels
    from ptmtools.texture.container import read_header, whole_levels
    from ptmtools.texture.encoder import encode, encode_to
    from ptmtools.texture.images import (
        Picture,
        load_image,
        read_image,
        read_ptm,
        write_image,
    )
    from ptmtools.texture.model import Description, EncodeOptions, Level, Limits, PtmHeader
    from ptmtools.texture.pyramid import build_pyramid
    from ptmtools.texture.reader import PtmReader
    from ptmtools.texture.reader import open as open

__all__ = [
    "Description",
    "EncodeOptions",
    "Level",
    "Limits",
    "Picture",
    "PtmHeader",
    "PtmReader",
    "build_pyramid",
    "check",
    "decode",
    "decode_levels",
    "encode",
    "encode_to",
    "load_image",
    "read_header",
    "read_image",
    "read_ptm",
    "whole_levels",
    "write_image",
]

_HOME = {
    "Description": "model",
    "EncodeOptions": "model",
    "Level": "model",
    "Limits": "model",
    "Picture": "images",
    "PtmHeader": "model",
    "PtmReader": "reader",
    "build_pyramid": "pyramid",
    "check": "codec",
    "decode": "codec",
    "decode_levels": "codec",
    "encode": "encoder",
    "encode_to": "encoder",
    "load_image": "images",
    "open": "reader",
    "read_header": "container",
    "read_image": "images",
    "read_ptm": "images",
    "whole_levels": "container",
    "write_image": "images",
}

__getattr__ = names(__name__, _HOME)
