"""GPU image interlacing: an image as a row of files that sharpen it step by step (Englert et al.,
"Efficient Image Distribution on the Web", 2014). One of the systems beside `.ptm`; the format
is in docs/formats/interlace.md.

The names below are loaded when first used, so that importing this package costs nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import lazy_exports

if TYPE_CHECKING:
    from ptmtools_systems.interlace.model import (
        Axis as Axis,
        Interlaced as Interlaced,
        InterlacedFile as InterlacedFile,
        InterlaceOptions as InterlaceOptions,
    )
    from ptmtools_systems.interlace.reading import (
        deinterlace as deinterlace,
        read_manifest as read_manifest,
        validate_interlaced as validate_interlaced,
    )
    from ptmtools_systems.interlace.steps import join as join, split as split
    from ptmtools_systems.interlace.writing import (
        interlace as interlace,
        write_folder as write_folder,
    )

__getattr__ = lazy_exports(
    __name__,
    {
        "ptmtools_systems.interlace.model": "Axis Interlaced InterlacedFile InterlaceOptions",
        "ptmtools_systems.interlace.reading": "deinterlace read_manifest validate_interlaced",
        "ptmtools_systems.interlace.steps": "join split",
        "ptmtools_systems.interlace.writing": "interlace write_folder",
    },
)
