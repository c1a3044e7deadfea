"""Hand-made places that are more, or less, than a house: (T, 3, 3) triangles in metres, Z up."""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Floats

from .buildings import box, house, sheet, wall


def city(width: float = 166, *, ground: bool = True, tallest: float = 60, seed: int = 1) -> Floats:
    """Blocks of boxes 6 m to ``tallest`` high, streets 9 m wide, and two spires."""
    random = np.random.default_rng(seed)
    plot = (width - 9) / 6
    parts = [sheet((0, 0, 0), (width, 0, 0), (width, width, 0), (0, width, 0))] if ground else []
    for i, j in np.ndindex(6, 6):
        x, y = 9 + i * plot, 9 + j * plot
        for k, (a, b) in enumerate(((0.0, 0.5), (0.5, 1.0))):
            deep, high = plot - 9, float(random.uniform(6, 0.4 * tallest))
            low, top = (x + a * deep, y, 0.0), (x + b * deep, y + deep, high)
            parts.append(box(low, top))
            if k == 0 and (i, j) in ((1, 2), (4, 3)):
                parts.append(box((x + 2, y + 2, high), (x + 5, y + 5, tallest)))
    return np.concatenate(parts)


def square(width: float = 34, *, solid: bool = True) -> Floats:
    """A paved square between façades 9 to 14 m high, with a belfry, a fountain and benches."""
    w, rim = width, 4.0
    parts = [sheet((0, 0, 0), (w, 0, 0), (w, w, 0), (0, w, 0))]
    heights = (9.0, 12.0, 14.0, 10.5)
    fronts = (
        ((0, 0), (w, rim)),
        ((0, w - rim), (w, w)),
        ((0, rim), (rim, w - rim)),
        ((w - rim, rim), (w, w - rim)),
    )
    for high, ((x0, y0), (x1, y1)) in zip(heights, fronts, strict=True):
        if solid:
            parts.append(box((x0, y0, 0), (x1, y1, high)))
        else:
            a, b, c, d = (min(max(v, rim), w - rim) for v in (x0, y0, x1, y1))
            parts.append(sheet((a, b, 0), (c, d, 0), (c, d, high), (a, b, high)))
    parts.append(box((2, 2, 0), (6, 6, 31)))
    parts.append(box((w / 2 - 2, w / 2 - 2, 0), (w / 2 + 2, w / 2 + 2, 0.9)))
    parts += [box((x, 8, 0.4), (x + 1.8, 8.5, 0.5)) for x in (8.0, 14.0, 20.0)]
    return np.concatenate(parts)


def museum() -> Floats:
    """Twelve rooms on two floors, 35 × 56 m and 20 m high, with plinths and a lantern."""
    parts = [house(35, 56, 6.5, storeys=2)]
    parts += [
        box((x, y, z), (x + 0.8, y + 0.8, z + 1.1))
        for x in np.arange(3.0, 33, 5.0)
        for y in np.arange(4.0, 53, 7.0)
        for z in (0.0, 6.8)
    ]
    parts.append(box((12, 20, 13.5), (24, 36, 20)))
    return np.concatenate(parts)


def serpentine() -> Floats:
    """Four halls of 24 × 6 × 4 m in a row, each open to the next at one end, without a ceiling."""
    parts = [box((0, 0, -0.2), (24, 24, 0))]
    parts += [wall((0, y), (24, y), 4) for y in (0.0, 24.0)]
    parts += [wall((x, 0), (x, 24), 4) for x in (0.0, 24.0)]
    parts += [wall((0, 6), (22, 6), 4), wall((2, 12), (24, 12), 4), wall((0, 18), (22, 18), 4)]
    return np.concatenate(parts)


def office() -> Floats:
    """An open plan of 32 × 18 × 2.8 m with cells along one side, desks, shelves and columns."""
    parts = [box((0, 0, -0.3), (32, 18, 0)), box((0, 0, 2.8), (32, 18, 3.2))]
    parts += [wall((0, y), (32, y), 2.8) for y in (0.0, 18.0)]
    parts += [wall((x, 0), (x, 18), 2.8) for x in (0.0, 32.0)]
    parts += [wall((x, 13), (x, 18), 2.8) for x in np.arange(4.0, 32, 4.0)]
    parts += [wall((x, 13), (x + 4, 13), 2.8, door=1.5) for x in np.arange(0.0, 32, 4.0)]
    for x in np.arange(2.0, 30, 3.0):
        for y in (2.0, 5.0, 8.0):
            parts.append(box((x, y, 0.7), (x + 1.6, y + 0.8, 0.74)))
            parts += [box((x + a, y, 0), (x + a + 0.05, y + 0.8, 0.7)) for a in (0.0, 1.55)]
        parts.append(box((x, 10, 0), (x + 1.2, 10.4, 2.0)))
    parts += [box((x, 9, 0), (x + 0.4, 9.4, 2.8)) for x in (8.0, 16.0, 24.0)]
    return np.concatenate(parts)


def flat() -> Floats:
    """Three furnished rooms, 10 × 7 × 2.5 m."""
    parts = [box((0, 0, -0.2), (10, 7, 0)), box((0, 0, 2.5), (10, 7, 2.7))]
    parts += [wall((0, y), (10, y), 2.5) for y in (0.0, 7.0)]
    parts += [wall((x, 0), (x, 7), 2.5) for x in (0.0, 10.0)]
    parts += [wall((6, 0), (6, 7), 2.5, door=2), wall((6, 3.5), (10, 3.5), 2.5, door=2)]
    low = [
        ((0.3, 0.3), (2.3, 1.2), 0.45),  # sofa
        ((0.3, 1.0), (2.3, 1.2), 0.85),
        ((3.5, 0.2), (5.5, 0.8), 0.9),  # kitchen
        ((4.9, 0.8), (5.5, 2.0), 2.1),
        ((6.5, 0.4), (8.5, 2.0), 0.5),  # bed
        ((9.2, 0.3), (9.8, 3.0), 2.2),  # wardrobe
        ((6.3, 5.0), (8.0, 5.7), 0.55),  # bath
    ]
    parts += [box((*a, 0.0), (*b, high)) for a, b, high in low]
    parts.append(box((1.5, 4.0, 0.72), (3.3, 5.0, 0.76)))
    parts += [box((x, y, 0), (x + 0.06, y + 0.06, 0.72)) for x in (1.5, 3.2) for y in (4.0, 4.9)]
    for x, y in ((1.7, 3.5), (2.6, 3.5), (1.7, 5.1), (2.6, 5.1)):
        parts.append(box((x, y, 0.42), (x + 0.45, y + 0.45, 0.46)))
    return np.concatenate(parts)


def table() -> Floats:
    """A table of 1.2 × 0.8 × 0.75 m."""
    parts = [box((0, 0, 0.7), (1.2, 0.8, 0.75))]
    parts += [box((x, y, 0), (x + 0.05, y + 0.05, 0.7)) for x in (0.0, 1.15) for y in (0.0, 0.75)]
    return np.concatenate(parts)


def hills(size: float = 400) -> Floats:
    """A terrain of 32 × 32 squares, without a level one."""
    at = np.linspace(0, size, 33)
    x, y = np.meshgrid(at, at, indexing="ij")
    z = 0.06 * size * (np.sin(7 * x / size) * np.cos(5 * y / size) + 0.3 * np.sin(23 * y / size))
    p = np.stack([x, y, z], axis=-1)
    a, b, c, d = p[:-1, :-1], p[1:, :-1], p[1:, 1:], p[:-1, 1:]
    both = (np.stack(t, axis=-2).reshape(-1, 3, 3) for t in ((a, b, c), (a, c, d)))
    return np.concatenate(list(both))


def boulder(radius: float = 0.4) -> Floats:
    """A closed and rounded object, as a scan of a statue gives it."""
    u, v = np.linspace(0, np.pi, 25), np.linspace(0, 2 * np.pi, 37)
    polar, turn = np.meshgrid(u, v, indexing="ij")
    r = radius * (1 + 0.2 * np.sin(3 * turn) * np.sin(polar) + 0.15 * np.cos(5 * polar))
    p = np.stack(
        [r * np.sin(polar) * np.cos(turn), r * np.sin(polar) * np.sin(turn), 2 * r * np.cos(polar)],
        axis=-1,
    )
    a, b, c, d = p[:-1, :-1], p[1:, :-1], p[1:, 1:], p[:-1, 1:]
    both = [np.stack(t, axis=-2).reshape(-1, 3, 3) for t in ((a, b, c), (a, c, d))]
    faces = np.concatenate(both)
    area = np.linalg.norm(np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0]), axis=1)
    return faces[area > 1e-9]
