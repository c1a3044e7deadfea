"""A scene becomes convex cells, portals and cut geometry (paper §3)."""

from ptmtools.cells.model import Cells
from ptmtools.cells.options import SubdivideOptions
from ptmtools.cells.structure import structural_triangles
from ptmtools.cells.subdivide import subdivide

__all__ = ["Cells", "SubdivideOptions", "structural_triangles", "subdivide"]
