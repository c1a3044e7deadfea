"""GPU image interlacing: an image as a row of files that sharpen it step by step (Englert et al.,
"Efficient Image Distribution on the Web", 2014). One of the systems beside `.ptm`; the format
is in docs/formats/interlace.md.

The names below are loaded when first used, so that importing this package costs nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import lazy_exports

if TYPE_CHECKING:
    from ptmtools.neighbours.interlace.model import (
        Axis as Axis,
        Interlaced as Interlaced,
        InterlaceOptions as InterlaceOptions,
        Part as Part,
    )
    from ptmtools.neighbours.interlace.reading import (
        deinterlace as deinterlace,
        read_manifest as read_manifest,
        validate_interlaced as validate_interlaced,
    )
    from ptmtools.neighbours.interlace.steps import join as join, split as split
    from ptmtools.neighbours.interlace.writing import (
        interlace as interlace,
        write_folder as write_folder,
    )

__getattr__ = lazy_exports(
    __name__,
    {
        "ptmtools.neighbours.interlace.model": "Axis Interlaced InterlaceOptions Part",
        "ptmtools.neighbours.interlace.reading": "deinterlace read_manifest validate_interlaced",
        "ptmtools.neighbours.interlace.steps": "join split",
        "ptmtools.neighbours.interlace.writing": "interlace write_folder",
    },
)
