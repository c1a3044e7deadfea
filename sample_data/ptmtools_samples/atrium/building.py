"""The hall: outer walls, a court within two storeys of arcades, walks around it, and a ceiling."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ptmtools_samples.atrium.sheets import Sheet, Vector, box, plane, revolve, smooth

#: Metres: the hall, the width of the walks around the court, the thickness of an arcade's wall.
LENGTH, WIDTH, HEIGHT, WALK, WALL = 31.0, 16.6, 11.2, 3.6, 0.5
#: Metres: floor, capitals and top of the arcade of each storey.
STOREYS = ((0.0, 3.3, 5.2), (5.6, 8.3, HEIGHT))
#: Bays along the long sides and along the short ones.
BAYS = (8, 3)
#: Metres: half the solid between two arches; radius of a shaft.
PIER, SHAFT = 0.36, 0.24
RAIL = 1.0


@dataclass(frozen=True)
class Side:
    """One side of the court.

    Attributes
    ----------
    name: of it. start: its first corner, on the floor, metres.
    along, inward: unit vectors, level.
    bay: metres between columns. bays: how many.
    """

    name: str
    start: Vector
    along: Vector
    inward: Vector
    bay: float
    bays: int

    def point(self, s: float, y: float, t: float) -> Vector:
        """The point ``s`` along the side, ``y`` up, ``t`` into the court, metres."""
        return (
            self.start[0] + s * self.along[0] + t * self.inward[0],
            y,
            self.start[2] + s * self.along[2] + t * self.inward[2],
        )


def sides() -> list[Side]:
    """South, east, north, west; counter-clockwise from above, so that along × up looks out."""
    x, z = LENGTH - 2 * WALK, WIDTH - 2 * WALK
    return [
        Side("south", (WALK, 0, WIDTH - WALK), (1, 0, 0), (0, 0, -1), x / BAYS[0], BAYS[0]),
        Side(
            "east", (LENGTH - WALK, 0, WIDTH - WALK), (0, 0, -1), (-1, 0, 0), z / BAYS[1], BAYS[1]
        ),
        Side("north", (LENGTH - WALK, 0, WALK), (-1, 0, 0), (0, 0, 1), x / BAYS[0], BAYS[0]),
        Side("west", (WALK, 0, WALK), (0, 0, 1), (1, 0, 0), z / BAYS[1], BAYS[1]),
    ]


def shell() -> Iterator[Sheet]:
    """Floor, ceiling and outer walls, which face inwards, and the floor of the upper walk."""
    yield plane("floor", "floor", (0, 0, WIDTH), (LENGTH, 0, 0), (0, 0, -WIDTH), 2.4)
    yield plane("ceiling", "coffer", (0, HEIGHT, 0), (LENGTH, 0, 0), (0, 0, WIDTH), 2.0)
    for name, corner, right in (
        ("wall_north", (0, 0, 0), (LENGTH, 0, 0)),
        ("wall_east", (LENGTH, 0, 0), (0, 0, WIDTH)),
        ("wall_south", (LENGTH, 0, WIDTH), (-LENGTH, 0, 0)),
        ("wall_west", (0, 0, WIDTH), (0, 0, -WIDTH)),
    ):
        yield plane(name, "ashlar", corner, right, (0, HEIGHT, 0), 3.0)
    low, high = STOREYS[0][2], STOREYS[1][0]
    inner = WALK + WALL / 2
    # Rings as four boxes; those at the ends fill the corners.
    for name, a, b in (
        ("north", (inner, 0), (LENGTH - inner, inner)),
        ("south", (inner, WIDTH - inner), (LENGTH - inner, WIDTH)),
        ("west", (0, 0), (inner, WIDTH)),
        ("east", (LENGTH - inner, 0), (LENGTH, WIDTH)),
    ):
        top, bottom = f"{name}_walk", f"{name}_vault"
        (x, z), (w, d) = a, (b[0] - a[0], b[1] - a[1])
        yield plane(top, "parquet", (x, high, z + d), (w, 0, 0), (0, 0, -d), 1.6)
        yield plane(bottom, "vault", (x, low, z), (w, 0, 0), (0, 0, d), 2.0)


def arcades() -> Iterator[Sheet]:
    """Columns, arches and the wall above them, in both storeys, and the edge of the upper walk."""
    for side in sides():
        for level, storey in enumerate(STOREYS):
            for k in range(side.bays):
                yield from _bay(side, level, storey, k)
            for k in range(1, side.bays):
                yield from _column(side, level, storey, k)
        low, high = STOREYS[0][2], STOREYS[1][0]
        length = side.bay * side.bays
        right = tuple(length * c for c in side.along)
        yield plane(
            f"{side.name}_edge",
            "cornice",
            side.point(length, low, WALL / 2),
            (-right[0], -right[1], -right[2]),
            (0, high - low, 0),
            0.8,
        )
    for x in (WALK, LENGTH - WALK):
        for z in (WALK, WIDTH - WALK):
            half = PIER + 0.02
            yield from box(
                "corner_pier",
                "ashlar",
                (x - half, 0, z - half),
                (x + half, HEIGHT, z + half),
                3.0,
                "xXzZ",
            )


def _bay(side: Side, level: int, storey: tuple[float, float, float], k: int) -> Iterator[Sheet]:
    """The wall around an arch: both faces, the soffit, and two rings of mouldings."""
    name = f"{side.name}_{level}_arch_{k}"
    _, spring, top = storey
    radius = side.bay / 2 - PIER
    count = 24
    angle = math.pi * np.arange(count + 1) / count
    s = np.concatenate([[0.0, PIER], side.bay / 2 - radius * np.cos(angle[1:-1])])
    s = np.concatenate([s, [side.bay - PIER, side.bay]])
    y = np.concatenate([[spring, spring], spring + radius * np.sin(angle[1:-1]), [spring, spring]])
    for face, t in (("front", WALL / 2), ("back", -WALL / 2)):
        low = [side.point(k * side.bay + a, b, t) for a, b in zip(s, y, strict=True)]
        high = [side.point(k * side.bay + a, top, t) for a in s]
        points = np.array([low, high])
        uv = np.stack([np.broadcast_to(s / 3.0, (2, len(s))), points[:, :, 1] / 3.0], axis=2)
        if face == "front":
            points, uv = points[:, ::-1], uv[:, ::-1]
        yield Sheet(name, "ashlar", points, uv)
    along = np.concatenate([[0], np.cumsum(np.hypot(np.diff(s), np.diff(y)))])
    soffit = [
        [side.point(k * side.bay + a, b, t) for a, b in zip(s, y, strict=True)]
        for t in (-WALL / 2, WALL / 2)
    ]
    uv = np.stack([np.broadcast_to(along, (2, len(s))), np.repeat([[0.0], [WALL]], len(s), 1)], 2)
    yield Sheet(name, "stone", np.array(soffit), uv)
    for t in (WALL / 2, -WALL / 2):
        yield _moulding(name, side, k, spring, radius + 0.12, 0.1, t)


def _moulding(
    name: str, side: Side, k: int, spring: float, radius: float, thick: float, t: float
) -> Sheet:
    """Half a torus over an arch, half of it within the wall."""
    long, around = 26, 6
    arc = math.pi * np.arange(long + 1) / long
    ring = 2 * math.pi * np.arange(around + 1) / around
    ring[-1] = 0.0
    points = np.array(
        [
            [
                side.point(
                    k * side.bay + side.bay / 2 - (radius + thick * math.cos(b)) * math.cos(a),
                    spring + (radius + thick * math.cos(b)) * math.sin(a),
                    t + thick * math.sin(b),
                )
                for a in arc
            ]
            for b in ring
        ]
    )
    u = np.broadcast_to(arc * radius / 0.8, points.shape[:2])
    v = np.broadcast_to((np.arange(around + 1) / around)[:, None], points.shape[:2])
    return Sheet(name, "cornice", points, np.stack([u, v], axis=2))


def _column(side: Side, level: int, storey: tuple[float, float, float], k: int) -> Iterator[Sheet]:
    name = f"{side.name}_{level}_column_{k}"
    floor, spring, _ = storey
    foot = side.point(k * side.bay, floor, 0.0)
    tall = spring - floor
    half = SHAFT * 1.45
    for low, high in ((0.0, 0.14), (tall - 0.12, tall)):
        yield from box(
            name,
            "marble",
            (foot[0] - half, floor + low, foot[2] - half),
            (foot[0] + half, floor + high, foot[2] + half),
            1.0,
        )
    base = [(1.35, 0.14), (1.4, 0.2), (1.25, 0.26), (1.12, 0.3), (1.2, 0.35), (1.02, 0.4)]
    yield revolve(name, "marble", smooth([(SHAFT * r, h) for r, h in base], 2), 24, foot, 2)
    shaft = [(SHAFT * (1 - 0.14 * t * t), 0.4 + t * (tall - 1.0)) for t in np.linspace(0, 1, 11)]
    flutes = 14
    yield revolve(
        name, ("granite", "marble")[level], shaft, 4 * flutes, foot, 2, flutes=flutes, depth=0.07
    )
    capital = [(0.88, 0.6), (1.0, 0.56), (0.92, 0.5), (0.95, 0.4), (1.15, 0.26), (1.4, 0.12)]
    yield revolve(
        name,
        "capital",
        smooth([(SHAFT * r, tall - h) for r, h in capital], 3),
        36,
        foot,
        6,
        flutes=12,
        depth=0.12,
    )
