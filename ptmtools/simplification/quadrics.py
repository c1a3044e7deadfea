"""Quadrics: weighted sums of squared distances from the planes and lines merged into a vertex.

Vertex quadrics follow Garland & Heckbert 1997: planes of the faces, weighted by area, and lines of
constrained edges. Wedge quadrics follow Hoppe 1999: deviations of the attributes of a wedge from
the attributes of its faces at the same position. Both are relative to the vertex (and to the
attributes of the wedge), so cancellation is of the size of an edge, not of the mesh: details of a
centimetre in a campus of a kilometre keep full precision.

A vertex quadric at p is a row of `SIZE` numbers: the entries of the symmetric matrix A from xx to
zz, b, c and the sum w of the weights. Its value for d = x - p is d·Ad + 2 b·d + c. A wedge quadric
is such a row without w, followed for each attribute by the sums of w g, w r and w
(`PER_ATTRIBUTE`), where g·d + r is the attribute of a face at d. Its value for d and the attribute
s is Σ w (g·d + r - s)².

Texture coordinates count as the distance by which the texture moves on the face: a shift of the
texture by a centimetre costs as much as a shift of the surface.
"""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.jit import plain_kernel as kernel
from ptmtools.simplification.model import Mesh
from ptmtools.simplification.surface import COLOR_SHARE, WeldedSurface

SIZE = 11
PER_ATTRIBUTE = 5
#: Weight of a constrained edge, as a share of its squared length: errors of boundaries and seams
#: are conspicuous.
LINE_WEIGHT = 4.0
#: Largest ratio between the texture scale of a face and the mean, either way: faces with a constant
#: texture have no scale.
MAX_SCALE_RATIO = 32.0

_ENTRIES = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


def vertex_quadrics(surface: WeldedSurface) -> Floats:
    """(V, SIZE) quadrics of the planes and constrained edges of each vertex."""
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

    faces, side = np.nonzero((surface.constraint[:, None] >> np.arange(3)) & 1)
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


def attributes(mesh: Mesh, surface: WeldedSurface) -> Floats:
    """(W, m) attributes of each wedge: texture coordinates unscaled, then colours as distances."""
    face, side = surface.source[surface.corner // 3], surface.corner % 3
    parts: list[Floats] = [np.zeros((len(face), 0))]
    if mesh.uv is not None:
        parts.append(mesh.uv[face, side].astype(np.float64))
    if mesh.colors is not None:
        parts.append(mesh.colors[face, side].astype(np.float64) * (COLOR_SHARE / 255))
    return np.concatenate(parts, axis=1)


def wedge_quadrics(mesh: Mesh, surface: WeldedSurface, attribute: Floats) -> Floats:
    """(W, 10 + PER_ATTRIBUTE m) quadrics of the (W, m) attributes over the faces of each wedge."""
    wedges, m = attribute.shape
    quadric = np.zeros((wedges, 10 + PER_ATTRIBUTE * m))
    if not m:
        return quadric
    a, b, c = (surface.point[surface.triangle[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    square = (normal**2).sum(axis=1)
    area = np.sqrt(square) / 2
    normal /= np.where(square > 0, square, 1.0)[:, None]
    # Gradients of the functions that grow by one from corner a to b, and from a to c.
    to_b, to_c = np.cross(c - a, normal), np.cross(normal, b - a)
    values = attribute[surface.wedge]
    slope = (values[:, 1] - values[:, 0])[:, :, None] * to_b[:, None]
    slope += (values[:, 2] - values[:, 0])[:, :, None] * to_c[:, None]
    weight = np.repeat(area[:, None], m, axis=1)
    if mesh.uv is not None:
        weight[:, :2] *= _squared_scales(slope[:, :2], area)[:, None]

    wedge = surface.wedge.T.reshape(-1)

    def total(terms: Floats) -> Floats:
        return np.bincount(wedge, np.tile(terms, 3), wedges).astype(np.float64)

    for column, (i, j) in enumerate(_ENTRIES):
        quadric[:, column] = total((weight * slope[:, :, i] * slope[:, :, j]).sum(axis=1))
    for k in range(m):
        begin = 10 + PER_ATTRIBUTE * k
        for i in range(3):
            quadric[:, begin + i] = total(weight[:, k] * slope[:, k, i])
        quadric[:, begin + 4] = total(weight[:, k])
    return quadric


def _squared_scales(slope: Floats, area: Floats) -> Floats:
    """(T,) squared distance over which the texture coordinates of each face change by one."""
    squared_slope = (slope**2).sum(axis=(1, 2)) / 2
    mean = float((area * squared_slope).sum() / max(float(area.sum()), np.finfo(float).tiny))
    if not mean > 0:
        return np.ones(len(area))
    return np.asarray(
        1 / np.clip(squared_slope, mean / MAX_SCALE_RATIO**2, mean * MAX_SCALE_RATIO**2)
    )


#: Refinements of the optimal position, each of which multiplies the effect of the midpoint by its
#: weight: vertices on the edges of a box stay there.
REFINEMENTS = 3


@kernel
def value_at(quadric: Floats, row: int, x: float, y: float, z: float) -> float:
    """Returns the value of a row for a displacement."""
    q = quadric[row]
    square = q[0] * x * x + q[3] * y * y + q[5] * z * z
    mixed = q[1] * x * y + q[2] * x * z + q[4] * y * z + q[6] * x + q[7] * y + q[8] * z
    return float(square + 2.0 * mixed + q[9])


@kernel
def wedge_value_at(
    quadric: Floats, attribute: Floats, row: int, target: int, x: float, y: float, z: float
) -> float:
    """Returns the value of a wedge's row for a displacement and the attributes of ``target``."""
    value = value_at(quadric, row, x, y, z)
    for k in range(attribute.shape[1]):
        i = 10 + PER_ATTRIBUTE * k
        s = attribute[target, k] - attribute[row, k]
        g = quadric[row, i] * x + quadric[row, i + 1] * y + quadric[row, i + 2] * z
        value += s * s * quadric[row, i + 4] - 2.0 * s * (g + quadric[row, i + 3])
    return float(value)


@kernel
def shift(quadric: Floats, row: int, x: float, y: float, z: float) -> None:
    """Makes a row relative to its vertex displaced by (x, y, z)."""
    q = quadric[row]
    c = value_at(quadric, row, x, y, z)
    q[6] += q[0] * x + q[1] * y + q[2] * z
    q[7] += q[1] * x + q[3] * y + q[4] * z
    q[8] += q[2] * x + q[4] * y + q[5] * z
    q[9] = c


@kernel
def shift_wedge(
    quadric: Floats, attribute: Floats, row: int, target: int, x: float, y: float, z: float
) -> None:
    """Makes a wedge's row relative to a displacement and to the attributes of ``target``."""
    c = wedge_value_at(quadric, attribute, row, target, x, y, z)
    shift(quadric, row, x, y, z)
    quadric[row, 9] = c
    for k in range(attribute.shape[1]):
        i = 10 + PER_ATTRIBUTE * k
        s = attribute[target, k] - attribute[row, k]
        for j in range(3):
            quadric[row, 6 + j] -= s * quadric[row, i + j]
        g = quadric[row, i] * x + quadric[row, i + 1] * y + quadric[row, i + 2] * z
        quadric[row, i + 3] += g - s * quadric[row, i + 4]


@kernel
def add(quadric: Floats, row: int, source: int) -> None:
    """Adds row ``source`` to a row."""
    for j in range(quadric.shape[1]):
        quadric[row, j] += quadric[source, j]


@kernel
def optimal_position(
    quadric: Floats,
    a: int,
    b: int,
    x: float,
    y: float,
    z: float,
    midpoint_weight: float,
    position: Floats,
) -> float:
    """Minimises the sum of two vertex quadrics; returns its value at the minimum.

    Parameters
    ----------
    a, b: rows; (x, y, z) is the position of the vertex of b relative to that of a.
    midpoint_weight: weight of the midpoint of the two vertices, as a share of the total
        weight. It makes the minimum unique, and near the edge where the planes leave it free.
    position: (3,) output, relative to the vertex of a.
    """
    p, q = quadric[a], quadric[b]
    xx, xy, xz = p[0] + q[0], p[1] + q[1], p[2] + q[2]
    yy, yz, zz = p[3] + q[3], p[4] + q[4], p[5] + q[5]
    bx = p[6] + q[6] - (q[0] * x + q[1] * y + q[2] * z)
    by = p[7] + q[7] - (q[1] * x + q[3] * y + q[4] * z)
    bz = p[8] + q[8] - (q[2] * x + q[4] * y + q[5] * z)
    c = p[9] + value_at(quadric, b, -x, -y, -z)
    w = midpoint_weight * (p[10] + q[10])
    ax, ay, az = xx + w, yy + w, zz + w
    # Solve by the adjugate: the matrix is symmetric, and positive definite by the midpoint.
    i, j, k = ay * az - yz * yz, xz * yz - xy * az, xy * yz - ay * xz
    l, m, n = ax * az - xz * xz, xz * xy - ax * yz, ax * ay - xy * xy
    det = ax * i + xy * j + xz * k
    position[0], position[1], position[2] = 0.5 * x, 0.5 * y, 0.5 * z
    if det > 0.0:
        # Each step replaces the midpoint by the last position, so the planes alone decide.
        for _ in range(REFINEMENTS):
            rx, ry, rz = w * position[0] - bx, w * position[1] - by, w * position[2] - bz
            position[0] = (i * rx + j * ry + k * rz) / det
            position[1] = (j * rx + l * ry + m * rz) / det
            position[2] = (k * rx + m * ry + n * rz) / det
    u, v, t = position[0], position[1], position[2]
    square = xx * u * u + yy * v * v + zz * t * t
    mixed = xy * u * v + xz * u * t + yz * v * t + bx * u + by * v + bz * t
    return float(square + 2.0 * mixed + c)
