"""Landscapes, the sea, a night sky, portraits and still lifes."""

from __future__ import annotations

import numpy as np
from PIL import Image

from ptmtools_samples.brush import BOLD, FINE, disk, disk_mask, paint, pick, sign
from ptmtools_samples.noise import (
    Color,
    Field,
    axes,
    blend,
    fractal,
    ramp,
    ridge,
    step,
    wave,
)


def _sky(rng: np.random.Generator, size: int, horizon: float) -> Field:
    _, y = axes(size)
    zenith = pick(rng, [(58, 102, 168), (84, 118, 160), (66, 74, 118), (108, 128, 150)])
    glow = pick(rng, [(246, 214, 158), (236, 186, 140), (226, 226, 220), (244, 196, 120)])
    image = ramp(np.broadcast_to(y / np.float32(horizon), (size, size)), (0.0, zenith), (1.0, glow))
    clouds = fractal(rng, size, 3, 7, 6, 0.55) * (np.float32(1.25) - y)
    image = blend(image, (250, 244, 236), step(clouds, 0.5, 0.78) * np.float32(0.9))
    return blend(image, (126, 128, 146), step(clouds, 0.66, 0.95) * np.float32(0.5))


def landscape(rng: np.random.Generator, size: int) -> Image.Image:
    """Ranges of hills under a sky, with trees in front."""
    _, y = axes(size)
    horizon = 0.42 + 0.16 * float(rng.random())
    image = _sky(rng, size, horizon)
    near_color = pick(rng, [(58, 74, 30), (92, 82, 34), (48, 66, 44), (104, 74, 36)])
    far_color = (132, 146, 170)
    layers = 5
    for k in range(layers):
        share = k / (layers - 1)
        top = horizon - 0.10 + share * 0.36
        edge = np.float32(top) + (ridge(rng, size, 3 + k, 6) - np.float32(0.5)) * np.float32(
            0.22 * (1 - 0.45 * share)
        )
        tone = fractal(rng, size, 8 + 4 * k, 16 + 8 * k, 4)
        color = [f + (n - f) * share for f, n in zip(far_color, near_color, strict=True)]
        dark: Color = (color[0] * 0.7, color[1] * 0.7, color[2] * 0.75)
        lit: Color = (color[0] * 1.3 + 12, color[1] * 1.3 + 10, color[2] * 1.15)
        mask = step(y - edge, -0.002, 0.006)
        image = blend(image, ramp(tone, (0.25, dark), (0.75, lit)), mask)
    for _ in range(int(rng.integers(4, 9))):
        cx, foot = float(rng.random()), 0.66 + 0.26 * float(rng.random())
        tall = (foot - 0.45) * (0.5 + 0.4 * float(rng.random()))
        image = blend(
            image, (48, 34, 22), disk_mask(size, cx, foot - tall * 0.4, 0.008, tall * 0.5)
        )
        leaves = fractal(rng, size, 20, 20, 4)
        crown = disk(size, cx, foot - tall, tall * 0.45, tall * 0.55) + (
            leaves - np.float32(0.5)
        ) * np.float32(1.6)
        shade = ramp(leaves, (0.3, (24, 40, 18)), (0.75, (94, 112, 44)))
        image = blend(image, shade, np.float32(1) - step(crown, 0.7, 1.0))
    return sign(rng, paint(rng, image, FINE))


def seascape(rng: np.random.Generator, size: int) -> Image.Image:
    """The sea in evening light, with sails."""
    x, y = axes(size)
    horizon = 0.46 + 0.1 * float(rng.random())
    image = _sky(rng, size, horizon)
    sun = 0.25 + 0.5 * float(rng.random())
    image = blend(
        image,
        (255, 238, 190),
        np.float32(1) - step(disk(size, sun, horizon - 0.08, 0.05, 0.05), 0.5, 2.5),
    )
    depth = np.clip((y - np.float32(horizon)) / np.float32(1 - horizon), 0, 1)
    swell = fractal(rng, size, 6, 40, 4)
    crest = swell * np.float32(0.6) + wave(
        y * np.float32(26) + swell * np.float32(2) + x
    ) * np.float32(0.2)
    sea = ramp(crest, (0.0, (18, 44, 66)), (0.5, (44, 92, 112)), (0.85, (196, 214, 206)))
    glitter = step(crest, 0.3, 0.7) * (
        np.float32(1) - step(np.abs(x - np.float32(sun)) / (depth + np.float32(0.25)), 0.1, 0.5)
    )
    sea = blend(sea, (250, 210, 140), glitter * np.float32(0.8))
    image = blend(
        image, sea, np.broadcast_to(step(y - np.float32(horizon), 0.0, 0.004), (size, size))
    )
    for _ in range(int(rng.integers(2, 5))):
        cx, tall = float(rng.random()), 0.06 + 0.2 * float(rng.random())
        foot = horizon + tall * 0.35
        width = np.clip((y - np.float32(foot - tall)) / np.float32(tall), 0, 1)
        sail = (
            np.abs(x - np.float32(cx) - width * np.float32(0.1 * tall))
            < width * np.float32(0.3 * tall)
        ) & ((y < foot) & (y > foot - tall))
        image = blend(image, (238, 224, 196), sail.astype(np.float32))
        image = blend(
            image, (52, 32, 24), disk_mask(size, cx, foot + tall * 0.08, tall * 0.42, tall * 0.09)
        )
    return sign(rng, paint(rng, image, FINE, swirl=0.1))


def night(rng: np.random.Generator, size: int) -> Image.Image:
    """Stars over a town, in swirling strokes."""
    _, y = axes(size)
    image = ramp(
        fractal(rng, size, 3, 3, 4) * np.float32(0.6) + y * np.float32(0.4),
        (0.2, (14, 24, 72)),
        (0.5, (40, 76, 140)),
        (0.85, (110, 152, 186)),
    )
    for _ in range(14):
        cx, cy = float(rng.random()), 0.55 * float(rng.random())
        r = 0.015 + 0.035 * float(rng.random())
        d = disk(size, cx, cy, r, r)
        image = blend(image, (240, 220, 120), np.float32(0.8) - step(d, 0.2, 7.0) * np.float32(0.8))
        image = blend(image, (255, 250, 210), np.float32(1) - step(d, 0.1, 0.4))
    edge = np.float32(0.72) + (ridge(rng, size, 4, 4) - np.float32(0.5)) * np.float32(0.2)
    image = blend(image, (18, 26, 44), step(y - edge, 0.0, 0.01))
    for _ in range(40):
        cx, cy = float(rng.random()), 0.78 + 0.2 * float(rng.random())
        image = blend(
            image,
            pick(rng, [(250, 200, 90), (230, 150, 60)]),
            disk_mask(size, cx, cy, 0.008, 0.011),
        )
    return sign(rng, paint(rng, image, BOLD, swirl=0.6))


def portrait(rng: np.random.Generator, size: int) -> Image.Image:
    """A half-length figure before a dark ground, lit from the upper left."""
    x, y = axes(size)
    ground = pick(rng, [(70, 56, 40), (48, 58, 52), (62, 44, 48), (52, 52, 66)])
    shade = fractal(rng, size, 3, 3, 4) * np.float32(0.5) + (np.float32(1) - x) * np.float32(0.5)
    image = ramp(
        shade,
        (0.1, (ground[0] * 0.4, ground[1] * 0.4, ground[2] * 0.4)),
        (0.9, (ground[0] * 1.5, ground[1] * 1.5, ground[2] * 1.5)),
    )
    cx = 0.46 + 0.08 * float(rng.random())
    coat = pick(rng, [(86, 24, 28), (30, 42, 72), (36, 36, 34), (52, 70, 46)])
    skin = pick(rng, [(224, 178, 144), (196, 144, 108), (142, 96, 68), (238, 202, 172)])
    hair = pick(rng, [(44, 28, 18), (110, 72, 34), (170, 166, 158), (22, 18, 18)])

    def light_ball(px: float, py: float, rx: float, ry: float, color: Color) -> None:
        nonlocal image
        u, v = (x - np.float32(px)) / np.float32(rx), (y - np.float32(py)) / np.float32(ry)
        bulge = np.sqrt(np.clip(np.float32(1) - u * u - v * v, 0, 1))
        light = np.clip(bulge * np.float32(0.62) - u * np.float32(0.45) - v * np.float32(0.3), 0, 1)
        tone = (
            np.float32(0.28)
            + light * np.float32(0.9)
            + (fractal(rng, size, 12, 12, 3) - np.float32(0.5)) * np.float32(0.12)
        )
        body = tone[..., None] * np.asarray(color, dtype=np.float32)
        image = blend(image, body, disk_mask(size, px, py, rx, ry))

    light_ball(cx, 0.37, 0.175, 0.235, hair)
    light_ball(cx, 1.06, 0.40, 0.42, coat)
    light_ball(cx, 0.60, 0.07, 0.14, skin)
    light_ball(cx, 0.715, 0.10, 0.06, (236, 230, 214))
    light_ball(cx, 0.40, 0.135, 0.19, skin)
    light_ball(cx, 0.26, 0.15, 0.09, hair)
    for side in (-1, 1):
        image = blend(
            image, (206, 196, 184), disk_mask(size, cx + side * 0.052, 0.385, 0.022, 0.009)
        )
        image = blend(image, (40, 28, 24), disk_mask(size, cx + side * 0.052, 0.385, 0.013, 0.012))
        image = blend(image, hair, disk_mask(size, cx + side * 0.052, 0.355, 0.034, 0.007))
    image = blend(image, (150, 74, 64), disk_mask(size, cx, 0.50, 0.042, 0.012))
    light_ball(cx - 0.004, 0.435, 0.02, 0.045, skin)
    for k in range(4):
        image = blend(
            image, (210, 172, 80), disk_mask(size, cx + 0.012, 0.80 + 0.055 * k, 0.011, 0.011)
        )
    return sign(rng, paint(rng, image, FINE))


def still_life(rng: np.random.Generator, size: int) -> Image.Image:
    """Fruit and a bottle on a table."""
    x, y = axes(size)
    wall = ramp(fractal(rng, size, 3, 3, 5), (0.2, (54, 46, 40)), (0.8, (104, 88, 70)))
    cloth = ramp(
        fractal(rng, size, 5, 12, 5) * np.float32(0.7) + wave(x * np.float32(5)) * np.float32(0.1),
        (0.1, (120, 104, 92)),
        (0.7, (232, 222, 206)),
    )
    image = blend(wall, cloth, np.broadcast_to(step(y, 0.62, 0.64), (size, size)))
    bx = 0.2 + 0.15 * float(rng.random())
    for cy, rx, ry in ((0.5, 0.085, 0.26), (0.2, 0.03, 0.14), (0.085, 0.04, 0.02)):
        u = (x - np.float32(bx)) / np.float32(rx)
        glass = ramp(
            np.broadcast_to(u, (size, size)),
            (-1.0, (20, 44, 30)),
            (-0.4, (120, 160, 110)),
            (-0.2, (34, 66, 44)),
            (1.0, (10, 22, 16)),
        )
        image = blend(image, glass, disk_mask(size, bx, cy, rx, ry))
    fruits = sorted(
        (
            0.58 + 0.28 * float(rng.random()),
            0.15 + 0.7 * float(rng.random()),
            0.06 + 0.05 * float(rng.random()),
        )
        for _ in range(int(rng.integers(7, 12)))
    )
    for cy, cx, r in fruits:
        color = pick(
            rng, [(206, 92, 28), (188, 40, 34), (214, 178, 52), (112, 136, 44), (98, 36, 74)]
        )
        image = blend(
            image,
            (46, 36, 34),
            disk_mask(size, cx + r * 0.5, cy + r * 0.8, r * 1.2, r * 0.35) * np.float32(0.6),
        )
        u, v = (x - np.float32(cx)) / np.float32(r), (y - np.float32(cy)) / np.float32(r)
        bulge = np.sqrt(np.clip(np.float32(1) - u * u - v * v, 0, 1))
        tone = np.clip(
            bulge * np.float32(0.7) - u * np.float32(0.4) - v * np.float32(0.4), 0, 1.2
        ) + np.float32(0.22)
        image = blend(
            image,
            tone[..., None] * np.asarray(color, dtype=np.float32),
            disk_mask(size, cx, cy, r, r),
        )
        image = blend(
            image,
            (255, 246, 226),
            disk_mask(size, cx - r * 0.35, cy - r * 0.4, r * 0.13, r * 0.11) * np.float32(0.8),
        )
    return sign(rng, paint(rng, image, FINE))
