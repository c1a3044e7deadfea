"""The normal maps of materials on the triangles of served geometry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.output.gltf import WRAPS
from ptmtools.output.gltf_reader import ReadPrimitive


@dataclass(frozen=True)
class Bumps:
    """The normal maps of materials on triangles.

    Attributes
    ----------
    number: (n,) int32, the normal map in the hints, -1 without.
    uv: (n, 3, 2) float64 coordinates in it, origin at the upper left; 0 without one.
    scale: (n,) factor of x and y of its normals.
    clamped: (n, 2) as in `Surfaces`.
    """

    number: NDArray[np.int32]
    uv: Floats
    scale: Floats
    clamped: Bools


def bumps_of(shapes: list[ReadPrimitive], count: list[int]) -> Bumps | None:
    """Those of shapes with ``count`` triangles each, except those that blend, which the page shows
    without; None if there are none."""
    drawn = [p.normal is not None and not _blends(p) for p in shapes]
    if not any(drawn):
        return None
    number = [p.material.normal if has else -1 for p, has in zip(shapes, drawn, strict=True)]
    clamped = [[wrap == WRAPS["clamp"] for wrap in p.material.normal_wrap] for p in shapes]
    return Bumps(
        np.repeat(np.array(number, np.int32), count),
        np.concatenate([corners_of(p.normal, p.triangle) for p in shapes]),
        np.repeat([float(p.material.scale) for p in shapes], count),
        np.repeat(np.array(clamped, np.bool_), count, axis=0),
    )


def _blends(shape: ReadPrimitive) -> bool:
    return shape.material.blends and shape.material.cutoff is None


def corners_of(uv: NDArray[np.float32] | None, triangle: Ints) -> Floats:
    """(m, 3, 2) coordinates of the corners of triangles; 0 without."""
    return np.zeros((len(triangle), 3, 2)) if uv is None else uv.astype(np.float64)[triangle]
