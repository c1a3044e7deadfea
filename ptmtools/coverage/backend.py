"""Which renderer draws the item buffers."""

from __future__ import annotations

import numpy as np

from ptmtools.cells.model import Cells
from ptmtools.coverage.embree import EmbreeRenderer
from ptmtools.coverage.item_buffer import VIEWS, Renderer, Surfaces
from ptmtools.coverage.opengl import OpenGLRenderer, create_context, is_software
from ptmtools.coverage.options import AchOptions
from ptmtools.errors import MissingComponentError
from ptmtools.visibility.model import Pvs

#: What a sample point costs, in µs: Mesa's rasteriser for each triangle (of the PVS, in those of
#: the six views that it can show in) and each pixel, Embree for each ray. Fitted to
#: `benchmarks/ach.py`; only their proportions matter.
RASTER_TRIANGLE = 1.0
RASTER_PIXEL = 0.05
RAY = 0.25


def rasterising_pays(triangles: float, face: int) -> bool:
    """Whether Mesa's software rasteriser is expected to be faster than rays, from the size of the
    task alone: never from the clock, the load or the number of workers. ``triangles``: those of
    the PVS of a cell, on average."""
    pixels = len(VIEWS) * face * face
    return RASTER_TRIANGLE * triangles + RASTER_PIXEL * pixels <= RAY * pixels


def triangles_of_a_pvs(cells: Cells, pvs: Pvs) -> float:
    """How many pieces of triangles the cells of a PVS have, on average over the cells."""
    if not cells.cell_count:
        return 0.0
    front, back = cells.triangle_cell.T
    each = np.bincount(front[front >= 0], minlength=cells.cell_count)
    each += np.bincount(back[(back >= 0) & (back != front)], minlength=cells.cell_count)
    return float(each[pvs.cell].sum()) / cells.cell_count


def open_renderer(surfaces: Surfaces, cells: Cells, pvs: Pvs, options: AchOptions) -> Renderer:
    """The renderer that the options name, ready to draw.

    "auto" is OpenGL wherever there is hardware for it; on a software OpenGL whichever of the two
    `rasterising_pays` expects to be faster; Embree where there is no OpenGL.

    Raises `MissingComponentError` PTM-M500 if "gl" or a device is asked for and there is no OpenGL.
    """
    context = None
    if options.backend == "gl":
        context = create_context(options.gpu)
    elif options.backend == "auto":
        try:
            context = create_context(options.gpu)
        except MissingComponentError:
            if options.gpu is not None:  # who names a device wants that one
                raise
    if context is None:
        return EmbreeRenderer(surfaces, options.side)
    software = is_software(context.info["GL_RENDERER"])
    slow = software and not rasterising_pays(triangles_of_a_pvs(cells, pvs), options.side)
    if options.backend == "auto" and slow:
        context.release()
        return EmbreeRenderer(surfaces, options.side)
    return OpenGLRenderer(context, surfaces, options.side)
