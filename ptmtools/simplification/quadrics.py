"""Quadrics: sums of squared distances of a vertex from the faces and edges that it replaces.

Garland & Heckbert 1997: of the planes of the faces that met in a vertex, weighted by area, and of
the lines of kept edges. Hoppe 1999 adds, for every wedge, how far its attributes are from those
that the faces had in that place. Both are held relative to the vertex (and to the wedge's own
values), so that what cancels is of the size of an edge, not of the mesh: details of a centimetre
on a campus of a kilometre have all their digits.

A quadric of a vertex at p is a row (`SIZE`): the six entries of the symmetric A from xx to zz,
b, c and the sum w of all weights; its value for d = x - p is d·Ad + 2 b·d + c. One of a wedge is
such a row without w, and for each attribute the sums of w g, w r and w (`PER_ATTRIBUTE`), where
g·d + r is what a face has there: its value for d and s is Σ w (g·d + r - s)².

Texture coordinates count as the distance by which the texture moves on the face, so that a shift
of the bricks by a centimetre is as dear as a shift of the wall.
"""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.jit import plain_kernel as kernel
from ptmtools.simplification.model import Mesh
from ptmtools.simplification.surface import COLOR_SHARE, Surface

SIZE = 11
PER_ATTRIBUTE = 5
#: What a kept edge weighs: this share of the square on it. Borders and seams show at once.
LINE_WEIGHT = 4.0
#: A face's scale of texture counts as at most so many times the mean, and as no less than that part
#: of it: faces on which the texture does not change have none.
SCALES = 32.0

_ENTRIES = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


def vertex_quadrics(surface: Surface) -> Floats:
    """(V, SIZE): of the planes and kept edges that meet in each vertex."""
    count = len(surface.point)
    a, b, c = (surface.point[surface.triangle[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1) / 2
    normal /= np.where(area > 0, 2 * area, 1.0)[:, None]
    quadric = np.zeros((count, SIZE))
    vertex = surface.triangle.T.reshape(-1)
    for column, (i, j) in enumerate(_ENTRIES):
        quadric[:, column] = np.bincount(
            vertex, np.tile(area * normal[:, i] * normal[:, j], 3), count
        )
    quadric[:, 10] = np.bincount(vertex, np.tile(area, 3), count)

    faces, side = np.nonzero((surface.kept[:, None] >> np.arange(3)) & 1)
    begin = surface.triangle[faces, side]
    end = surface.triangle[faces, (side + 1) % 3]
    along = surface.point[end] - surface.point[begin]
    square = (along**2).sum(axis=1)
    along /= np.sqrt(np.where(square > 0, square, 1.0))[:, None]
    for column, (i, j) in enumerate(_ENTRIES):
        across = LINE_WEIGHT * square * (float(i == j) - along[:, i] * along[:, j])
        quadric[:, column] += np.bincount(begin, across, count) + np.bincount(end, across, count)
    weight = LINE_WEIGHT * square
    quadric[:, 10] += np.bincount(begin, weight, count) + np.bincount(end, weight, count)
    return quadric


def attributes(mesh: Mesh, surface: Surface) -> Floats:
    """(W, m) values of each wedge: texture coordinates as they are, colours as distances."""
    face, side = surface.source[surface.corner // 3], surface.corner % 3
    parts: list[Floats] = [np.zeros((len(face), 0))]
    if mesh.uv is not None:
        parts.append(mesh.uv[face, side].astype(np.float64))
    if mesh.colors is not None:
        parts.append(mesh.colors[face, side].astype(np.float64) * (COLOR_SHARE / 255))
    return np.concatenate(parts, axis=1)


def wedge_quadrics(mesh: Mesh, surface: Surface, attribute: Floats) -> Floats:
    """(W, 10 + PER_ATTRIBUTE m): of how the attributes of each wedge change over its faces."""
    wedges, m = attribute.shape
    quadric = np.zeros((wedges, 10 + PER_ATTRIBUTE * m))
    if not m:
        return quadric
    a, b, c = (surface.point[surface.triangle[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    square = (normal**2).sum(axis=1)
    area = np.sqrt(square) / 2
    normal /= np.where(square > 0, square, 1.0)[:, None]
    # What grows by one from the corner a to b, and from a to c.
    to_b, to_c = np.cross(c - a, normal), np.cross(normal, b - a)
    at = attribute[surface.wedge]
    slope = (at[:, 1] - at[:, 0])[:, :, None] * to_b[:, None]
    slope += (at[:, 2] - at[:, 0])[:, :, None] * to_c[:, None]
    weight = np.repeat(area[:, None], m, axis=1)
    if mesh.uv is not None:
        weight[:, :2] *= _scales(slope[:, :2], area)[:, None]

    wedge = surface.wedge.T.reshape(-1)

    def total(each: Floats) -> Floats:
        return np.bincount(wedge, np.tile(each, 3), wedges).astype(np.float64)

    for column, (i, j) in enumerate(_ENTRIES):
        quadric[:, column] = total((weight * slope[:, :, i] * slope[:, :, j]).sum(axis=1))
    for k in range(m):
        begin = 10 + PER_ATTRIBUTE * k
        for i in range(3):
            quadric[:, begin + i] = total(weight[:, k] * slope[:, k, i])
        quadric[:, begin + 4] = total(weight[:, k])
    return quadric


def _scales(slope: Floats, area: Floats) -> Floats:
    """(T,) the square of the distance over which texture coordinates change by one."""
    steep = (slope**2).sum(axis=(1, 2)) / 2
    mean = float((area * steep).sum() / max(float(area.sum()), np.finfo(float).tiny))
    if not mean > 0:
        return np.ones(len(area))
    return np.asarray(1 / np.clip(steep, mean / SCALES**2, mean * SCALES**2))


#: Steps to the best place, each of which leaves the pull's share of the way: vertices on the edges
#: of a box stay there.
STEPS = 3


@kernel
def value_at(quadric: Floats, row: int, x: float, y: float, z: float) -> float:
    """The value of a row for a displacement."""
    q = quadric[row]
    square = q[0] * x * x + q[3] * y * y + q[5] * z * z
    mixed = q[1] * x * y + q[2] * x * z + q[4] * y * z + q[6] * x + q[7] * y + q[8] * z
    return float(square + 2.0 * mixed + q[9])


@kernel
def wedge_value_at(
    quadric: Floats, attribute: Floats, row: int, at: int, x: float, y: float, z: float
) -> float:
    """The value of a wedge's row for a displacement, and the attributes of another wedge."""
    value = value_at(quadric, row, x, y, z)
    for k in range(attribute.shape[1]):
        i = 10 + PER_ATTRIBUTE * k
        s = attribute[at, k] - attribute[row, k]
        g = quadric[row, i] * x + quadric[row, i + 1] * y + quadric[row, i + 2] * z
        value += s * s * quadric[row, i + 4] - 2.0 * s * (g + quadric[row, i + 3])
    return float(value)


@kernel
def shift(quadric: Floats, row: int, x: float, y: float, z: float) -> None:
    """Makes a row relative to a place so far from where it was."""
    q = quadric[row]
    c = value_at(quadric, row, x, y, z)
    q[6] += q[0] * x + q[1] * y + q[2] * z
    q[7] += q[1] * x + q[3] * y + q[4] * z
    q[8] += q[2] * x + q[4] * y + q[5] * z
    q[9] = c


@kernel
def shift_wedge(
    quadric: Floats, attribute: Floats, row: int, at: int, x: float, y: float, z: float
) -> None:
    """Makes a wedge's row relative to a place so far away, and to another wedge's attributes."""
    c = wedge_value_at(quadric, attribute, row, at, x, y, z)
    shift(quadric, row, x, y, z)
    quadric[row, 9] = c
    for k in range(attribute.shape[1]):
        i = 10 + PER_ATTRIBUTE * k
        s = attribute[at, k] - attribute[row, k]
        for j in range(3):
            quadric[row, 6 + j] -= s * quadric[row, i + j]
        g = quadric[row, i] * x + quadric[row, i + 1] * y + quadric[row, i + 2] * z
        quadric[row, i + 3] += g - s * quadric[row, i + 4]


@kernel
def add(quadric: Floats, row: int, other: int) -> None:
    """Adds one row to another."""
    for j in range(quadric.shape[1]):
        quadric[row, j] += quadric[other, j]


@kernel
def best_place(
    quadric: Floats,
    a: int,
    b: int,
    x: float,
    y: float,
    z: float,
    pull: float,
    place: Floats,
) -> float:
    """Where the sum of two rows is least; returns its value there.

    Parameters
    ----------
    a, b: the rows; (x, y, z) is where b's vertex is, seen from a's.
    pull: how much of the weight counts as a pull to the middle of the two, so that there is one
        such place, and a near one, where the planes do not say.
    place: (3,), where it is left, seen from a's vertex.
    """
    p, q = quadric[a], quadric[b]
    xx, xy, xz = p[0] + q[0], p[1] + q[1], p[2] + q[2]
    yy, yz, zz = p[3] + q[3], p[4] + q[4], p[5] + q[5]
    bx = p[6] + q[6] - (q[0] * x + q[1] * y + q[2] * z)
    by = p[7] + q[7] - (q[1] * x + q[3] * y + q[4] * z)
    bz = p[8] + q[8] - (q[2] * x + q[4] * y + q[5] * z)
    c = p[9] + value_at(quadric, b, -x, -y, -z)
    w = pull * (p[10] + q[10])
    ax, ay, az = xx + w, yy + w, zz + w
    # By the adjugate: the matrix is symmetric, and positive by the pull.
    i, j, k = ay * az - yz * yz, xz * yz - xy * az, xy * yz - ay * xz
    l, m, n = ax * az - xz * xz, xz * xy - ax * yz, ax * ay - xy * xy
    det = ax * i + xy * j + xz * k
    place[0], place[1], place[2] = 0.5 * x, 0.5 * y, 0.5 * z
    if det > 0.0:
        # Pulled to where the last step led: what the planes do say is left as it is.
        for _ in range(STEPS):
            rx, ry, rz = w * place[0] - bx, w * place[1] - by, w * place[2] - bz
            place[0] = (i * rx + j * ry + k * rz) / det
            place[1] = (j * rx + l * ry + m * rz) / det
            place[2] = (k * rx + m * ry + n * rz) / det
    u, v, t = place[0], place[1], place[2]
    square = xx * u * u + yy * v * v + zz * t * t
    mixed = xy * u * v + xz * u * t + yz * v * t + bx * u + by * v + bz * t
    return float(square + 2.0 * mixed + c)
