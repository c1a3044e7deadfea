"""Compiled arithmetic of quadrics; `quadrics` says what their rows hold, and is the reference."""

from __future__ import annotations

from ptmtools.arrays import Floats
from ptmtools.compiled import plain_kernel as kernel
from ptmtools.simplification.quadrics import PER_ATTRIBUTE

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
    found = value_at(quadric, row, x, y, z)
    for k in range(attribute.shape[1]):
        i = 10 + PER_ATTRIBUTE * k
        s = attribute[at, k] - attribute[row, k]
        g = quadric[row, i] * x + quadric[row, i + 1] * y + quadric[row, i + 2] * z
        found += s * s * quadric[row, i + 4] - 2.0 * s * (g + quadric[row, i + 3])
    return float(found)


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
