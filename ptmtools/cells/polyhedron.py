"""Convex polyhedra as face loops, cut by planes.

Every face remembers the plane that made it, so that the two sides of a BSP plane can be matched
into portals later. Cutting snaps: a vertex within the rounding distance of the plane lies in it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

#: Tag of a face that lies in the root box.
BOX_FACE = -1

#: Loops of a box whose corner k is (bit 2, bit 1, bit 0) of k as (x, y, z), outward.
_BOX_LOOPS = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


@dataclass(frozen=True)
class Polyhedron:
    """A convex polyhedron.

    Attributes
    ----------
    points: (n, 3) vertices.
    faces: loops of indices into `points`, counter-clockwise seen from outside.
    tags: for each face the BSP node whose plane it lies in, or `BOX_FACE`.
    """

    points: NDArray[np.float64]
    faces: tuple[NDArray[np.int64], ...]
    tags: tuple[int, ...]

    @staticmethod
    def box(low: NDArray[np.float64], high: NDArray[np.float64]) -> Polyhedron:
        """The axis-parallel box between two corners."""
        k = np.arange(8)
        bits = np.stack([k >> 2 & 1, k >> 1 & 1, k & 1], axis=1)
        points = np.where(bits == 1, high, low).astype(np.float64)
        loops = tuple(np.array(loop) for loop in _BOX_LOOPS)
        return Polyhedron(points, loops, (BOX_FACE,) * 6)

    @property
    def volume(self) -> float:
        """Volume in m³, by tetrahedra from the centroid of the vertices."""
        centre = self.points.mean(axis=0)
        total = 0.0
        for loop in self.faces:
            p = self.points[loop] - centre
            total += float(
                np.einsum("ij,ij->", np.cross(p[1:-1], p[2:]), np.tile(p[0], (len(p) - 2, 1)))
            )
        return total / 6.0


def cut(
    body: Polyhedron, plane: NDArray[np.float64], tag: int, rounding: float
) -> tuple[Polyhedron | None, Polyhedron | None]:
    """Cut by a (4,) plane; returns (front, back), None where nothing lies on that side.

    The new faces carry ``tag``; vertices within ``rounding`` metres of the plane lie in it.
    """
    distance = body.points @ plane[:3] + plane[3]
    side = np.where(np.abs(distance) <= rounding, 0, np.sign(distance)).astype(np.int64)
    if not np.any(side > 0):
        return None, body
    if not np.any(side < 0):
        return body, None
    points = list(body.points)
    on = set(np.flatnonzero(side == 0).tolist())
    crossing: dict[tuple[int, int], int] = {}
    front: list[tuple[list[int], int]] = []
    back: list[tuple[list[int], int]] = []
    for loop, face_tag in zip(body.faces, body.tags, strict=True):
        before: list[int] = []
        behind: list[int] = []
        corners = loop.tolist()
        for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
            if side[a] >= 0:
                before.append(a)
            if side[a] <= 0:
                behind.append(a)
            if side[a] * side[b] < 0:
                key = (min(a, b), max(a, b))
                if key not in crossing:
                    i, j = key
                    t = distance[i] / (distance[i] - distance[j])
                    crossing[key] = len(points)
                    points.append(body.points[i] + t * (body.points[j] - body.points[i]))
                before.append(crossing[key])
                behind.append(crossing[key])
        if len(before) > 2 and any(v < len(side) and side[v] > 0 for v in before):
            front.append((before, face_tag))
        if len(behind) > 2 and any(v < len(side) and side[v] < 0 for v in behind):
            back.append((behind, face_tag))
    every = np.array(points)
    rim = _around(every, sorted(on | set(crossing.values())), plane[:3])
    front.append((rim[::-1], tag))
    back.append((rim, tag))
    return _compact(every, front), _compact(every, back)


def section(body: Polyhedron, plane: NDArray[np.float64], rounding: float) -> NDArray[np.float64]:
    """(n, 3) convex polygon in which a plane cuts the body, counter-clockwise against the normal;
    (0, 3) where it does not cut the interior."""
    front, back = cut(body, plane, BOX_FACE, rounding)
    if front is None or back is None:
        return np.zeros((0, 3))
    return back.points[back.faces[-1]]


def clip_polygon(
    polygon: NDArray[np.float64], plane: NDArray[np.float64], rounding: float
) -> NDArray[np.float64]:
    """The part of a convex (n, 3) polygon in front of a plane; (0, 3) where nothing is left."""
    distance = polygon @ plane[:3] + plane[3]
    if np.all(distance >= -rounding):
        return polygon
    if np.all(distance <= rounding):
        return polygon[:0]
    following = np.concatenate([distance[1:], distance[:1]])
    ahead = distance >= 0
    crosses = distance * following < 0
    with np.errstate(invalid="ignore", divide="ignore"):
        t = np.where(crosses, distance / (distance - following), 0.0)[:, None]
    cuts = polygon + t * (np.concatenate([polygon[1:], polygon[:1]]) - polygon)
    both = np.stack([polygon, cuts], axis=1).reshape(-1, 3)
    kept: NDArray[np.float64] = both[np.stack([ahead, crosses], axis=1).ravel()]
    return kept


def _around(points: NDArray[np.float64], loop: list[int], normal: NDArray[np.float64]) -> list[int]:
    """The vertices of a convex polygon in counter-clockwise order about ``normal``."""
    p = points[loop]
    p = p - p.mean(axis=0)
    u = p[np.argmax(np.einsum("ij,ij->i", p, p))]
    v = np.cross(normal, u)
    order = np.argsort(np.arctan2(p @ v, p @ u), kind="stable")
    return [loop[i] for i in order]


def _compact(points: NDArray[np.float64], faces: list[tuple[list[int], int]]) -> Polyhedron:
    used = np.unique(np.concatenate([np.array(loop) for loop, _ in faces]))
    rename = np.full(len(points), -1)
    rename[used] = np.arange(len(used))
    return Polyhedron(
        points[used],
        tuple(rename[np.array(loop)] for loop, _ in faces),
        tuple(tag for _, tag in faces),
    )
