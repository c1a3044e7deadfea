"""Made models of the kinds that people have, and what visitors should keep resident of each.

Metres, Z up, as in `buildings`. The figures of `benchmarks/strangers.py` are of these.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Floats
from tests.cells.buildings import Box, carved, room
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


#: Expectations were written before the first run.
STRANGERS: Mapping[str, Stranger] = {
    "office": Stranger(office, 0.30, (21, 25)),
    "institute": Stranger(institute, 0.30, (40, 48)),
    "serpentine": Stranger(serpentine, 0.75, (4, 12)),
    "tile": Stranger(tile, 1.0, (1, 40)),
}
