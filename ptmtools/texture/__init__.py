"""One image and one `.ptm`: the progressive texture map codec (paper §4).

The names below are loaded when first used, so that importing this package costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ptmtools.texture.codec import check, decode, decode_levels, encode
    from ptmtools.texture.container import read_header, whole_levels
    from ptmtools.texture.images import read_image, read_ptm, write_png
    from ptmtools.texture.model import EncodeOptions, Level, Limits, PtmHeader
    from ptmtools.texture.pyramid import build_pyramid

__all__ = [
    "EncodeOptions",
    "Level",
    "Limits",
    "PtmHeader",
    "build_pyramid",
    "check",
    "decode",
    "decode_levels",
    "encode",
    "read_header",
    "read_image",
    "read_ptm",
    "whole_levels",
    "write_png",
]

_HOME = {
    "EncodeOptions": "model",
    "Level": "model",
    "Limits": "model",
    "PtmHeader": "model",
    "build_pyramid": "pyramid",
    "check": "codec",
    "decode": "codec",
    "decode_levels": "codec",
    "encode": "codec",
    "read_header": "container",
    "read_image": "images",
    "read_ptm": "images",
    "whole_levels": "container",
    "write_png": "images",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
