"""Hand-made buildings: (T, 3, 3) triangles in metres, Z up, facing outwards from solids."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ptmtools.arrays import Floats, Ints

Point = tuple[float, float, float]
#: Of a doorway.
WIDE, HIGH = 0.9, 2.1


def box(low: Point, high: Point) -> Floats:
    """The 12 triangles of a box."""
    ends = np.array([low, high], dtype=np.float64)
    corner = np.array([ends[[i, j, k], [0, 1, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return corner[[t for q in quads for t in (q[:3], [q[0], q[2], q[3]])]]


def sheet(*corner: Point) -> Floats:
    """Two triangles over four corners."""
    a, b, c, d = corner
    return np.array([[a, b, c], [a, c, d]], dtype=np.float64)


def wall(
    start: tuple[float, float],
    end: tuple[float, float],
    height: float,
    bottom: float = 0.0,
    door: float | None = None,
) -> Floats:
    """A wall 20 cm thick along x or y, with a doorway at ``door`` metres from its start."""
    along = 0 if start[0] != end[0] else 1
    across = start[1 - along]

    def part(a: float, b: float, low: float, high: float) -> Floats:
        span = [(across - 0.1, across + 0.1)] * 2
        span[along] = (start[along] + a, start[along] + b)
        (x0, x1), (y0, y1) = span
        return box((x0, y0, bottom + low), (x1, y1, bottom + high))

    length = end[along] - start[along]
    if door is None:
        return part(0, length, 0, height)
    sides = part(0, door, 0, height), part(door + WIDE, length, 0, height)
    return np.concatenate([*sides, part(door, door + WIDE, HIGH, height)])


def house(
    width: float = 19,
    depth: float = 11.4,
    height: float = 3,
    *,
    floor: bool = True,
    roof: bool = True,
    storeys: int = 1,
) -> Floats:
    """Rooms in three strips, with doorways, and an open front door."""
    w, d, parts = width, depth, []
    for storey in range(storeys):
        z = storey * (height + 0.3)
        parts += [
            wall((0, 0), (w, 0), height, z, door=w * 0.1 if storey == 0 else None),
            wall((0, d), (w, d), height, z),
            wall((0, 0), (0, d), height, z),
            wall((w, 0), (w, d), height, z),
            wall((w * 0.4, 0), (w * 0.4, d), height, z, door=d * 0.25),
            wall((w * 0.7, 0), (w * 0.7, d), height, z, door=d * 0.65),
            wall((0, d * 0.5), (w * 0.4, d * 0.5), height, z, door=w * 0.1),
            wall((w * 0.7, d * 0.6), (w, d * 0.6), height, z, door=w * 0.1),
        ]
        if floor:
            parts.append(box((-0.1, -0.1, z - 0.3), (w + 0.1, d + 0.1, z)))
    if roof:
        top = storeys * (height + 0.3) - 0.3
        parts.append(box((-0.1, -0.1, top), (w + 0.1, d + 0.1, top + 0.2)))
    return np.concatenate(parts)


def sheets(width: float = 19, depth: float = 11.4, height: float = 3) -> Floats:
    """Walls of no thickness, and nothing else."""
    w, d = width, depth
    lines = [
        (0, 0, w, 0),
        (w, 0, w, d),
        (w, d, 0, d),
        (0, d, 0, 0),
        (w * 0.4, 0, w * 0.4, d),
        (w * 0.7, 0, w * 0.7, d),
        (0, d / 2, w * 0.4, d / 2),
    ]
    return np.concatenate(
        [sheet((a, b, 0), (c, e, 0), (c, e, height), (a, b, height)) for a, b, c, e in lines]
    )


def furnished(building: Floats) -> Floats:
    """With fifteen tables."""
    parts = [building]
    for x in (1.0, 3.0, 9.0, 11.0, 15.0):
        for y in (1.5, 4.0, 8.0):
            parts.append(box((x, y, 0.7), (x + 1.2, y + 0.8, 0.75)))
            parts += [
                box((x + a, y + b, 0), (x + a + 0.05, y + b + 0.05, 0.7))
                for a in (0, 1.15)
                for b in (0, 0.75)
            ]
    return np.concatenate(parts)


def gabled(building: Floats, along: int) -> Floats:
    """With a roof of 19 × 11.4 m whose ridge runs along x or y."""
    w, d, h = 19.0, 11.4, 3.0
    if along == 0:
        ridge = (0, d / 2, h + 3), (w, d / 2, h + 3)
        eaves = ((0, 0, h), (w, 0, h)), ((0, d, h), (w, d, h))
    else:
        ridge = (w / 2, 0, h + 3), (w / 2, d, h + 3)
        eaves = ((0, 0, h), (0, d, h)), ((w, 0, h), (w, d, h))
    return np.concatenate([building, *(sheet(*each, ridge[1], ridge[0]) for each in eaves)])


def corridor(length: float, width: float, height: float, *, rooms: bool) -> Floats:
    """A corridor, alone or with rooms along one side."""
    spans = [(0.0, width), (width, width + 5)] if rooms else [(0.0, width)]
    parts = [
        wall((0, 0), (length, 0), height, door=5),
        wall((0, width), (length, width), height, door=2),
        wall((0, 0), (0, width), height),
        wall((length, 0), (length, width), height),
    ]
    for low, high in spans:
        parts.append(box((0, low, -0.2), (length, high, 0)))
        parts.append(box((0, low, height), (length, high, height + 0.2)))
    if rooms:
        parts.append(wall((0, width + 5), (length, width + 5), height))
        parts += [wall((x, width), (x, width + 5), height) for x in np.arange(0.0, length + 1, 5)]
    return np.concatenate(parts)


def mezzanine() -> Floats:
    """A hall 6 m high with a floor at half its height over a part of it."""
    return np.concatenate(
        [
            box((0, 0, -0.2), (12, 9, 0)),
            box((0, 0, 6), (12, 9, 6.2)),
            box((0, 0, 2.8), (5, 9, 3)),
            wall((0, 0), (12, 0), 6),
            wall((0, 9), (12, 9), 6),
            wall((0, 0), (0, 9), 6),
            wall((12, 0), (12, 9), 6),
        ]
    )


def castle(rooms: int = 1, *, slabs: bool = True) -> Floats:
    """Rooms of 5 m between walls, floors and ceilings that are all 1.8 m thick."""
    t, inner, deep, high = 1.8, 5.0, 6.4, 5.0
    w, d = t + rooms * (inner + t), deep + 2 * t
    parts = [box((0, 0, 0), (w, t, high)), box((0, d - t, 0), (w, d, high))]
    parts += [
        box((x, t, 0), (x + t, d - t, high)) for x in (np.arange(rooms + 1) * (inner + t)).tolist()
    ]
    if slabs:
        parts += [box((0, 0, -t), (w, d, 0)), box((0, 0, high), (w, d, high + t))]
    return np.concatenate(parts)


def tower() -> Floats:
    """21 floors 3.2 m apart within four walls, 8 m wide and 64.2 m high."""
    floors = [box((0, 0, z * 3.2 - 0.2), (8, 8, z * 3.2)) for z in range(21)]
    walls = [
        box((0, 0, 0), (0.2, 8, 64)),
        box((7.8, 0, 0), (8, 8, 64)),
        box((0, 0, 0), (8, 0.2, 64)),
        box((0, 7.8, 0), (8, 8, 64)),
    ]
    return np.concatenate([*floors, *walls])


def meadow(building: Floats, size: float = 480) -> Floats:
    """On a level ground of this width."""
    s = size / 2
    ground = sheet((-s, -s, -0.3), (s, -s, -0.3), (s, s, -0.3), (-s, s, -0.3))
    return np.concatenate([building, ground])


def site_plan() -> Floats:
    """Two sheets, one lying on the other."""
    return np.concatenate(
        [
            sheet((0, 0, 0), (30, 0, 0), (30, 20, 0), (0, 20, 0)),
            sheet((5, 5, 0.01), (9, 5, 0.01), (9, 9, 0.01), (5, 9, 0.01)),
        ]
    )


def divided(triangles: Floats, times: int = 2) -> Floats:
    """Each triangle cut into four, some times."""
    for _ in range(times):
        a, b, c = np.moveaxis(triangles, 1, 0)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        pieces = (a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)
        triangles = np.concatenate([np.stack(piece, axis=1) for piece in pieces])
    return triangles


def turned_in_plan(triangles: Floats, degrees: float) -> Floats:
    """Turned about the upright axis."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return triangles @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])


def y_up(triangles: Floats) -> Floats:
    """The same building, Y up."""
    return triangles[..., [0, 2, 1]] * [1, 1, -1]


def inside_out(triangles: Floats) -> Floats:
    """The same with every face turned over."""
    return triangles[:, ::-1]


def welded(triangles: Floats) -> tuple[Floats, Ints]:
    """(V, 3) points and (T, 3) indices."""
    points, index = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    return points, index.reshape(-1, 3)


def obj_text(triangles: Floats) -> str:
    """An OBJ file."""
    points, faces = welded(triangles)
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in points.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (faces + 1).tolist()]
    return "\n".join(lines) + "\n"


def atrium() -> Floats:
    """Two storeys of arcades around a courtyard without a roof, 37.2 × 22.9 m and 15.6 m high.

    As in Sponza: round columns carry the arches, a vault spans each aisle, and between the back
    wall of the aisles and the outer wall the building is hollow from the ground to the roof. Walls
    are sheets.
    """
    wide, deep, high, base = 37.21, 22.87, 14.3, -1.26
    low, end = (5.9, 7.3), (31.3, 15.57)  # corners of the courtyard
    back = 3.2  # from the arches to the wall behind them
    parts = [
        _ring((0, 0), (wide, deep), base, high),
        _ring((low[0] - back, low[1] - back), (end[0] + back, end[1] + back), 0, high - 1.4),
        sheet((0, 0, 0), (wide, 0, 0), (wide, deep, 0), (0, deep, 0)),
        sheet((0, 0, base), (0, deep, base), (wide, deep, base), (wide, 0, base)),
    ]
    storeys = ((0.0, 2.6, 4.7, 5.2), (5.2, 7.4, 9.0, 11.6))  # floor, springing, crown, top
    for along, across in ((0, low[1]), (0, end[1]), (1, low[0]), (1, end[0])):
        span = low[along], end[along]
        behind = across - back if across == low[1 - along] else across + back
        for floor, springing, crown, top in storeys:
            parts.append(_arcade(along, span, across, (floor, springing, crown, top)))
            parts.append(_vault(along, span, (across, behind), springing, crown))
        parts.append(_strip(along, span, (across, behind), 5.2, 5.2))
    # The roof falls towards the courtyard.
    rim = [(low[0], low[1]), (end[0], low[1]), (end[0], end[1]), (low[0], end[1])]
    outer = [(0.0, 0.0), (wide, 0.0), (wide, deep), (0.0, deep)]
    for k in range(4):
        a, b, c, d = rim[k - 1], rim[k], outer[k], outer[k - 1]
        parts.append(sheet((*a, 11.6), (*b, 11.6), (*c, high), (*d, high)))
    return np.concatenate(parts)


def _ring(a: tuple[float, float], b: tuple[float, float], low: float, high: float) -> Floats:
    """Four walls of no thickness."""
    rim = [a, (b[0], a[1]), b, (a[0], b[1])]
    return np.concatenate(
        [
            sheet((*rim[k - 1], low), (*rim[k], low), (*rim[k], high), (*rim[k - 1], high))
            for k in range(4)
        ]
    )


def _strip(
    along: int, span: tuple[float, float], across: tuple[float, float], z0: float, z1: float
) -> Floats:
    """A sheet along an axis, at one height on one of its sides, at another on the other."""
    corner = [(span[0], across[0], z0), (span[1], across[0], z0)]
    corner += [(span[1], across[1], z1), (span[0], across[1], z1)]
    return sheet(*((s, c, z) if along == 0 else (c, s, z) for s, c, z in corner))


def _arcade(
    along: int,
    span: tuple[float, float],
    across: float,
    levels: tuple[float, float, float, float],
) -> Floats:
    """Columns, and a wall 60 cm thick upon their arches; across: where its middle lies."""
    floor, springing, crown, top = levels
    bays = max(2, round((span[1] - span[0]) / 4.2))
    bay = (span[1] - span[0]) / bays
    half = bay / 2 - 0.45
    rise = min(half, crown - springing)
    parts = []

    def at(s: float, c: float, z: float) -> Point:
        return (s, c, z) if along == 0 else (c, s, z)

    for k in range(bays):
        middle = span[0] + (k + 0.5) * bay
        angle = np.linspace(np.pi, 0, 13)
        arch = [(middle + half * np.cos(v), springing + rise * np.sin(v)) for v in angle]
        edge = [(middle - bay / 2, springing), *arch, (middle + bay / 2, springing)]
        for (s0, z0), (s1, z1) in pairwise(edge):
            near, far = across - 0.3, across + 0.3
            for c in (near, far):
                if s1 > s0:
                    parts.append(
                        sheet(at(s0, c, z0), at(s1, c, z1), at(s1, c, top), at(s0, c, top))
                    )
            parts.append(
                sheet(at(s0, near, z0), at(s1, near, z1), at(s1, far, z1), at(s0, far, z0))
            )
    turn = np.linspace(0, 2 * np.pi, 13)
    for s in np.linspace(*span, bays + 1).tolist():
        rim = [(s + 0.4 * np.cos(v), across + 0.4 * np.sin(v)) for v in turn]
        parts += [
            sheet(at(*a, floor), at(*b, floor), at(*b, springing), at(*a, springing))
            for a, b in pairwise(rim)
        ]
    return np.concatenate(parts)


def _vault(
    along: int,
    span: tuple[float, float],
    across: tuple[float, float],
    springing: float,
    crown: float,
) -> Floats:
    """A barrel over an aisle between two lines."""
    middle, half = (across[0] + across[1]) / 2, abs(across[1] - across[0]) / 2
    rim = [
        (middle + half * np.cos(v), springing + (crown - springing) * np.sin(v))
        for v in np.linspace(0, np.pi, 13)
    ]

    def at(s: float, c: float, z: float) -> Point:
        return (s, c, z) if along == 0 else (c, s, z)

    return np.concatenate(
        [
            sheet(at(span[0], *a), at(span[1], *a), at(span[1], *b), at(span[0], *b))
            for a, b in pairwise(rim)
        ]
    )
