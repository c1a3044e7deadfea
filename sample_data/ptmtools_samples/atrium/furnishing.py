"""What stands and hangs in the hall: drapes, balustrades, vases, reliefs, frescoes, runners."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ptmtools_samples.atrium.building import (
    HEIGHT,
    LENGTH,
    RAIL,
    STOREYS,
    WALK,
    WALL,
    WIDTH,
    Side,
    sides,
)
from ptmtools_samples.atrium.sheets import Sheet, Vector, box, picture, plane, revolve, smooth

DRAPES = ("drape_red", "drape_green", "drape_blue")
#: Metres.
VASE_HEIGHT, RELIEF_SIDE = 1.25, 2.6


def drapes(rng: np.random.Generator) -> Iterator[Sheet]:
    """Cloth in folds, hung before every second arch of the upper storey's long sides."""
    floor = STOREYS[1][0]
    number = 0
    for side in (sides()[0], sides()[2]):
        for k in range(0, side.bays, 2):
            yield _drape(f"drape_{number}", DRAPES[number % 3], side, k, floor - 1.6, rng)
            number += 1


def _drape(
    name: str, material: str, side: Side, k: int, low: float, rng: np.random.Generator
) -> Sheet:
    wide, tall = side.bay * 0.72, 4.2
    columns, rows = 60, 44
    s, v = np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1)
    folds, phase = 6 + int(rng.integers(3)), 2 * math.pi * rng.random(2)
    # Folds deepen downwards, the hem sags, and the cloth gathers towards its middle.
    deep = (0.05 + 0.09 * (1 - v))[:, None]
    out = deep * np.sin(2 * math.pi * folds * s + phase[0] + 1.2 * (1 - v)[:, None])
    out = out + 0.04 * np.sin(2 * math.pi * s + phase[1] + 3 * v[:, None])
    across = (s - 0.5) * (1 - 0.16 * np.sin(math.pi * v))[:, None] * wide
    sag = 0.12 * np.cos(2 * math.pi * s) * (1 - v)[:, None]
    points = np.array(
        [
            [
                side.point(
                    (k + 0.5) * side.bay + float(across[i, j]),
                    low + tall * float(v[i]) - float(sag[i, j]),
                    WALL / 2 + 0.28 + float(out[i, j]),
                )
                for j in range(columns + 1)
            ]
            for i in range(rows + 1)
        ]
    )
    uv = np.stack(np.broadcast_arrays(2 * s[None, :], 3 * v[:, None]), axis=2)
    return Sheet(name, material, points, uv)


def balustrades() -> Iterator[Sheet]:
    """Balusters and a rail in each upper arch."""
    floor = STOREYS[1][0]
    profile = smooth(
        [(0.06, 0.0), (0.06, 0.06), (0.03, 0.12), (0.075, 0.3), (0.03, 0.62), (0.05, 0.78),
         (0.06, RAIL - 0.14)],
        1,
    )  # fmt: skip
    for side in sides():
        for k in range(side.bays):
            name = f"{side.name}_balustrade_{k}"
            count = 8
            for n in range(count):
                s = (k + 0.16 + 0.68 * (n + 0.5) / count) * side.bay
                yield revolve(name, "stone", profile, 10, side.point(s, floor, 0.0), 1)
            a = side.point((k + 0.12) * side.bay, floor + RAIL - 0.14, -0.11)
            b = side.point((k + 0.88) * side.bay, floor + RAIL, 0.11)
            low = min(a[0], b[0]), min(a[1], b[1]), min(a[2], b[2])
            high = max(a[0], b[0]), max(a[1], b[1]), max(a[2], b[2])
            yield from box(name, "stone", low, high, 1.0)


def vases() -> Iterator[Sheet]:
    """On plinths, along both sides of the court."""
    profile = [(0.0, 0.0), (0.24, 0.0), (0.25, 0.05), (0.13, 0.12), (0.11, 0.2), (0.3, 0.42),
               (0.41, 0.66), (0.36, 0.88), (0.2, 1.02), (0.18, 1.1), (0.29, 1.22),
               (0.3, VASE_HEIGHT), (0.25, 1.22), (0.14, 1.1), (0.0, 1.0)]  # fmt: skip
    for n, x in enumerate(np.linspace(WALK + 3.5, LENGTH - WALK - 3.5, 5).tolist()):
        for z in (WIDTH / 2 - 2.4, WIDTH / 2 + 2.4):
            name = f"vase_{2 * n + (z > WIDTH / 2)}"
            half, tall = 0.34, 0.8
            yield from box(
                name, "marble", (x - half, 0, z - half), (x + half, tall, z + half), 1.0, "xXYzZ"
            )
            yield revolve(
                name, ("vase_blue", "vase_clay")[n % 2], smooth(profile, 3), 44, (x, tall, z), 1
            )


def reliefs() -> Iterator[Sheet]:
    """A carved disc at each end of the hall, with rays, petals and a boss."""
    rows = 72
    t = np.linspace(-1, 1, rows + 1)
    x, y = np.meshgrid(t, t)
    radius_share, angle = np.hypot(x, y), np.arctan2(y, x)
    height = 0.1 * np.exp(-((radius_share / 0.22) ** 2))
    height += 0.07 * np.abs(np.cos(4 * angle)) * np.exp(-(((radius_share - 0.42) / 0.14) ** 2))
    height += 0.05 * (np.cos(24 * angle) > 0) * np.exp(-(((radius_share - 0.72) / 0.09) ** 2))
    height += 0.06 * np.exp(-(((radius_share - 0.92) / 0.04) ** 2))
    height[radius_share > 1] = 0.0
    half, middle = RELIEF_SIDE / 2, 2.2 + RELIEF_SIDE / 2
    uv = np.stack([(x + 1) / 2, (y + 1) / 2], axis=2)
    for name, at, sign in (("relief_west", 0.02, 1.0), ("relief_east", LENGTH - 0.02, -1.0)):
        z = WIDTH / 2 - sign * half * x
        points = np.stack([at + sign * height, middle + half * y, z], axis=2)
        yield Sheet(name, "relief", points, uv)


def frescoes(names: list[str]) -> Iterator[Sheet]:
    """Large paintings on the long outer walls of both walks, and at the ends above."""
    size, gap = 2.2, 0.012
    places: list[tuple[Vector, Vector]] = []
    for floor in (0.9, STOREYS[1][0] + 0.9):
        for x in np.linspace(5.0, LENGTH - 5.0, 5).tolist():
            places.append(((x - size / 2, floor, gap), (size, 0, 0)))
            places.append(((x + size / 2, floor, WIDTH - gap), (-size, 0, 0)))
    for n, (corner, right) in enumerate(places):
        yield picture(f"fresco_{n:02}", names[n % len(names)], corner, right, (0, size, 0))


def runners() -> Iterator[Sheet]:
    """A carpet down the court, and banners of it at the ends."""
    x, z = WALK + 2.0, WIDTH / 2 - 1.2
    yield plane("runner", "carpet", (x, 0.012, z + 2.4), (LENGTH - 2 * x, 0, 0), (0, 0, -2.4), 2.4)
    for name, at, way in (("banner_west", 0.03, 1.0), ("banner_east", LENGTH - 0.03, -1.0)):
        corner = (at, STOREYS[1][0] + 1.2, WIDTH / 2 + way * 1.2)
        yield plane(name, "carpet", corner, (0, 0, -2.4 * way), (0, HEIGHT - 7.6, 0), 2.4)
