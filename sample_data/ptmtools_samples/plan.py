"""The plan of the museum: boxes of air in a solid block, in whole millimetres.

Air describes a building. Rooms, corridors, stairwells, doorways and windows are axis-aligned boxes
that do not overlap; an opening arises where two boxes touch, and the rest between them is wall.
Thus walls have a thickness, and the model cannot have a gap: its surface is the boundary of the
union of the boxes, plus the outside of the block (`shell.py`). Whole millimetres make contact
exact.

X points east, Y up, Z south. Each floor is a row of parallel wings along z; a wing is a strip of
rooms, a corridor and a second strip of rooms, with a stairwell at the east end of the corridor. A
stairwell is one shaft through all floors, with an entry on each.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

OUTER_WALL = 300
INNER_WALL = 200
SLAB = 300
ROOM_HEIGHT = 4200
STOREY = ROOM_HEIGHT + SLAB
CORRIDOR_WIDTH = 4000
#: Lengths of the stairwell along x: an entry with a floor on each storey, two parallel flights that
#: rise half a storey each, and the landing between them.
STAIR_ENTRY = 1600
STAIR_RUN = 4200
STAIR_LANDING = 1600
STAIRWELL = STAIR_ENTRY + STAIR_RUN + STAIR_LANDING
#: Minimum distance of a doorway from the ends of its wall.
DOOR_MARGIN = 300
WALLS = ("plaster_cream", "plaster_red", "plaster_green", "plaster_blue")
FLOORS = ("parquet", "carpet", "parquet")

Mm = tuple[int, int, int]


@dataclass(frozen=True)
class PlanBox:
    """A box of air [low, high] in mm and the names of its surface materials.

    ``kind`` is room, corridor, entry, shaft, door or window; ``storey`` counts from 0.
    """

    name: str
    kind: str
    storey: int
    low: Mm
    high: Mm
    wall: str
    floor: str
    ceiling: str


@dataclass
class Plan:
    """All boxes of air, and the bounds [low, high] of the solid block."""

    boxes: list[PlanBox] = field(default_factory=list)
    low: Mm = (0, 0, 0)
    high: Mm = (0, 0, 0)
    storeys: int = 1

    def of_kind(self, *kinds: str) -> list[PlanBox]:
        return [box for box in self.boxes if box.kind in kinds]


def storeys_for(rooms: int) -> int:
    """Returns the number of storeys: two, or more for large museums."""
    if rooms < 4:
        return 1
    return 2 if rooms <= 24 else 3 if rooms <= 90 else 4


def make_plan(rooms: int, rng: np.random.Generator, *, windows: bool = True) -> Plan:
    """Plans a museum of ``rooms`` rooms besides its corridors and stairwells."""
    storeys = storeys_for(rooms)
    per_storey = math.ceil(rooms / storeys)
    wings = math.ceil(per_storey / 16)
    strips = min(2 * wings, per_storey)
    columns = math.ceil(per_storey / strips)
    # A narrower block would leave no corridor beside the stairwell.
    least = math.ceil((STAIRWELL + INNER_WALL + 4000) / columns / 500) * 500
    widths = [max(least, 500 * int(rng.integers(13, 20))) for _ in range(columns)]
    depths = [500 * int(rng.integers(14, 17)) for _ in range(strips)]
    length = sum(widths) + INNER_WALL * (columns - 1)

    plan = Plan(storeys=storeys)
    number = 0
    for storey in range(storeys):
        room_count = min(per_storey, rooms - number)
        # The same widths in another order: rooms differ within the same block.
        order = [widths[k] for k in rng.permutation(columns)] if storey else widths
        starts = np.cumsum([0, *[w + INNER_WALL for w in order]]).tolist()
        slots = [(c, s) for c in range(columns) for s in range(strips)][:room_count]
        grid = _Grid(slots, starts, order, depths)
        _plan_storey(plan, grid, storey, number, rng, windows=windows)
        number += room_count

    depth = _strip_start(strips - 1, depths) + depths[-1]
    if strips % 2:
        depth += INNER_WALL + CORRIDOR_WIDTH
    plan.low = (-OUTER_WALL, -SLAB, -OUTER_WALL)
    plan.high = (length + OUTER_WALL, storeys * STOREY, depth + OUTER_WALL)
    for wing in range(wings):
        z = _strip_start(2 * wing, depths) + depths[2 * wing] + INNER_WALL
        _stairwell(plan, wing, length, z, windows)
    return plan


def _strip_start(strip: int, depths: list[int]) -> int:
    """Returns the z at which a strip of rooms starts."""
    corridors = (strip + 1) // 2
    walls = strip // 2 + 2 * corridors
    return sum(depths[:strip]) + corridors * CORRIDOR_WIDTH + walls * INNER_WALL


@dataclass(frozen=True)
class _Grid:
    """The rooms of a floor: their slots (column, strip), where columns start, mm, and the widths of
    columns and depths of strips."""

    slots: list[tuple[int, int]]
    starts: list[int]
    widths: list[int]
    depths: list[int]

    @property
    def length(self) -> int:
        return self.starts[-1] - INNER_WALL


def _plan_rooms(grid: _Grid, storey: int, number: int) -> dict[tuple[int, int], PlanBox]:
    """The rooms of a floor by their slots; ``number`` are below it."""
    base = storey * STOREY
    room: dict[tuple[int, int], PlanBox] = {}
    for k, (column, strip) in enumerate(grid.slots):
        z = _strip_start(strip, grid.depths)
        # The last room takes the rest of its strip, so all solid is wall.
        last = (column + 1, strip) not in grid.slots
        end = grid.length if last else grid.starts[column] + grid.widths[column]
        room[column, strip] = PlanBox(
            name=f"room{number + k + 1:02d}",
            kind="room",
            storey=storey,
            low=(grid.starts[column], base, z),
            high=(end, base + ROOM_HEIGHT, z + grid.depths[strip]),
            wall=WALLS[(number + k) % len(WALLS)],
            floor=FLOORS[(number + k) % len(FLOORS)],
            ceiling="ceiling",
        )
    return room


def _plan_corridors(grid: _Grid, storey: int) -> list[PlanBox]:
    """The corridor of each wing of a floor."""
    base, depths = storey * STOREY, grid.depths
    corridors = []
    for wing in range((len(depths) + 1) // 2):
        z = _strip_start(2 * wing, depths) + depths[2 * wing] + INNER_WALL
        corridors.append(
            PlanBox(
                name=f"corridor{storey}{chr(97 + wing)}",
                kind="corridor",
                storey=storey,
                low=(0, base, z),
                high=(grid.length - STAIRWELL - INNER_WALL, base + ROOM_HEIGHT, z + CORRIDOR_WIDTH),
                wall="plaster_cream",
                floor="stone",
                ceiling="ceiling",
            )
        )
    return corridors


def _plan_storey(
    plan: Plan, grid: _Grid, storey: int, number: int, rng: np.random.Generator, *, windows: bool
) -> None:
    """Plans one floor: rooms, corridors, doorways, windows."""
    base = storey * STOREY
    room, corridors = _plan_rooms(grid, storey, number), _plan_corridors(grid, storey)
    plan.boxes += [*room.values(), *corridors]

    for (column, strip), box in room.items():
        on_corridor = _door(plan, box, corridors[strip // 2], 2, rng, (1400, 1900))
        east = room.get((column + 1, strip))
        # Corridor doors suffice for access; some rooms also open into the next one.
        if east and (not on_corridor or _past_corridor(east, corridors) or rng.random() < 0.6):
            _door(plan, box, east, 0, rng, (1300, 2000))
        south = room.get((column, strip + 1))
        if south and strip % 2 and rng.random() < 0.7:
            _door(plan, box, south, 2, rng, (1300, 2000))
    for wing, corridor in enumerate(corridors):
        entry_x = corridor.high[0] + INNER_WALL
        entry = PlanBox(
            name=f"stair{chr(97 + wing)}_entry{storey}",
            kind="entry",
            storey=storey,
            low=(entry_x, base, corridor.low[2]),
            high=(entry_x + STAIR_ENTRY, base + ROOM_HEIGHT, corridor.high[2]),
            wall="plaster_cream",
            floor="stone",
            ceiling="ceiling",
        )
        plan.boxes.append(entry)
        _door(plan, corridor, entry, 0, rng, (2400, 2400), height=3000, centred=True)
        if windows and storey:
            _window(plan, corridor, 0, -1, 1, 1800)
    if windows:
        for (_, strip), box in room.items():
            if strip in (0, len(grid.depths) - 1):
                count = max(1, (box.high[0] - box.low[0]) // 3500)
                _window(plan, box, 2, 1 if strip else -1, count, 1400)


def _past_corridor(box: PlanBox, corridors: list[PlanBox]) -> bool:
    """Whether a room lies east of the corridor, so it cannot open into it."""
    least = box.low[0] + 2 * DOOR_MARGIN + 1900
    return all(least > corridor.high[0] for corridor in corridors)


def _door(
    plan: Plan,
    first: PlanBox,
    second: PlanBox,
    axis: int,
    rng: np.random.Generator,
    width: tuple[int, int],
    *,
    height: int = 0,
    centred: bool = False,
) -> bool:
    """A doorway through the wall between two boxes that face each other along ``axis``."""
    if first.low[axis] > second.low[axis]:
        first, second = second, first
    along = 2 - axis
    low = max(first.low[along], second.low[along]) + DOOR_MARGIN
    high = min(first.high[along], second.high[along]) - DOOR_MARGIN
    wide = 100 * int(rng.integers(width[0] // 100, width[1] // 100 + 1))
    tall = height or 100 * int(rng.integers(24, 28))
    if high - low < wide:
        return False
    share = 0.5 if centred else 0.3 + 0.4 * float(rng.random())
    start = low + int((high - low - wide) * share) // 100 * 100
    corner, opposite = [0, first.low[1], 0], [0, first.low[1] + tall, 0]
    corner[axis], opposite[axis] = first.high[axis], second.low[axis]
    corner[along], opposite[along] = start, start + wide
    plan.boxes.append(
        PlanBox(
            name=f"doorway_{first.name}_{second.name}",
            kind="door",
            storey=first.storey,
            low=(corner[0], corner[1], corner[2]),
            high=(opposite[0], opposite[1], opposite[2]),
            wall="wood",
            floor="stone",
            ceiling="wood",
        )
    )
    return True


def _window(
    plan: Plan,
    box: PlanBox,
    axis: int,
    side: int,
    count: int,
    width: int,
    *,
    sill: int = 1000,
    first: int = 1,
) -> None:
    """``count`` windows in the outer wall on one side of a box, ``sill`` mm above its floor."""
    along = 2 - axis
    extent = box.high[along] - box.low[along]
    for k in range(count):
        centre = box.low[along] + extent * (2 * k + 1) // (2 * count) // 50 * 50
        base = box.low[1] + sill
        corner, opposite = [0, base, 0], [0, base + 2200, 0]
        wall = box.high[axis] if side > 0 else box.low[axis] - OUTER_WALL
        corner[axis], opposite[axis] = wall, wall + OUTER_WALL
        corner[along], opposite[along] = centre - width // 2, centre + width // 2
        plan.boxes.append(
            PlanBox(
                name=f"window_{box.name}_{first + k}",
                kind="window",
                storey=box.storey,
                low=(corner[0], corner[1], corner[2]),
                high=(opposite[0], opposite[1], opposite[2]),
                wall="ceiling",
                floor="stone",
                ceiling="ceiling",
            )
        )


def _stairwell(plan: Plan, wing: int, length: int, z: int, windows: bool) -> None:
    """The shaft between the entries of the storeys: one box of air from the ground to the top."""
    shaft = PlanBox(
        name=f"stair{chr(97 + wing)}_shaft",
        kind="shaft",
        storey=0,
        low=(length - STAIR_RUN - STAIR_LANDING, 0, z),
        high=(length, plan.storeys * STOREY - SLAB, z + CORRIDOR_WIDTH),
        wall="plaster_cream",
        floor="stone",
        ceiling="ceiling",
    )
    plan.boxes.append(shaft)
    if windows:  # each slightly above a landing
        for storey in range(max(1, plan.storeys - 1)):
            sill = storey * STOREY + STOREY // 2 + 600 if plan.storeys > 1 else 1000
            _window(plan, shaft, 0, 1, 1, 1800, sill=sill, first=storey + 1)
