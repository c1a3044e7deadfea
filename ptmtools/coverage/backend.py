"""Which renderer draws the item buffers."""

from __future__ import annotations

import contextlib

from ptmtools.coverage.embree import EmbreeRenderer
from ptmtools.coverage.item_buffer import VIEWS, Renderer, Surfaces
from ptmtools.coverage.opengl import OpenGLRenderer, create_context, is_software
from ptmtools.coverage.options import AchOptions
from ptmtools.errors import MissingComponentError

#: What a sample point costs, in µs: Mesa's rasteriser for each triangle (six views of it) and each
#: pixel, Embree for each ray. Fitted to `benchmarks/ach.py`; only their proportions matter.
RASTER_TRIANGLE = 1.0
RASTER_PIXEL = 0.05
RAY = 0.25


def rasterising_pays(triangles: int, face: int) -> bool:
    """Whether Mesa's software rasteriser is expected to be faster than rays, from the size of the
    task alone: never from the clock, the load or the number of workers."""
    pixels = len(VIEWS) * face * face
    return RASTER_TRIANGLE * triangles + RASTER_PIXEL * pixels <= RAY * pixels


def open_renderer(surfaces: Surfaces, options: AchOptions) -> Renderer:
    """The renderer that the options name, ready to draw.

    "auto" is OpenGL wherever there is hardware for it; on a software OpenGL whichever of the two
    `rasterising_pays` expects to be faster; Embree where there is no OpenGL.

    Raises `MissingComponentError` PTM-M500 if "gl" is asked for and there is no OpenGL.
    """
    context = None
    if options.backend == "gl":
        context = create_context()
    elif options.backend == "auto":
        with contextlib.suppress(MissingComponentError):
            context = create_context()
    if context is None:
        return EmbreeRenderer(surfaces, options.face)
    software = is_software(context.info["GL_RENDERER"])
    slow = software and not rasterising_pays(len(surfaces.cell), options.face)
    if options.backend == "auto" and slow:
        context.release()
        return EmbreeRenderer(surfaces, options.face)
    return OpenGLRenderer(context, surfaces, options.face)
