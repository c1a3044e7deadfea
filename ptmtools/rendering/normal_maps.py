"""Shading of normal maps: of objects (`ptm build-scene --relief normal-map`), and of materials.

A material's map tilts the normals of its faces, and changes their colours by the share by which the
light of the lamp changes (`ptmtools.rendering.light`). So a level map changes nothing, and walls
with a map are as bright as those without. (Rejected: the light itself, since all other textured
surfaces are unlit, and a lamp at the eye, which fades and shimmers at a slant.)
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, units
from ptmtools.output.object_maps import frame_axes
from ptmtools.output.surfaces import Surfaces
from ptmtools.rendering.kernels import shade
from ptmtools.rendering.light import light_on
from ptmtools.rendering.records import Shows, Sight, triangles_of


def show_relief(
    sight: Sight,
    surfaces: Surfaces,
    shows: Shows,
    loaded: Bools,
    column: Ints,
    lamps: Floats,
    shown: Floats,
) -> None:
    """Lights the pixels ``shown`` (n, 3) of surfaces with the normal map of an object by that,
    instead of the ``lamps`` (m,) on their faces. ``loaded`` (C,): the cells that are drawn;
    ``column`` (T,): of each texture, and without one the faces stay."""
    relief = surfaces.relief
    if relief is None:
        return
    relieved = _with_map(sight, surfaces, relief.number, loaded, column)
    if not len(relieved):
        return
    maps = replace(
        surfaces,
        uv=relief.uv,
        texture=relief.number,
        color=np.ones_like(surfaces.color),
        clamped=np.ones_like(surfaces.clamped),
    )
    value = _sample_maps(sight, maps, shows, loaded, column)
    face = sight.triangle[relieved]
    axes = frame_axes(relief.frame[face])
    normal = np.einsum("nij,nj->ni", axes, value[relieved] / 127.5 - 1)
    shown[relieved] *= (light_on(normal) / lamps[face])[:, None]


def show_bumps(
    sight: Sight, surfaces: Surfaces, shows: Shows, loaded: Bools, column: Ints, shown: Floats
) -> None:
    """Multiplies the pixels ``shown`` (n, 3) of surfaces whose materials have normal maps by the
    light on these, as a share of that on their faces; ``loaded`` and ``column`` as in
    `show_relief`."""
    bumps, maps = surfaces.bumps, surfaces.bump_surfaces
    if bumps is None or maps is None:
        return
    bumped = _with_map(sight, surfaces, bumps.number, loaded, column)
    if not len(bumped):
        return
    triangles = triangles_of(maps)
    value = _sample_maps(sight, maps, shows, loaded, column)[bumped] / 127.5 - 1
    face, ray = sight.triangle[bumped], sight.ray[bumped]
    normal = triangles.normal[face]
    facing = np.einsum("ij,ij->i", normal, ray)
    up = units(np.where(facing[:, None] > 0, -normal, normal))
    # The tangent is the direction along which v stays: across its gradient, to where u grows.
    du, dv = np.moveaxis(triangles.gradient[face], 1, 0)
    right = np.cross(dv, up)
    right = units(np.where(np.einsum("ij,ij->i", right, du)[:, None] < 0, -right, right))
    over = np.cross(up, right)
    # v grows downwards in the image.
    over = np.where(np.einsum("ij,ij->i", over, dv)[:, None] > 0, -over, over)
    scale = bumps.scale[face]
    tilted = right * (value[:, 0] * scale)[:, None] + over * (value[:, 1] * scale)[:, None]
    tilted += up * value[:, 2:]
    flat = ~right.any(axis=1)
    tilted[flat] = up[flat]
    shown[bumped] *= (light_on(tilted) / light_on(up))[:, None]


def _with_map(
    sight: Sight, surfaces: Surfaces, number: NDArray[np.int32], loaded: Bools, column: Ints
) -> Ints:
    """The pixels of drawn surfaces whose map, (m,) ``number``, has a column."""
    some = np.flatnonzero(sight.triangle >= 0)
    face = sight.triangle[some]
    present = (number[face] >= 0) & (column[number[face]] > 0) & loaded[surfaces.cell[face]]
    return some[present]


def _sample_maps(sight: Sight, maps: Surfaces, shows: Shows, loaded: Bools, column: Ints) -> Floats:
    """(n, 3) texels of surfaces with maps as textures, 0 to 255."""
    value = np.empty((len(sight.ray), 3))
    shade(sight, triangles_of(maps), shows, loaded, column, value)
    return value
