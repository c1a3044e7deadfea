"""Cuts polygons into triangles without adding points.

Convex polygons become fans around their first vertex, as every viewer draws them; a quad whose
fan would fold over takes its other diagonal. All others are cut by clipping ears in the plane of
their Newell normal (Meisters 1975), which also serves concave, slightly bent and keyhole outlines.
Shapely's constrained Delaunay triangulation was rejected: it refuses outlines that touch
themselves, and needs a GEOS newer than the one we ask for. So was mapbox_earcut (2.1), which would
save 40 statements: its time has no bound. A spiral of 10,000 corners takes it 6.6 s, a star of
100,000 takes 6 s, and one of a million had not ended after a minute; here none of them takes 4 s.

Clipping (`polygon_kernels`) takes a time that grows with the square of an outline, and for outlines
made to be difficult faster. The steps that all of them together may take grow with the number of
corners only; an outline for which they do not suffice becomes a fan, and is counted as tangled.
That happens to single concave polygons from 50,000 corners on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.tolerance import ROUNDING_SHARE

#: Steps of clipping, of about 3 ns, one for each corner that is looked at: for all outlines
#: together, and for each of their corners besides.
_BASE_STEPS, _CORNER_STEPS = 1_000_000_000, 30_000


@dataclass(frozen=True)
class Triangulation:
    """Triangles of polygons.

    Attributes
    ----------
    corner: (T, 3) int64 indices into the corners, ordered by polygon.
    polygon: (T,) int64 the polygon of each triangle.
    tangled: number of polygons whose outline crosses itself or is too intricate; they are cut as
        fans.
    """

    corner: NDArray[np.int64]
    polygon: NDArray[np.int64]
    tangled: int


def triangulate(corners: NDArray[np.float64], start: NDArray[np.int64]) -> Triangulation:
    """Cut each polygon into triangles of the same winding.

    Parameters
    ----------
    corners: (C, 3) positions; NaN and infinity are passed through.
    start: (P + 1,) polygon p has the corners ``start[p]`` to ``start[p + 1]``, at least three.
    """
    size = np.diff(start)
    corner: list[NDArray[np.int64]] = []
    polygon: list[NDArray[np.int64]] = []
    tangled = 0
    steps = _BASE_STEPS + _CORNER_STEPS * len(corners)
    for n in np.unique(size).tolist():
        which = np.flatnonzero(size == n)
        index = start[which][:, None] + np.arange(n)
        if n == 3:
            corner.append(index)
            polygon.append(which)
            continue
        with np.errstate(all="ignore"):  # moved to the first vertex, scaled to a size of 1
            shape = corners[index] - corners[index[:, :1]]
            scale = np.abs(shape).max(axis=(1, 2), keepdims=True)
            shape /= np.where(scale > 0, scale, 1.0)
        cut, done = _fans(shape)
        corner.append(np.take_along_axis(index[done], cut[done].reshape(-1, 3 * (n - 2)), axis=1))
        corner[-1] = corner[-1].reshape(-1, 3)
        polygon.append(np.repeat(which[done], n - 2))
        for row in np.flatnonzero(~done):
            ears, simple, taken = _clip_ears(shape[row], steps)
            steps -= taken
            tangled += not simple
            corner.append(index[row][ears])
            polygon.append(np.full(len(ears), which[row]))
    if not corner:
        return Triangulation(np.zeros((0, 3), np.int64), np.zeros(0, np.int64), 0)
    owner = np.concatenate(polygon)
    order = np.argsort(owner, kind="stable")
    return Triangulation(np.concatenate(corner)[order], owner[order], tangled)


def _fans(shape: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Fans (m, n - 2, 3) of local indices, and for which polygons they are right."""
    m, n, _ = shape.shape
    steps = np.arange(1, n - 1)
    fan = np.stack([np.zeros_like(steps), steps, steps + 1], axis=1)
    with np.errstate(all="ignore"):
        cross = np.cross(shape[:, 1:-1], shape[:, 2:])
        normal = cross.sum(axis=1)
        right = (np.einsum("mkc,mc->mk", cross, normal) > ROUNDING_SHARE).all(axis=1)
    cut = np.tile(fan, (m, 1, 1))
    if n == 4:
        other = np.array([[1, 2, 3], [1, 3, 0]])
        with np.errstate(all="ignore"):
            b = shape - shape[:, 1:2]
            halves = np.stack([np.cross(b[:, 2], b[:, 3]), np.cross(b[:, 3], b[:, 0])], axis=1)
            turned = (np.einsum("mkc,mc->mk", halves, normal) > ROUNDING_SHARE).all(axis=1)
        cut[turned & ~right] = other
        right |= turned
    # What is not finite is dropped later; there is nothing to clip.
    right |= ~np.isfinite(shape).all(axis=(1, 2))
    return cut, right


def _clip_ears(shape: NDArray[np.float64], steps: int) -> tuple[NDArray[np.int64], bool, int]:
    """Triangles (k, 3) of one polygon, whether its outline is simple, and the steps taken, about
    ``steps`` at most."""
    n = len(shape)
    cross = np.cross(shape[1:-1], shape[2:])
    first = np.arange(1, n - 1)
    fan = np.stack([np.zeros_like(first), first, first + 1], axis=1)
    if np.abs(cross).max() <= ROUNDING_SHARE:
        return fan[:1], True, 0  # a line or a point: one degenerate triangle stands for it
    normal = cross.sum(axis=0)
    axis = int(np.abs(normal).argmax())
    if abs(normal[axis]) <= ROUNDING_SHARE or n * n > steps:
        return fan, False, 0
    flat = shape[:, [(axis + 1) % 3, (axis + 2) % 3]] * [1.0, np.sign(normal[axis])]

    from ptmtools.scene.polygon_kernels import clip_ears

    return clip_ears(np.ascontiguousarray(flat), ROUNDING_SHARE, steps)
