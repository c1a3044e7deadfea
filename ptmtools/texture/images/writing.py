"""Texels into image files; the suffix decides which, and only what is exact is written."""

from __future__ import annotations

import os
from collections.abc import Callable
from importlib import import_module
from pathlib import PurePath
from typing import IO, Any

from numpy.typing import NDArray

from ptmtools.errors import OutputError, naming
from ptmtools.texture.model import Description

Samples = NDArray[Any]
_PLAIN = Description()
#: Suffixes of formats that would change texels, or might.
LOSSY = (".jpg", ".jpeg", ".jxl", ".webp", ".avif", ".heic", ".gif")


def write_image(
    path: str | os.PathLike[str],
    texels: Samples,
    description: Description = _PLAIN,
    force: bool = False,
) -> None:
    """Write (h, w, c) texels, 1 to 4 components, as an image file, whole or not at all.

    By suffix: .png uint8 and uint16; .npy and .tif anything; .hdr and .exr floats, .hdr only what
    it holds exactly (levels of a Radiance picture below the finest are seldom that). PNG and TIFF
    keep the description, the others keep none of it.

    Raises
    ------
    OutputError: PTM-O101 another suffix, PTM-O102 a format that does not hold these samples, and
        those of `ptmtools.files.write_with`.
    MissingComponentError: PTM-M101 OpenEXR is not installed.
    """
    from ptmtools.files import refuse_existing, write_with

    suffix = PurePath(path).suffix
    with naming(path):
        writer(suffix)
        if not force:
            refuse_existing(path)
        write_with(path, lambda file: write_to(file, suffix, texels, description), force=force)


def write_to(
    file: IO[bytes], suffix: str, texels: Samples, description: Description = _PLAIN
) -> None:
    """As `write_image`, into an open file."""
    writer(suffix)(file, texels, description)


Writer = Callable[[IO[bytes], "Samples", Description], object]


def writer(suffix: str) -> Writer:
    """What writes files of that suffix. Raises OutputError PTM-O101."""
    found = WRITTEN.get(suffix.lower())
    if found is None:
        lossy = suffix.lower() in LOSSY
        why = "is lossy and would change the texels" if lossy else "is not written"
        raise OutputError(
            "PTM-O101",
            f"the suffix {suffix!r} {why}",
            remedy=f"use one of {', '.join(WRITTEN)}",
        )
    write: Writer = getattr(import_module(f"ptmtools.texture.images.{found}"), f"save_{found}")
    return write


#: The module, and its function ``save_…``, that writes files of each suffix.
WRITTEN = {
    ".png": "png",
    ".npy": "npy",
    ".tif": "tiff",
    ".tiff": "tiff",
    ".hdr": "radiance",
    ".exr": "openexr",
}
