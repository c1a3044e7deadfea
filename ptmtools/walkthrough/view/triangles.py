"""The triangles that are drawn, as kernels take them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats
from ptmtools.cells.vectors import normals
from ptmtools.scene.mapping import gradients
from ptmtools.walkthrough.served import Surfaces


class Triangles(NamedTuple):
    """
    Attributes
    ----------
    corner, uv, cell, texture, color, clamped: see `Surfaces`.
    normal: (m, 3) of any length. gradient: (m, 2, 3) of u and v, per metre.
    """

    corner: Floats
    normal: Floats
    uv: Floats
    gradient: Floats
    cell: NDArray[np.int32]
    texture: NDArray[np.int32]
    color: Floats
    clamped: Bools

    @staticmethod
    def of(surfaces: Surfaces) -> Triangles:
        """All of the surfaces."""
        corner, uv = surfaces.corner, surfaces.uv
        return Triangles(
            corner, normals(corner), uv, gradients(corner, uv), surfaces.cell, surfaces.texture,
            surfaces.color, surfaces.clamped,
        )  # fmt: skip
