"""Whether some texel that a surface uses is not opaque.

Atlases often have an alpha channel that is below 255 only where no face takes its colours from,
so the whole image says nothing, and neither do the bounding boxes of faces. A summed-area table
sorts out, for all triangles at once, those whose box holds no such texel; the others are tested
texel by texel. A texel counts as used if the triangle reaches into the square that bilinear
filtering spreads it over, two texels wide. Rasterising with Pillow was rejected: its polygons
miss texels at slivers and corners, and that errs to the wrong side.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.scene.model import Wrap

#: A triangle repeating the image more often than this, counted in images, is taken to use all.
_MANY_TILES = 16
#: Texels tested at once.
_BATCH = 1 << 20


def uses_holes(
    holes: NDArray[np.bool_], uv: NDArray[np.float64], wrap_s: Wrap, wrap_t: Wrap
) -> bool:
    """Whether some triangle uses a texel that is not opaque.

    Parameters
    ----------
    holes: (H, W) bool, rows from the top.
    uv: (T, 3, 2) float64, origin at the lower left.
    wrap_s, wrap_t: what lies beyond [0, 1].
    """
    if not holes.any() or not len(uv):
        return False
    if holes.all():
        return True
    height, width = holes.shape
    wraps: tuple[Wrap, Wrap] = (wrap_s, wrap_t)
    with np.errstate(over="ignore"):
        texel = np.stack([uv[..., 0] * width, (1.0 - uv[..., 1]) * height], axis=2)
    if not np.isfinite(texel).all():
        return True
    # Texel i spreads over the open interval (i - 0.5, i + 1.5).
    low = np.floor(texel.min(axis=1) - 0.5)
    high = np.ceil(texel.max(axis=1) + 0.5)
    span = (high - low) / [width, height]
    # Beyond a clamped edge a triangle smears: its box stands for it.
    smeared = np.zeros(len(uv), dtype=bool)
    for axis, size in enumerate((width, height)):
        if wraps[axis] == "clamp":
            smeared |= (texel[..., axis].min(axis=1) < 0) | (texel[..., axis].max(axis=1) > size)
            low[:, axis] = np.clip(low[:, axis], 0, size - 1)
            high[:, axis] = np.clip(high[:, axis], 1, size)
            span[:, axis] = np.minimum(span[:, axis], 1.0)
    if (span.prod(axis=1) > _MANY_TILES).any():
        return True
    # Whole images away the texels are the same; near zero the numbers stay small and exact.
    for axis, size in enumerate((width, height)):
        if wraps[axis] == "repeat":
            shift = np.floor(low[:, axis] / size) * size
            low[:, axis] -= shift
            high[:, axis] -= shift
            texel[..., axis] -= shift[:, None]

    box = np.concatenate([low, high], axis=1).astype(np.int64)
    table = _table(holes)
    inside = np.zeros(len(box), dtype=np.int64)
    for sign_x, x in ((-1, box[:, 0]), (1, box[:, 2])):
        for sign_y, y in ((-1, box[:, 1]), (1, box[:, 3])):
            inside += sign_x * sign_y * _up_to(table, x, y)
    if (smeared & (inside > 0)).any():
        return True
    candidates = np.flatnonzero(inside)
    # The smallest first: a used hole is found soonest where there is little to test.
    spans = (box[:, 2] - box[:, 0]) * (box[:, 3] - box[:, 1])
    return any(
        _touches(holes, texel[t], box[t])
        for t in candidates[np.argsort(spans[candidates], kind="stable")]
    )


def _table(holes: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(H + 1, W + 1) number of holes above and to the left."""
    table = np.zeros((holes.shape[0] + 1, holes.shape[1] + 1), dtype=np.int64)
    table[1:, 1:] = holes.cumsum(axis=0, dtype=np.int64).cumsum(axis=1)
    return table


def _up_to(
    table: NDArray[np.int64], x: NDArray[np.int64], y: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Holes in [0, x) × [0, y) of the plane tiled with the image."""
    height, width = table.shape[0] - 1, table.shape[1] - 1
    tiles_x, rest_x = np.divmod(x, width)
    tiles_y, rest_y = np.divmod(y, height)
    count: NDArray[np.int64] = (
        tiles_x * tiles_y * table[-1, -1]
        + tiles_x * table[rest_y, -1]
        + tiles_y * table[-1, rest_x]
        + table[rest_y, rest_x]
    )
    return count


def _touches(
    holes: NDArray[np.bool_],
    triangle: NDArray[np.float64],
    box: NDArray[np.int64],
) -> bool:
    """Whether a triangle in texels reaches into the square of a hole within its box."""
    height, width = holes.shape
    x0, y0, x1, y1 = box.tolist()
    columns, rows = np.arange(x0, x1), np.arange(y0, y1)
    column_of, row_of = columns % width, rows % height
    (ax, ay), (bx, by), (cx, cy) = triangle.tolist()
    if (bx - ax) * (cy - ay) - (by - ay) * (cx - ax) < 0:
        bx, by, cx, cy = cx, cy, bx, by
    step = max(1, _BATCH // max(1, len(columns)))
    for start in range(0, len(rows), step):
        window = holes[row_of[start : start + step]][:, column_of]
        y, x = np.nonzero(window)
        # The middle of each texel; its square reaches one texel to every side.
        px, py = columns[x] + 0.5, rows[start + y] + 0.5
        hit = (min(ax, bx, cx) < px + 1) & (max(ax, bx, cx) > px - 1)
        hit &= (min(ay, by, cy) < py + 1) & (max(ay, by, cy) > py - 1)
        for ux, uy, vx, vy in ((ax, ay, bx, by), (bx, by, cx, cy), (cx, cy, ax, ay)):
            ex, ey = vx - ux, vy - uy
            reach = abs(ex) + abs(ey)
            # Outside only if the whole square lies strictly on the wrong side of an edge.
            hit &= ex * (py - uy) - ey * (px - ux) + reach >= 0
        if hit.any():
            return True
    return False
