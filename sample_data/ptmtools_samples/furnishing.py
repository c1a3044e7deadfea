"""Pictures, statues, benches, stairs and the entrance: the detail inside the shell.

These objects neither close nor open a cell. Pictures are a hard case on purpose: thin closed frames
2 mm to 2 cm in front of their wall.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ptmtools.errors import InputError
from ptmtools_samples.mesh import Face, Point, Thing, Uv, block, tile_face
from ptmtools_samples.plan import STAIR_LANDING, STAIR_RUN, STOREY, Plan, PlanBox
from ptmtools_samples.shell import TILE, Panel

#: Distance of a frame's back, and of its canvas, from the wall; mm.
HANG = (2, 20)
#: Depth of a frame; m.
FRAME_DEPTH = 0.025
#: Hanging schemes by decreasing spacing: metres of wall per picture, heights of the row centres
#: above the floor, maximum height of a canvas; m.
HANGINGS = [
    (2.6, (1.65,), 1.7),
    (1.9, (1.65,), 1.3),
    (1.5, (1.15, 2.5), 1.0),
    (1.0, (0.75, 1.6, 2.45, 3.3), 0.6),
]
RISERS = 15
FLIGHT_GAP = 0.3


@dataclass(frozen=True)
class FurnitureSpot:
    """A position for a picture: its panel, the centre along the wall and above the model's origin,
    and the maximum size of the canvas; m."""

    panel: Panel
    along: float
    height: float
    width: float
    tall: float


def places(panels: list[Panel], wanted: int) -> list[FurnitureSpot]:
    """Returns positions for at least ``wanted`` pictures, with as much spacing as possible.

    Raises InputError: PTM-I111 they do not fit even with the least spacing.
    """
    walls = [p for p in panels if p.top - p.bottom > 3500 and p.high - p.low > 1300]
    for pitch, rows, tall in HANGINGS:
        actual = []
        for panel in walls:
            length = (panel.high - panel.low) / 1000 - 0.3
            count = int(length / pitch)
            for k in range(count):
                along = panel.low / 1000 + 0.15 + length * (2 * k + 1) / (2 * count)
                actual += [
                    FurnitureSpot(panel, along, panel.bottom / 1000 + row, pitch - 0.45, tall)
                    for row in rows
                ]
        if len(actual) >= wanted:
            return actual
    raise InputError(
        "PTM-I111",
        f"{wanted} pictures do not fit on the walls",
        remedy="use more rooms or fewer pictures",
    )


def hang(
    panels: list[Panel], aspects: list[float], rooms: int, rng: np.random.Generator
) -> list[Thing]:
    """Hangs every picture once, then repeats them until the walls are full.

    ``aspects`` gives width over height of each picture; picture k has the material
    ``painting_%02d`` % (k + 1).
    """
    actual = places(panels, len(aspects))
    count = min(len(actual), max(2 * len(aspects), 8 * rooms)) if aspects else 0
    chosen = sorted(int(k) for k in rng.permutation(len(actual))[:count])
    order: list[int] = []
    while len(order) < count:
        order += [int(k) for k in rng.permutation(len(aspects))]
    return [
        hang_picture(f"painting_{i + 1:02d}", order[i], aspects[order[i]], actual[k], rng)
        for i, k in enumerate(chosen)
    ]


def hang_picture(
    name: str, picture: int, aspect: float, place: FurnitureSpot, rng: np.random.Generator
) -> Thing:
    """A canvas in a closed frame of four mitred bars."""
    panel = place.panel
    right = panel.side if panel.axis == 2 else -panel.side
    back = int(rng.integers(HANG[0], HANG[1] + 1)) / 1000
    tall = place.tall * (0.7 + 0.3 * float(rng.random()))
    wide = min(place.width, tall * aspect)
    w, h = round(wide / 2, 3), round(wide / aspect / 2, 3)
    bar = (0.04, 0.06, 0.09)[int(rng.integers(3))]
    frame = ("frame_gilt", "frame_gilt", "frame_dark", "frame_black")[int(rng.integers(4))]

    def point(u: float, v: float, d: float) -> Point:
        wall = panel.position / 1000 + panel.side * d
        along = place.along + right * u
        return (
            (wall, place.height + v, along) if panel.axis == 0 else (along, place.height + v, wall)
        )

    inner = [(-w, -h), (w, -h), (w, h), (-w, h)]
    outer = [(u + math.copysign(bar, u), v + math.copysign(bar, v)) for u, v in inner]
    unit: tuple[Uv, ...] = ((0, 0), (1, 0), (1, 1), (0, 1))
    canvas = Face(f"painting_{picture + 1:02d}", tuple(point(*c, back) for c in inner), unit)
    faces = [canvas]
    front = back + FRAME_DEPTH
    for k in range(4):
        o, p, i, j = outer[k], outer[k - 3], inner[k], inner[k - 3]
        length = round(2 * (h if k % 2 else w) / 0.25)
        for quad in (
            (point(*o, front), point(*p, front), point(*j, front), point(*i, front)),
            (point(*o, back), point(*p, back), point(*p, front), point(*o, front)),
            (point(*i, front), point(*j, front), point(*j, back), point(*i, back)),
            (point(*i, back), point(*j, back), point(*p, back), point(*o, back)),
        ):
            faces.append(Face(frame, quad, ((0, 0), (length, 0), (length, 1), (0, 1))))
    return Thing(name, faces)


def furnish(plan: Plan, rng: np.random.Generator) -> list[Thing]:
    """Returns statues and benches of the rooms, benches of the corridors, the entrance, the
    stairs."""
    statues: list[Thing] = []
    benches: list[Thing] = []
    for box in plan.of_kind("room"):
        spots = [(0.27, 0.27), (0.73, 0.27), (0.27, 0.73), (0.73, 0.73)]
        for k in rng.permutation(4)[: int(rng.integers(0, 4))]:
            x, z = (_metres_between(box, axis, spots[k][axis // 2]) for axis in (0, 2))
            kind = STATUES[int(rng.integers(len(STATUES)))]
            name = f"statue_{len(statues) + 1:02d}"
            statues.append(Thing(name, kind(x, box.low[1] / 1000, z)))
        if rng.random() < 0.75:
            benches.append(bench(len(benches) + 1, box, 0.5, int(rng.integers(2))))
    for box in plan.of_kind("corridor"):
        benches += [
            bench(len(benches) + 1 + k, box, share, 0) for k, share in enumerate((0.3, 0.7))
        ]
    ground = next(box for box in plan.of_kind("corridor") if box.storey == 0)
    z = _metres_between(ground, 2, 0.5)
    # Two leaves on either side of the wall, which stays closed behind them.
    leaves = [
        face
        for x, X in ((0.005, 0.06), (plan.low[0] / 1000 - 0.06, plan.low[0] / 1000 - 0.005))
        for side in (-1.1, 0.01)
        for face in block("wood", (x, 0.0, z + side), (X, 2.6, z + side + 1.09), TILE["wood"])
    ]
    things = [*statues, *benches, Thing("entrance_door", leaves)]
    for shaft in plan.of_kind("shaft"):
        things += _stairs(shaft, plan.storeys)
    return things


def _metres_between(box: PlanBox, axis: int, share: float) -> float:
    return round((box.low[axis] + (box.high[axis] - box.low[axis]) * share) / 1000, 2)


def bench(number: int, box: PlanBox, share: float, turned: int) -> Thing:
    x, z, y = _metres_between(box, 0, share), _metres_between(box, 2, 0.5), box.low[1] / 1000
    a, b = (0.3, 0.9) if turned else (0.9, 0.3)
    faces = block("wood", (x - a, y + 0.38, z - b), (x + a, y + 0.46, z + b), 0.9)
    for s in (-1, 1):
        dx, dz = (0.0, 0.6 * s) if turned else (0.6 * s, 0.0)
        c, d = (0.22, 0.05) if turned else (0.05, 0.22)
        low, high = (x + dx - c, y, z + dz - d), (x + dx + c, y + 0.38, z + dz + d)
        faces += block("frame_black", low, high, 0.9, without=frozenset({"-y", "+y"}))
    return Thing(f"bench_{number:02d}", faces)


def _stairs(shaft: PlanBox, storeys: int) -> list[Thing]:
    """Two flights and a landing per storey, with guards; step heights divide the storey exactly."""
    things: list[Thing] = []
    x0 = shaft.low[0] / 1000
    z0, z1 = shaft.low[2] / 1000, shaft.high[2] / 1000
    middle = (z0 + z1) / 2
    landing = x0 + STAIR_RUN / 1000
    rise = STOREY / 1000 / (2 * RISERS)
    name = shaft.name.removesuffix("_shaft")
    for storey in range(storeys - 1):
        y = storey * STOREY / 1000
        half = y + STOREY / 2000
        low, high = (landing, half - 0.2, z0), (landing + STAIR_LANDING / 1000, half, z1)
        walls = frozenset({"+x", "-z", "+z"})
        things.append(
            Thing(f"{name}_landing{storey}", block("stone", low, high, 2.0, without=walls))
        )
        south, north = (middle + FLIGHT_GAP / 2, z1), (z0, middle - FLIGHT_GAP / 2)
        up = _flight(x0, landing, y, rise, south, inner=0)
        under = half - 2 * rise  # the flight ends below the underside of the landing
        end = [(under, south[1]), (under, south[0]), (half - 0.2, south[0]), (half - 0.2, south[1])]
        up.append(tile_face("stone", tuple((landing, h, z) for h, z in end), 2.0))
        things.append(Thing(f"{name}_flight{storey}_up", up))
        things.append(
            Thing(f"{name}_flight{storey}_on", _flight(landing, x0, half, rise, north, inner=1))
        )
    if storeys > 1:
        y = (storeys - 1) * STOREY / 1000
        low, high = (x0 - 0.06, y, middle - FLIGHT_GAP / 2), (x0 - 0.01, y + 1.0, z1)
        things.append(
            Thing(f"{name}_guard", block("wood", low, high, 1.5, without=frozenset({"-y", "+z"})))
        )
    return things


def _flight(
    start: float, stop: float, y: float, rise: float, z: tuple[float, float], *, inner: int
) -> list[Face]:
    """A flight from (start, y) to stop: treads, risers, inner side, underside and guard.

    The floor or landing above provides the last riser. ``inner`` selects the z of the side towards
    the other flight; the opposite side touches the wall.
    """
    run = (stop - start) / (RISERS - 1)
    towards = 1 if run > 0 else -1
    ends = z if towards > 0 else z[::-1]
    side = z[inner]
    faces: list[Face] = []

    def facing(points: list[Point], outward: bool) -> Face:
        return tile_face("stone", tuple(points if outward else points[::-1]), 2.0)

    for k in range(RISERS - 1):
        a, b = start + run * k, start + run * (k + 1)
        bottom, top = y + rise * k, y + rise * (k + 1)
        under_a, under_b = max(0.0, bottom - rise), bottom
        p, q = ends
        faces.append(facing([(a, top, q), (b, top, q), (b, top, p), (a, top, p)], True))
        faces.append(facing([(a, bottom, p), (a, bottom, q), (a, top, q), (a, top, p)], True))
        if under_b > 0 or under_a > 0:
            faces.append(
                facing([(a, under_a, p), (b, under_b, p), (b, under_b, q), (a, under_a, q)], True)
            )
        profile: list[Point] = [
            (a, under_a, side),
            (b, under_b, side),
            (b, top, side),
            (a, top, side),
        ]
        faces.append(facing(profile, (towards > 0) == (inner == 1)))
    return faces + _guard(start, stop, y, rise, side + (0.01 if inner else -0.06))


def _guard(start: float, stop: float, y: float, rise: float, z: float) -> list[Face]:
    """A sloping panel 5 cm thick beside a flight, from its underside to hand height."""
    (a, ya), (b, yb) = sorted([(start, y), (stop, y + rise * (RISERS - 1))])
    drop = rise if y > 0 else 0.0
    low = [(a, ya - drop), (b, yb - drop)]
    corners = [*low, (b, yb + 1.0), (a, ya + 1.0)]
    Z = z + 0.05
    loops = [[(p, q, Z) for p, q in corners], [(p, q, z) for p, q in reversed(corners)]]
    for k in range(4):
        (p, q), (r, s) = corners[k], corners[k - 3]
        loops.append([(p, q, z), (r, s, z), (r, s, Z), (p, q, Z)])
    return [tile_face("wood", tuple(loop), 1.5) for loop in loops]


def lathe(
    x: float,
    y: float,
    z: float,
    profile: list[tuple[float, float, float]],
    material: str,
    segments: int = 20,
    twist: float = 0.0,
) -> list[Face]:
    """Rings of (height, radius in x, radius in z), joined by triangles, with flat ends."""
    rings: list[list[Point]] = []
    for height, rx, rz in profile:
        turn = twist * height
        rings.append([])
        for k in range(segments):
            angle = 2 * math.pi * k / segments
            a, b = rx * math.cos(angle), -rz * math.sin(angle)
            cosine, sine = math.cos(turn), math.sin(turn)
            rings[-1].append(
                (
                    round(x + a * cosine - b * sine, 4),
                    round(y + height, 4),
                    round(z + a * sine + b * cosine, 4),
                )
            )
    faces = []
    for i in range(len(rings) - 1):
        v, V = (round(profile[n][0], 3) for n in (i, i + 1))
        for k in range(segments):
            u, U = 2 * k / segments, 2 * (k + 1) / segments
            p, q = rings[i][k], rings[i][(k + 1) % segments]
            r, s = rings[i + 1][(k + 1) % segments], rings[i + 1][k]
            faces.append(Face(material, (p, q, r), ((u, v), (U, v), (U, V))))
            faces.append(Face(material, (p, r, s), ((u, v), (U, V), (u, V))))
    faces.append(tile_face(material, tuple(rings[-1]), 1.0))
    faces.append(tile_face(material, tuple(reversed(rings[0])), 1.0))
    return faces


def smooth_curve(
    knots: list[tuple[float, float, float]], per_span: int = 3
) -> list[tuple[float, float, float]]:
    """Catmull–Rom curve through the knots."""
    ends = [knots[0], *knots, knots[-1]]
    curve = []
    for k in range(len(knots) - 1):
        p, q, r, s = ends[k : k + 4]
        for n in range(per_span):
            t = n / per_span
            weights = (
                (-t + 2 * t * t - t**3) / 2,
                (2 - 5 * t * t + 3 * t**3) / 2,
                (t + 4 * t * t - 3 * t**3) / 2,
                (t**3 - t * t) / 2,
            )
            point = [
                sum(w * c[i] for w, c in zip(weights, (p, q, r, s), strict=True)) for i in range(3)
            ]
            curve.append((point[0], max(point[1], 0.01), max(point[2], 0.01)))
    return [*curve, knots[-1]]


def plinth(x: float, y: float, z: float, height: float, half: float = 0.3) -> list[Face]:
    """A base, a shaft and a cornice; touching faces are left out."""
    h, levels = half, [(0.0, 0.12, 0.06), (0.12, height - 0.08, 0.0), (height - 0.08, height, 0.04)]
    faces: list[Face] = []
    for bottom, top, out in levels:
        low = (x - h - out, y + bottom, z - h - out)
        high = (x + h + out, y + top, z + h + out)
        without = {"-y"} if bottom == 0 else {"-y", "+y"} if out == 0 else set()
        faces += block("marble", low, high, 1.0, without=frozenset(without))
    return faces


def amphora(x: float, y: float, z: float) -> list[Face]:
    knots = [
        (0.0, 0.13, 0.13),
        (0.04, 0.12, 0.12),
        (0.1, 0.09, 0.09),
        (0.4, 0.26, 0.26),
        (0.62, 0.24, 0.24),
        (0.78, 0.1, 0.1),
        (0.9, 0.09, 0.09),
        (0.95, 0.14, 0.14),
    ]
    return plinth(x, y, z, 0.9) + lathe(x, y + 0.9, z, smooth_curve(knots, 2), "terracotta")


def figure(x: float, y: float, z: float) -> list[Face]:
    """A standing robed figure."""
    knots = [
        (0.0, 0.26, 0.22),
        (0.05, 0.25, 0.21),
        (0.5, 0.19, 0.17),
        (0.85, 0.21, 0.17),
        (1.05, 0.16, 0.13),
        (1.3, 0.22, 0.14),
        (1.42, 0.22, 0.12),
        (1.5, 0.08, 0.08),
        (1.56, 0.06, 0.07),
        (1.64, 0.085, 0.1),
        (1.74, 0.09, 0.1),
        (1.82, 0.03, 0.03),
    ]
    return plinth(x, y, z, 0.6, 0.32) + lathe(x, y + 0.6, z, smooth_curve(knots, 2), "marble")


def bust(x: float, y: float, z: float) -> list[Face]:
    knots = [
        (0.0, 0.12, 0.12),
        (0.06, 0.1, 0.1),
        (0.12, 0.16, 0.11),
        (0.26, 0.26, 0.14),
        (0.34, 0.22, 0.12),
        (0.4, 0.08, 0.08),
        (0.46, 0.075, 0.08),
        (0.54, 0.1, 0.12),
        (0.64, 0.11, 0.13),
        (0.74, 0.07, 0.08),
        (0.77, 0.02, 0.02),
    ]
    return plinth(x, y, z, 1.15, 0.24) + lathe(x, y + 1.15, z, smooth_curve(knots, 2), "marble")


def column(x: float, y: float, z: float) -> list[Face]:
    """A twisted pillar, four-sided at the foot and round at the top."""
    profile = [(0.09 * k, 0.24 - 0.012 * k, 0.12 + 0.002 * k) for k in range(19)]
    return plinth(x, y, z, 0.5) + lathe(x, y + 0.5, z, profile, "bronze", 16, twist=1.6)


STATUES: list[Callable[[float, float, float], list[Face]]] = [amphora, figure, bust, column]
