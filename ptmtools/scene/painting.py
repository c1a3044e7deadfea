"""Colours of vertices of formats whose materials have colours, too."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints
from ptmtools.scene.source import SourceMaterial

_WHITE = (1.0, 1.0, 1.0)
#: With a number from here on colours go to 255: those to 1 may exceed it by rounding.
_BYTES = 2.0


def painted(
    materials: Sequence[SourceMaterial],
    triangles: Ints,
    triangle_material: Ints,
    colored: Ints,
    given: Floats,
) -> tuple[tuple[SourceMaterial, ...], NDArray[np.uint8]]:
    """The materials without their colours where vertices have some, and (T, 3, 3) sRGB of corners.

    ``colored`` are (n,) vertices with colours, and ``given`` these, (n, 3), from 0 to 1 or to 255.
    Corners without a colour of their own keep that of their material, and are white where no corner
    of a material has one.
    """
    finite = np.nan_to_num(given, nan=0.0, posinf=0.0, neginf=0.0)
    scale = 1.0 if finite.max(initial=0.0) >= _BYTES else 255.0
    count = int(max(triangles.max(initial=-1), colored.max(initial=-1))) + 1
    has, color = np.zeros(count, dtype=bool), np.zeros((count, 3), dtype=np.uint8)
    has[colored] = True
    color[colored] = np.rint(np.clip(scale * finite, 0, 255)).astype(np.uint8)
    known = has[triangles]
    touched = np.zeros(len(materials), dtype=bool)
    touched[triangle_material[known.any(axis=1)]] = True
    own = np.array([m.color or _WHITE for m in materials]) * touched[:, None] + ~touched[:, None]
    plain = np.rint(255 * own).astype(np.uint8)[triangle_material]
    found = np.where(known[..., None], color[triangles], plain[:, None])
    kept = (replace(m, color=_WHITE) if t else m for m, t in zip(materials, touched, strict=True))
    return tuple(kept), found
