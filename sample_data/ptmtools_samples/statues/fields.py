"""Solids as implicit functions: negative inside, approximately the signed distance.

Like `ptmtools_samples.noise`, the module uses only +, −, ×, ÷, √, floor and comparisons, so statues
have the same bytes on every machine. Points are (3, n) float64: x, y and z, metres, Y up.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Values = NDArray[np.float64]
Points = NDArray[np.float64]
Place = tuple[float, float, float]


def _length(*parts: Values) -> Values:
    total = parts[0] * parts[0]
    for part in parts[1:]:
        total = total + part * part
    return np.asarray(np.sqrt(total))


def move(p: Points, to: Place) -> Points:
    return np.asarray(p - np.array(to)[:, None])


def sphere(p: Points, middle: Place, radius: float) -> Values:
    x, y, z = move(p, middle)
    return _length(x, y, z) - radius


def ellipsoid(p: Points, middle: Place, radii: Place) -> Values:
    x, y, z = move(p, middle) / np.array(radii)[:, None]
    near = _length(x, y, z)
    steep = _length(x / radii[0], y / radii[1], z / radii[2])
    return np.asarray(near * (near - 1) / np.maximum(steep, 1e-9))


def capsule(p: Points, a: Place, b: Place, thick: float, end: float | None = None) -> Values:
    """A round bar from a to b, with radius ``thick`` at a and ``end`` at b."""
    along = np.array(b) - np.array(a)
    x, y, z = move(p, a)
    square = float(along[0] ** 2 + along[1] ** 2 + along[2] ** 2)
    t = np.clip((x * along[0] + y * along[1] + z * along[2]) / square, 0, 1)
    away = _length(x - t * along[0], y - t * along[1], z - t * along[2])
    return np.asarray(away - (thick + t * ((thick if end is None else end) - thick)))


def box(p: Points, middle: Place, half: Place, rounding: float = 0.0) -> Values:
    x, y, z = np.abs(move(p, middle)) - (np.array(half) - rounding)[:, None]
    outside = _length(np.maximum(x, 0), np.maximum(y, 0), np.maximum(z, 0))
    return np.asarray(outside + np.minimum(np.maximum(np.maximum(x, y), z), 0) - rounding)


def disc(p: Points, middle: Place, radius: float, half: float, rounding: float = 0.0) -> Values:
    """A round plate with an upright axis."""
    x, y, z = move(p, middle)
    out, up = _length(x, z) - (radius - rounding), np.abs(y) - (half - rounding)
    outside = _length(np.maximum(out, 0), np.maximum(up, 0))
    return np.asarray(outside + np.minimum(np.maximum(out, up), 0) - rounding)


def ring(p: Points, middle: Place, radius: float, thick: float) -> Values:
    """A torus with an upright axis."""
    x, y, z = move(p, middle)
    return _length(_length(x, z) - radius, y) - thick


def union(*solids: Values) -> Values:
    least = solids[0]
    for solid in solids[1:]:
        least = np.minimum(least, solid)
    return least


def blend(a: Values, b: Values, width: float) -> Values:
    """Smooth union with a fillet of the given width."""
    overlap = np.maximum(width - np.abs(a - b), 0)
    return np.minimum(a, b) - overlap * overlap / (4 * width)


def carve(a: Values, b: Values, width: float) -> Values:
    """Smooth difference a − b with an edge rounded to the given width."""
    return -blend(-a, b, width)


def step(t: Values, low: float, high: float) -> Values:
    """0 below ``low``, 1 above ``high``, smooth between."""
    s = np.clip((t - low) / (high - low), 0, 1)
    return s * s * (3 - 2 * s)


def wave(t: Values) -> Values:
    """A sine-like wave of period 1 between −1 and 1, made of parabolas."""
    f = (t - np.floor(t)) * 2 - 1
    return np.asarray(4 * f * (np.abs(f) - 1))


def saw(t: Values) -> Values:
    """A triangle wave between 0 and 1 with period 1."""
    return np.abs((t - np.floor(t)) * 2 - 1)


def turn(x: Values, y: Values) -> Values:
    """The angle of (x, y), in turns between −½ and ½, accurate to a thousandth."""
    wide, tall = np.abs(x), np.abs(y)
    share = np.minimum(wide, tall) / np.maximum(np.maximum(wide, tall), 1e-12)
    eighth = share * (0.125 + 0.0434 * (1 - share))
    quarter = np.where(tall > wide, 0.25 - eighth, eighth)
    half = np.where(x < 0, 0.5 - quarter, quarter)
    return np.where(y < 0, -half, half)


class Noise:
    """Smooth 3D noise between −1 and 1 from a periodic lattice of random values."""

    def __init__(self, random: np.random.Generator, side: int = 32) -> None:
        self._side = side
        self._value = 2 * random.random(side**3) - 1

    def __call__(self, p: Points, size: float, octaves: int = 1) -> Values:
        """Evaluates octaves with grains from ``size`` on, each of half the size and height."""
        total = np.zeros(p.shape[1])
        share, whole = 1.0, 0.0
        for _ in range(octaves):
            total += share * self._one(p / size)
            whole += share
            size, share = size / 2, share / 2
        return total / whole

    def _one(self, p: Points) -> Values:
        side = self._side
        floor = np.floor(p)
        f = p - floor
        f = f * f * (3 - 2 * f)
        low = floor.astype(np.int64) % side
        high = (low + 1) % side
        x, y, z = ((low[k], high[k]) for k in range(3))
        rows = []
        for i in (0, 1):
            for j in (0, 1):
                at = (x[i] * side + y[j]) * side
                a, b = self._value[at + z[0]], self._value[at + z[1]]
                rows.append(a + (b - a) * f[2])
        a, b = rows[0] + (rows[1] - rows[0]) * f[1], rows[2] + (rows[3] - rows[2]) * f[1]
        return np.asarray(a + (b - a) * f[0])
