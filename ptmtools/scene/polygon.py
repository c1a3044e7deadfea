"""Cuts polygons into triangles without adding points.

Convex polygons become fans around their first vertex, as every viewer draws them; a quad whose
fan would fold over takes its other diagonal. All others are cut by clipping ears in the plane of
their Newell normal (Meisters 1975), which also serves concave, slightly bent and keyhole outlines.
Shapely's constrained Delaunay triangulation was rejected: it refuses outlines that touch
themselves, and needs a GEOS newer than the one we ask for. So was mapbox_earcut (2.1), which would
save 60 statements: its time has no bound. A spiral of 10,000 corners takes it 6.6 s, a star of
100,000 takes 6 s, and one of a million had not ended after a minute; here none of them takes 4 s.

Clipping takes a time that grows with the square of an outline, and for outlines made to be
difficult faster. The steps that all of them together may take grow with the number of corners
only; an outline for which they do not suffice becomes a fan, and is counted as tangled. That
happens to single concave polygons from 15,000 corners on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.tolerance import ROUNDING_SHARE

#: Steps of clipping, of about 10 ns: for all outlines together and for each corner besides; of a
#: look at a corner; of a search for what occupies an ear, which takes one more for each corner; of
#: a corner where there are few, which are searched one by one.
_BASE_STEPS, _CORNER_STEPS = 200_000_000, 10_000
_LOOK, _SEARCH, _CORNER = 150, 2_000, 40
#: So many corners are few.
_FEW = 40


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
        shape = _normalised(corners[index])
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


def _normalised(shape: NDArray[np.float64]) -> NDArray[np.float64]:
    """(m, n, 3) polygons moved to their first vertex and scaled to a size of 1."""
    with np.errstate(all="ignore"):
        moved = shape - shape[:, :1]
        scale = np.abs(moved).max(axis=(1, 2), keepdims=True)
        scaled: NDArray[np.float64] = moved / np.where(scale > 0, scale, 1.0)
    return scaled


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
    if abs(normal[axis]) <= ROUNDING_SHARE or 3 * n * (_SEARCH + n) // 2 > steps:
        return fan, False, 0
    flat = shape[:, [(axis + 1) % 3, (axis + 2) % 3]] * [1.0, np.sign(normal[axis])]

    ring = _Ring(flat)
    ears: list[list[int]] = []
    at = tried = 0
    while len(ring.index) > 2:
        m = len(ring.index)
        a, b, c = ring.index[(at - 1) % m], ring.index[at % m], ring.index[(at + 1) % m]
        area = _turn(*(ring.points[i] for i in (a, b, c)))
        ring.steps += _LOOK
        if area > ROUNDING_SHARE and not ring.occupied(a, b, c):
            ears.append([a, b, c])
            ring.pop(at % m)
            at, tried = at % m, 0
        elif tried > m and abs(area) <= ROUNDING_SHARE:
            ring.pop(at % m)  # no ear is left but this point lies on a straight edge
            tried = 0
        else:
            at, tried = (at + 1) % m, tried + 1
            if tried > 2 * m + 2 or ring.steps > steps:
                ears += [[ring.index[0], ring.index[i], ring.index[i + 1]] for i in range(1, m - 1)]
                return np.array(ears, dtype=np.int64), False, ring.steps
    return np.array(ears, dtype=np.int64), True, ring.steps


class _Ring:
    """What is left of an outline.

    Attributes
    ----------
    index: of the vertices left, in order.
    points: of all vertices.
    steps: taken so far.
    """

    def __init__(self, flat: NDArray[np.float64]) -> None:
        self.index = list(range(len(flat)))
        self.steps = 0
        self.points: list[list[float]] = flat.tolist()
        self._left = flat.copy()
        self._there = [True] * len(flat)
        self._occupant: dict[tuple[int, int, int], int] = {}

    def pop(self, at: int) -> None:
        """Takes a vertex away, by its place in the ring."""
        self._there[self.index.pop(at)] = False
        left = len(self.index)
        self._left[at:left] = self._left[at + 1 : left + 1]

    def occupied(self, a: int, b: int, c: int) -> bool:
        """Whether a vertex of the ring lies in the closed triangle, other than in its corners."""
        known = self._occupant.get((a, b, c))
        if known is not None and self._there[known]:
            return True
        found = (self._one_by_one if len(self.index) <= _FEW else self._at_once)(a, b, c)
        if found < 0:
            return False
        self._occupant[a, b, c] = found
        return True

    def _at_once(self, a: int, b: int, c: int) -> int:
        """The first vertex of the ring that occupies a triangle, -1 if none does."""
        left = len(self.index)
        self.steps += _SEARCH + left
        x, y = self._left[:left].T
        inside = np.ones(left, dtype=bool)
        for s, t in ((a, b), (b, c), (c, a)):
            (ux, uy), (vx, vy) = self.points[s], self.points[t]
            inside &= (vx - ux) * (y - uy) - (vy - uy) * (x - ux) >= 0
            inside &= (x != ux) | (y != uy)
        found = int(inside.argmax())
        return self.index[found] if inside[found] else -1

    def _one_by_one(self, a: int, b: int, c: int) -> int:
        """The same by the same arithmetic."""
        corners = self.points[a], self.points[b], self.points[c]
        (ax, ay), (bx, by), (cx, cy) = corners
        px, py, qx, qy, rx, ry = bx - ax, by - ay, cx - bx, cy - by, ax - cx, ay - cy
        for i in self.index:
            self.steps += _CORNER
            x, y = point = self.points[i]
            if (
                px * (y - ay) - py * (x - ax) >= 0
                and qx * (y - by) - qy * (x - bx) >= 0
                and rx * (y - cy) - ry * (x - cx) >= 0
                and point not in corners
            ):
                return i
        return -1


def _turn(a: list[float], b: list[float], c: list[float]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
