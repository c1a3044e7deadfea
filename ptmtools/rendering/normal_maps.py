"""Shading of normal maps (`ptm build-scene --relief normal-map`)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.neighbours.apo.normal_map import axes_of
from ptmtools.output.served import Surfaces
from ptmtools.rendering.kernels import shade
from ptmtools.rendering.light import light_on
from ptmtools.rendering.records import Pyramids, Sight, own_levels, triangles_of


def show_relief(
    sight: Sight, surfaces: Surfaces, pyramids: Pyramids, column: Ints, lamps: Floats, shown: Floats
) -> None:
    """Lights the pixels ``shown`` (n, 3) of surfaces with a normal map by that, instead of the
    ``lamps`` (m,) on their faces; ``column`` (T,): levels of each texture."""
    relief = surfaces.relief
    if relief is None:
        return
    relieved = np.flatnonzero(sight.triangle >= 0)
    relieved = relieved[relief.number[sight.triangle[relieved]] >= 0]
    maps = replace(
        surfaces,
        uv=relief.uv,
        texture=relief.number,
        color=np.ones_like(surfaces.color),
        clamped=np.ones_like(surfaces.clamped),
    )
    value = np.empty_like(shown)
    loaded = np.ones(int(surfaces.cell.max(initial=-1)) + 1, np.bool_)
    shade(sight, triangles_of(maps), own_levels(pyramids), loaded, column, value)
    face = sight.triangle[relieved]
    axes = axes_of(relief.frame[face])
    normal = np.einsum("nij,nj->ni", axes, value[relieved] / 127.5 - 1)
    shown[relieved] *= (light_on(normal) / lamps[face])[:, None]
