"""Compiled sampling of textures, and the sums of errors by level (see `tables`)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.compiled import plain_kernel

#: What is shown where nothing is known: 0 to 255.
GREY = 128.0


@plain_kernel
def wrapped(at: float, side: int) -> int:
    """Which texel is at a whole number along a side of a texture that repeats."""
    if 0.0 <= at < side:  # most are, and divisions are dear
        return int(at)
    return int(at - np.floor(at / side) * side) % side


@plain_kernel
def sample(
    texel: NDArray[np.uint8],
    start: int,
    width: int,
    height: int,
    u: float,
    v: float,
    clamp_u: bool,
    clamp_v: bool,
    color: Floats,
) -> None:
    """Writes the bilinear sample of a level at (u, v) to ``color`` (3,), 0 to 255."""
    x, y = u * width - 0.5, v * height - 0.5
    left, top = np.floor(x), np.floor(y)
    across, down = x - left, y - top
    if clamp_u:
        x0 = int(min(max(left, 0.0), width - 1.0))
        x1 = int(min(max(left + 1.0, 0.0), width - 1.0))
    else:
        x0 = wrapped(left, width)
        x1 = x0 + 1 if x0 + 1 < width else 0
    if clamp_v:
        y0 = int(min(max(top, 0.0), height - 1.0))
        y1 = int(min(max(top + 1.0, 0.0), height - 1.0))
    else:
        y0 = wrapped(top, height)
        y1 = y0 + 1 if y0 + 1 < height else 0
    a, b = start + (y0 * width + x0) * 3, start + (y0 * width + x1) * 3
    c, d = start + (y1 * width + x0) * 3, start + (y1 * width + x1) * 3
    for k in range(3):
        upper = texel[a + k] + across * (float(texel[b + k]) - texel[a + k])
        lower = texel[c + k] + across * (float(texel[d + k]) - texel[c + k])
        color[k] = upper + down * (lower - upper)


@plain_kernel
def level_of_detail(
    ray: Floats, axes: Floats, normal: Floats, offset: Floats, gradient: Floats, pixel: float
) -> float:
    """log2 of the texels of the finest level that a pixel covers, as OpenGL has it: the larger of
    the derivatives across and up the screen; -99 where it covers none.

    Parameters
    ----------
    ray: (3,) with component 1 along the view. axes: (2, 3) right and up.
    normal: (3,) of the plane, any length. offset: (3,) from the eye to a point of the plane.
    gradient: (2, 3) texels per metre of u and v. pixel: its side at depth 1.
    """
    facing = normal[0] * ray[0] + normal[1] * ray[1] + normal[2] * ray[2]
    if facing == 0.0:
        return 99.0
    depth = (normal[0] * offset[0] + normal[1] * offset[1] + normal[2] * offset[2]) / facing
    most = 0.0
    for k in range(2):
        slope = (normal[0] * axes[k, 0] + normal[1] * axes[k, 1] + normal[2] * axes[k, 2]) / facing
        total = 0.0
        for c in range(2):
            move = 0.0
            for j in range(3):
                move += gradient[c, j] * (axes[k, j] - ray[j] * slope)
            total += move * move
        most = max(most, total)
    covered = np.sqrt(most) * abs(depth) * pixel
    return float(np.log2(covered)) if covered > 1e-30 else -99.0


@plain_kernel
def texel_under(
    ray: Floats,
    axes: Floats,
    eye: Floats,
    pixel: float,
    corner: Floats,
    normal: Floats,
    gradient: Floats,
    uv: Floats,
    size: Ints,
    offset: Floats,
    scaled: Floats,
) -> tuple[float, float, float]:
    """Texture coordinates of what a pixel shows, and its level of detail (see `level_of_detail`).

    Parameters
    ----------
    corner, normal, uv: (3,), (3,), (2,) of the triangle, and of one of its corners. gradient:
        (2, 3) of u and v, per metre. size: (2,) texels of the finest level.
    offset, scaled: (3,), (2, 3) to work in.
    """
    facing, depth = 0.0, 0.0
    for k in range(3):
        offset[k] = corner[k] - eye[k]
        facing += normal[k] * ray[k]
        depth += normal[k] * offset[k]
        scaled[0, k] = gradient[0, k] * size[0]
        scaled[1, k] = gradient[1, k] * size[1]
    depth = depth / facing if facing != 0.0 else 0.0
    u, v = uv[0], uv[1]
    for k in range(3):
        step = depth * ray[k] - offset[k]
        u += gradient[0, k] * step
        v += gradient[1, k] * step
    return u, v, level_of_detail(ray, axes, normal, offset, scaled, pixel)


@plain_kernel
def add_frame(
    triangle: Ints,
    ray: Floats,
    axes: Floats,
    eye: Floats,
    pixel: float,
    corner: Floats,
    normal: Floats,
    gradient: Floats,
    uv: Floats,
    texture: NDArray[np.int32],
    pair: Ints,
    color: Floats,
    clamped: Bools,
    texel: NDArray[np.uint8],
    start: Ints,
    size: Ints,
    count: Ints,
    mean: Floats,
    full_texel: NDArray[np.uint8],
    full_start: Ints,
    full_size: Ints,
    full_count: Ints,
    same: bool,
    seen: Bools,
    room: Floats,
    error: Floats,
    square: Floats,
    need: Floats,
    sight: Floats,
) -> None:
    """Adds what the pixels of one frame show to the sums of each pair of cell and texture.

    Parameters
    ----------
    triangle: (n,) that each pixel shows, -1 for none. ray: (n, 3). axes: (2, 3). eye: (3,).
    corner, normal, uv: (m, 3, 3), (m, 3), (m, 3, 2) of the triangles. gradient: (m, 2, 3) of u and
        v, per metre. texture, pair, color, clamped: (m,), (m,), (m, 3), (m, 2).
    texel, start, size, count, mean: see `Pyramids`. full_texel, full_start, full_size, full_count:
        of those that the picture is compared with; ``same`` if they are these.
    seen: (n,) whether the pixel is also one of the client's own item buffer.
    room: (L + 7, 3) to work in.
    error, square: (P, L + 2) sums of root mean squares over R, G and B, and of their squares, with
        nothing, the mean colour, level 0, level 1, … as the finest that is there.
    need: (P, L) sums of how much each level is wanted, 0 to 1 a pixel; sight: the same of the
        client's item buffer.
    """
    whole, exact, offset, fine, coarse = room[0], room[1], room[2], room[3], room[4]
    scaled, levels = room[5:7], room[7:]
    for i in range(len(triangle)):
        f = triangle[i]
        if f < 0:
            continue
        p, t = pair[f], texture[f]
        if t < 0:
            total = 0.0
            for k in range(3):
                total += (GREY - 255.0 * color[f, k]) ** 2
            error[p, 0] += np.sqrt(total / 3.0)
            square[p, 0] += total / 3.0
            need[p, 0] += 1.0
            if seen[i]:
                sight[p, 0] += 1.0
            continue
        finest = count[t] - 1
        u, v, detail = texel_under(
            ray[i], axes, eye, pixel, corner[f, 0], normal[f], gradient[f], uv[f, 0],
            size[t, finest], offset, scaled,
        )  # fmt: skip
        detail = min(max(detail, 0.0), float(finest))
        part = detail - int(detail)
        sharp = finest - int(detail)  # the finest level that is sampled
        for n in range(sharp + 1):
            sample(
                texel, start[t, n], size[t, n, 0], size[t, n, 1], u, v, clamped[f, 0],
                clamped[f, 1], levels[n],
            )  # fmt: skip
        below = max(sharp - 1, 0)
        for k in range(3):
            whole[k] = levels[sharp, k] + part * (levels[below, k] - levels[sharp, k])
            exact[k] = whole[k]
        if not same:
            best = full_count[t] - 1
            _, _, away = texel_under(
                ray[i], axes, eye, pixel, corner[f, 0], normal[f], gradient[f], uv[f, 0],
                full_size[t, best], offset, scaled,
            )  # fmt: skip
            away = min(max(away, 0.0), float(best))
            upper = best - int(away)
            lower = max(upper - 1, 0)
            sample(
                full_texel, full_start[t, upper], full_size[t, upper, 0], full_size[t, upper, 1],
                u, v, clamped[f, 0], clamped[f, 1], fine,
            )  # fmt: skip
            sample(
                full_texel, full_start[t, lower], full_size[t, lower, 0], full_size[t, lower, 1],
                u, v, clamped[f, 0], clamped[f, 1], coarse,
            )  # fmt: skip
            for k in range(3):
                exact[k] = fine[k] + (away - int(away)) * (coarse[k] - fine[k])
        # Levels that are finer than what is sampled change nothing.
        for n in range(-2, (sharp if same else finest) + 1):
            total = 0.0
            for k in range(3):
                if n == -2:
                    shown = GREY
                elif n == -1:
                    shown = mean[t, k] * color[f, k]
                else:
                    shown = (levels[n, k] if n < sharp else whole[k]) * color[f, k]
                total += (shown - exact[k] * color[f, k]) ** 2
            error[p, n + 2] += np.sqrt(total / 3.0)
            square[p, n + 2] += total / 3.0
            if n >= 0:
                wanted = min(max(float(finest - n) + 1.0 - detail, 0.0), 1.0)
                need[p, n] += wanted
                if seen[i]:
                    sight[p, n] += wanted
