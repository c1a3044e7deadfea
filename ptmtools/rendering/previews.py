"""Decodes previews: ordinary lossy images of single levels of textures.

A preview of level n shows that level and, halved by means of 2 × 2 texels, all coarser ones. Its
image is as Pillow decodes it; browsers decode JPEG with other chroma filters, which moves single
texels by a few steps of 255.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import DatabaseError
from ptmtools.output.model import sizes_of
from ptmtools.output.served import BUILD, Served
from ptmtools.texture.previews import decode_preview
from ptmtools.texture.pyramid import build_pyramid

Texels = NDArray[np.uint8]


def read_preview(served: Served, texture: int, number: int, *, alpha: bool = False) -> list[Texels]:
    """The levels of a preview, the coarsest first, as (h, w, 3) RGB, or with ``alpha`` (h, w, 4),
    without offsets.

    Raises DatabaseError: PTM-D005, D006 it is missing, damaged or does not match the index.
    """
    row = served.index["textures"][texture]
    preview = row["previews"][number]
    file = served.file(preview["file"])
    sizes = sizes_of(row)[: preview["level"] + 1]
    levels = build_pyramid(_decode(file, served.read(preview["file"]), 3 + alpha))[-len(sizes) :]
    if [level.shape[1::-1] for level in levels] != sizes:
        raise _damage_error(file, "does not match the index")
    return [np.ascontiguousarray(level) for level in levels]


def _decode(file: Path, data: bytes, components: int) -> Texels:
    """(h, w, components) the texels of an image."""
    try:
        return decode_preview(data, components)
    except (OSError, ValueError, SyntaxError) as fault:
        raise _damage_error(file, f"cannot be decoded ({fault})") from None


def _damage_error(file: Path, problem: str) -> DatabaseError:
    return DatabaseError("PTM-D006", problem, file=file, remedy=BUILD)
