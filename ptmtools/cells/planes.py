"""Planes, (4,) unit normals n and offsets d with n·x + d = 0, coordinates in them, boxes, and the
convex polyhedra that they bound, as face loops.

Every face of a polyhedron remembers the plane that made it, so that the two sides of a BSP plane
can be matched into portals. Cutting snaps: a vertex within the rounding distance of the plane lies
in it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely

from ptmtools.arrays import Bools, Floats, Ints, cross, normals
from ptmtools.tolerance import Tolerance

#: Normals of planes are turned to this side: no wall lies in the direction, so that rounding never
#: decides.
UPWARD = np.array([0.5772156649, 0.8346268417, 0.2614972128])
#: Seen from above.
PLAN = [0, 2]
#: Up to this many boxes are compared one by one, which is faster by up to 30 times.
_FEW = 12


@dataclass(frozen=True)
class PlaneFrame:
    """A plane with two axes in it: `to_plane` and `to_space` are inverses up to rounding."""

    plane: Floats  # (4,) unit normal n and offset d, n·x + d = 0
    origin: Floats  # a point of it
    u: Floats  # an orthonormal basis, u × v = n
    v: Floats

    @staticmethod
    def from_plane(plane: Floats) -> PlaneFrame:
        """A frame for a (4,) plane; the axes depend on nothing but the plane."""
        normal = plane[:3]
        axis = np.zeros(3)
        axis[np.argmin(np.abs(normal))] = 1.0
        u = cross(axis, normal)
        u /= np.linalg.norm(u)
        return PlaneFrame(plane, -plane[3] * normal, u, cross(normal, u))

    def to_plane(self, points: Floats) -> Floats:
        """(…, 2) coordinates of (…, 3) points, projected along the normal."""
        q = points - self.origin
        return np.stack([q @ self.u, q @ self.v], axis=-1)

    def to_space(self, flat: Floats) -> Floats:
        """(…, 3) points of (…, 2) coordinates."""
        space: Floats = self.origin + flat[..., :1] * self.u + flat[..., 1:] * self.v
        return space


def planes_of(corners: Floats) -> tuple[Floats, Floats]:
    """(n, 4) planes with one sign for both windings, and (n,) areas, of (n, 3, 3) triangles."""
    normal = normals(corners)
    double = np.linalg.norm(normal, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        normal = np.where(double[:, None] > 0, normal / double[:, None], 0.0)
    normal *= np.where(normal @ UPWARD < 0, -1.0, 1.0)[:, None]
    offset = -np.einsum("ij,ij->i", normal, corners.mean(axis=1))
    return np.concatenate([normal, offset[:, None]], axis=1), double / 2.0


def plane_axes(normal: Floats) -> tuple[Floats, Floats]:
    """(r, 3) and (r, 3): directions square to each of (r, 3) unit normals and to one another."""
    axis = np.eye(3)[np.argmin(np.abs(normal), axis=1)]
    u = cross(axis, normal)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    return u, cross(normal, u)


def parallel_gap(a: Floats, b: Floats, tolerance: Tolerance) -> float:
    """Distance of two parallel (4,) planes in metres, whichever way they face; else infinite."""
    turn = float(a[:3] @ b[:3])
    if abs(turn) < tolerance.cosine:
        return float("inf")
    return abs(float(a[3]) - float(np.sign(turn)) * float(b[3]))


def bounds(corners: Floats) -> tuple[Floats, Floats]:
    """(3,) and (3,): the least and the greatest coordinates of points, (…, 3)."""
    points = corners.reshape(-1, 3)
    return points.min(axis=0), points.max(axis=0)


def boxes_meet(low: Floats, high: Floats, boxes: Floats) -> Bools:
    """(n,) which of the boxes between (n, 3) corners meet one of (m, 2, 3) boxes."""
    if len(boxes) <= _FEW:
        meets = np.zeros(len(low), dtype=np.bool_)
        for lowest, highest in boxes:
            meets |= ((low <= highest) & (high >= lowest)).all(axis=1)
        return meets
    x0, z0 = low[:, PLAN].T
    x1, z1 = high[:, PLAN].T
    (u0, bottom, w0), (u1, top, w1) = boxes.transpose(1, 2, 0)
    row, met = shapely.STRtree(shapely.box(x0, z0, x1, z1)).query(shapely.box(u0, w0, u1, w1))
    result = np.zeros(len(low), dtype=np.bool_)
    result[met[(low[met, 1] <= top[row]) & (high[met, 1] >= bottom[row])]] = True
    return result


#: Tag of a face that lies in the root box.
BOX_FACE = -1

#: Loops of a box whose corner k is (bit 2, bit 1, bit 0) of k as (x, y, z), outward.
_BOX_LOOPS = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


@dataclass(frozen=True)
class Polyhedron:
    """A convex polyhedron."""

    points: Floats  # (n, 3) vertices
    faces: tuple[Ints, ...]  # loops of indices into them, counter-clockwise seen from outside
    tags: tuple[int, ...]  # for each face the BSP node of its plane, or `BOX_FACE`

    @staticmethod
    def box(low: Floats, high: Floats) -> Polyhedron:
        """The axis-parallel box between two corners."""
        k = np.arange(8)
        bits = np.stack([k >> 2 & 1, k >> 1 & 1, k & 1], axis=1)
        points = np.where(bits == 1, high, low).astype(np.float64)
        loops = tuple(np.array(loop) for loop in _BOX_LOOPS)
        return Polyhedron(points, loops, (BOX_FACE,) * 6)

    @cached_property
    def edges(self) -> Ints:
        """(e, 2) the ends of each edge, the lower first, in the order in which faces have them."""
        loops = [loop.tolist() for loop in self.faces]
        pairs = (pair for r in loops for pair in zip(r, r[1:] + r[:1], strict=True))
        return np.array(list({(min(a, b), max(a, b)): None for a, b in pairs}))

    @property
    def volume(self) -> float:
        """Volume in m³, by tetrahedra from the centroid of the vertices."""
        a, b, c = self._fan(self.points - self.points.mean(axis=0))
        return float(np.einsum("ij,ij->", cross(a, b), c)) / 6.0

    @property
    def width(self) -> float:
        """The least extent square to one of the faces, metres."""
        heights = self.points @ self.planes[:, :3].T
        return float(np.ptp(heights, axis=0).min())

    @property
    def planes(self) -> Floats:
        """(f, 4) the planes of the faces, unit normals pointing outwards."""
        a, b, c = self._fan(self.points)
        start = np.cumsum([0] + [len(loop) - 2 for loop in self.faces[:-1]])
        normals = np.add.reduceat(cross(b - a, c - a), start)
        normals /= np.sqrt(np.einsum("ij,ij->i", normals, normals))[:, None]
        return np.column_stack([normals, -np.einsum("ij,ij->i", normals, a[start])])

    def _fan(self, points: Floats) -> tuple[Floats, ...]:
        """The (m, 3) corners of the faces' triangles, face by face, taken from ``points``."""
        loops = [loop.tolist() for loop in self.faces]
        fan = [(r[0], r[i], r[i + 1]) for r in loops for i in range(1, len(r) - 1)]
        return tuple(points[np.array(fan).T])


def cut(
    body: Polyhedron, plane: Floats, tag: int, rounding: float
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
    rim = _order_around(every, sorted(on | set(crossing.values())), plane[:3])
    front.append((rim[::-1], tag))
    back.append((rim, tag))
    return _compact(every, front), _compact(every, back)


def section(body: Polyhedron, plane: Floats, rounding: float) -> Floats:
    """(n, 3) convex polygon in which a plane cuts the body, counter-clockwise against the normal;
    (0, 3) where it does not cut the interior. The rim of the face that `cut` would make."""
    distance = body.points @ plane[:3] + plane[3]
    side = np.where(np.abs(distance) <= rounding, 0, np.sign(distance))
    if side.max() <= 0 or side.min() >= 0:
        return np.zeros((0, 3))
    i, j = body.edges[side[body.edges[:, 0]] * side[body.edges[:, 1]] < 0].T
    t = (distance[i] / (distance[i] - distance[j]))[:, None]
    crossing = body.points[i] + t * (body.points[j] - body.points[i])
    rim = np.concatenate([body.points[side == 0], crossing])
    return rim[_order_around(rim, list(range(len(rim))), plane[:3])]


def clip_polygon(polygon: Floats, plane: Floats, rounding: float) -> Floats:
    """The part of a convex (n, 3) polygon in front of a plane; (0, 3) if it is empty."""
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
    kept: Floats = both[np.stack([ahead, crosses], axis=1).ravel()]
    return kept


def _order_around(points: Floats, loop: list[int], normal: Floats) -> list[int]:
    """The vertices of a convex polygon in counter-clockwise order about ``normal``."""
    p = points[loop]
    p = p - p.mean(axis=0)
    u = p[np.argmax(np.einsum("ij,ij->i", p, p))]
    angle = np.arctan2(p @ cross(normal, u), p @ u).tolist()
    return [loop[i] for i in sorted(range(len(loop)), key=angle.__getitem__)]


def _compact(points: Floats, faces: list[tuple[list[int], int]]) -> Polyhedron:
    used = sorted({i for loop, _ in faces for i in loop})
    rename = {old: new for new, old in enumerate(used)}
    return Polyhedron(
        points[used],
        tuple(np.array([rename[i] for i in loop]) for loop, _ in faces),
        tuple(tag for _, tag in faces),
    )
