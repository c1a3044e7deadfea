"""Reading and writing image files without ever changing a texel silently.

Nothing is scaled, rounded or converted on the way: texels that a format or a `.ptm` cannot hold
exactly are an error, except for `open_shallow`, which says what it converts. Colour and orientation
are *kept*, not applied: texels are numbers, in the order of the file's rows, and the file's
description of them goes into a `ptmtools.texture.Description`. The exception is TIFF, whose
orientation says how its rows are stored; it is applied.
"""

from __future__ import annotations

from ptmtools.texture.images.files import (
    SUFFIXES,
    WRITTEN,
    load_image,
    open_shallow,
    read_image,
    read_ptm,
    write_image,
    write_to,
)
from ptmtools.texture.images.picture import Picture
from ptmtools.texture.images.png import png_bytes

__all__ = [
    "SUFFIXES",
    "WRITTEN",
    "Picture",
    "load_image",
    "open_shallow",
    "png_bytes",
    "read_image",
    "read_ptm",
    "write_image",
    "write_to",
]
