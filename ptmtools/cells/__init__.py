"""A scene becomes convex cells, portals and cut geometry (paper §3)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import lazy_exports

if TYPE_CHECKING:
    from ptmtools.cells.model import Cells as Cells
    from ptmtools.cells.options import SubdivideOptions as SubdivideOptions
    from ptmtools.cells.structure import structural_triangles as structural_triangles
    from ptmtools.cells.subdivision import subdivide as subdivide

__getattr__ = lazy_exports(
    __name__,
    {
        "ptmtools.cells.model": "Cells",
        "ptmtools.cells.options": "SubdivideOptions",
        "ptmtools.cells.structure": "structural_triangles",
        "ptmtools.cells.subdivision": "subdivide",
    },
)
