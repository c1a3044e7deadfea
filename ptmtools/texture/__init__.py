"""One image and one `.ptm`: the progressive texture map codec (paper §4).

The names below are loaded when first used, so that importing this package costs nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import lazy_exports

if TYPE_CHECKING:
    from ptmtools.texture.container import read_header as read_header, whole_levels as whole_levels
    from ptmtools.texture.encoder import encode as encode, encode_to as encode_to
    from ptmtools.texture.images import (
        Picture as Picture,
        load_image as load_image,
        read_image as read_image,
        read_ptm as read_ptm,
        write_image as write_image,
    )
    from ptmtools.texture.model import (
        Description as Description,
        EncodeOptions as EncodeOptions,
        Level as Level,
        Limits as Limits,
        PtmHeader as PtmHeader,
    )
    from ptmtools.texture.pyramid import build_pyramid as build_pyramid
    from ptmtools.texture.reader import (
        PtmReader as PtmReader,
        check as check,
        decode as decode,
        decode_levels as decode_levels,
        open as open,
    )

__getattr__ = lazy_exports(
    __name__,
    {
        "ptmtools.texture.container": "read_header whole_levels",
        "ptmtools.texture.encoder": "encode encode_to",
        "ptmtools.texture.images": "Picture load_image read_image read_ptm write_image",
        "ptmtools.texture.model": "Description EncodeOptions Level Limits PtmHeader",
        "ptmtools.texture.pyramid": "build_pyramid",
        "ptmtools.texture.reader": "PtmReader check decode decode_levels open",
    },
)
