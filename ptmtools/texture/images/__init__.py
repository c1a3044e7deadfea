"""Reading and writing image files without ever changing a texel silently.

Nothing is scaled, rounded or converted on the way: what a format cannot hold exactly, or what a
`.ptm` cannot, is an error that says so. Colour and orientation are *kept*, not applied: texels are
numbers, in the order of the file's rows, and what the file says of them goes into a
`ptmtools.texture.Description`. The exception is TIFF, whose orientation says how its rows are
stored; it is applied.
"""

from __future__ import annotations

from ptmtools.texture.images.files import (
    SUFFIXES,
    WRITTEN,
    check_image,
    load_image,
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
    "check_image",
    "load_image",
    "png_bytes",
    "read_image",
    "read_ptm",
    "write_image",
    "write_to",
]
