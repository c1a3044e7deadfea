"""Tiling textures of walls and roofs. See `ptmtools_samples.noise` for the arithmetic."""

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
from ptmtools_samples.surfaces import speckle

Surface = Callable[[np.random.Generator, int], Field]


def shade(color: Color, factor: float) -> Color:
    return color[0] * factor, color[1] * factor, color[2] * factor


def courses(
    rng: np.random.Generator, size: int, rows: int, blocks: int, joint: float, wobble: float = 0.0
) -> tuple[Field, Field, Field]:
    """Running bond: a tone 0…1 for each block, the joints 0…1, and the height within a course 0…1.

    ``joint``: width as a share of the height of a course; ``wobble``: deviation of the edges, in
    courses.
    """
    x, y = axes(size)
    if wobble:
        a, b = (fractal(rng, size, 12, 12, 3) - np.float32(0.5) for _ in range(2))
        x = x + a * np.float32(wobble / rows * 2)
        y = y + b * np.float32(wobble / rows * 2)
    j = np.floor(y * np.float32(rows))
    t = x * np.float32(blocks) + (j % 2) * np.float32(0.5)
    i = np.floor(t)
    tone = rng.random((rows, blocks), dtype=np.float32)
    tones = tone[j.astype(np.int64) % rows, i.astype(np.int64) % blocks]
    fx, fy = t - i, y * np.float32(rows) - j
    half = joint / 2
    aspect = rows / blocks
    across = np.minimum(fx, np.float32(1) - fx) * np.float32(aspect)
    along = np.minimum(fy, np.float32(1) - fy)
    gap = np.float32(1) - step(np.minimum(across, along), half * 0.5, half * 1.4)
    return tones, np.asarray(gap), np.asarray(fy + np.zeros_like(fx))


def bricks(dark: Color, middle: Color, light: Color, mortar: Color) -> Surface:
    """Eight stretchers by 26 courses on 2 m."""

    def draw(rng: np.random.Generator, size: int) -> Field:
        tone, gap, _ = courses(rng, size, 26, 8, 0.2)
        rough = fractal(rng, size, 32, 32, 4, 0.7)
        weather = fractal(rng, size, 3, 2, 4)
        t = tone * np.float32(0.75) + rough * np.float32(0.25)
        image = ramp(t, (0.05, dark), (0.5, middle), (0.95, light))
        image = image * (np.float32(0.9) + weather * np.float32(0.2))[..., None]
        image = blend(image, mortar, gap * np.float32(0.9))
        return image + speckle(rng, size, 8)[..., None]

    return draw


def ashlar(dark: Color, light: Color, rows: int, blocks: int, *, rustic: bool = False) -> Surface:
    """Cut stone; ``rustic``: with deep joints and blocks that bulge."""

    def draw(rng: np.random.Generator, size: int) -> Field:
        tone, gap, height = courses(rng, size, rows, blocks, 0.16 if rustic else 0.045)
        rough = fractal(rng, size, 16, 24, 6, 0.62)
        bedding = fractal(rng, size, 2, 24, 4)
        t = rough * np.float32(0.5) + bedding * np.float32(0.2) + tone * np.float32(0.3)
        image = ramp(t, (0.2, dark), (0.8, light))
        if rustic:
            light_from_above = np.float32(1.1) - height * np.float32(0.22)
            image = image * light_from_above[..., None]
        image = blend(image, shade(dark, 0.6), gap * np.float32(0.95 if rustic else 0.7))
        return image + speckle(rng, size, 5)[..., None]

    return draw


def rubble(rng: np.random.Generator, size: int) -> Field:
    """Field stones in thick mortar."""
    tone, gap, _ = courses(rng, size, 14, 9, 0.22, 0.75)
    rough = fractal(rng, size, 24, 24, 5, 0.65)
    image = ramp(
        tone,
        (0.0, (112, 104, 92)),
        (0.4, (146, 136, 118)),
        (0.7, (160, 142, 112)),
        (1.0, (128, 126, 124)),
    )
    image = image * (np.float32(0.72) + rough * np.float32(0.52))[..., None]
    return blend(image, (188, 180, 164), gap) + speckle(rng, size, 7)[..., None]


def plaster(color: Color) -> Surface:
    """Painted render with the marks of the float and of rain."""

    def draw(rng: np.random.Generator, size: int) -> Field:
        fine = fractal(rng, size, 48, 48, 4, 0.7)
        clouds = fractal(rng, size, 4, 3, 5)
        runs = fractal(rng, size, 40, 2, 2)
        t = fine * np.float32(0.5) + clouds * np.float32(0.35) + runs * np.float32(0.15)
        image = ramp(t, (0.25, shade(color, 0.9)), (0.75, shade(color, 1.05)))
        return image + speckle(rng, size, 5)[..., None]

    return draw


def concrete(rng: np.random.Generator, size: int) -> Field:
    """Cast between boards, with tie holes."""
    x, y = axes(size)
    j = np.floor(y * np.float32(16))
    tone = rng.random(16, dtype=np.float32)[j.astype(np.int64)]
    fy = y * np.float32(16) - j
    clouds, pores = fractal(rng, size, 5, 4, 6, 0.6), rng.random((size, size), dtype=np.float32)
    fibre = value_noise(rng, size, 12, max(16, size // 2))
    t = clouds * np.float32(0.6) + tone * np.float32(0.2) + fibre * np.float32(0.2)
    image = ramp(t, (0.2, (142, 140, 134)), (0.8, (186, 183, 176)))
    seam = step(np.abs(fy - np.float32(0.5)), 0.46, 0.495) * np.float32(0.35)
    image = blend(image, (108, 106, 102), seam + np.zeros_like(clouds))
    image = blend(image, (92, 90, 88), step(pores, 0.992, 1.0) * np.float32(0.7))
    hx, hy = (t * np.float32(2) - np.floor(t * np.float32(2)) - np.float32(0.5) for t in (x, y))
    hole = np.float32(1) - step(hx * hx + hy * hy, 0.0006, 0.001)
    return blend(image, (74, 73, 72), hole)


def concrete_panel(rng: np.random.Generator, size: int) -> Field:
    """Washed concrete: pebbles in panels of 3 by 1.5 m with sealed joints."""
    x, y = axes(size)
    pebbles = value_noise(rng, size, max(8, size // 6), max(8, size // 6))
    tint = value_noise(rng, size, max(8, size // 8), max(8, size // 8))
    clouds = fractal(rng, size, 4, 4, 4)
    image = ramp(
        pebbles * np.float32(0.7) + tint * np.float32(0.3),
        (0.1, (128, 122, 112)),
        (0.5, (172, 164, 150)),
        (0.9, (206, 198, 184)),
    )
    image = image * (np.float32(0.9) + clouds * np.float32(0.2))[..., None]
    fx = np.minimum(x, np.float32(1) - x)
    t = y * np.float32(2)
    fy = np.minimum(t - np.floor(t), np.float32(1) - t + np.floor(t)) / np.float32(2)
    joint = np.float32(1) - step(np.minimum(fx, fy), 0.004, 0.007)
    return blend(image, (76, 74, 72), joint)


def boards(colors: tuple[Color, Color, Color]) -> Surface:
    """Upright cladding, 14 boards on 2 m."""

    def draw(rng: np.random.Generator, size: int) -> Field:
        x, _ = axes(size)
        n = 14
        i = np.floor(x * np.float32(n))
        tone = rng.random(n, dtype=np.float32)[i.astype(np.int64)]
        bend = fractal(rng, size, 6, 2, 3)
        rings = wave(x * np.float32(n * 2) + bend * np.float32(5) + tone * np.float32(7))
        pores = value_noise(rng, size, max(8, size // 3), 18)
        t = (
            rings * np.float32(0.16)
            + pores * np.float32(0.4)
            + tone * np.float32(0.4)
            + np.float32(0.1)
        )
        image = ramp(t, (0.1, colors[0]), (0.5, colors[1]), (0.95, colors[2]))
        joint = step(np.abs(x * np.float32(n) - i - np.float32(0.5)), 0.45, 0.49)
        return blend(image, shade(colors[0], 0.45), joint + np.zeros_like(t))

    return draw


def rib_sheet(color: Color, ribs: int, *, seams: bool) -> Surface:
    """Sheet metal: corrugated, or flat with standing ``seams``."""

    def draw(rng: np.random.Generator, size: int) -> Field:
        x, _ = axes(size)
        t = x * np.float32(ribs)
        f = t - np.floor(t)
        clouds, streaks = fractal(rng, size, 4, 4, 5), fractal(rng, size, 48, 3, 3)
        tone = clouds * np.float32(0.6) + streaks * np.float32(0.4)
        if seams:
            light = step(f, 0.9, 0.95) - step(f, 0.96, 1.0) * np.float32(1.6)
            light = light * np.float32(0.25)
        else:
            light = wave(t) * np.float32(0.22)
        image = ramp(tone, (0.25, shade(color, 0.84)), (0.75, shade(color, 1.1)))
        image = image * (np.float32(1) + light + np.zeros_like(tone))[..., None]
        return image + speckle(rng, size, 3)[..., None]

    return draw


def terracotta(rng: np.random.Generator, size: int) -> Field:
    """Hung panels of 0.6 by 0.3 m in stacked bond, ribbed."""
    x, y = axes(size)
    nx, ny = 4, 8
    i, j = np.floor(x * np.float32(nx)), np.floor(y * np.float32(ny))
    tone = rng.random((ny, nx), dtype=np.float32)[j.astype(np.int64), i.astype(np.int64)]
    fx, fy = x * np.float32(nx) - i, y * np.float32(ny) - j
    rough = fractal(rng, size, 32, 32, 4, 0.6)
    image = ramp(
        tone * np.float32(0.6) + rough * np.float32(0.4),
        (0.1, (150, 82, 58)),
        (0.9, (192, 120, 88)),
    )
    rib = wave(y * np.float32(ny * 4)) * np.float32(0.07)
    image = image * (np.float32(1) + rib + np.zeros_like(tone))[..., None]
    edge = np.maximum(np.abs(fx - np.float32(0.5)) * np.float32(1.0), np.abs(fy - np.float32(0.5)))
    return blend(image, (66, 42, 34), step(edge, 0.475, 0.495)) + speckle(rng, size, 4)[..., None]


def roof_tiles(rng: np.random.Generator, size: int) -> Field:
    """Plain tiles with round ends, each row in the shadow of that above."""
    x, y = axes(size)
    rows, tiles = 14, 11
    # Rows count downwards; the round lower end of a tile overlaps the next row.
    t = x * np.float32(tiles)
    row = np.floor(y * np.float32(rows))
    shift = (row % 2) * np.float32(0.5)
    fx = t + shift - np.floor(t + shift) - np.float32(0.5)
    dip = np.float32(0.34) * (np.float32(1) - np.float32(4) * fx * fx)
    fy = y * np.float32(rows) - row
    above = fy < dip
    r = np.where(above, row - 1, row)
    s = (r % 2) * np.float32(0.5)
    i = np.floor(t + s)
    tone = rng.random((rows, tiles), dtype=np.float32)
    tone = tone[r.astype(np.int64) % rows, i.astype(np.int64) % tiles]
    gx = t + s - i - np.float32(0.5)
    rough = fractal(rng, size, 24, 24, 4, 0.6)
    image = ramp(
        tone * np.float32(0.7) + rough * np.float32(0.3),
        (0.05, (116, 52, 36)),
        (0.5, (158, 76, 50)),
        (0.95, (190, 108, 72)),
    )
    depth = fy - dip
    shadow = np.where(above, np.float32(0), np.float32(1) - step(depth, 0.0, 0.22))
    image = blend(image, (52, 26, 20), shadow * np.float32(0.75))
    side = step(np.abs(gx), 0.45, 0.5) * np.float32(0.6)
    return blend(image, (64, 32, 24), side) + speckle(rng, size, 5)[..., None]


def roof_slate(rng: np.random.Generator, size: int) -> Field:
    tone, gap, height = courses(rng, size, 16, 8, 0.07)
    rough = fractal(rng, size, 16, 16, 5, 0.65)
    t = tone * np.float32(0.65) + rough * np.float32(0.35)
    image = ramp(t, (0.1, (66, 70, 80)), (0.5, (88, 93, 103)), (0.95, (118, 122, 130)))
    image = image * (np.float32(0.82) + height * np.float32(0.26))[..., None]
    return blend(image, (36, 38, 44), gap * np.float32(0.9)) + speckle(rng, size, 4)[..., None]


def stone_trim(rng: np.random.Generator, size: int) -> Field:
    fine, clouds = fractal(rng, size, 24, 24, 5, 0.65), fractal(rng, size, 4, 4, 4)
    t = fine * np.float32(0.55) + clouds * np.float32(0.45)
    image = ramp(t, (0.25, (178, 170, 152)), (0.75, (214, 207, 190)))
    return image + speckle(rng, size, 6)[..., None]


def stone_polished(rng: np.random.Generator, size: int) -> Field:
    """Granite with veins."""
    a, b = (fractal(rng, size, 4, 4, 5) - np.float32(0.5) for _ in range(2))
    field = warp(fractal(rng, size, 3, 3, 6), a * np.float32(0.5), b * np.float32(0.5))
    crystals = value_noise(rng, size, max(8, size // 4), max(8, size // 4))
    vein = np.float32(1) - np.abs(field - np.float32(0.5)) * np.float32(2)
    image = ramp(
        crystals * np.float32(0.5) + field * np.float32(0.5),
        (0.2, (70, 66, 68)),
        (0.8, (132, 120, 116)),
    )
    return blend(image, (176, 160, 150), step(vein, 0.93, 1.0) * np.float32(0.5))


WALLS_AND_ROOFS: dict[str, Surface] = {
    "brick_red": bricks((112, 46, 36), (150, 68, 50), (178, 98, 72), (176, 168, 154)),
    "brick_yellow": bricks((168, 136, 84), (200, 170, 112), (220, 196, 146), (206, 198, 180)),
    "brick_brown": bricks((84, 58, 46), (118, 84, 64), (146, 110, 86), (150, 142, 130)),
    "brick_dark": bricks((52, 46, 50), (76, 68, 70), (104, 90, 88), (116, 112, 108)),
    "sandstone": ashlar((176, 148, 102), (220, 196, 148), 7, 3),
    "sandstone_red": ashlar((136, 74, 58), (184, 118, 94), 8, 4),
    "limestone": ashlar((186, 180, 162), (228, 223, 208), 6, 4),
    "rustic": ashlar((158, 146, 122), (206, 194, 166), 6, 3, rustic=True),
    "rubble": rubble,
    "plaster_white": plaster((226, 222, 212)),
    "plaster_ochre": plaster((216, 176, 98)),
    "plaster_rose": plaster((206, 148, 128)),
    "concrete": concrete,
    "concrete_panel": concrete_panel,
    "cladding_metal": rib_sheet((142, 154, 168), 20, seams=False),
    "cladding_timber": boards(((118, 78, 44), (164, 118, 72), (196, 154, 106))),
    "cladding_terracotta": terracotta,
    "stone_trim": stone_trim,
    "stone_polished": stone_polished,
    "roof_tiles": roof_tiles,
    "roof_slate": roof_slate,
    "roof_copper": rib_sheet((124, 166, 146), 6, seams=True),
}
