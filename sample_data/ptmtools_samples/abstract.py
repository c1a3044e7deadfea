"""Abstract paintings: colour fields, drip paintings, rectangles, marbled paper."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw

from ptmtools_samples.brush import paint, pick, weave_canvas
from ptmtools_samples.noise import (
    Color,
    axes,
    blend,
    bytes_of,
    fractal,
    ramp,
    step,
    warp,
    wave,
)


def color_field(rng: np.random.Generator, size: int) -> Image.Image:
    """Soft-edged bands of colour, layer over layer."""
    x, y = axes(size)
    palettes: list[list[Color]] = [
        [(120, 24, 20), (214, 84, 30), (238, 164, 52)],
        [(24, 34, 74), (70, 96, 160), (196, 204, 214)],
        [(40, 24, 30), (132, 40, 58), (212, 128, 118)],
        [(28, 50, 40), (104, 128, 62), (222, 206, 130)],
    ]
    palette = palettes[int(rng.integers(len(palettes)))]
    image = ramp(fractal(rng, size, 4, 4, 6, 0.6), (0.2, palette[0]), (1.1, palette[1]))
    rough = (fractal(rng, size, 10, 10, 6, 0.6) - np.float32(0.5)) * np.float32(0.10)
    edges = [0.07, 0.3 + 0.15 * float(rng.random()), 0.62 + 0.12 * float(rng.random()), 0.93]
    for k in range(3):
        inside_y = step(y - edges[k] - np.float32(0.02) + rough, 0.0, 0.03) * (
            np.float32(1) - step(y - edges[k + 1] + np.float32(0.02) + rough, -0.03, 0.0)
        )
        inside_x = step(np.float32(0.43) - np.abs(x - np.float32(0.5)) + rough, 0.0, 0.04)
        wash = fractal(rng, size, 5, 9, 6, 0.6)
        light: Color = tuple(min(255.0, c * 1.25 + 14) for c in palette[(k + 1) % 3])  # type: ignore[assignment]
        image = blend(
            image,
            ramp(wash, (0.2, palette[(k + 1) % 3]), (0.9, light)),
            inside_y * inside_x * (np.float32(0.65) + wash * np.float32(0.35)),
        )
    return paint(rng, image, [(2500, 0.08, 0.012), (4000, 0.04, 0.004)], swirl=0.05)


def drips(rng: np.random.Generator, size: int) -> Image.Image:
    """Threads of paint dripped over a canvas."""
    image = ramp(fractal(rng, size, 4, 4, 6, 0.6), (0.2, (196, 184, 160)), (0.8, (226, 216, 196)))
    canvas = Image.fromarray(bytes_of(image)).resize((2 * size, 2 * size), Image.Resampling.NEAREST)
    draw = ImageDraw.Draw(canvas)
    colors = [(24, 22, 22), (236, 230, 220), (150, 40, 32), (196, 150, 48), (40, 74, 92)]
    for _ in range(150):
        color = pick(rng, [(float(a), float(b), float(c)) for a, b, c in colors])
        fill = tuple(int(c) for c in color)
        x, y, dx, dy = (float(v) for v in rng.random(4))
        dx, dy = (dx - 0.5) * 0.04, (dy - 0.5) * 0.04
        points = []
        for _ in range(70):
            dx += (float(rng.random()) - 0.5) * 0.014
            dy += (float(rng.random()) - 0.5) * 0.014
            dx, dy = dx * 0.97, dy * 0.97
            x, y = x + dx, y + dy
            points.append((round(x * 2 * size), round(y * 2 * size)))
        thick = float(rng.random())
        wide = max(1, round((0.001 + 0.006 * thick * thick) * 2 * size))
        draw.line(points, fill=fill, width=wide, joint="curve")
        for px, py in points[:: int(rng.integers(9, 30))]:
            r = wide * int(rng.integers(1, 4)) // 2
            draw.ellipse((px - r, py - r, px + r, py + r), fill=fill)
    return weave_canvas(rng, canvas.reduce(2))


def constructivism(rng: np.random.Generator, size: int) -> Image.Image:
    """Rectangles in primary colours between black bars."""
    image = ramp(fractal(rng, size, 6, 6, 6, 0.6), (0.2, (226, 220, 206)), (0.8, (244, 240, 230)))
    x, y = axes(size)

    def cut(low: float, high: float, depth: int) -> list[tuple[float, float]]:
        if depth == 0 or high - low < 0.16:
            return [(low, high)]
        middle = low + (high - low) * (0.3 + 0.4 * float(rng.random()))
        return cut(low, middle, depth - 1) + cut(middle, high, depth - 1)

    colors: list[Color] = [(186, 32, 28), (28, 54, 126), (232, 190, 40), (30, 30, 30)]
    columns, rows = cut(0, 1, 2), cut(0, 1, 2)
    for a, b in columns:
        for c, d in rows:
            if rng.random() < 0.42:
                brush = fractal(rng, size, 4, 24, 4)
                color = pick(rng, colors)
                lit: Color = (color[0] * 1.2 + 10, color[1] * 1.2 + 10, color[2] * 1.2 + 10)
                mask = ((x > a) & (x < b) & (y > c) & (y < d)).astype(np.float32)
                image = blend(image, ramp(brush, (0.2, color), (0.9, lit)), mask)
    for a, _ in columns[1:]:
        image = blend(
            image,
            (22, 22, 24),
            np.broadcast_to(
                np.float32(1) - step(np.abs(x - np.float32(a)), 0.012, 0.015), (size, size)
            ),
        )
    for c, _ in rows[1:]:
        image = blend(
            image,
            (22, 22, 24),
            np.broadcast_to(
                np.float32(1) - step(np.abs(y - np.float32(c)), 0.012, 0.015), (size, size)
            ),
        )
    return weave_canvas(rng, Image.fromarray(bytes_of(image)))


def _pick_palette(rng: np.random.Generator) -> list[Color]:
    palettes: list[list[Color]] = [
        [(26, 42, 82), (64, 112, 150), (224, 206, 160), (196, 92, 52)],
        [(88, 20, 34), (190, 70, 56), (242, 212, 160), (52, 84, 90)],
        [(24, 56, 44), (98, 138, 84), (238, 226, 178), (190, 138, 50)],
    ]
    return palettes[int(rng.integers(len(palettes)))]


def marble_paper(rng: np.random.Generator, size: int) -> Image.Image:
    """Marbled paper: bands of colour distorted twice."""
    bands = fractal(rng, size, 3, 3, 3)
    for reach in (0.5, 0.25):
        dx, dy = (fractal(rng, size, 3, 3, 5) - np.float32(0.5) for _ in range(2))
        bands = warp(bands, dx * np.float32(reach), dy * np.float32(reach))
    tone = wave(bands * np.float32(6)) * np.float32(0.5) + np.float32(0.5)
    stops = _pick_palette(rng)
    image = ramp(tone, (0.0, stops[0]), (0.35, stops[1]), (0.65, stops[2]), (1.0, stops[3]))
    vein = np.float32(1) - step(np.abs(tone - np.float32(0.5)), 0.0, 0.05)
    return weave_canvas(
        rng, Image.fromarray(bytes_of(blend(image, (30, 24, 30), vein * np.float32(0.7))))
    )
