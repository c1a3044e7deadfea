"""Compiled texture sampling, as in OpenGL.

Functions called for every pixel are inlined: a call that passes all arrays of the records takes
1.5 times as long.
"""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.jit import inlined_kernel, kernel, plain_kernel
from ptmtools.rendering.records import Pyramids, Shows, Sight, Triangles

#: Colour of pixels without data, 0 to 255.
GREY = 128.0
#: A texture that moves by fewer texels from a pixel to the next is constant.
_CONSTANT = 1e-30


@plain_kernel
def wrap(at: float, side: int) -> int:
    """Wraps a whole number of texels into the side of a repeating texture."""
    if 0.0 <= at < side:  # the usual case, without a division
        return int(at)
    return int(at - np.floor(at / side) * side) % side


@plain_kernel
def adjacent_texels(at: float, side: int, clamped: bool) -> tuple[int, int, float]:
    """Returns the two texels adjacent to a texture coordinate and the weight of the second."""
    place = at * side - 0.5
    low = np.floor(place)
    if clamped:
        last = side - 1.0
        first, second = int(min(max(low, 0.0), last)), int(min(max(low + 1.0, 0.0), last))
    else:
        first = wrap(low, side)
        second = first + 1 if first + 1 < side else 0
    return first, second, place - low


@inlined_kernel
def sample(
    textures: Pyramids, t: int, level: int, u: float, v: float, clamped: Bools, color: Floats
) -> None:
    """Writes the bilinear sample of a level of a texture at (u, v) to ``color`` (3,), 0 to 255;
    ``clamped`` (2,): see `Surfaces`."""
    texel, start = textures.texel, textures.start[t, level]
    width, height = textures.size[t, level, 0], textures.size[t, level, 1]
    x0, x1, across = adjacent_texels(u, width, clamped[0])
    y0, y1, down = adjacent_texels(v, height, clamped[1])
    a, b = start + (y0 * width + x0) * 3, start + (y0 * width + x1) * 3
    c, d = start + (y1 * width + x0) * 3, start + (y1 * width + x1) * 3
    for k in range(3):
        upper = texel[a + k] + across * (float(texel[b + k]) - texel[a + k])
        lower = texel[c + k] + across * (float(texel[d + k]) - texel[c + k])
        color[k] = upper + down * (lower - upper)


@plain_kernel
def blend(
    textures: Pyramids,
    t: int,
    detail: float,
    u: float,
    v: float,
    clamped: Bools,
    color: Floats,
    coarse: Floats,
) -> None:
    """Writes the trilinear sample at a level of detail, from 0 to the coarsest level, to ``color``
    (3,), 0 to 255; ``coarse`` (3,) is a scratch buffer."""
    sharp = textures.levels[t] - 1 - int(detail)
    sample(textures, t, sharp, u, v, clamped, color)
    sample(textures, t, max(sharp - 1, 0), u, v, clamped, coarse)
    for k in range(3):
        color[k] += (detail - int(detail)) * (coarse[k] - color[k])


@plain_kernel
def level_of_detail(
    ray: Floats, axes: Floats, normal: Floats, offset: Floats, gradient: Floats, pixel: float
) -> float:
    """Returns log2 of the number of finest texels per pixel, as defined by OpenGL: the larger of
    the derivatives across and up the screen; -99 for a constant texture, 99 for a plane seen
    edge-on.

    Parameters
    ----------
    ray: (3,) with component 1 along the view. axes: (2, 3) right and up.
    normal: (3,) of the plane, any length. offset: (3,) from the eye to a point of the plane.
    gradient: (2, 3) texels per metre of u and v. pixel: side of a pixel at depth 1.
    """
    facing = normal[0] * ray[0] + normal[1] * ray[1] + normal[2] * ray[2]
    if facing == 0.0:
        return 99.0
    depth = (normal[0] * offset[0] + normal[1] * offset[1] + normal[2] * offset[2]) / facing
    largest = 0.0
    for k in range(2):
        slope = (normal[0] * axes[k, 0] + normal[1] * axes[k, 1] + normal[2] * axes[k, 2]) / facing
        total = 0.0
        for c in range(2):
            move = 0.0
            for j in range(3):
                move += gradient[c, j] * (axes[k, j] - ray[j] * slope)
            total += move * move
        largest = max(largest, total)
    covered = np.sqrt(largest) * abs(depth) * pixel
    return float(np.log2(covered)) if covered > _CONSTANT else -99.0


@inlined_kernel
def texel_under(
    sight: Sight, i: int, triangles: Triangles, textures: Pyramids, t: int, scratch: Floats
) -> tuple[float, float, float]:
    """Returns the texture coordinates at pixel ``i`` and its level of detail (`level_of_detail`) in
    pyramid ``t``, clamped to 0 … coarsest level.

    ``scratch`` (3, 3) is overwritten.
    """
    f = sight.triangle[i]
    finest = textures.levels[t] - 1
    ray, normal, gradient = sight.ray[i], triangles.normal[f], triangles.gradient[f]
    offset, scaled = scratch[0], scratch[1:]
    facing, depth = 0.0, 0.0
    for k in range(3):
        offset[k] = triangles.corner[f, 0, k] - sight.eye[k]
        facing += normal[k] * ray[k]
        depth += normal[k] * offset[k]
        scaled[0, k] = gradient[0, k] * textures.size[t, finest, 0]
        scaled[1, k] = gradient[1, k] * textures.size[t, finest, 1]
    depth = depth / facing if facing != 0.0 else 0.0
    u, v = triangles.uv[f, 0, 0], triangles.uv[f, 0, 1]
    for k in range(3):
        step = depth * ray[k] - offset[k]
        u += gradient[0, k] * step
        v += gradient[1, k] * step
    detail = level_of_detail(ray, sight.axes, normal, offset, scaled, sight.pixel)
    return u, v, min(max(detail, 0.0), float(finest))


@kernel
def shade(
    sight: Sight,
    triangles: Triangles,
    shows: Shows,
    loaded: Bools,
    column: Ints,
    shown: Floats,
) -> None:
    """Writes the colours of the pixels of a frame, 0 to 255, to ``shown`` (n, 3).

    Pixels without loaded geometry are grey, textures without loaded levels have their mean colour,
    the background is black. ``loaded`` (C,): whether the geometry of a cell is loaded; ``column``
    (T,): loaded column of each texture.
    """
    work, coarse = np.zeros((3, 3)), np.zeros(3)
    for i in range(len(sight.triangle)):
        f, pixel = sight.triangle[i], shown[i]
        if f < 0:
            pixel[:] = 0.0
            continue
        if not loaded[triangles.cell[f]]:
            pixel[:] = GREY
            continue
        t = triangles.texture[f]
        loaded_level = column[t] if t >= 0 else 0
        if loaded_level > 0:
            textures, row = shows.pyramids, shows.row[t, loaded_level]
            u, v, detail = texel_under(sight, i, triangles, textures, row, work)
            # The finest loaded level bounds the level of detail from below.
            detail = max(detail, float(textures.levels[row] - shows.held[t, loaded_level]))
            blend(textures, row, detail, u, v, triangles.clamped[f], pixel, coarse)
        else:
            for k in range(3):
                pixel[k] = shows.mean[t, k] if t >= 0 else 255.0
        for k in range(3):
            pixel[k] *= triangles.color[f, k]
