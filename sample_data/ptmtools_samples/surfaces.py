"""Tiling textures of walls, floors, frames and stone.

Each function takes a generator and a size and returns (size, size, 3) colours 0…255. `SURFACES`
lists them by priority: a museum of few textures has only the first ones, and plain colours for the
other materials.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ptmtools_samples.noise import (
    Color,
    Field,
    axes,
    blend,
    fractal,
    ramp,
    step,
    value_noise,
    warp,
    wave,
)

Surface = Callable[[np.random.Generator, int], Field]


def speckle(rng: np.random.Generator, size: int, strength: float) -> Field:
    """Fine grain around 0 for every texel."""
    return (rng.random((size, size), dtype=np.float32) - np.float32(0.5)) * np.float32(2 * strength)


def plaster_cream(rng: np.random.Generator, size: int) -> Field:
    trowel = fractal(rng, size, 6, 10, 6, 0.6)
    stains = fractal(rng, size, 3, 3, 4)
    image = ramp(trowel, (0.2, (206, 196, 176)), (0.5, (226, 218, 200)), (0.8, (240, 234, 220)))
    image = blend(image, (196, 182, 156), step(stains, 0.55, 0.85) * np.float32(0.5))
    return image + speckle(rng, size, 5)[..., None]


def _damask(rng: np.random.Generator, size: int, dark: Color, light: Color) -> Field:
    """Woven silk: a lattice of onion shapes with a flower in each."""
    x, y = axes(size)
    bend = wave(y * np.float32(4)) * np.float32(0.25)
    lattice = np.minimum(
        *(
            np.abs(t - np.floor(t + np.float32(0.5)))
            for t in (x * np.float32(4) + bend, x * np.float32(4) + np.float32(0.5) - bend)
        )
    )
    petals = wave(x * np.float32(16)) * wave(y * np.float32(16)) * np.float32(0.3)
    flower = wave(x * np.float32(4)) * wave(y * np.float32(4)) + petals
    pattern = np.maximum(np.float32(1) - step(lattice, 0.05, 0.07), step(flower, 0.62, 0.68))
    thread = wave(x * np.float32(size // 4)) * np.float32(0.5) + speckle(rng, size, 1)
    wear = fractal(rng, size, 4, 4, 5)
    image = blend(ramp(wear, (0.2, dark), (0.9, dark)), light, pattern * np.float32(0.55))
    worn = np.float32(0.85) + wear * np.float32(0.3)
    return np.asarray(image * worn[..., None] + thread[..., None] * np.float32(5))


def plaster_red(rng: np.random.Generator, size: int) -> Field:
    return _damask(rng, size, (112, 28, 30), (158, 60, 52))


def plaster_green(rng: np.random.Generator, size: int) -> Field:
    return _damask(rng, size, (62, 82, 62), (104, 124, 92))


def _wood(rng: np.random.Generator, size: int, along: int, across: int) -> Field:
    """Growth rings and pores that run along y, 0…1."""
    x, _ = axes(size)
    bend = fractal(rng, size, across, along, 3)
    rings = wave(x * np.float32(9) + bend * np.float32(4)) * np.float32(0.5) + np.float32(0.5)
    pores = value_noise(rng, size, max(8, size // 3), 24)
    return rings * np.float32(0.55) + pores * np.float32(0.45)


OAK = ((0.1, (104, 66, 34)), (0.5, (148, 100, 54)), (0.95, (188, 138, 84)))


def wood(rng: np.random.Generator, size: int) -> Field:
    """Boards running along y."""
    x, _ = axes(size)
    grain = _wood(rng, size, 2, 4)
    board = np.floor(x * np.float32(5))
    tone = rng.random(5, dtype=np.float32)[board.astype(np.int64) % 5]
    joint = np.abs(x * np.float32(5) - np.floor(x * np.float32(5)) - np.float32(0.5))
    image = ramp(grain, *OAK) * (np.float32(0.8) + tone * np.float32(0.35))[..., None]
    return blend(image, (50, 30, 16), np.broadcast_to(step(joint, 0.485, 0.498), grain.shape))


def parquet(rng: np.random.Generator, size: int) -> Field:
    """Basket weave: squares of four strips in alternating directions."""
    x, y = axes(size)
    squares, strips = 6, 4
    i, j = np.floor(x * np.float32(squares)), np.floor(y * np.float32(squares))
    standing = ((i + j) % 2 == 0) & np.ones((size, size), dtype=bool)
    upright, lying = _wood(rng, size, 3, 6), _wood(rng, size, 3, 6).T
    grain = np.where(standing, upright, lying)
    fx, fy = x * np.float32(squares) - i, y * np.float32(squares) - j
    across = np.where(standing, fx, fy) * np.float32(strips)
    strip = np.floor(across)
    tones = rng.random((squares, squares, strips), dtype=np.float32)
    tone = tones[j.astype(np.int64), i.astype(np.int64), strip.astype(np.int64)]
    joint = np.abs(across - strip - np.float32(0.5))
    ends = np.maximum(np.abs(fx - np.float32(0.5)), np.abs(fy - np.float32(0.5)))
    gap = np.maximum(step(joint, 0.46, 0.495), step(ends, 0.488, 0.499))
    image = ramp(grain, *OAK) * (np.float32(0.75) + tone * np.float32(0.45))[..., None]
    return blend(image, (48, 28, 14), gap * np.float32(0.8)) + speckle(rng, size, 3)[..., None]


def stone(rng: np.random.Generator, size: int) -> Field:
    """Square slabs in two greys with joints."""
    x, y = axes(size)
    n = 4
    i, j = np.floor(x * np.float32(n)), np.floor(y * np.float32(n))
    tone = rng.random((n, n), dtype=np.float32)[j.astype(np.int64), i.astype(np.int64)]
    dark = ((i + j) % 2).astype(np.float32) * np.float32(34)
    clouds, specks = fractal(rng, size, 6, 6, 6, 0.6), rng.random((size, size), dtype=np.float32)
    image = ramp(clouds, (0.2, (150, 146, 138)), (0.8, (204, 200, 190)))
    image = image + (tone * np.float32(22) - dark)[..., None]
    image = blend(image, (84, 80, 76), step(specks, 0.96, 1.0) * np.float32(0.5))
    fx, fy = x * np.float32(n) - i, y * np.float32(n) - j
    edge = np.maximum(np.abs(fx - np.float32(0.5)), np.abs(fy - np.float32(0.5)))
    return blend(image, (104, 98, 90), step(edge, 0.482, 0.496))


def marble(rng: np.random.Generator, size: int) -> Field:
    a, b = (fractal(rng, size, 4, 4, 5) - np.float32(0.5) for _ in range(2))
    field = warp(fractal(rng, size, 3, 3, 6), a * np.float32(0.5), b * np.float32(0.5))
    vein = np.float32(1) - np.abs(field - np.float32(0.5)) * np.float32(2)
    image = ramp(field, (0.2, (206, 204, 204)), (0.7, (238, 236, 232)))
    image = blend(image, (128, 124, 130), step(vein, 0.9, 1.0) * np.float32(0.6))
    return image + speckle(rng, size, 3)[..., None]


def carpet(rng: np.random.Generator, size: int) -> Field:
    """A knotted pattern of diamonds in borders."""
    x, y = axes(size)
    u = np.abs(x * np.float32(4) - np.floor(x * np.float32(4)) - np.float32(0.5))
    v = np.abs(y * np.float32(4) - np.floor(y * np.float32(4)) - np.float32(0.5))
    diamond = u + v
    image = ramp(fractal(rng, size, 8, 8, 5), (0.2, (96, 22, 28)), (0.8, (132, 34, 36)))
    image = blend(image, (30, 40, 74), step(diamond, 0.30, 0.31))
    image = blend(image, (196, 160, 98), step(diamond, 0.36, 0.37) - step(diamond, 0.40, 0.41))
    image = blend(image, (200, 176, 128), np.float32(1) - step(diamond, 0.10, 0.11))
    image = blend(image, (44, 70, 60), np.float32(1) - step(diamond, 0.05, 0.06))
    knots = wave(x * np.float32(size // 8)) * wave(y * np.float32(size // 8))
    return image + (knots * np.float32(9) + speckle(rng, size, 14))[..., None]


def gilt(rng: np.random.Generator, size: int) -> Field:
    """Carved and gilded moulding: v runs across the frame, u along it."""
    x, y = axes(size)
    profile = wave(y * np.float32(1.5) + np.float32(0.1)) * np.float32(0.35)
    beads = wave(x * np.float32(8)) * wave(y * np.float32(2)) * np.float32(0.3)
    leaf = fractal(rng, size, 8, 8, 6, 0.65)
    tone = np.float32(0.5) + profile + beads + (leaf - np.float32(0.5)) * np.float32(0.7)
    image = ramp(
        tone,
        (0.0, (66, 40, 12)),
        (0.4, (150, 106, 34)),
        (0.7, (214, 170, 74)),
        (1.0, (252, 232, 160)),
    )
    return image + speckle(rng, size, 4)[..., None]


def facade(rng: np.random.Generator, size: int) -> Field:
    """Ashlar: courses of blocks, every second one offset by half a block."""
    x, y = axes(size)
    rows, blocks = 8, 4
    j = np.floor(y * np.float32(rows))
    t = x * np.float32(blocks) + (j % 2) * np.float32(0.5)
    i = np.floor(t)
    tone = rng.random((rows, blocks), dtype=np.float32)
    tone = tone[j.astype(np.int64), i.astype(np.int64) % blocks]
    rough = fractal(rng, size, 16, 16, 6, 0.65)
    image = ramp(rough, (0.2, (158, 140, 108)), (0.8, (212, 196, 162)))
    image = image * (np.float32(0.88) + tone * np.float32(0.2))[..., None]
    fy = y * np.float32(rows) - j
    gap = np.maximum(
        step(np.abs(t - i - np.float32(0.5)), 0.485, 0.497),
        step(np.abs(fy - np.float32(0.5)), 0.47, 0.495),
    )
    return blend(image, (110, 98, 78), gap) + speckle(rng, size, 6)[..., None]


SURFACES: dict[str, Surface] = {
    "plaster_cream": plaster_cream,
    "parquet": parquet,
    "stone": stone,
    "plaster_red": plaster_red,
    "marble": marble,
    "carpet": carpet,
    "plaster_green": plaster_green,
    "gilt": gilt,
    "wood": wood,
    "facade": facade,
}
