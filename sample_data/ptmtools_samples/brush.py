"""Brush strokes, canvas, lettering and shapes, shared by all styles of painting."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from ptmtools_samples.noise import (
    Color,
    Field,
    axes,
    bytes_of,
    fractal,
    step,
    value_noise,
    wave,
)


def pick(rng: np.random.Generator, colors: list[Color]) -> Color:
    return colors[int(rng.integers(len(colors)))]


def paint(
    rng: np.random.Generator,
    image: Field,
    passes: list[tuple[int, float, float]],
    swirl: float = 0.0,
) -> Image.Image:
    """Repaints ``image`` in strokes; a pass is (strokes, length, width), lengths as shares of the
    size.

    Strokes run along the contours of the brightness, turned towards a slow noise field by ``swirl``
    (0…1).
    """
    size = image.shape[0]
    canvas = Image.fromarray(bytes_of(image)).resize((2 * size, 2 * size), Image.Resampling.NEAREST)
    draw = ImageDraw.Draw(canvas)
    light = (image[..., 0] + image[..., 1] + image[..., 2]) / np.float32(3)
    spread = max(1, size // 64)
    dx = np.roll(light, -spread, 1) - np.roll(light, spread, 1)
    dy = np.roll(light, -spread, 0) - np.roll(light, spread, 0)
    flow = value_noise(rng, size, 4, 4)
    fx, fy = wave(flow), wave(flow + np.float32(0.25))
    for strokes, long, wide in passes:
        where = rng.integers(0, size, (strokes, 2))
        jitter = (rng.random((strokes, 4), dtype=np.float32) - np.float32(0.5)) * np.float32(2)
        x, y = where[:, 0], where[:, 1]
        tx = -dy[y, x] + fx[y, x] * np.float32(swirl * 120) + jitter[:, 0] * np.float32(4)
        ty = dx[y, x] + fy[y, x] * np.float32(swirl * 120) + jitter[:, 1] * np.float32(4)
        length = np.sqrt(tx * tx + ty * ty) + np.float32(1)
        reach = np.float32(long * size) * (np.float32(1) + jitter[:, 2] * np.float32(0.4))
        ex = np.floor(tx / length * reach).astype(np.int64)
        ey = np.floor(ty / length * reach).astype(np.int64)
        color = bytes_of(image[y, x] + jitter[:, 3:4] * np.float32(14)).tolist()
        width = max(1, round(2 * wide * size))
        for k, (a, b, c, d) in enumerate(
            np.stack([2 * x - ex, 2 * y - ey, 2 * x + ex, 2 * y + ey], 1).tolist()
        ):
            draw.line((a, b, c, d), fill=tuple(color[k]), width=width)
    return weave_canvas(rng, canvas.reduce(2))


def weave_canvas(rng: np.random.Generator, image: Image.Image) -> Image.Image:
    """The weave of the canvas and uneven varnish over a finished picture."""
    size = image.width
    x, y = axes(size)
    threads = max(8, size // 5)
    weave = wave(x * np.float32(threads)) * wave(y * np.float32(threads)) * np.float32(5)
    grain = (rng.random((size, size), dtype=np.float32) - np.float32(0.5)) * np.float32(9)
    varnish = np.float32(0.93) + fractal(rng, size, 3, 3, 4) * np.float32(0.12)
    out = np.asarray(image, dtype=np.float32) * varnish[..., None] + (weave + grain)[..., None]
    return Image.fromarray(bytes_of(out))


FINE = [(1800, 0.05, 0.02), (5000, 0.025, 0.008), (7000, 0.012, 0.004)]


BOLD = [(1500, 0.06, 0.03), (3500, 0.035, 0.014), (3000, 0.02, 0.007)]


def draw_letters(
    image: Image.Image,
    lines: list[tuple[str, float, float, float, Color]],
    *,
    middle: bool = True,
) -> Image.Image:
    """Writes (text, x, y, height, colour), the numbers as shares of the size, onto a picture."""
    size = image.width
    big = image.resize((2 * size, 2 * size), Image.Resampling.BILINEAR)
    draw = ImageDraw.Draw(big)
    for text, x, y, height, color in lines:
        font = ImageFont.load_default(max(6.0, round(2 * height * size)))
        fill = tuple(int(c) for c in color)
        anchor = "mm" if middle else "lm"
        draw.text((2 * x * size, 2 * y * size), text, fill=fill, font=font, anchor=anchor)
    return big.reduce(2)


def sign(rng: np.random.Generator, image: Image.Image) -> Image.Image:
    name = ("A. Ferrand", "M. Oude", "L. Castell", "J. Brandt", "E. Sorel")[int(rng.integers(5))]
    year = str(int(rng.integers(1780, 1930)))
    return draw_letters(image, [(f"{name} {year}", 0.84, 0.95, 0.026, (58, 24, 16))])


def disk(size: int, cx: float, cy: float, rx: float, ry: float) -> Field:
    """Squared distance from an ellipse's centre: 1 on its edge."""
    x, y = axes(size)
    u, v = (x - np.float32(cx)) / np.float32(rx), (y - np.float32(cy)) / np.float32(ry)
    return u * u + v * v


def disk_mask(size: int, cx: float, cy: float, rx: float, ry: float) -> Field:
    return np.float32(1) - step(disk(size, cx, cy, rx, ry), 0.94, 1.06)
