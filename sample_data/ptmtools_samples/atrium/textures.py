"""Textures of the atrium: those of the museum where they fit, and some of its own.

Each function takes a generator and a size and returns (size, size, 3) colours 0…255. Like the
museum's, they use arithmetic that is the same on every machine (`ptmtools_samples.noise`).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from ptmtools_samples.noise import Color, Field, axes, blend, fractal, ramp, step, wave
from ptmtools_samples.surfaces import SURFACES, Surface, speckle

#: Dark and light of each drape.
DRAPES = {
    "drape_red": ((120, 22, 24), (186, 74, 52)),
    "drape_green": ((36, 84, 54), (96, 138, 84)),
    "drape_blue": ((30, 46, 104), (92, 112, 170)),
}


def _grain_stone(
    rng: np.random.Generator, size: int, dark: Color, light: Color, grain: float
) -> Field:
    """Stone without joints: clouds, and grains of a texel."""
    clouds = fractal(rng, size, 5, 5, 7, 0.62)
    return ramp(clouds, (0.2, dark), (0.8, light)) + speckle(rng, size, grain)[..., None]


def granite(rng: np.random.Generator, size: int) -> Field:
    image = _grain_stone(rng, size, (120, 84, 78), (168, 128, 116), 10)
    dark, light = (rng.random((size, size), dtype=np.float32) for _ in range(2))
    image = blend(image, (52, 44, 46), step(dark, 0.9, 1.0) * np.float32(0.7))
    return blend(image, (220, 196, 186), step(light, 0.93, 1.0) * np.float32(0.6))


def coffer(rng: np.random.Generator, size: int) -> Field:
    """Two by two coffers of wood with a gilt rosette each."""
    x, y = axes(size)
    u = np.abs(x * np.float32(2) - np.floor(x * np.float32(2)) - np.float32(0.5))
    v = np.abs(y * np.float32(2) - np.floor(y * np.float32(2)) - np.float32(0.5))
    edge = np.maximum(u, v)
    image = np.asarray(SURFACES["wood"](rng, size)) * np.float32(0.8)
    image = blend(image, (46, 58, 92), np.float32(1) - step(edge, 0.34, 0.35))
    image = blend(image, (30, 20, 12), step(edge, 0.35, 0.37) - step(edge, 0.4, 0.42))
    distance = np.sqrt(u * u + v * v)
    petals = np.float32(0.2) + wave((u - v) * np.float32(5)) * wave((u + v) * np.float32(5)) * 0.08
    rosette = np.float32(1) - step(np.asarray(distance - petals, np.float32), -0.02, 0.02)
    return blend(image, np.asarray(SURFACES["gilt"](rng, size)), rosette)


def cornice(rng: np.random.Generator, size: int) -> Field:
    """Carved leaves and eggs in turn, four to a metre, in bands."""
    x, y = axes(size)
    image = _grain_stone(rng, size, (176, 164, 142), (226, 216, 196), 6)
    eggs = wave(x * np.float32(4)) * wave(y * np.float32(2))
    image = blend(image, (96, 84, 66), step(eggs, 0.2, 0.5) * np.float32(0.6))
    image = blend(image, (246, 240, 224), step(eggs, 0.62, 0.9) * np.float32(0.7))
    lines = np.abs(y * np.float32(4) - np.floor(y * np.float32(4)) - np.float32(0.5))
    edge = np.broadcast_to(step(lines, 0.44, 0.48), eggs.shape)
    return blend(image, (88, 76, 60), np.asarray(edge) * np.float32(0.8))


def drape(rng: np.random.Generator, size: int, dark: Color, light: Color) -> Field:
    """Woven cloth with a pattern of flowers between wavy stripes."""
    x, y = axes(size)
    bend = wave(y * np.float32(2)) * np.float32(0.12)
    stripe = wave(x * np.float32(6) + bend)
    flower = wave(x * np.float32(12)) * wave(y * np.float32(12))
    flower = flower + wave(x * np.float32(36)) * wave(y * np.float32(36)) * np.float32(0.35)
    image = ramp(fractal(rng, size, 4, 4, 6), (0.1, dark), (0.95, dark))
    image = blend(image, light, step(np.asarray(stripe), 0.2, 0.3) * np.float32(0.5))
    image = blend(image, (214, 182, 104), step(flower, 0.66, 0.74) * np.float32(0.75))
    thread = wave(x * np.float32(size // 4)) + wave(y * np.float32(size // 4))
    return np.asarray(image + thread[..., None] * np.float32(6) + speckle(rng, size, 8)[..., None])


def vase(rng: np.random.Generator, size: int, ground: Color, paint: Color) -> Field:
    """Bands of meanders and flowers around a glazed vessel."""
    x, y = axes(size)
    red, green, blue = (min(c + 26, 255) for c in ground)
    image = _grain_stone(rng, size, ground, (red, green, blue), 3)
    band = np.floor(y * np.float32(8))
    meander = wave(x * np.float32(16)) * np.float32(0.25) + (y * np.float32(8) - band)
    lines = step(np.abs(np.asarray(meander) - np.float32(0.5)), 0.1, 0.14)
    image = blend(
        image, paint, np.where(band % 2 == 0, np.float32(1) - lines, 0).astype(np.float32)
    )
    flower = wave(x * np.float32(8)) * wave(y * np.float32(8))
    leaf = wave(x * np.float32(24) + y * np.float32(8)) * wave(y * np.float32(24)) * np.float32(0.4)
    painted = np.where(band % 2 == 1, step(np.asarray(flower + leaf), 0.5, 0.6), 0)
    return blend(image, paint, painted.astype(np.float32))


def relief(rng: np.random.Generator, size: int) -> Field:
    """Weathered sandstone, darker in the hollows of the disc."""
    x, y = axes(size)
    distance = np.sqrt((x * 2 - 1) ** 2 + (y * 2 - 1) ** 2).astype(np.float32)
    image = _grain_stone(rng, size, (172, 142, 102), (216, 188, 144), 12)
    hollow = wave(distance * np.float32(4)) * np.float32(0.5) + np.float32(0.5)
    return blend(image, (98, 74, 50), hollow * np.float32(0.45))


def stone(rng: np.random.Generator, size: int) -> Field:
    return _grain_stone(rng, size, (188, 178, 158), (224, 216, 198), 8)


def _shared_surface(name: str) -> Surface:
    return SURFACES[name]


TEXTURES: dict[str, Callable[[np.random.Generator, int], Field]] = {
    "floor": _shared_surface("stone"),
    "coffer": coffer,
    "ashlar": _shared_surface("facade"),
    "parquet": _shared_surface("parquet"),
    "vault": _shared_surface("plaster_cream"),
    "cornice": cornice,
    "stone": stone,
    "marble": _shared_surface("marble"),
    "granite": granite,
    "capital": _shared_surface("gilt"),
    "vase_blue": partial(vase, ground=(214, 218, 224), paint=(34, 58, 138)),
    "vase_clay": partial(vase, ground=(178, 94, 52), paint=(38, 26, 24)),
    "relief": relief,
    "carpet": _shared_surface("carpet"),
    **{name: partial(drape, dark=dark, light=light) for name, (dark, light) in DRAPES.items()},
}
