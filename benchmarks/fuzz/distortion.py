"""Damages geometry as exporters, modellers, compression and accidents do.

Each distortion takes a model and a random generator and returns another model. What it changes is
all of the model, or a share of its triangles. Distances run from below the rounding of a file to
the size of rooms, evenly in their logarithm, because faults lie at unforeseen orders of magnitude.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from benchmarks.fuzz.soup import Soup
from ptmtools.arrays import Floats, Ints

Rng = np.random.Generator
Distortion = Callable[[Soup, Rng], Soup]

#: Numbers of distortions per input.
OFTEN = (1, 1, 1, 2, 2, 3, 4)
#: Triangles of an input at most: duplication adds some.
LARGEST = 1000


def distorted(soup: Soup, rng: Rng) -> tuple[Soup, tuple[str, ...]]:
    """A model with several distortions, and their names."""
    names = tuple(rng.choice(list(DISTORTIONS), rng.choice(OFTEN)).tolist())
    for name in names:
        changed = DISTORTIONS[name](soup, rng)
        if np.isfinite(changed.corners).all() and 0 < len(changed) <= LARGEST:
            soup = changed
    return soup, names


def logarithmic(rng: Rng, low: float, high: float) -> float:
    """A number between two others, evenly in the logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def some(soup: Soup, rng: Rng) -> Ints:
    """Numbers of triangles: one, some, most or all, or those of one object."""
    if rng.random() < 0.3:
        return np.flatnonzero(soup.of == soup.of[rng.integers(len(soup))])
    share = rng.choice((0.0, 0.03, 0.2, 0.8, 1.0))
    rows = np.flatnonzero(rng.random(len(soup)) < share)
    return rows if len(rows) else rng.integers(len(soup), size=1)


def unit_vectors(rng: Rng, count: int) -> Floats:
    """(count, 3)."""
    vector = rng.normal(size=(count, 3))
    return np.asarray(vector / np.linalg.norm(vector, axis=1, keepdims=True))


def rotation(axis: Floats, angle: float) -> Floats:
    """(3, 3) matrix that turns by an angle, radians, about a unit vector."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)


def jitter(soup: Soup, rng: Rng) -> Soup:
    """Moves vertices, or the corners of each triangle on their own."""
    size = logarithmic(rng, 1e-9, 0.05)
    corners = soup.corners.reshape(-1, 3)
    if rng.random() < 0.6:
        points, index = np.unique(corners, axis=0, return_inverse=True)
        shift = rng.normal(size=points.shape)[index.reshape(-1)]
    else:
        shift = rng.normal(size=corners.shape)
    moved = np.zeros((len(soup), 3, 3), dtype=bool)
    moved[some(soup, rng)] = True
    shift[~moved.reshape(-1, 3)] = 0
    return soup.moved_to((corners + size * shift).reshape(-1, 3, 3))


def half_floats(soup: Soup, rng: Rng) -> Soup:
    """Rounds to float16, or to float32."""
    kind = np.float16 if rng.random() < 0.8 else np.float32
    with np.errstate(over="ignore"):
        return soup.moved_to(soup.corners.astype(kind).astype(np.float64))


def coarse_grid(soup: Soup, rng: Rng) -> Soup:
    """Rounds to a grid of 14 bits, or of another number of bits."""
    bits = 14 if rng.random() < 0.5 else int(rng.integers(2, 20))
    step = (soup.extent or 1.0) / 2**bits
    low = soup.corners.reshape(-1, 3).min(axis=0)
    return soup.moved_to(low + np.round((soup.corners - low) / step) * step)


def duplicates(soup: Soup, rng: Rng) -> Soup:
    """Doubles triangles, with the same or the opposite winding, or moved by less than they show."""
    rows = some(soup, rng)
    corners = soup.corners[rows]
    if rng.random() < 0.5:
        corners = corners[:, ::-1]
    elif rng.random() < 0.5:
        corners = np.roll(corners, 1, axis=1)
    if rng.random() < 0.3:
        corners = corners + unit_vectors(rng, 1) * logarithmic(rng, 1e-12, 1e-3)
    return soup.with_more(corners, rows)


def reversal(soup: Soup, rng: Rng) -> Soup:
    """Reverses triangles."""
    corners = soup.corners.copy()
    rows = some(soup, rng)
    corners[rows] = corners[rows, ::-1]
    return soup.moved_to(corners)


def deletion(soup: Soup, rng: Rng) -> Soup:
    """Removes triangles."""
    share = rng.choice((0.0, 0.01, 0.05, 0.3, 0.7))
    kept = rng.random(len(soup)) >= share
    kept[rng.integers(len(soup))] = False
    return soup.take(np.flatnonzero(kept))


def welding(soup: Soup, rng: Rng) -> Soup:
    """Moves vertices of one cell of a grid to the first of them."""
    step = logarithmic(rng, 1e-6, 1.0)
    corners = soup.corners.reshape(-1, 3)
    with np.errstate(over="ignore"):
        place = np.floor(corners / step + rng.random(3))
    _, first, index = np.unique(place, axis=0, return_index=True, return_inverse=True)
    return soup.moved_to(corners[first[index.reshape(-1)]].reshape(-1, 3, 3))


def mirror(soup: Soup, rng: Rng) -> Soup:
    """Mirrors all of it, or adds the mirror image of a part at a plane through its own corner."""
    axis = int(rng.integers(3))
    sign = np.ones(3)
    sign[axis] = -1
    if rng.random() < 0.5:
        return soup.moved_to(soup.corners * sign)
    rows = some(soup, rng)
    plane = np.zeros(3)
    plane[axis] = soup.corners[rows].reshape(-1, 3)[0, axis]
    return soup.with_more(soup.corners[rows] * sign + 2 * plane, rows)


def scale(soup: Soup, rng: Rng) -> Soup:
    """Other units, or other proportions."""
    if rng.random() < 0.5:
        power = 6 if rng.random() < 0.8 else 18
        return soup.moved_to(soup.corners * 10.0 ** rng.integers(-power, power + 1))
    return soup.moved_to(soup.corners * [logarithmic(rng, 0.01, 100) for _ in range(3)])


def flatten(soup: Soup, rng: Rng) -> Soup:
    """All of it, or a part, in a plane or on a line, exactly or nearly."""
    rows = some(soup, rng) if rng.random() < 0.5 else np.arange(len(soup))
    factor = np.ones(3)
    thin = rng.choice((0.0, logarithmic(rng, 1e-12, 1e-2)))
    factor[rng.choice(3, rng.choice((1, 1, 1, 2)), replace=False)] = thin
    corners = soup.corners.copy()
    middle = corners[rows].reshape(-1, 3).mean(axis=0)
    corners[rows] = middle + (corners[rows] - middle) * factor
    return soup.moved_to(corners)


def few(soup: Soup, rng: Rng) -> Soup:
    """Hardly any triangles."""
    count = min(len(soup), int(logarithmic(rng, 2, 20)))
    return soup.take(np.sort(rng.choice(len(soup), count, replace=False)))


def offset(soup: Soup, rng: Rng) -> Soup:
    """Far from the origin."""
    distance = logarithmic(rng, 10.0, 1e12) if rng.random() < 0.5 else 1e6
    return soup.moved_to(soup.corners + unit_vectors(rng, 1) * distance)


def turn(soup: Soup, rng: Rng) -> Soup:
    """Turns all of it, in plan or in space, by any angle or by hardly any."""
    axis = np.array([0.0, 1.0, 0.0]) if rng.random() < 0.5 else unit_vectors(rng, 1)[0]
    angle = rng.uniform(0, 6.3) if rng.random() < 0.5 else logarithmic(rng, 1e-9, 0.1)
    return soup.moved_to(soup.corners @ rotation(axis, angle).T)


def shear(soup: Soup, rng: Rng) -> Soup:
    """Walls that lean, floors that slope."""
    matrix = np.eye(3)
    matrix[rng.integers(3), rng.integers(3)] += logarithmic(rng, 1e-6, 1.0)
    return soup.moved_to(soup.corners @ matrix)


def split(soup: Soup, rng: Rng) -> Soup:
    """Splits triangles at points of their edges, which no neighbour has: T-junctions."""
    for _ in range(rng.integers(1, 4)):
        rows = some(soup, rng)[: LARGEST // 2]
        share = rng.random((len(rows), 1))
        if rng.random() < 0.3:
            share = np.round(share * 4) / 4
        if rng.random() < 0.3:
            share = share * logarithmic(rng, 1e-9, 1.0)
        corners = np.roll(soup.corners, int(rng.integers(3)), axis=1)
        a, b, c = corners[rows].transpose(1, 0, 2)
        at = a + share * (b - a)
        corners[rows] = np.stack([a, at, c], axis=1)
        soup = soup.moved_to(corners).with_more(np.stack([at, b, c], axis=1), rows)
    return soup


def slivers(soup: Soup, rng: Rng) -> Soup:
    """Adds triangles along edges that are thinner than they are long by any factor."""
    rows = some(soup, rng)
    a, b, _ = np.roll(soup.corners[rows], int(rng.integers(3)), axis=1).transpose(1, 0, 2)
    at = a + rng.uniform(-0.2, 1.2, (len(rows), 1)) * (b - a)
    at += unit_vectors(rng, len(rows)) * logarithmic(rng, 1e-13, 1e-2)
    return soup.with_more(np.stack([a, b, at], axis=1), rows)


def overlaps(soup: Soup, rng: Rng) -> Soup:
    """Adds triangles that overlap others in their planes."""
    rows = some(soup, rng)
    corners = soup.corners[rows]
    along = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    share = rng.uniform(-1, 1, (2, len(rows), 1)) * logarithmic(rng, 1e-6, 2.0)
    shift = share[0] * along[0] + share[1] * along[1]
    return soup.with_more(corners + shift[:, None], rows)


def tilts(soup: Soup, rng: Rng) -> Soup:
    """Adds copies, or turns triangles themselves, by about 1e-4 rad about their middles."""
    rows = some(soup, rng)
    angle = 1e-4 if rng.random() < 0.4 else logarithmic(rng, 1e-9, 1e-2)
    middle = soup.corners[rows].mean(axis=1, keepdims=True)
    if rng.random() < 0.5:
        middle = soup.corners[rows].reshape(-1, 3).mean(axis=0)
    tilted = (soup.corners[rows] - middle) @ rotation(unit_vectors(rng, 1)[0], angle).T + middle
    if rng.random() < 0.5:
        return soup.with_more(tilted, rows)
    corners = soup.corners.copy()
    corners[rows] = tilted
    return soup.moved_to(corners)


def collapse(soup: Soup, rng: Rng) -> Soup:
    """Triangles that become edges or points, exactly or nearly."""
    rows = some(soup, rng)
    corners = soup.corners.copy()
    share = rng.choice((0.0, 0.5, 1.0, rng.random()))
    corners[rows, 2] = corners[rows, 0] + share * (corners[rows, 1] - corners[rows, 0])
    if rng.random() < 0.3:
        corners[rows, 1] = corners[rows, 0]
    if rng.random() < 0.3:
        corners[rows] += rng.normal(size=(len(rows), 3, 3)) * logarithmic(rng, 1e-15, 1e-6)
    return soup.moved_to(corners)


def push(soup: Soup, rng: Rng) -> Soup:
    """Pushes a part through the others, or moves it by a crack's width."""
    rows = some(soup, rng)
    size = logarithmic(rng, 1e-7, 2.0)
    way = unit_vectors(rng, 1)
    if rng.random() < 0.5:
        way = np.eye(3)[rng.integers(3)] * rng.choice((-1, 1))
    corners = soup.corners.copy()
    corners[rows] += way * size
    return soup.moved_to(corners)


def strays(soup: Soup, rng: Rng) -> Soup:
    """Adds detached random triangles, of any size, within the model or far beyond it."""
    count = int(logarithmic(rng, 1, 20))
    low = soup.corners.reshape(-1, 3).min(axis=0)
    size = soup.extent or 1.0
    place = low + rng.random((count, 1, 3)) * size
    if rng.random() < 0.1:
        place = place + unit_vectors(rng, 1) * size * logarithmic(rng, 1, 1e4)
    corners = place + rng.normal(size=(count, 3, 3)) * size * logarithmic(rng, 1e-4, 1.0)
    return soup.with_more(corners, rng.integers(len(soup), size=count))


def confetti(soup: Soup, rng: Rng) -> Soup:
    """Adds random triangles to the plane of a triangle, exactly or nearly in it."""
    row = rng.integers(len(soup))
    corner, *others = soup.corners[row]
    along = np.array(others) - corner
    share = rng.uniform(-1, 2, (int(logarithmic(rng, 2, 40)), 3, 2))
    if rng.random() < 0.3:
        share = np.round(share * 8) / 8
    corners = corner + share @ along
    if rng.random() < 0.7:
        corners += (
            unit_vectors(rng, 1)
            * rng.normal(size=(len(corners), 3, 1))
            * logarithmic(rng, 1e-16, 1e-3)
        )
    return soup.with_more(corners, np.full(len(corners), row))


def materials(soup: Soup, rng: Rng) -> Soup:
    """Gives triangles an image or glass."""
    material = soup.material.copy()
    material[some(soup, rng)] = rng.integers(1, 3)
    return replace(soup, material=material)


#: By name.
DISTORTIONS: dict[str, Distortion] = {
    "jitter": jitter,
    "float16": half_floats,
    "grid": coarse_grid,
    "duplicate": duplicates,
    "reverse": reversal,
    "delete": deletion,
    "weld": welding,
    "mirror": mirror,
    "scale": scale,
    "flatten": flatten,
    "few": few,
    "offset": offset,
    "rotate": turn,
    "shear": shear,
    "split": split,
    "sliver": slivers,
    "overlap": overlaps,
    "tilt": tilts,
    "collapse": collapse,
    "push": push,
    "stray": strays,
    "confetti": confetti,
    "material": materials,
}
