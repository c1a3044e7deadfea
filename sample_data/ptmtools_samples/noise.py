"""Noise, ramps and waves in plain arithmetic.

The textures must have the same bytes on every machine. numpy's sine, exponential and power differ
in the last bit between processors (they dispatch to vector instructions), and sums may differ in
their order; +, −, ×, ÷, √, floor and comparisons do not. The module uses only the latter, on
float32 arrays; random numbers are raw uniforms.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Field = NDArray[np.float32]
Color = tuple[float, float, float]


def generator(seed: int, *stream: int) -> np.random.Generator:
    """An independent stream of random numbers for a part of a sample."""
    return np.random.Generator(np.random.PCG64([seed, *stream]))


def axes(size: int) -> tuple[Field, Field]:
    """x (1, size) from left to right and y (size, 1) from top to bottom, texel centres in 0…1."""
    t = ((np.arange(size, dtype=np.float32) + np.float32(0.5)) / np.float32(size)).astype(
        np.float32
    )
    return t[None, :], t[:, None]


def smooth(t: Field) -> Field:
    """The smoothstep of t in 0…1."""
    return np.asarray(t * t * (np.float32(3) - t - t))


def step(t: Field, low: float, high: float) -> Field:
    """0 below ``low``, 1 above ``high``, smooth between."""
    return smooth(np.clip((t - np.float32(low)) / np.float32(high - low), 0, 1))


def wave(t: Field) -> Field:
    """A sine-like wave of period 1 between −1 and 1, made of parabolas."""
    f = (t - np.floor(t)) * np.float32(2) - np.float32(1)
    return np.asarray(np.float32(4) * f * (np.abs(f) - np.float32(1)))


def _interpolate(values: Field, size: int, axis: int) -> Field:
    """``values`` (periodic lattice) resampled to ``size`` along an axis."""
    n = values.shape[axis]
    t = (np.arange(size, dtype=np.float32) + np.float32(0.5)) * np.float32(n) / np.float32(size)
    cell = np.floor(t).astype(np.int64)
    f = smooth(t - cell.astype(np.float32))
    f = f[:, None] if axis == 0 else f[None, :]
    a = np.take(values, cell % n, axis=axis)
    b = np.take(values, (cell + 1) % n, axis=axis)
    return np.asarray(a + (b - a) * f)


def value_noise(rng: np.random.Generator, size: int, nx: int, ny: int) -> Field:
    """(size, size) noise in 0…1 from a periodic lattice of nx × ny values: it tiles."""
    lattice = rng.random((ny, nx), dtype=np.float32)
    return _interpolate(_interpolate(lattice, size, 0), size, 1)


def fractal(
    rng: np.random.Generator, size: int, nx: int, ny: int, octaves: int, gain: float = 0.5
) -> Field:
    """Octaves of `value_noise`, each with doubled lattice and ``gain`` times the strength; 0…1.

    Octaves finer than a texel are left out.
    """
    total = np.zeros((size, size), dtype=np.float32)
    strength, sum_ = 1.0, 0.0
    for k in range(octaves):
        if k and max(nx, ny) << k > size:
            break
        total += np.float32(strength) * value_noise(rng, size, nx << k, ny << k)
        sum_ += strength
        strength *= gain
    return np.asarray(total / np.float32(sum_))


def ridge(rng: np.random.Generator, size: int, cells: int, octaves: int) -> Field:
    """(1, size) one-dimensional fractal noise in 0…1."""
    total = np.zeros((1, size), dtype=np.float32)
    strength, sum_ = 1.0, 0.0
    for k in range(octaves):
        lattice = rng.random((1, cells << k), dtype=np.float32)
        total += np.float32(strength) * _interpolate(lattice, size, 1)
        sum_ += strength
        strength *= 0.5
    return np.asarray(total / np.float32(sum_))


def warp(field: Field, dx: Field, dy: Field) -> Field:
    """Samples the periodic ``field`` displaced by dx, dy (shares of its size), right and down."""
    size = field.shape[0]
    x, y = axes(size)
    column = np.floor((x + dx) * np.float32(size)).astype(np.int64) % size
    row = np.floor((y + dy) * np.float32(size)).astype(np.int64) % size
    return np.asarray(field[row, column])


def ramp(t: Field, *stops: tuple[float, Color]) -> Field:
    """(…, 3) colours 0…255 along ``t``: piecewise linear between (position, colour) stops."""
    out = np.empty((*t.shape, 3), dtype=np.float32)
    out[:] = np.asarray(stops[0][1], dtype=np.float32)
    for (a, first), (b, second) in pairwise(stops):
        share = np.clip((t - np.float32(a)) / np.float32(b - a), 0, 1)
        change = np.asarray(second, dtype=np.float32) - np.asarray(first, dtype=np.float32)
        out += share[..., None] * change
    return out


def blend(image: Field, color: Color | Field, mask: Field) -> Field:
    """Lays ``color`` over ``image`` with the opacity ``mask`` (0…1)."""
    over = np.asarray(color, dtype=np.float32)
    return np.asarray(image + (over - image) * mask[..., None])


def bytes_of(image: Field) -> NDArray[np.uint8]:
    """Rounds to 0…255."""
    return np.asarray(np.clip(np.floor(image + np.float32(0.5)), 0, 255), dtype=np.uint8)
