"""Roofs, cornices and the structures on roofs."""

from __future__ import annotations

import itertools
import math

import numpy as np

from ptmtools_samples.campus.solids import (
    Flat,
    Ring,
    Wall,
    box,
    extrude,
    lid,
    offset,
    prism,
    sweep,
    walls_of,
)
from ptmtools_samples.mesh import Face, Point


def flat(rings: list[Ring], top: float, coping: str, inside: str, surface: str) -> list[Face]:
    """A parapet around a level roof 0.7 m below its top."""
    faces = []
    for ring in rings:
        faces += sweep(ring, [(0, top), (-0.35, top)], coping, closed=False)
        faces += sweep(ring, [(-0.35, top), (-0.35, top - 0.7)], inside, closed=False)
    return faces + lid([offset(r, -0.35) for r in rings], top - 0.7, surface)


def slope(
    rings: list[Ring], top: float, run: float, rise: float, surface: str, crown: str
) -> list[Face]:
    """Slopes up from every wall: a hipped roof, a mansard, a pyramid; the crown is level."""
    faces = []
    for ring in rings:
        faces += sweep(ring, [(0, top), (-run, top + rise)], surface, closed=False)
    return faces + lid([offset(r, -run) for r in rings], top + rise, crown)


def gable(width: float, rise: float, top: float) -> list[Flat]:
    """The upper edge of an end wall, from its left end."""
    return [(0.0, top), (width / 2, top + rise), (width, top)]


def barrel(width: float, rise: float, top: float, steps: int = 14) -> list[Flat]:
    """The upper edge of the end wall of a vault: a circular arc."""
    radius = (width * width / 4 + rise * rise) / (2 * rise)
    half = math.asin(width / 2 / radius)
    edge = []
    for k in range(steps + 1):
        t = half * (2 * k / steps - 1)
        edge.append((width / 2 + radius * math.sin(t), top + rise - radius * (1 - math.cos(t))))
    edge[0], edge[-1] = (0.0, top), (width, top)
    return edge


def span(end: Wall, length: float, edge: list[Flat], surface: str) -> list[Face]:
    """The roof between an end wall and the opposite wall at ``length``, and its eaves.

    ``edge``: the upper edge (u, v) of the end wall. The inner roof closes the walls; a thicker,
    closed roof with overhanging eaves covers it.
    """
    faces = []
    slope_length = 0.0
    for (u, v), (U, V) in itertools.pairwise(edge):
        step = math.sqrt((U - u) ** 2 + (V - v) ** 2)
        quad: list[Point] = [(u, v, -length), (u, v, 0), (U, V, 0), (U, V, -length)]
        uv = [
            (0, slope_length),
            (length, slope_length),
            (length, slope_length + step),
            (0, slope_length + step),
        ]
        faces.append(end.face(surface, quad, uv))
        slope_length += step
    return faces + _overhang(end, length, edge, surface)


def _overhang(end: Wall, length: float, edge: list[Flat], surface: str) -> list[Face]:
    """The roof above: the edge raised slightly and extended at both ends."""
    faces = []
    (u0, v0), (u1, v1) = edge[0], edge[1]
    share = 0.5 / math.sqrt((u1 - u0) ** 2 + (v1 - v0) ** 2)
    tip = (u0 - (u1 - u0) * share, v0 - (v1 - v0) * share)
    width = edge[-1][0]
    line = [tip, *edge[1:-1], (width - tip[0], tip[1])]
    upper = [(u, v + 0.2) for u, v in line]
    lower = [(u, v + 0.03) for u, v in line]
    front, back = 0.45, -length - 0.45
    slope_length = 0.0
    for k in range(len(line) - 1):
        (u, v), (U, V) = upper[k], upper[k + 1]
        (p, q), (P, Q) = lower[k], lower[k + 1]
        step = math.sqrt((U - u) ** 2 + (V - v) ** 2)
        # Seen from the eaves: u along them to the right, v up the slope on either side.
        a, b = (
            (slope_length, slope_length + step)
            if v < V or width / 2 > U
            else (-slope_length, -slope_length - step)
        )
        uv = [(0, a), (front - back, a), (front - back, b), (0, b)]
        faces.append(
            end.face(surface, [(u, v, back), (u, v, front), (U, V, front), (U, V, back)], uv)
        )
        under: list[Point] = [(p, q, front), (p, q, back), (P, Q, back), (P, Q, front)]
        faces.append(
            end.face("paint_white", under, [(0, a), (front - back, a), (front - back, b), (0, b)])
        )
        faces.append(
            end.face("paint_white", [(p, q, front), (P, Q, front), (U, V, front), (u, v, front)])
        )
        faces.append(
            end.face("paint_white", [(P, Q, back), (p, q, back), (u, v, back), (U, V, back)])
        )
        slope_length += step
    for k, flip in ((0, False), (len(line) - 1, True)):
        (u, v), (p, q) = upper[k], lower[k]
        quad = [(p, q, back), (p, q, front), (u, v, front), (u, v, back)]
        uv = [(back, q), (front, q), (front, v), (back, v)]
        if flip:
            quad, uv = quad[::-1], uv[::-1]
        faces.append(end.face("paint_white", quad, uv))
    return faces


def cornice(ring: Ring, y: float, material: str, out: float = 0.4, tall: float = 0.5) -> list[Face]:
    """A moulding with its top at y, with dentils below if they fit."""
    profile = [
        (-0.02, y - tall),
        (out * 0.25, y - tall),
        (out * 0.35, y - tall * 0.6),
        (out * 0.8, y - tall * 0.35),
        (out, y - tall * 0.3),
        (out, y - 0.04),
        (-0.02, y + 0.03),
    ]
    return sweep(ring, profile, material, closed=True)


def course(
    ring: Ring, y: float, material: str, tall: float = 0.18, out: float = 0.06
) -> list[Face]:
    """A string course."""
    profile = [
        (-0.02, y - tall / 2),
        (out * 0.7, y - tall / 2),
        (out, y + tall / 4),
        (-0.02, y + tall / 2),
    ]
    return sweep(ring, profile, material, closed=True)


def dentils(ring: Ring, y: float, material: str, pitch: float = 0.6) -> list[Face]:
    faces = []
    for wall in walls_of(ring):
        count = int((wall.length - 0.3) / pitch)
        for k in range(count):
            u = wall.length * (k + 0.5) / count
            faces += box(wall, material, (u - 0.1, y - 0.22, -0.02), (u + 0.1, y + 0.02, 0.16))
    return faces


def dormer(wall: Wall, u: float, v: float, run: float, rise: float, roof: str) -> list[Face]:
    """A dormer on the slope above the edge of a wall at height v (``run`` in, ``rise`` up)."""
    half, tall, d = 0.8, 1.25, -0.25 * run
    low = v + 0.2 * rise
    back = -min(run, 3.0) - 0.2
    faces = box(wall, "plaster_white", (u - half, low, back), (u + half, low + tall, d))
    top = low + tall - 0.01
    # The gabled roof of a dormer is a profile across the wall, from the slope to the front.
    front = d + 0.2
    a, b, c = (u - half - 0.2, top), (u + half + 0.2, top), (u, top + 0.75)
    faces += [
        wall.face("paint_white", [(*a, front), (*b, front), (*c, front)]),
        wall.face("paint_white", [(*b, back), (*a, back), (*c, back)]),
    ]
    for p, q in ((b, c), (c, a), (a, b)):
        step = math.dist(p, q)
        uv = [(0.0, 0.0), (front - back, 0.0), (front - back, step), (0.0, step)]
        quad: list[Point] = [(*p, front), (*p, back), (*q, back), (*q, front)]
        faces.append(wall.face(roof, quad, uv))
    w = half - 0.18
    l, h = low + 0.2, low + tall - 0.1
    for x, X, y, Y in (
        (u - w - 0.07, u - w, l, h),
        (u + w, u + w + 0.07, l, h),
        (u - w, u + w, l - 0.07, l),
        (u - w, u + w, h, h + 0.07),
        (u - 0.03, u + 0.03, l, h),
    ):
        faces += box(wall, "paint_white", (x, y, d - 0.02), (X, Y, d + 0.08))
    return faces + box(wall, "glass_dark", (u - w, l, d - 0.01), (u + w, h, d + 0.03))


def chimney(x: float, z: float, low: float, high: float, material: str) -> list[Face]:
    wall = Wall((x - 0.5, z + 0.35), (1, 0), 1)
    faces = box(wall, material, (0, low, -0.7), (1, high, 0))
    faces += box(wall, "stone_trim", (-0.08, high - 0.01, -0.78), (1.08, high + 0.14, 0.08))
    for k in (0.27, 0.73):
        pot = [(0.13, high + 0.13), (0.16, high + 0.3), (0.12, high + 0.65), (0.09, high + 0.66)]
        faces += prism((x - 0.5 + k, z), pot, 8, "roof_tiles")
    return faces


def equipment(x: float, z: float, y: float, kind: int, rng: np.random.Generator) -> list[Face]:
    """A machine on a flat roof: cooling, a duct, a skylight or the head of a staircase."""
    w, d = 1.2 + 1.3 * float(rng.random()), 1.0 + 0.8 * float(rng.random())
    wall = Wall((x - w, z + d), (1, 0), 2 * w)
    kind %= 4
    if kind == 0:
        faces = box(wall, "metal", (0, y + 0.25, -2 * d), (2 * w, y + 1.5, 0))
        for k in range(7):
            v = y + 0.4 + 0.14 * k
            faces += box(wall, "louvre", (0.1, v, -0.01), (2 * w - 0.1, v + 0.07, 0.06))
        for u in (0.1, 2 * w - 0.3):
            faces += box(wall, "metal_dark", (u, y - 0.02, -2 * d + 0.1), (u + 0.2, y + 0.26, -0.1))
        for u in (w * 0.6, w * 1.4):
            faces += prism(
                (x - w + u, z),
                [(0.42, y + 1.49), (0.42, y + 1.7), (0.36, y + 1.72)],
                14,
                "metal_dark",
            )
        return faces
    if kind == 1:
        faces = box(wall, "metal", (0, y + 0.4, -0.7), (2 * w, y + 1.0, -0.1))
        faces += box(wall, "metal", (0, y - 0.02, -0.65), (0.5, y + 0.41, -0.15))
        faces += box(wall, "metal", (2 * w - 0.5, y - 0.02, -0.65), (2 * w, y + 0.41, -0.15))
        for k in range(1, 4):
            u = 2 * w * k / 4
            faces += box(
                wall, "metal_dark", (u - 0.03, y + 0.37, -0.73), (u + 0.03, y + 1.03, -0.07)
            )
        return faces
    if kind == 2:
        faces = box(wall, "metal", (0, y - 0.02, -2 * d), (2 * w, y + 0.3, 0))
        roof = [(-2 * d + 0.06, y + 0.29), (-0.06, y + 0.29), (-d, y + 0.29 + d * 0.6)]
        return faces + extrude(wall, roof, 0.06, 2 * w - 0.06, "louvre")
    faces = box(wall, "plaster_grey", (0, y - 0.02, -2 * d), (2 * w, y + 2.6, 0))
    faces += box(wall, "metal", (-0.15, y + 2.59, -2 * d - 0.15), (2 * w + 0.15, y + 2.75, 0.15))
    return faces + box(wall, "metal_dark", (w - 0.5, y, -0.01), (w + 0.5, y + 2.1, 0.04))


def railing(ring: Ring, y: float, material: str) -> list[Face]:
    """A rail on posts along a ring."""
    faces = []
    for wall in walls_of(ring):
        count = max(1, round(wall.length / 1.5))
        for k in range(count):
            u = wall.length * k / count
            faces += box(wall, material, (u - 0.03, y - 0.02, -0.06), (u + 0.03, y + 0.91, 0))
        for v in (y + 0.45, y + 0.9):
            faces += box(wall, material, (0.04, v, -0.055), (wall.length - 0.04, v + 0.05, -0.005))
    return faces
