"""Builds a building from its recipe: walls, roof, and attachments before and above them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ptmtools_samples.campus import roofs
from ptmtools_samples.campus.facade import Bay, balcony, facades, louvres, pilasters
from ptmtools_samples.campus.openings import plinth_steps
from ptmtools_samples.campus.recipes import Recipe
from ptmtools_samples.campus.solids import (
    Flat,
    Ring,
    Wall,
    box,
    extrude,
    lid,
    prism,
    sweep,
    walls_of,
)
from ptmtools_samples.mesh import Face


@dataclass(frozen=True)
class StreetBuilding:
    """Faces in the local frame of the building, and its footprint."""

    faces: list[Face]
    rings: list[Ring]


def build(recipe: Recipe, rng: np.random.Generator) -> StreetBuilding:
    look, rings = recipe.look, recipe.footprint()
    ring = rings[0]
    walls = walls_of(ring)
    opposite = 0 if recipe.door_wall else 2

    def choose(wall: int, storey: int, bay: int, bays: int) -> str:
        if storey == 0 and bay == bays // 2 and wall == recipe.door_wall:
            return "door"
        if "columns" in recipe.extras and wall == opposite and storey == 0:
            return "blank"
        if "balconies" in recipe.extras and storey and wall == 0 and bay % 3 == 1:
            return "balcony"
        return "window"

    kind, surface = recipe.roof
    width, depth = walls[0].length, max(-z for _, z in ring)
    tops: dict[int, list[Flat]] = {}
    if kind in ("gable", "barrel"):
        make = roofs.gable if kind == "gable" else roofs.barrel
        share = recipe.pitch / 2 if kind == "gable" else 0.16
        tops = dict.fromkeys((1, 3), make(depth, depth * share, look.top))
    elif kind == "gable_front":
        tops = dict.fromkeys((0, 2), roofs.gable(width, width * recipe.pitch / 2, look.top))
    faces, bays = facades(rings, look, choose, tops, rng)
    faces += lid(rings, 0.0, "concrete", up=False)

    run, rise = 0.0, 0.0
    if kind == "flat":
        inside = look.wall
        faces += roofs.flat(rings, look.top, "stone_trim", inside, surface)
    elif kind in ("gable", "barrel", "gable_front"):
        end = walls[0] if kind == "gable_front" else walls[1]
        length = depth if kind == "gable_front" else width
        faces += roofs.span(end, length, tops[0 if kind == "gable_front" else 1], surface)
        run, rise = depth / 2, depth / 2 * recipe.pitch
    else:
        run = 1.8 if kind == "mansard" else _wing(rings) / 2 - 0.45
        rise = 3.2 if kind == "mansard" else run * recipe.pitch
        crown = "roof_zinc" if kind == "mansard" else surface
        faces += roofs.slope(rings, look.top, run, rise, surface, crown)
        for r in rings:
            gutter = [(-0.02, 0.18), (0.35, 0.02), (0.47, 0.0), (0.5, 0.16), (-0.02, 0.32)]
            profile = [(d, look.top - 0.2 + y) for d, y in gutter]
            faces += sweep(r, profile, "metal_dark", closed=True)
    faces += _entrance(recipe, walls, bays)
    faces += _dress(recipe, rings, bays)
    faces += _roof_attachments(recipe, rings, run, rise, rng)
    return StreetBuilding(faces, rings)


def _wing(rings: list[Ring]) -> float:
    """Returns the narrowest width of the building, the span of a hipped roof."""
    if len(rings) == 2:
        return abs(rings[1][0][1])
    lengths = [w.length for w in walls_of(rings[0])]
    if len(lengths) == 4:
        return min(lengths)
    if len(lengths) == 8 and lengths[1] < 3:  # projecting centre
        return min(lengths[2], lengths[5])
    return min(x for x in lengths if x > 3)


def _entrance(recipe: Recipe, walls: list[Wall], bays: list[Bay]) -> list[Face]:
    """Adds stairs to every door, and a canopy or a portico over it."""
    look, faces = recipe.look, []
    for bay in bays:
        if bay.kind != "door":
            continue
        u, v, U, V = bay.hole
        middle, wide = (u + U) / 2, U - u + 1.4
        wall, out = bay.wall, 0.0
        if "portico" in recipe.extras or "columns" in recipe.extras:
            wide, out = min(wall.length - 0.4, 12.0), 2.6
            middle = wall.length / 2
            faces += _portico(recipe, wall, middle, wide, out)
        faces += plinth_steps(wall, middle, wide, look.plinth, "stone_trim", out)
        if "canopy" in recipe.extras:
            low, high = V + 0.12, V + 0.34
            faces += box(wall, "metal", (u - 1.4, low, -0.02), (U + 1.4, high, 2.4))
            faces += box(
                wall, "metal_dark", (u - 1.45, low + 0.03, 2.39), (U + 1.45, high - 0.03, 2.44)
            )
            for x in (u - 1.2, U + 1.2):
                faces += _column(wall, x, 2.1, 0.0, low + 0.01, 0.07, 10, "metal")
        else:
            for x in (u - 0.45, U + 0.25):  # lamps beside the door
                faces += box(wall, "metal_dark", (x, v + 2.0, -0.02), (x + 0.2, v + 2.4, 0.18))
    return faces


def _column(
    wall: Wall,
    u: float,
    d: float,
    low: float,
    high: float,
    radius: float,
    sides: int,
    material: str,
) -> list[Face]:
    x, _, z = wall.point(u, 0, d)
    if radius < 0.15:
        return prism((x, z), [(radius, low), (radius, high)], sides, material)
    r = radius
    shaft = [(r + (r * 0.82 - r) * k / 5, low + 0.3 + (high - low - 0.7) * k / 5) for k in range(6)]
    levels = [
        (r * 1.4, low),
        (r * 1.4, low + 0.14),
        (r * 1.2, low + 0.18),
        (r * 1.2, low + 0.26),
        *shaft,
        (r * 0.95, high - 0.36),
        (r * 1.25, high - 0.18),
        (r * 1.35, high - 0.16),
        (r * 1.35, high),
    ]
    return prism((x, z), levels, sides, material)


def _portico(recipe: Recipe, wall: Wall, middle: float, wide: float, out: float) -> list[Face]:
    """Adds columns before the entrance, with an entablature and a pediment."""
    look = recipe.look
    low = look.plinth - 0.01
    tall = look.ground_height + (look.height if "columns" in recipe.extras else 0) - 0.5
    material = "stone_polished" if "columns" in recipe.extras else "stone_trim"
    high, d = low + tall, out + 0.55
    count = 6 if "columns" in recipe.extras else 4
    faces: list[Face] = []
    for k in range(count):
        u = middle - wide / 2 + 0.6 + (wide - 1.2) * k / (count - 1)
        faces += _column(wall, u, d, low, high + 0.01, 0.055 * tall, 16, material)
    start, end = middle - wide / 2, middle + wide / 2
    faces += box(wall, "stone_trim", (start, high, -0.02), (end, high + 0.7, d + 0.5))
    faces += box(
        wall, "stone_trim", (start - 0.2, high + 0.69, -0.02), (end + 0.2, high + 0.95, d + 0.7)
    )
    rise = wide * 0.16
    a, b, top = start - 0.2, end + 0.2, high + 0.94
    front, back = d + 0.6, -0.02
    tip = ((a + b) / 2, top + rise)
    outline = [(a, top), (b, top), tip]
    faces.append(wall.face(look.wall, [(*p, front) for p in outline]))
    faces.append(wall.face(look.wall, [(*p, back) for p in outline[::-1]]))
    for p, q in ((outline[1], tip), (tip, outline[0]), (outline[0], outline[1])):
        step = math.dist(p, q)
        uv = [(0.0, 0.0), (front - back, 0.0), (front - back, step), (0.0, step)]
        faces.append(
            wall.face("roof_copper", [(*p, front), (*p, back), (*q, back), (*q, front)], uv)
        )
    return faces


def _dress(recipe: Recipe, rings: list[Ring], bays: list[Bay]) -> list[Face]:
    """Adds attachments before the walls."""
    look, extras, faces = recipe.look, recipe.extras, []
    top = look.top
    for ring in rings:
        if "cornice" in extras:
            faces += roofs.cornice(ring, top - 0.25, "stone_trim")
            if "dentils" in extras:
                faces += roofs.dentils(ring, top - 0.8, "stone_trim")
        if "courses" in extras:
            trim = "stone_trim" if look.wall not in ("brick_red", "plaster_white") else "concrete"
            heights = look.floors[1:2] if "pilasters" in extras else look.floors[1:]
            for y in heights:
                faces += roofs.course(ring, y - 0.02, trim)
        if "eaves" in extras:
            profile = [(-0.02, top - 0.42), (1.6, top - 0.42), (1.6, top - 0.1), (-0.02, top - 0.1)]
            faces += sweep(ring, profile, "metal", closed=True)
        if "pilasters" in extras or "pilasters_brick" in extras:
            trim = "stone_trim" if "pilasters" in extras else look.wall
            faces += pilasters(walls_of(ring), look, trim, top - 0.74)
    if "buttresses" in extras:
        for wall in (walls_of(rings[0])[k] for k in (1, 3)):
            for k in range(7):
                u = 0.45 + (wall.length - 0.9) * k / 6
                profile = [
                    (-0.02, 0.0),
                    (1.3, 0.0),
                    (1.3, 2.6),
                    (0.8, 3.4),
                    (0.8, 5.4),
                    (-0.02, 7.0),
                ]
                faces += extrude(wall, profile, u - 0.3, u + 0.3, "sandstone_red")
    first = [b for b in bays if b.wall.start[1] > -3 and b.wall.right[0] > 0]
    for bay in bays:
        if bay.kind == "balcony":
            faces += balcony(bay, "concrete", "metal_dark" if "canopy" in extras else "glass_clear")
    if "louvres" in extras:
        for bay in first:
            if bay.kind == "window" and bay.storey:
                faces += louvres(bay, "louvre")
    return faces


def _roof_attachments(
    recipe: Recipe, rings: list[Ring], run: float, rise: float, rng: np.random.Generator
) -> list[Face]:
    """Adds attachments on the roof."""
    look, extras, faces = recipe.look, recipe.extras, []
    ring, roof = rings[0], recipe.roof[1]
    top = look.top
    walls = walls_of(ring)
    depth = max(-z for _, z in ring)
    half = max(x for x, _ in ring)
    z = _ridge(rings, depth)
    if "dormers" in extras:
        for wall in (w for w in walls if w.right[0] > 0 and w.length > 8):
            count = int(wall.length / 5.5)
            for k in range(count):
                u = wall.length * (k + 0.5) / count
                faces += roofs.dormer(wall, u, top, run, rise, roof)
    if "chimneys" in extras:
        for share in (-0.55, 0.15, 0.6):
            ridge = top + rise * (1.0 if run else 0)
            faces += roofs.chimney(half * share, z - 0.8, ridge - 2.2, ridge + 1.4, "brick_brown")
    if "equipment" in extras:
        shift = int(rng.integers(4))
        count = max(3, int(half / 3.2))
        for k in range(count):
            x = -half + 2.8 + (2 * half - 5.6) * k / (count - 1)
            faces += roofs.equipment(x, z + 0.6, top - 0.7, k + shift, rng)
    if "skylights" in extras:
        for k in range(5):
            x = -half * 0.7 + half * 0.35 * k
            faces += roofs.equipment(x, -depth * 0.7, top - 0.7, 2, rng)
    if "railing" in extras:
        for r in rings:
            faces += roofs.railing(r, top, "metal")
    if "dome" in extras:
        faces += _dome((0.0, z), top - 0.7)
    if "belfry" in extras:
        faces += _belfry(look.wall, top)
    return faces


def _ridge(rings: list[Ring], depth: float) -> float:
    """Returns the z of the centre of the widest part of the building."""
    ring, wing = rings[0], _wing(rings)
    if len(ring) == 8 and ring[0][1] < 0:  # projecting centre
        return (ring[0][1] - depth) / 2
    back = len(ring) == 8 and ring[2][1] < 0 and ring[2][0] < 0  # a U, open to the front
    return -depth + wing / 2 if back else -wing / 2


def _dome(centre: Flat, y: float) -> list[Face]:
    """Adds a drum with a copper dome, split by a rib."""
    r, drum = 4.2, 2.6
    faces = prism(centre, [(r, y - 0.02), (r, y + drum)], 24, "brick_yellow")
    rim = [(r + 0.3, y + drum - 0.1), (r + 0.3, y + drum + 0.15), (r, y + drum + 0.2)]
    arc = [
        (r * math.cos(math.pi / 2 * k / 9), y + drum + 0.2 + r * math.sin(math.pi / 2 * k / 9))
        for k in range(1, 9)
    ]
    return faces + prism(centre, [*rim, *arc, (0.3, arc[-1][1] + 0.1)], 24, "roof_copper")


def _belfry(material: str, top: float) -> list[Face]:
    """Adds a small tower with louvres and a spire on the ridge above the front."""
    wall = Wall((-1.5, -1.2), (1, 0), 3)
    base = top + 3
    faces = box(wall, material, (0, base, -3), (3, base + 8, 0))
    for side in walls_of([(-1.5, -1.2), (1.5, -1.2), (1.5, -4.2), (-1.5, -4.2)]):
        for u in (0.7, 1.7):
            faces += box(
                side, "sandstone_red", (u - 0.12, base + 5.1, -0.02), (u, base + 7.2, 0.08)
            )
            faces += box(
                side, "sandstone_red", (u + 0.6, base + 5.1, -0.02), (u + 0.72, base + 7.2, 0.08)
            )
            for k in range(7):
                v = base + 5.2 + 0.28 * k
                faces += box(side, "louvre", (u + 0.01, v, -0.02), (u + 0.59, v + 0.12, 0.06))
    ring = [(-1.5, -1.2), (1.5, -1.2), (1.5, -4.2), (-1.5, -4.2)]
    faces += roofs.cornice(ring, base + 8, "sandstone_red", 0.3, 0.4)
    spire = [(0.25, base + 7.95), (0.25, base + 8.05), (-1.42, base + 14)]
    faces += sweep(ring, spire, "roof_copper", closed=False)
    at = [(-1.75, -0.95), (1.75, -0.95), (1.75, -4.45), (-1.75, -4.45)]
    faces += lid([at], base + 7.95, "roof_copper", up=False)
    tip = [(-0.08, -2.62), (0.08, -2.62), (0.08, -2.78), (-0.08, -2.78)]
    return faces + lid([tip], base + 14, "roof_copper")
