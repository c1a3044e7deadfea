"""Cuts polygons into triangles without adding points.

Convex polygons become fans around their first vertex, as every viewer draws them; a quad whose fan
would fold over uses the other diagonal. All others are cut by ear clipping in the plane of their
Newell normal (Meisters 1975), which also handles concave, slightly bent and keyhole outlines.
Rejected: Shapely's constrained Delaunay triangulation, which refuses outlines that touch themselves
and needs a newer GEOS than required here; and mapbox_earcut (2.1), which would save 40 statements
but has no bound on its time: a spiral of 10,000 corners takes it 6.6 s, a star of 100,000 takes
6 s, and one of a million had not ended after a minute; here none of them takes 4 s.

The time of ear clipping (`polygon_kernels`) grows with the square of the number of corners, and
faster for adversarial outlines. The budget of steps for all outlines together is linear in the
number of corners; an outline that exceeds it becomes a fan and counts as tangled. That affects
single concave polygons from 50,000 corners on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints, cross
from ptmtools.scene.notes import IngestNotes
from ptmtools.tolerance import ROUNDING_SHARE

#: Budget of pairs of corners that may join a hole to its outline, and pairs that are tested.
_PAIRS, _TESTED = 4_000_000, 64
#: Budget of clipping steps (one tested corner, about 3 ns): constant, and per corner of an outline.
_BASE_STEPS, _CORNER_STEPS = 1_000_000_000, 30_000


@dataclass(frozen=True)
class Triangulation:
    """The triangles of polygons.

    Attributes
    ----------
    corner: (T, 3) int64 indices into the corners, ordered by polygon.
    polygon: (T,) int64 the polygon of each triangle.
    tangled: number of polygons cut as fans because their outline crosses itself or exceeds the
        budget.
    """

    corner: Ints
    polygon: Ints
    tangled: int

    def note(self, notes: IngestNotes, place: str) -> None:
        """Notes tangled polygons."""
        if self.tangled:
            message = "polygons with crossing edges or too many corners cut into fans of triangles"
            notes.note("PTM-N211", message, place, self.tangled)


def triangulate(corners: Floats, start: Ints) -> Triangulation:
    """Cuts each polygon into triangles of the same winding.

    Parameters
    ----------
    corners: (C, 3) positions; NaN and infinity are passed through.
    start: (P + 1,) polygon p has the corners ``start[p]`` to ``start[p + 1]``, at least three.
    """
    size = np.diff(start)
    corner: list[Ints] = []
    polygon: list[Ints] = []
    tangled = 0
    steps = _BASE_STEPS + _CORNER_STEPS * len(corners)
    for n in np.unique(size).tolist():
        same_size = np.flatnonzero(size == n)
        index = start[same_size][:, None] + np.arange(n)
        if n == 3:
            corner.append(index)
            polygon.append(same_size)
            continue
        with np.errstate(all="ignore"):  # relative to the first vertex, scaled to an extent of 1
            shape = corners[index] - corners[index[:, :1]]
            scale = np.abs(shape).max(axis=(1, 2), keepdims=True)
            shape /= np.where(scale > 0, scale, 1.0)
        cut, done = _fans(shape)
        corner.append(np.take_along_axis(index[done], cut[done].reshape(-1, 3 * (n - 2)), axis=1))
        corner[-1] = corner[-1].reshape(-1, 3)
        polygon.append(np.repeat(same_size[done], n - 2))
        for row in np.flatnonzero(~done):
            ears, simple, used = _clip_ears(shape[row], steps)
            steps -= used
            tangled += not simple
            corner.append(index[row][ears])
            polygon.append(np.full(len(ears), same_size[row]))
    if not corner:
        return Triangulation(np.zeros((0, 3), np.int64), np.zeros(0, np.int64), 0)
    owner = np.concatenate(polygon)
    order = np.argsort(owner, kind="stable")
    return Triangulation(np.concatenate(corner)[order], owner[order], tangled)


def cut(corners: Floats, start: Ints, notes: IngestNotes, place: str) -> Triangulation:
    """`triangulate` of the polygons of at least three corners; others are a miss."""
    size = np.diff(start)
    kept = np.flatnonzero(size >= 3)
    if short := len(size) - len(kept):
        notes.miss("PTM-N214", "faces of fewer than three corners", place, short)
    rows = np.flatnonzero(np.repeat(size >= 3, size))
    part = triangulate(corners[rows], np.concatenate([[0], np.cumsum(size[kept])]))
    result = Triangulation(rows[part.corner], kept[part.polygon], part.tangled)
    result.note(notes, place)
    return result


def keyhole(loops: Sequence[Floats]) -> tuple[Ints, int]:
    """The outline that walks around a polygon and its holes, along a bridge to each hole and back.

    ``loops`` are (n, 3) corners: the outline, then holes of either direction. Returns the corners
    by their numbers over all loops; and the number of holes that are left out, because they are
    beyond a budget.
    """
    sizes = [len(loop) for loop in loops]
    if not sizes or sizes[0] < 3:
        return np.arange(sizes[0] if sizes else 0), 0
    normal = np.cross(loops[0] - loops[0][0], np.roll(loops[0], -1, axis=0) - loops[0][0]).sum(0)
    axis = int(np.abs(normal).argmax())
    flat = np.concatenate(loops)[:, [(axis + 1) % 3, (axis + 2) % 3]]
    rings = [np.arange(n) + first for n, first in zip(sizes, np.cumsum([0, *sizes]), strict=False)]
    following = flat[np.concatenate([np.roll(ring, -1) for ring in rings])]
    path, budget, omitted = rings[0], _PAIRS, 0
    for ring in rings[1:]:
        hole = ring if _turn(flat[ring]) * _turn(flat[rings[0]]) < 0 else ring[::-1]
        budget -= len(path) * len(hole)
        if len(hole) < 3 or budget < 0:
            omitted += 1
            continue
        distance = ((flat[path][:, None] - flat[hole]) ** 2).sum(axis=2).ravel()
        near = np.argpartition(distance, min(_TESTED, len(distance)) - 1)[:_TESTED]
        near = near[np.argsort(distance[near], kind="stable")].tolist()
        pairs = [divmod(pair, len(hole)) for pair in near]
        i, j = next(
            (p for p in pairs if not _crosses(flat[path[p[0]]], flat[hole[p[1]]], flat, following)),
            pairs[0],
        )
        path = np.concatenate([path[: i + 1], hole[j:], hole[: j + 1], path[i:]])
    return path, omitted


def _turn(loop: Floats) -> float:
    """Twice the area of a loop (n, 2), counter-clockwise positive."""
    x, y = (loop - loop[0]).T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def _crosses(a: Floats, b: Floats, c: Floats, d: Floats) -> bool:
    """Whether the line from a to b crosses one of the (n, 2) lines from c to d."""

    def side(p: Floats, q: Floats, r: Floats) -> Any:
        pq, pr = q - p, r - p
        return pq[..., 0] * pr[..., 1] - pq[..., 1] * pr[..., 0]

    apart = (side(a, b, c) * side(a, b, d) < 0) & (side(c, d, a) * side(c, d, b) < 0)
    return bool(apart.any())


def _fans(shape: Floats) -> tuple[Ints, Bools]:
    """Fans (m, n - 2, 3) of local indices, and (m,) whether they are valid."""
    m, n, _ = shape.shape
    fan = fan_of(n)
    with np.errstate(all="ignore"):
        corner = cross(shape[:, 1:-1], shape[:, 2:])
        normal = corner.sum(axis=1)
        right = (np.einsum("mkc,mc->mk", corner, normal) > ROUNDING_SHARE).all(axis=1)
    cut = np.tile(fan, (m, 1, 1))
    if n == 4:
        second_fan = np.array([[1, 2, 3], [1, 3, 0]])
        with np.errstate(all="ignore"):
            b = shape - shape[:, 1:2]
            halves = np.stack([cross(b[:, 2], b[:, 3]), cross(b[:, 3], b[:, 0])], axis=1)
            turned = (np.einsum("mkc,mc->mk", halves, normal) > ROUNDING_SHARE).all(axis=1)
        cut[turned & ~right] = second_fan
        right |= turned
    # Ingest drops non-finite polygons later, and they cannot be clipped.
    right |= ~np.isfinite(shape).all(axis=(1, 2))
    return cut, right


def fan_of(n: int) -> Ints:
    """(n - 2, 3) local indices of the fan around the first of n corners."""
    second = np.arange(1, n - 1)
    return np.stack([np.zeros_like(second), second, second + 1], axis=1)


def strip_of(n: int) -> Ints:
    """(n - 2, 3) local indices of the strip over n corners."""
    strip = np.arange(max(n - 2, 0))[:, None] + np.arange(3)
    strip[1::2] = strip[1::2, ::-1]
    return strip


def _clip_ears(shape: Floats, steps: int) -> tuple[Ints, bool, int]:
    """Triangles (k, 3) of one polygon, whether its outline is simple, and the number of steps,
    about ``steps`` at most."""
    n = len(shape)
    cross = np.cross(shape[1:-1], shape[2:])
    fan = fan_of(n)
    if np.abs(cross).max() <= ROUNDING_SHARE:
        return fan[:1], True, 0  # a line or a point, represented by one degenerate triangle
    normal = cross.sum(axis=0)
    axis = int(np.abs(normal).argmax())
    if abs(normal[axis]) <= ROUNDING_SHARE or n * n > steps:
        return fan, False, 0
    flat = shape[:, [(axis + 1) % 3, (axis + 2) % 3]] * [1.0, np.sign(normal[axis])]

    from ptmtools.scene.polygon_kernels import clip_ears

    return clip_ears(np.ascontiguousarray(flat), ROUNDING_SHARE, steps)
