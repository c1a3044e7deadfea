"""Textures of glass, doors, ground and plants, and masks.

`IMAGES` draws colours; `MASKS` derives specular masks from the same picture; `ALPHAS` draws opacity
masks of plants.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from PIL import Image

from ptmtools_samples.brush import draw_letters
from ptmtools_samples.campus.masonry import WALLS_AND_ROOFS, Surface, courses, shade
from ptmtools_samples.noise import (
    Color,
    Field,
    axes,
    blend,
    bytes_of,
    fractal,
    ramp,
    step,
    value_noise,
    warp,
    wave,
)
from ptmtools_samples.surfaces import speckle


def paint(rng: np.random.Generator, size: int) -> Field:
    t = fractal(rng, size, 12, 12, 5, 0.6)
    return (
        ramp(t, (0.2, (222, 220, 214)), (0.8, (244, 243, 238))) + speckle(rng, size, 3)[..., None]
    )


def metal(rng: np.random.Generator, size: int) -> Field:
    brushed = value_noise(rng, size, 4, max(8, size // 2))
    t = brushed * np.float32(0.4) + fractal(rng, size, 4, 4, 4) * np.float32(0.6)
    return ramp(t, (0.2, (158, 161, 165)), (0.8, (200, 203, 206)))


def louvre(rng: np.random.Generator, size: int) -> Field:
    _, y = axes(size)
    t = y * np.float32(8)
    f = t - np.floor(t) + np.zeros((size, size), dtype=np.float32)
    tone = fractal(rng, size, 6, 6, 4)
    image = ramp(f, (0.0, (208, 211, 214)), (0.6, (150, 154, 160)), (0.9, (70, 74, 80)))
    return np.asarray(image * (np.float32(0.9) + tone * np.float32(0.2))[..., None])


def _interior(rng: np.random.Generator, size: int) -> Field:
    """A dark room with reflections of the sky above and of trees below."""
    _, y = axes(size)
    up = np.float32(1) - y
    clouds = fractal(rng, size, 3, 4, 5)
    t = up * np.float32(0.6) + clouds * np.float32(0.4)
    return ramp(t, (0.15, (28, 34, 36)), (0.5, (50, 60, 68)), (0.9, (112, 130, 146)))


def glass_dark(rng: np.random.Generator, size: int) -> Field:
    image = _interior(rng, size)
    x, y = axes(size)
    trees = fractal(rng, size, 6, 8, 5) * np.float32(0.4) + y
    image = blend(image, (34, 42, 32), step(trees, 0.8, 0.95) * np.float32(0.6))
    lamp = np.float32(1) - step(
        np.maximum(np.abs(x - np.float32(0.62)) * 2, np.abs(y - np.float32(0.22)) * 14), 0.2, 0.26
    )
    return blend(image, (226, 214, 176), lamp * np.float32(0.5))


def glass_sky(rng: np.random.Generator, size: int) -> Field:
    x, y = axes(size)
    clouds = fractal(rng, size, 3, 5, 6, 0.55)
    t = clouds * np.float32(0.75) + (np.float32(1) - y) * np.float32(0.25)
    image = ramp(t, (0.25, (70, 96, 120)), (0.55, (120, 150, 176)), (0.8, (206, 216, 224)))
    return blend(image, (60, 76, 84), step(y + x * np.float32(0.15), 0.8, 1.05) * np.float32(0.6))


def glass_blinds(rng: np.random.Generator, size: int) -> Field:
    _, y = axes(size)
    image = _interior(rng, size)
    t = y * np.float32(40)
    slat = np.abs(t - np.floor(t) - np.float32(0.5)) + np.zeros((size, size), dtype=np.float32)
    blinds = ramp(slat, (0.0, (206, 204, 194)), (0.35, (184, 182, 172)), (0.5, (112, 112, 108)))
    down = np.float32(1) - step(y + np.zeros_like(slat), 0.62, 0.63)
    return np.asarray(blend(image, blinds, down * np.float32(0.85)))


def glass_curtains(rng: np.random.Generator, size: int) -> Field:
    x, _ = axes(size)
    image = _interior(rng, size)
    fold = wave(x * np.float32(14) + fractal(rng, size, 4, 2, 3) * np.float32(1.5))
    cloth = ramp(fold, (-1.0, (160, 150, 132)), (0.0, (206, 198, 180)), (1.0, (228, 222, 206)))
    side = np.abs(x - np.float32(0.5)) + fractal(rng, size, 2, 3, 2) * np.float32(0.08)
    return np.asarray(blend(image, cloth, step(side, 0.27, 0.3) * np.float32(0.9)))


def _panel(light: Color, dark: Color) -> Surface:
    def draw(rng: np.random.Generator, size: int) -> Field:
        x, y = axes(size)
        pores = value_noise(rng, size, max(8, size // 3), 20)
        rings = wave(x * np.float32(7) + fractal(rng, size, 4, 2, 3) * np.float32(4))
        t = pores * np.float32(0.6) + rings * np.float32(0.2) + np.float32(0.2)
        image = ramp(t, (0.1, dark), (0.9, light))
        for low, high in ((0.06, 0.36), (0.42, 0.62), (0.68, 0.93)):
            cy, hy = (low + high) / 2, (high - low) / 2
            d = np.maximum(
                np.abs(x - np.float32(0.5)) - np.float32(0.36),
                np.abs(y - np.float32(cy)) - np.float32(hy),
            )
            line = step(d, -0.02, -0.01) - step(d, 0.0, 0.01)
            image = blend(image, shade(dark, 0.5), line * np.float32(0.8))
        return image

    return draw


def door_glass(rng: np.random.Generator, size: int) -> Field:
    x, y = axes(size)
    image = _interior(rng, size)
    edge = np.maximum(np.abs(x - np.float32(0.5)), np.abs(y - np.float32(0.5)) + np.float32(0.03))
    image = blend(image, (150, 154, 158), step(edge, 0.43, 0.44))
    band = np.abs(y - np.float32(0.45)) + np.zeros_like(edge)
    return blend(
        image, (214, 218, 220), (np.float32(1) - step(band, 0.012, 0.016)) * np.float32(0.7)
    )


def asphalt(rng: np.random.Generator, size: int) -> Field:
    stones = value_noise(rng, size, max(8, size // 3), max(8, size // 3))
    clouds, cracks = fractal(rng, size, 4, 4, 5), fractal(rng, size, 5, 5, 5)
    image = ramp(
        stones * np.float32(0.6) + clouds * np.float32(0.4),
        (0.2, (66, 66, 68)),
        (0.8, (104, 103, 102)),
    )
    line = np.float32(1) - step(np.abs(cracks - np.float32(0.42)), 0.0, 0.006)
    return blend(image, (46, 46, 48), line * np.float32(0.6)) + speckle(rng, size, 6)[..., None]


def paving(rng: np.random.Generator, size: int) -> Field:
    tone, gap, _ = courses(rng, size, 6, 4, 0.035)
    rough = fractal(rng, size, 24, 24, 5, 0.65)
    image = ramp(
        tone * np.float32(0.5) + rough * np.float32(0.5),
        (0.15, (148, 144, 138)),
        (0.85, (190, 186, 178)),
    )
    return blend(image, (98, 95, 88), gap) + speckle(rng, size, 6)[..., None]


def cobbles(rng: np.random.Generator, size: int) -> Field:
    tone, gap, height = courses(rng, size, 18, 15, 0.3, 0.3)
    rough = fractal(rng, size, 32, 32, 4, 0.6)
    image = ramp(
        tone * np.float32(0.7) + rough * np.float32(0.3),
        (0.1, (104, 100, 98)),
        (0.9, (162, 156, 148)),
    )
    image = image * (np.float32(1.08) - height * np.float32(0.16))[..., None]
    return blend(image, (70, 66, 60), gap) + speckle(rng, size, 5)[..., None]


def gravel(rng: np.random.Generator, size: int) -> Field:
    a = value_noise(rng, size, max(8, size // 5), max(8, size // 5))
    b = value_noise(rng, size, max(8, size // 3), max(8, size // 3))
    t = a * np.float32(0.6) + b * np.float32(0.4)
    return ramp(t, (0.1, (118, 110, 98)), (0.5, (176, 167, 150)), (0.9, (214, 206, 190)))


def grass(rng: np.random.Generator, size: int) -> Field:
    blades = value_noise(rng, size, max(8, size // 2), max(8, size // 9))
    leaning = warp(
        blades, fractal(rng, size, 16, 16, 2) * np.float32(0.03), blades * np.float32(0.01)
    )
    patches = fractal(rng, size, 5, 5, 5)
    t = leaning * np.float32(0.6) + patches * np.float32(0.4)
    image = ramp(t, (0.15, (48, 72, 28)), (0.5, (82, 112, 44)), (0.85, (126, 148, 72)))
    return image + speckle(rng, size, 8)[..., None]


def leaves(dark: Color, light: Color, scale: int) -> Surface:
    def draw(rng: np.random.Generator, size: int) -> Field:
        a = value_noise(rng, size, max(8, size // scale), max(8, size // scale))
        b = fractal(rng, size, 14, 14, 4)
        t = a * np.float32(0.55) + b * np.float32(0.45)
        return (
            ramp(t, (0.2, shade(dark, 0.5)), (0.45, dark), (0.85, light))
            + speckle(rng, size, 7)[..., None]
        )

    return draw


def bark(rng: np.random.Generator, size: int) -> Field:
    x, _ = axes(size)
    t = wave(x * np.float32(12) + fractal(rng, size, 8, 4, 4) * np.float32(3)) * np.float32(0.25)
    t = t + fractal(rng, size, 24, 8, 4) * np.float32(0.6) + np.float32(0.2)
    return ramp(t, (0.15, (58, 46, 36)), (0.8, (128, 108, 86)))


def crown(width: float, stem: float) -> Surface:
    """Opacity of a tree, 0 or 255: its crown of leaves with gaps, and the stem."""

    def draw(rng: np.random.Generator, size: int) -> Field:
        x, y = axes(size)
        edge = fractal(rng, size, 7, 7, 5, 0.6) - np.float32(0.5)
        dx = (x - np.float32(0.5)) / np.float32(width)
        dy = (y - np.float32(0.38)) / np.float32(0.36)
        inside = np.float32(1) - dx * dx - dy * dy + edge * np.float32(1.1)
        gaps = fractal(rng, size, 28, 28, 3, 0.6)
        full = (inside > 0.12) & (gaps + np.clip(inside, 0, 1) * np.float32(0.3) > 0.47)
        trunk = (np.abs(x - np.float32(0.5)) < np.float32(stem)) & (y > 0.35)
        return np.asarray((full | trunk) * np.float32(255), dtype=np.float32)

    return draw


def tree(dark: Color, light: Color, stem: float) -> Surface:
    foliage = leaves(dark, light, 6)

    def draw(rng: np.random.Generator, size: int) -> Field:
        x, y = axes(size)
        image = foliage(rng, size)
        shade = np.float32(1.12) - y * np.float32(0.6)
        image = image * (shade + np.zeros_like(x))[..., None]
        trunk = ((np.abs(x - np.float32(0.5)) < np.float32(stem * 1.5)) & (y > 0.7)).astype(
            np.float32
        )
        return blend(image, (88, 72, 58), trunk)

    return draw


def signs(labels: list[str]) -> Callable[[np.random.Generator, int], Image.Image]:
    """Labels in four columns and ten rows, blue with white lettering."""

    def draw(rng: np.random.Generator, size: int) -> Image.Image:
        x, y = axes(size)
        t = fractal(rng, size, 4, 4, 3)
        image = ramp(t, (0.2, (28, 62, 108)), (0.8, (34, 72, 122)))
        fx, fy = x * np.float32(4), y * np.float32(10)
        fx, fy = fx - np.floor(fx), fy - np.floor(fy)
        edge = np.maximum(
            np.abs(fx - np.float32(0.5)) + np.float32(0.03), np.abs(fy - np.float32(0.5))
        )
        image = blend(image, (226, 228, 230), step(edge, 0.43, 0.44) - step(edge, 0.47, 0.48))
        lines: list[tuple[str, float, float, float, Color]] = []
        for k, label in enumerate(labels[:40]):
            cx, cy = (k % 4 + 0.5) / 4, (k // 4 + 0.5) / 10
            words = label.split(" ", 1) if len(label) > 13 else [label]
            for i, word in enumerate(words):
                at = cy + (0.026 * (i - 0.5) if len(words) > 1 else 0)
                lines.append((word, cx, at, 0.026, (250, 250, 250)))
        return draw_letters(Image.fromarray(bytes_of(image)), lines)

    return draw


IMAGES: dict[str, Surface] = {
    **WALLS_AND_ROOFS,
    "paint": paint,
    "metal": metal,
    "louvre": louvre,
    "door_oak": _panel((172, 120, 72), (104, 66, 36)),
    "door_blue": _panel((70, 104, 136), (48, 78, 108)),
    "door_glass": door_glass,
    "glass_dark": glass_dark,
    "glass_sky": glass_sky,
    "glass_blinds": glass_blinds,
    "glass_curtains": glass_curtains,
    "asphalt": asphalt,
    "paving": paving,
    "cobbles": cobbles,
    "gravel": gravel,
    "grass": grass,
    "hedge": leaves((44, 74, 34), (96, 126, 62), 5),
    "bark": bark,
    "tree_broad": tree((54, 84, 34), (126, 152, 72), 0.03),
    "tree_slender": tree((74, 96, 40), (160, 172, 88), 0.022),
}

ALPHAS: dict[str, Surface] = {
    "tree_broad": crown(0.44, 0.03),
    "tree_slender": crown(0.24, 0.022),
}


def mask(name: str, image: Field, rng: np.random.Generator, size: int) -> Field:
    """Specular mask: glass without curtains, stone, metal."""
    light = image[..., 0] * np.float32(0.3) + image[..., 1] * np.float32(0.5)
    light = light + image[..., 2] * np.float32(0.2)
    smears = fractal(rng, size, 5, 5, 5)
    if name.startswith(("glass", "door")):
        base = np.float32(235) - np.clip(light - np.float32(140), 0, 90) * np.float32(1.6)
    elif name == "stone_polished":
        base = np.float32(150) - np.abs(light - np.float32(110))
    else:
        base = light * np.float32(0.75)
    return np.asarray(np.clip(base - smears * np.float32(40), 0, 255))
