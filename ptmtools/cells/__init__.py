"""A scene becomes convex cells, portals and cut geometry (paper §3)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import names

if TYPE_CHECKING:
    from ptmtools.cells.model import Cells
    from ptmtools.cells.naming import structural_triangles
    from ptmtools.cells.options import SubdivideOptions
    from ptmtools.cells.subdivision import subdivide

__all__ = ["Cells", "SubdivideOptions", "structural_triangles", "subdivide"]

__getattr__ = names(
    __name__,
    {
        "Cells": "model",
        "SubdivideOptions": "options",
        "structural_triangles": "naming",
        "subdivide": "subdivision",
    },
)
