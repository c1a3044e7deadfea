"""Planes, (4,) unit normals n and offsets d with n·x + d = 0, coordinates in them, and boxes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from ptmtools.arrays import Bools, Floats, cross, normals
from ptmtools.tolerance import Tolerance

#: Normals of planes are turned to this side: no wall lies in the direction, so that rounding never
#: decides.
UPWARD = np.array([0.5772156649, 0.8346268417, 0.2614972128])
#: Seen from above.
PLAN = [0, 2]


@dataclass(frozen=True)
class Frame:
    """A plane with two axes in it: `to_plane` and `to_space` are inverses up to rounding."""

    plane: Floats  # (4,) unit normal n and offset d, n·x + d = 0
    origin: Floats  # a point of it
    u: Floats  # an orthonormal basis, u × v = n
    v: Floats

    @staticmethod
    def of(plane: Floats) -> Frame:
        """A frame for a (4,) plane; the axes depend on nothing but the plane."""
        normal = plane[:3]
        axis = np.zeros(3)
        axis[np.argmin(np.abs(normal))] = 1.0
        u = cross(axis, normal)
        u /= np.linalg.norm(u)
        return Frame(plane, -plane[3] * normal, u, cross(normal, u))

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
    x0, z0 = low[:, PLAN].T
    x1, z1 = high[:, PLAN].T
    (u0, bottom, w0), (u1, top, w1) = boxes.transpose(1, 2, 0)
    row, met = shapely.STRtree(shapely.box(x0, z0, x1, z1)).query(shapely.box(u0, w0, u1, w1))
    result = np.zeros(len(low), dtype=np.bool_)
    result[met[(low[met, 1] <= top[row]) & (high[met, 1] >= bottom[row])]] = True
    return result
