"""Tests whether the faces of a material use transparent texels.

Atlases often have alpha below 255 only in regions that no face uses, so neither the whole image nor
the bounding boxes of faces decide. A summed-area table excludes, for all triangles at once, those
whose box contains no transparent texel (*hole*); the others are tested row by row. A triangle uses
a texel if it overlaps the square, two texels wide, over which bilinear filtering spreads it; the
used texels of a row are one run, in which the table counts holes. (Rejected: testing texel by
texel. A thousand large triangles beside the holes of an image of 4096², files of 50 KB, take a
quarter of an hour. Rasterising with Pillow: its polygons omit texels at slivers and corners, which
is an error to the wrong side.)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.scene.model import Wrap

#: A triangle over more repetitions of the image than this is assumed to use every texel.
_MANY_TILES = 16
#: Texels by which a box is smaller, against rounding.
_INSET = 1e-3
#: Widening of a run against rounding, relative to a texel or its distance from the origin.
_SLACK = 1e-9


def near_holes(holes: Bools, uv: Floats, wrap_s: Wrap, wrap_t: Wrap) -> Bools:
    """(T,) whether the box of each triangle has a texel that is not opaque. What filtering spreads
    from beside the box, as from the next tile of an atlas, does not count. See `uses_holes`."""
    _, box, tiles, _ = _boxes(holes, uv, (wrap_s, wrap_t), -_INSET)
    box[:, 2:] = np.maximum(box[:, 2:], box[:, :2] + 1)
    result = tiles > _MANY_TILES
    result[~result] = _holes_in(_table(holes), box[~result].astype(np.int64)) > 0
    return result


def uses_holes(holes: Bools, uv: Floats, wrap_s: Wrap, wrap_t: Wrap) -> bool:
    """Whether some triangle uses a texel that is not opaque.

    Parameters
    ----------
    holes: (H, W) bool, rows from the top, the texels that are not opaque.
    uv: (T, 3, 2) float64, origin at the lower left.
    wrap_s, wrap_t: wrap modes beyond [0, 1].
    """
    if not holes.any() or not len(uv):
        return False
    if holes.all():
        return True
    # Texel i spreads over the open interval (i - 0.5, i + 1.5).
    texel, box, tiles, smeared = _boxes(holes, uv, (wrap_s, wrap_t), 0.5)
    if not np.isfinite(texel).all() or (tiles > _MANY_TILES).any():
        return True
    table, whole = _table(holes), box.astype(np.int64)
    inside = _holes_in(table, whole)
    # Beyond a clamped edge a triangle smears; its box is used instead.
    if (smeared & (inside > 0)).any():
        return True
    candidates = np.flatnonzero(inside)
    # The smallest first, which are the cheapest to test.
    spans = (whole[:, 2] - whole[:, 0]) * (whole[:, 3] - whole[:, 1])
    return any(
        _touches(table, texel[t], whole[t])
        for t in candidates[np.argsort(spans[candidates], kind="stable")]
    )


def _boxes(
    holes: Bools, uv: Floats, wraps: tuple[Wrap, Wrap], spread: float
) -> tuple[Floats, Floats, Floats, Bools]:
    """(T, 3, 2) triangles in texels from the top, (T, 4) the whole texels that their boxes, larger
    by a ``spread``, have: low x and y, high x and y, (T,) the repetitions of the image in these,
    and whether triangles reach beyond a clamped edge. Moved by whole repetitions, so that the
    numbers are small and exact."""
    height, width = holes.shape
    with np.errstate(over="ignore", invalid="ignore"):
        texel = np.stack([uv[..., 0] * width, (1.0 - uv[..., 1]) * height], axis=2)
        low, high = texel.min(axis=1), texel.max(axis=1)
        box = np.concatenate([np.floor(low - spread), np.ceil(high + spread)], axis=1)
        span = (box[:, 2:] - box[:, :2]) / [width, height]
        smeared = np.zeros(len(uv), dtype=bool)
        for axis, size in enumerate((width, height)):
            if wraps[axis] == "clamp":
                smeared |= (low[:, axis] < 0) | (high[:, axis] > size)
                box[:, axis] = np.clip(box[:, axis], 0, size - 1)
                box[:, axis + 2] = np.clip(box[:, axis + 2], 1, size)
                span[:, axis] = np.minimum(span[:, axis], 1.0)
            else:
                shift = np.floor(box[:, axis] / size) * size
                box[:, [axis, axis + 2]] -= shift[:, None]
                texel[..., axis] -= shift[:, None]
    return texel, box, span.prod(axis=1), smeared


def _table(holes: Bools) -> NDArray[np.uint32]:
    """(H + 1, W + 1) number of holes above and to the left of each texel corner."""
    table = np.zeros((holes.shape[0] + 1, holes.shape[1] + 1), dtype=np.uint32)
    inner = table[1:, 1:]
    inner[:] = holes
    np.cumsum(inner, axis=0, out=inner)
    np.cumsum(inner, axis=1, out=inner)
    return table


def _holes_in(table: NDArray[np.uint32], box: Ints) -> Ints:
    """(n,) holes in (n, 4) boxes of the plane tiled with the image: low x and y, high x and y."""
    inside = np.zeros(len(box), dtype=np.int64)
    for sign_x, x in ((-1, box[:, 0]), (1, box[:, 2])):
        for sign_y, y in ((-1, box[:, 1]), (1, box[:, 3])):
            inside += sign_x * sign_y * _count_holes(table, x, y)
    return inside


def _count_holes(table: NDArray[np.uint32], x: Ints, y: Ints) -> Ints:
    """Holes in [0, x) × [0, y) of the plane tiled with the image."""
    height, width = table.shape[0] - 1, table.shape[1] - 1
    tiles_x, rest_x = np.divmod(x, width)
    tiles_y, rest_y = np.divmod(y, height)
    count: Ints = (
        tiles_x * tiles_y * int(table[-1, -1])
        + tiles_x * table[rest_y, -1].astype(np.int64)
        + tiles_y * table[-1, rest_x].astype(np.int64)
        + table[rest_y, rest_x]
    )
    return count


def _touches(table: NDArray[np.uint32], triangle: Floats, box: Ints) -> bool:
    """Whether a (3, 2) triangle in texels overlaps the square of a hole within its box."""
    height, width = table.shape[0] - 1, table.shape[1] - 1
    x0, y0, x1, y1 = box.tolist()
    (ax, ay), (bx, by), (cx, cy) = triangle.tolist()
    if (bx - ax) * (cy - ay) - (by - ay) * (cx - ax) < 0:
        bx, by, cx, cy = cx, cy, bx, by
    rows = np.arange(y0, y1)
    # The middle of each texel; its square reaches one texel to every side.
    py = rows + 0.5
    reached = (min(ay, by, cy) < py + 1) & (max(ay, by, cy) > py - 1)
    # Columns likewise, exactly: corners in an atlas often lie in the middle of texels.
    columns = np.arange(x0, x1)
    within = (min(ax, bx, cx) < columns + 1.5) & (max(ax, bx, cx) > columns - 0.5)
    if not within.any():
        return False
    x0, x1 = x0 + int(within.argmax()), x1 - int(within[::-1].argmax())
    low, high = np.full(len(rows), -np.inf), np.full(len(rows), np.inf)
    for ux, uy, vx, vy in ((ax, ay, bx, by), (bx, by, cx, cy), (cx, cy, ax, ay)):
        ex, ey = vx - ux, vy - uy
        # Outside only if the whole square lies strictly on the wrong side of an edge.
        room = ex * (py - uy) + abs(ex) + abs(ey)
        if ey > 0:
            high = np.minimum(high, ux + room / ey)
        elif ey < 0:
            low = np.maximum(low, ux + room / ey)
        else:
            reached &= room >= 0
    slack = _SLACK * (1 + max(abs(x0), abs(x1)))
    first = np.clip(np.ceil(low - slack - 0.5), x0, x1).astype(np.int64)
    end = np.clip(np.floor(high + slack - 0.5) + 1, x0, x1).astype(np.int64)
    reached &= end > first
    row = rows[reached] % height

    def holes_before(column: Ints) -> Ints:
        """Holes of each row to the left of a column of the tiled plane."""
        tiles, rest = np.divmod(column, width)
        whole = table[row + 1, -1].astype(np.int64) - table[row, -1]
        part = table[row + 1, rest].astype(np.int64) - table[row, rest]
        count: Ints = tiles * whole + part
        return count

    return bool((holes_before(end[reached]) > holes_before(first[reached])).any())
