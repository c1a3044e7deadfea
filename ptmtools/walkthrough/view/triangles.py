"""The surfaces as kernels take them."""

from __future__ import annotations

from ptmtools.cells.vectors import normals
from ptmtools.scene.mapping import gradients
from ptmtools.walkthrough.served import Surfaces
from ptmtools.walkthrough.view.records import Triangles


def triangles_of(surfaces: Surfaces) -> Triangles:
    """All of them."""
    corner, uv = surfaces.corner, surfaces.uv
    return Triangles(
        corner, normals(corner), uv, gradients(corner, uv), surfaces.cell, surfaces.texture,
        surfaces.color, surfaces.clamped,
    )  # fmt: skip
