"""Posters and pages with legible lettering."""

from __future__ import annotations

import numpy as np
from PIL import Image

from ptmtools_samples.brush import disk, disk_mask, draw_letters, pick, weave_canvas
from ptmtools_samples.noise import (
    Color,
    axes,
    blend,
    bytes_of,
    fractal,
    ramp,
    step,
    wave,
)


def poster(rng: np.random.Generator, size: int) -> Image.Image:
    """A poster of an exhibition: a bold figure and large lettering."""
    x, y = axes(size)
    ink = pick(rng, [(24, 38, 64), (92, 22, 24), (30, 62, 50), (44, 34, 30)])
    paper = pick(rng, [(240, 226, 192), (232, 214, 176), (244, 236, 214)])
    glow = pick(rng, [(222, 122, 46), (204, 62, 46), (226, 182, 70), (76, 136, 148)])
    image = ramp(
        fractal(rng, size, 6, 6, 6, 0.65),
        (0.1, (paper[0] - 22, paper[1] - 24, paper[2] - 30)),
        (0.8, paper),
    )
    cx = 0.35 + 0.3 * float(rng.random())
    d = disk(size, cx, 0.46, 0.24, 0.24)
    sun = ramp(
        np.broadcast_to(y, (size, size)),
        (0.2, glow),
        (0.7, (glow[0] * 0.6, glow[1] * 0.5, glow[2] * 0.6)),
    )
    image = blend(image, sun, np.float32(1) - step(d, 0.985, 1.015))
    for k in range(5):
        edge = np.float32(0.48 + 0.055 * k) + wave(
            x * np.float32(1 + k % 2) + np.float32(0.17 * k)
        ) * np.float32(0.025)
        band = (y > edge) & (y < edge + np.float32(0.026)) & (np.abs(x - np.float32(0.5)) < 0.4)
        image = blend(image, ink, band.astype(np.float32))
    border = np.maximum(np.abs(x - np.float32(0.5)), np.abs(y - np.float32(0.5)))
    image = blend(image, ink, ((border > 0.455) & (border < 0.47)).astype(np.float32))
    title = ("MUSEUM", "LUMIERE", "HORIZON", "ATELIER", "SALON")[int(rng.integers(5))]
    under = (
        "Paintings of the Coast",
        "New Works on Paper",
        "Colour and Light",
        "Travels in the South",
    )[int(rng.integers(4))]
    year = int(rng.integers(1895, 1935))
    picture = draw_letters(
        Image.fromarray(bytes_of(image)),
        [
            (title, 0.5, 0.135, 0.13, ink),
            (under, 0.5, 0.815, 0.052, ink),
            (
                f"Galleries 1 to {int(rng.integers(5, 12))}   May - September {year}",
                0.5,
                0.885,
                0.032,
                ink,
            ),
        ],
    )
    return weave_canvas(rng, picture)


TEXT = (
    "of the old road along the river and the mills that stood there in the year of the "
    "great flood when the bridge was carried away and rebuilt in stone by the masters of "
    "the town as it is written in the book of the guild with the names of all who gave "
    "for the work their silver timber and days here follow the measures of the piers the "
    "span of every arch"
)


def _pick_text(rng: np.random.Generator, letters: str) -> str:
    return letters[int(rng.integers(len(letters)))]


def manuscript(rng: np.random.Generator, size: int) -> Image.Image:
    """A page of writing on parchment, with an ornate initial and a seal."""
    x, y = axes(size)
    image = ramp(fractal(rng, size, 4, 4, 7, 0.6), (0.2, (198, 168, 116)), (0.75, (236, 218, 176)))
    edge = np.maximum(np.abs(x - np.float32(0.5)), np.abs(y - np.float32(0.5)))
    image = blend(
        image,
        (122, 86, 46),
        step(edge + fractal(rng, size, 8, 8, 4) * np.float32(0.08), 0.46, 0.56) * np.float32(0.8),
    )
    brown: Color = (58, 36, 22)
    image = blend(
        image,
        (150, 34, 28),
        ((np.abs(x - np.float32(0.19)) < 0.075) & (np.abs(y - np.float32(0.23)) < 0.075)).astype(
            np.float32
        ),
    )
    image = blend(image, (140, 24, 24), disk_mask(size, 0.78, 0.86, 0.06, 0.06))
    image = blend(image, (176, 60, 50), disk_mask(size, 0.78, 0.86, 0.042, 0.042))
    lines: list[tuple[str, float, float, float, Color]] = [
        ("THE CHRONICLE", 0.115, 0.1, 0.07, (124, 26, 22)),
        (_pick_text(rng, "ABDEMR"), 0.155, 0.23, 0.13, (238, 204, 110)),
    ]
    words = TEXT.split()
    start = int(rng.integers(len(words)))
    for k in range(16):
        indent = 0.29 if k < 4 else 0.115
        count = 6 if k < 4 else 8
        text = " ".join(words[(start + n) % len(words)] for n in range(count))
        start += count
        lines.append((text, indent, 0.175 + 0.042 * k, 0.031, brown))
    return weave_canvas(rng, draw_letters(Image.fromarray(bytes_of(image)), lines, middle=False))
