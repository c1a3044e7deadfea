"""Closed solids: boxes on walls, swept rings, extruded profiles, prisms.

Coordinates are local to a building: x along its front, y up, z out of the front. Footprints are
rectilinear rings of (x, z), with the solid on the left as seen from above (a court runs in the
opposite direction). Every solid is closed, has no T-junctions and faces outwards.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from ptmtools_samples.campus.materials import MATERIALS
from ptmtools_samples.mesh import Face, Point, Uv

Flat = tuple[float, float]
Ring = list[Flat]


def face(material: str, points: Sequence[Point], uv: Sequence[Uv]) -> Face:
    """A face with texture coordinates in metres, scaled to repetitions of the image."""
    tile = MATERIALS[material].tile or 1
    return Face(material, tuple(points), tuple((u / tile, v / tile) for u, v in uv))


@dataclass(frozen=True)
class Wall:
    """A vertical plane: u to the right as seen from its front, v up, d outwards; metres."""

    start: Flat
    right: Flat
    length: float

    def point(self, u: float, v: float, d: float) -> Point:
        (x, z), (rx, rz) = self.start, self.right
        return x + rx * u - rz * d, v, z + rz * u + rx * d

    def face(self, material: str, corners: Sequence[Point], uv: Sequence[Uv] = ()) -> Face:
        """A face with corners (u, v, d), counter-clockwise from its front.

        Texture coordinates are ``uv``, or the two of u, v, d along which the face extends.
        """
        us, vs, _ = (max(c) - min(c) for c in zip(*corners, strict=True))
        if not uv:
            if us < 1e-9:
                uv = [(d, v) for _, v, d in corners]
            elif vs < 1e-9:
                uv = [(u, d) for u, _, d in corners]
            else:
                uv = [(u, v) for u, v, _ in corners]
        return face(material, [self.point(*c) for c in corners], uv)


def walls_of(ring: Ring) -> list[Wall]:
    walls = []
    for (x, z), (X, Z) in pairwise([*ring, ring[0]]):
        length = abs(X - x) + abs(Z - z)
        walls.append(Wall((x, z), ((X - x) / length, (Z - z) / length), length))
    return walls


def zip_strip(a: Sequence[Point], b: Sequence[Point]) -> list[tuple[Point, ...]]:
    """Triangulates the strip between two polylines of the same direction, ``a`` below ``b``."""

    def shares(line: Sequence[Point]) -> list[float]:
        steps = [math.dist(p, q) for p, q in pairwise(line)]
        total = sum(steps)
        return [sum(steps[:k]) / total for k in range(len(line))]

    s, t, i, j = shares(a), shares(b), 0, 0
    pieces: list[tuple[Point, ...]] = []
    while i < len(a) - 1 or j < len(b) - 1:
        # Advance by the midpoints of the next steps: both ends of a long step get triangles.
        x = (s[i] + s[i + 1]) / 2 if i < len(a) - 1 else 2.0
        y = (t[j] + t[j + 1]) / 2 if j < len(b) - 1 else 2.0
        ends = i < len(a) - 1 and j < len(b) - 1 and abs(s[i + 1] - t[j + 1]) < 0.02
        if ends and abs(x - y) < 0.02:
            pieces.append((a[i], a[i + 1], b[j + 1], b[j]))
            i, j = i + 1, j + 1
        elif x < y:
            pieces.append((a[i], a[i + 1], b[j]))
            i += 1
        else:
            pieces.append((a[i], b[j + 1], b[j]))
            j += 1
    return pieces


def box(
    wall: Wall, material: str, low: Point, high: Point, without: frozenset[str] = frozenset()
) -> list[Face]:
    """A solid box in the u, v, d of a wall."""
    (u, v, d), (U, V, D) = low, high
    sides = {
        "front": ((u, v, D), (U, v, D), (U, V, D), (u, V, D)),
        "back": ((U, v, d), (u, v, d), (u, V, d), (U, V, d)),
        "left": ((u, v, d), (u, v, D), (u, V, D), (u, V, d)),
        "right": ((U, v, D), (U, v, d), (U, V, d), (U, V, D)),
        "top": ((u, V, D), (U, V, D), (U, V, d), (u, V, d)),
        "bottom": ((u, v, d), (U, v, d), (U, v, D), (u, v, D)),
    }
    return [wall.face(material, s) for name, s in sides.items() if name not in without]


def offset(ring: Ring, d: float) -> Ring:
    """Offsets every wall of a ring outwards by d."""
    walls = walls_of(ring)
    out = []
    for k, (x, z) in enumerate(ring):
        (ax, az), (bx, bz) = walls[k - 1].right, walls[k].right
        out.append((x + d * (-az - bz), z + d * (ax + bx)))
    return out


def sweep(ring: Ring, profile: Sequence[Flat], material: str, *, closed: bool) -> list[Face]:
    """A profile of (d, y) swept around a ring; solid on its left, going up the outside.

    ``closed`` joins the end of the profile with its start, which gives a separate moulding.
    """
    points = [*profile, profile[0]] if closed else list(profile)
    faces = []
    v = 0.0
    for (d, y), (D, Y) in pairwise(points):
        low, high = offset(ring, d), offset(ring, D)
        step = math.sqrt((D - d) ** 2 + (Y - y) ** 2)
        for k, wall in enumerate(walls_of(ring)):
            m = (k + 1) % len(ring)
            quad = [
                (low[k][0], y, low[k][1]),
                (low[m][0], y, low[m][1]),
                (high[m][0], Y, high[m][1]),
                (high[k][0], Y, high[k][1]),
            ]
            (x, z), (rx, rz) = wall.start, wall.right
            along = [(p[0] - x) * rx + (p[2] - z) * rz for p in quad]
            base = y if abs(D - d) < 1e-9 and y < Y else v
            uv = list(zip(along, (base, base, base + step, base + step), strict=True))
            faces.append(face(material, quad, uv))
        v += step
    return faces


def ears(ring: Sequence[Flat]) -> list[tuple[int, int, int]]:
    """Triangulates a simple polygon by ear clipping, counter-clockwise in (x, -z) or other plane
    axes."""

    def turn(a: Flat, b: Flat, c: Flat) -> float:
        return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])

    remaining, out = list(range(len(ring))), []
    while len(remaining) > 3:
        for k in range(len(remaining)):
            i, j, m = remaining[k - 1], remaining[k], remaining[(k + 1) % len(remaining)]
            a, b, c = ring[i], ring[j], ring[m]
            if turn(a, b, c) <= 1e-9:
                continue
            rest = [ring[r] for r in remaining if r not in (i, j, m)]
            if any(min(turn(a, b, p), turn(b, c, p), turn(c, a, p)) >= -1e-9 for p in rest):
                continue
            out.append((i, j, m))
            del remaining[k]
            break
        else:
            raise ValueError("a polygon that cannot be cut")
    return [*out, (remaining[0], remaining[1], remaining[2])]


def lid(rings: list[Ring], y: float, material: str, *, up: bool = True) -> list[Face]:
    """The level surface of a footprint: one ring, or a ring of four corners around a court."""
    if len(rings) == 2:
        outer, court = rings
        # A court runs in the opposite direction: its corner k faces outer corner (4 - k) % 4.
        polygons = [
            [outer[k], outer[(k + 1) % 4], court[(3 - k) % 4], court[(4 - k) % 4]] for k in range(4)
        ]
    else:
        ring = rings[0]
        polygons = [[ring[i] for i in e] for e in ears([(x, -z) for x, z in ring])]
    faces = []
    for polygon in polygons:
        corners = polygon if up else polygon[::-1]
        faces.append(face(material, [(x, y, z) for x, z in corners], [(x, -z) for x, z in corners]))
    return faces


def extrude(wall: Wall, profile: Sequence[Flat], u: float, U: float, material: str) -> list[Face]:
    """A profile of (d, v), counter-clockwise as seen from the wall's left end (d to the right)."""
    faces = []
    along = 0.0
    for (d, v), (D, V) in pairwise([*profile, profile[0]]):
        step = math.sqrt((D - d) ** 2 + (V - v) ** 2)
        quad = [(U, v, d), (U, V, D), (u, V, D), (u, v, d)]
        uv = [(U, along), (U, along + step), (u, along + step), (u, along)]
        faces.append(wall.face(material, quad, uv))
        along += step
    for e in ears(profile):
        ends = [profile[k] for k in e]
        faces.append(wall.face(material, [(u, v, d) for d, v in ends]))
        faces.append(wall.face(material, [(U, v, d) for d, v in ends[::-1]]))
    return faces


def prism(
    centre: Flat, levels: Sequence[Flat], sides: int, material: str, squeeze: float = 1.0
) -> list[Face]:
    """A turned solid: (radius, y) from the bottom up; ends closed."""
    turns = [2 * math.pi * k / sides for k in range(sides)]
    unit = [(math.cos(t), -math.sin(t) * squeeze) for t in turns]

    def corner(k: int, r: float, y: float) -> Point:
        return centre[0] + r * unit[k % sides][0], y, centre[1] + r * unit[k % sides][1]

    faces = []
    around = max(r for r, _ in levels) * 2 * math.pi / sides
    for (r, y), (R, Y) in pairwise(levels):
        v, V = (y, Y) if abs(Y - y) > 1e-9 else (r, R)
        for k in range(sides):
            quad = [corner(k, r, y), corner(k + 1, r, y), corner(k + 1, R, Y), corner(k, R, Y)]
            uv = [(around * k, v), (around * (k + 1), v), (around * (k + 1), V), (around * k, V)]
            faces.append(face(material, quad, uv))
    for (r, y), order in ((levels[0], -1), (levels[-1], 1)):
        corners = [corner(k, r, y) for k in range(sides)][::order]
        faces.append(face(material, corners, [(p[0], -p[2]) for p in corners]))
    return faces
