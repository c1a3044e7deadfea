"""Small buildings with their expected cells, places to stand, and places without.

It follows from the definitions in docs/design/cells.md, and was written down before the first run.
Where these leave something open, nothing is expected.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ptmtools.arrays import Floats
from tests.cells.buildings import (
    AXES,
    WHOLE,
    BuildingCase,
    carved,
    flight,
    moved,
    prism,
    room,
    turned,
)
from tests.scene.buildings import (
    Point,
    box,
    castle,
    divided,
    furnished,
    house,
    inside_out,
    mezzanine,
    sheet,
    turned_in_plan,
)

A, B, C = (room(x, 0, x + 5, 5) for x in (0, 5.2, 10.4))
DOORWAY, NEXT = (((x, 2, 0), (x + 0.2, 2.9, 2.1)) for x in (5, 10.2))
IN_A, IN_B = (2, 2.5, 1.6), (8, 2.5, 1.6)
BOTH = {"a": IN_A, "b": IN_B}
TWO_ROOMS = carved([A, B], [DOORWAY])
BEFORE_THE_HOUSE = (-3, 2.5, 1.6)

ROOMS = {
    "one room": BuildingCase(
        carved([A]),
        {"a": IN_A},
        gone=(BEFORE_THE_HOUSE, (5.1, 2, 1)),
        options={},
        notes=("single hall",),
    ),
    "two rooms with a doorway": BuildingCase(TWO_ROOMS, BOTH, sees=("a b",), options={}),
    "two rooms, 20 m apart: two buildings": BuildingCase(
        np.concatenate([carved([A]), moved(carved([A]), 25)]),
        {"a": IN_A, "b": (27, 2.5, 1.6)},
        gone=((15, 2.5, 1.6),),
        blind=("a b",),
        cut_off=1,
    ),
    "a bathroom of 0.9 × 1.2 m behind a doorway of 60 cm": BuildingCase(
        carved([A, room(5.2, 0, 6.1, 1.2)], [((5, 0.3, 0), (5.2, 0.9, 2))]),
        {"a": IN_A, "bath": (5.65, 0.6, 1.6)},
        sees=("a bath",),
    ),
    "a thin partition without a door, too wide to be one": BuildingCase(
        {"building": carved([room(0, 0, 10.2, 5)]), "screen": box((5, 0, 0), (5.05, 5, 2.8))},
        BOTH,
        blind=("a b",),
        cut_off=1,
    ),
    "a hall with twelve ornaments: columns, pilasters, mouldings": BuildingCase(
        carved(
            [room(0, 0, 12, 8, high=5)],
            solids=[((x, y, 0), (x + 0.4, y + 0.4, 5)) for x in (3, 8.6) for y in (2, 5.6)]
            + [((5.8, y, 0), (6.2, y + 0.2, 5)) for y in (0, 7.8)]
            + [((x, 3.8, 0), (x + 0.2, 4.2, 5)) for x in (0, 11.8)]
            + [((0, y, 4.6), (12, y + 0.25, 4.9)) for y in (0, 7.75)]
            + [((x, 0.25, 4.6), (x + 0.25, 7.75, 4.9)) for x in (0, 11.75)],
            wall=0.3,
        ),
        {"middle": (6, 4, 1.6), "corner": (1, 1, 1.6), "far": (11, 7, 1.6)},
        rooms=("middle corner far",),
        options={},
    ),
    "a column of 1.2 m that stands on the floor": BuildingCase(
        {"hall": carved([room(0, 0, 8, 8)]), "column": box((3.4, 3.4, 0), (4.6, 4.6, 2.8))},
        {"here": (1, 1, 1.6), "behind": (7, 7, 1.6)},
        rooms=("here behind",),
        gone=((4, 4, 1.4),),
        options={},
    ),
    "a beam under the ceiling": BuildingCase(
        carved([room(0, 0, 8, 5)], solids=[((3.8, 0, 2.4), (4.2, 5, 2.8))]),
        {"here": (1, 2.5, 1.6), "under": (4, 2.5, 1.6), "there": (7, 2.5, 1.6)},
        rooms=("here under there",),
        options={},
    ),
    "a corridor with eight doors": BuildingCase(
        carved(
            [room(0, 0, 16, 2)]
            + [room(4 * i + 0.1, y, 4 * i + 3.9, y + 4) for i in range(4) for y in (2.2, -4.2)],
            [
                ((4 * i + 1.5, y, 0), (4 * i + 2.4, y + 0.2, 2.1))
                for i in range(4)
                for y in (2, -0.2)
            ],
        ),
        {"corridor": (8, 1, 1.6)}
        | {f"n{i}": (4 * i + 2, 4, 1.6) for i in range(4)}
        | {f"s{i}": (4 * i + 2, -2, 1.6) for i in range(4)},
        sees=("corridor n0", "corridor n3", "corridor s1", "n0 s0", "n2 s2"),
        blind=("n0 n1", "n0 n3", "s1 s2"),
    ),
    "a courtyard open above between two rooms": BuildingCase(
        carved(
            [A, room(11.2, 0, 16.2, 5)],
            [room(5.2, 0, 11, 5, high=4), DOORWAY, ((11, 2, 0), (11.2, 2.9, 2.1))],
        ),
        {"a": IN_A, "yard": (8, 1, 1.6), "b": (14, 2.5, 1.6)},
        sees=("a yard", "yard b", "a b"),
        closed=False,
        notes=("open",),
    ),
    "a room with a window to the outside": BuildingCase(
        carved([A], [((-0.2, 2, 0.9), (0, 3.2, 2.1))]),
        {"a": IN_A},
        seen={(-0.1, 2.6, 1.5): "a"},
        closed=False,
        notes=("open",),
    ),
    "a room on ground that is a block 6 m thick": BuildingCase(
        {"ground": box((-10, -10, -6), (15, 15, -0.2)), "building": carved([A])},
        {"a": IN_A},
        gone=((2, 2.5, -3), (-5, -5, -3), BEFORE_THE_HOUSE),
    ),
    "a doorway and a window through a wall 80 cm thick": BuildingCase(
        carved(
            [A, room(5.8, 0, 10.8, 5)],
            [((5, y, low), (5.8, y + 0.9, 2.1)) for y, low in ((1, 0), (3.5, 0.9))],
        ),
        BOTH,
        seen={(5.4, 3.9, 1.5): None},
        gone=((5.4, 2.5, 1.5),),
        sees=("a b",),
        options=WHOLE | {"wall_thickness": 1.0},
    ),
    "a tent": BuildingCase(
        prism([(0, 0), (4, 0), (2, 3)], 0, 5), {"inside": (2, 2.5, 1.6)}, gone=((0.2, 2.5, 2),)
    ),
    "a floor and nothing else": BuildingCase(
        sheet((0, 0, 0), (10, 0, 0), (10, 8, 0), (0, 8, 0)), {"above": (5, 4, 0.05)}, closed=False
    ),
}

UPSTAIRS = room(0, 0, 8, 5, 3.1, 5.9)
STOREYS = {"lower": (4, 3.5, 1.6), "upper": (4, 3.5, 4.7)}
#: A well 1.6 m wide, seen through a window; its bottom is what differs. Nobody fits below that.
WELL = carved([A, room(5.2, 0, 6.8, 5, -2, 4)], [((5, 1.5, 0.9), (5.2, 3.5, 2.1))])


def sloping(degrees: float) -> Floats:
    end = -2 + 1.6 * np.tan(np.radians(degrees))
    return prism([(5.2, -2), (6.8, -2), (6.8, end)], 0, 5)


HEIGHTS = {
    "two floors without a stair": BuildingCase(
        carved([room(0, 0, 8, 5), UPSTAIRS]), STOREYS, blind=("lower upper",), cut_off=1
    ),
    "two floors with a stair": BuildingCase(
        {
            "building": carved([room(0, 0, 8, 5), UPSTAIRS], [((2, 0, 2.8), (5.4, 1.2, 3.1))]),
            "stair": flight((1.08, 5.4), (0, 1.2), 0, 3.1 / 17, 16),
        },
        STOREYS | {"stair": (2.5, 0.6, 2.69)},
        rooms=("lower", "upper"),
        more=True,
        sees=("lower upper",),
    ),
    "a stair with a landing, in a well between two floors": BuildingCase(
        {
            "building": carved(
                [room(0, 0, 2.4, 5, 0, 5.9), room(2.6, 0, 8, 5), room(2.6, 0, 8, 5, 3.1, 5.9)],
                [((2.4, 0.2, z), (2.6, 1.1, z + 2.1)) for z in (0, 3.1)],
                [((0, 3.6, 1.35), (2.4, 5, 1.55)), ((1.2, 0, 2.9), (2.4, 1.17, 3.1))],
            ),
            "up": turned(flight((1.17, 3.6), (0, 1.2), 0, 0.155, 9)),
            "further up": turned(flight((3.6, 1.17), (1.2, 2.4), 1.55, 0.155, 9)),
        },
        {"lower": (5, 3, 1.6), "upper": (5, 3, 4.7), "landing": (1.2, 4.3, 3.15)},
        rooms=("lower", "upper", "landing"),
        more=True,
        blind=("lower upper",),
    ),
    "a gallery round a void over two storeys": BuildingCase(
        carved([room(0, 0, 10, 8), room(0, 0, 10, 8, 3.1, 5.9)], [((3.5, 2, 2.8), (6.5, 6, 3.1))]),
        {"lower": (1, 1, 1.6), "upper": (1, 1, 4.7)},
        sees=("lower upper",),
    ),
    "a hall with a mezzanine, and no stair": BuildingCase(
        mezzanine(),
        {"hall": (9, 4, 1.6), "below": (2, 4, 1.6), "loft": (2, 4, 4.6)},
        rooms=(),
        more=True,
        sees=("hall below", "hall loft"),
    ),
    "a ramp of 1 in 6": BuildingCase(
        {
            "building": carved([room(0, 0, 14, 2, high=3.6)], solids=[((10, 0, 0), (14, 2, 1))]),
            "ramp": prism([(4, 0), (10, 0), (10, 1)], 0, 2),
        },
        {"low": (2, 1, 1.6), "ramp": (7, 1, 2.1), "high": (12, 1, 2.6)},
        rooms=("low ramp high",),
    ),
    "a bottom sloping by 40° is a place": BuildingCase(
        {"building": WELL, "bottom": sloping(40)},
        {"a": IN_A, "well": (6, 2.5, 0.27)},
        sees=("a well",),
    ),
    "a bottom sloping by 50° is none": BuildingCase(
        {"building": WELL, "bottom": sloping(50)}, {"a": IN_A}, seen={(6, 2.5, 0.55): None}
    ),
    "the treads of a stair of 48° are places": BuildingCase(
        {"building": WELL, "stair": flight((5.2, 6.8), (0, 5), -2, 0.22, 8, -2)},
        {"a": IN_A, "stair": (6.05, 2.5, 0.7)},
        more=True,
        sees=("a stair",),
    ),
    "a pit of 1 × 2 m, 1.5 m deep": BuildingCase(
        carved([A, ((2, 2, -1.5), (3, 4, 0))]),
        {"a": (1, 1, 1.6), "pit": (2.5, 3, -0.5)},
        rooms=("a pit",),
    ),
    "a hole in the floor of 40 cm": BuildingCase(
        carved([A, ((2, 2, -1), (2.4, 2.4, 0))]), {"a": (1, 1, 1.6)}, seen={(2.2, 2.2, -0.5): "a"}
    ),
}

#: A wall of 45 cm with a hollow of 20 cm in it.
HOLLOW = room(5.12, 0, 5.32, 1.85), room(5.12, 3.05, 5.32, 5)
CAVITY = [A, room(5.45, 0, 10.45, 5), *HOLLOW]
THROUGH = (5, 2, 0), (5.45, 2.9, 2.1)
#: A ceiling of 5 cm under a plenum.
PLENUM = [room(0, 0, 6, 5, 0, 2.6), room(0, 0, 6, 5, 2.65, 3.2)]
LAMPS = [((x, x, 2.6), (x + 0.6, x + 0.6, 2.65)) for x in (1.2, 3.6)]
TUNNEL = carved([A, room(11, 0, 16, 5)], [((5, 2, 0), (11, 3, 1.4))])
#: Behind the room's wall a gap, and behind that another.
GAPS = [room(0, 0, 6, 5), room(6.2, 0, 6.5, 5), room(6.7, 0, 7, 5)]
CHINKS = [((6, 0.1, 1), (6.2, 0.3, 1.2)), ((6.5, 4.7, 1), (6.7, 4.9, 1.2))]
GAP_BEHIND_GAP = carved(GAPS, CHINKS)

NO_PLACES = {
    "a shaft of 40 cm": BuildingCase(
        carved([A, room(5.2, 0, 5.6, 0.4)]), {"a": IN_A}, gone=((5.4, 0.2, 1.4),)
    ),
    "a lift shaft, in which one can stand": BuildingCase(
        carved([room(0, 0, 5, 5, high=5.6), room(5.2, 0, 6.8, 1.6, high=5.6)]),
        {"a": IN_A, "shaft": (6, 0.8, 1.6)},
        blind=("a shaft",),
        cut_off=1,
    ),
    "a wall with a hollow": BuildingCase(
        carved(CAVITY, [THROUGH]), BOTH, gone=((5.22, 1, 1.4), (5.22, 4, 1.4)), sees=("a b",)
    ),
    "a wall with a hollow that is seen through a hole of 10 cm": BuildingCase(
        carved(CAVITY, [THROUGH, ((5, 1, 1.2), (5.12, 1.1, 1.3))]),
        BOTH,
        seen={(5.22, 1.05, 1.25): None},
        gone=((5.22, 4, 1.4),),
        sees=("a b",),
    ),
    "a gap behind a gap, which can be reached but is not seen": BuildingCase(
        GAP_BEHIND_GAP,
        {"a": IN_A},
        seen={(6.35, 0.2, 1.1): None},
        gone=((6.85, 2.5, 1.4),),
    ),
    "a suspended ceiling": BuildingCase(carved(PLENUM), {"room": IN_A}, gone=((3, 2.5, 3),)),
    "a suspended ceiling with openings for lamps": BuildingCase(
        carved(PLENUM, LAMPS), {"room": IN_A}, seen={(1.5, 1.5, 3): None}
    ),
    "a plenum over three rooms, open to each at a lamp": BuildingCase(
        carved(
            [A, B, C, room(0, 0, 15.4, 5, 2.85, 3.4)],
            [DOORWAY, NEXT] + [((x, 1, 2.8), (x + 0.6, 1.6, 2.85)) for x in (1, 6, 11)],
        ),
        BOTH | {"c": (13, 2.5, 1.6)},
        seen={(x + 0.3, 1.3, 3.1): None for x in (1, 6, 11)},
        sees=("a b", "b c"),
    ),
    "a raised floor": BuildingCase(
        carved([A, room(0, 0, 5, 5, -0.5, -0.1)]), {"a": IN_A}, gone=((2, 2, -0.3),)
    ),
    "a crawl space 1.2 m high, open to the room": BuildingCase(
        carved([room(0, 0, 6, 6), room(6.2, 0, 10, 6, 0, 1.2)], [((6, 2, 0), (6.2, 4, 1.2))]),
        {"room": IN_A},
        seen={(8, 2.5, 0.6): None},
    ),
    "a tunnel 1.4 m high between two rooms": BuildingCase(
        TUNNEL,
        {"a": IN_A, "b": (14, 2.5, 1.6)},
        seen={(8, 2.5, 0.7): None},
        sees=("a b",),
    ),
    "the tunnel, for a visitor 1.3 m tall": BuildingCase(
        TUNNEL,
        {"a": IN_A, "tunnel": (8, 2.5, 0.7), "b": (14, 2.5, 1.6)},
        rooms=("a", "b"),
        more=True,
        sees=("a tunnel", "tunnel b"),
        options=WHOLE | {"walker": (0.25, 0.4, 1.3)},
    ),
    "a niche 20 cm deep": BuildingCase(
        carved([room(0, 0, 6, 5)], [((6, 2, 0.8), (6.2, 2.6, 1.8))], wall=0.4),
        {"a": IN_A},
        seen={(6.1, 2.3, 1.3): "a"},
    ),
    "a window between two rooms, with a sill 40 cm deep": BuildingCase(
        carved([A, room(5.4, 0, 10.4, 5)], [((5, 2, 0.9), (5.4, 3.2, 2.1))]),
        BOTH,
        seen={(5.2, 2.6, 1.5): None},
        sees=("a b",),
    ),
    "a niche in a wall 80 cm thick": BuildingCase(
        carved([room(0, 0, 6, 5)], [((6, 2, 0.8), (6.2, 2.6, 1.8))], wall=0.8),
        {"a": IN_A},
        seen={(6.1, 2.3, 1.3): "a"},
    ),
    "a fireplace and its flue": BuildingCase(
        carved(
            [room(0, 0, 5, 5, high=5.5), ((5.05, 2.3, 0.8), (5.3, 2.7, 5.5))],
            [((5, 2, 0), (5.3, 3, 0.8))],
        ),
        {"a": IN_A},
        seen={(5.15, 2.5, 0.4): "a", (5.15, 2.5, 1.2): "a"},
    ),
    "a platform 2 m high along three walls": BuildingCase(
        {"hall": carved([room(0, 0, 8, 5, high=5)]), "platform": box((0, 0, 0), (3, 5, 2))},
        {"hall": (6, 3, 1.6), "platform": (1, 1, 3.6)},
        rooms=(),
        more=True,
        gone=((1, 1, 1),),
        sees=("hall platform",),
    ),
    "a wardrobe in the corner": BuildingCase(
        {"room": carved([A]), "wardrobe": box((0, 0, 0), (2, 2, 2.2))},
        {"a": (3, 3, 1.6)},
        gone=((1, 1, 1),),
    ),
}

#: Of the house of five rooms, whose front door is open.
FIVE = {"sw": (3, 2.5, 1.6), "nw": (3, 8.5, 1.6), "hall": (10, 5, 1.6)}
FIVE |= {"se": (16, 3, 1.6), "ne": (16, 9, 1.6)}


TURNED = {eye: tuple(turned_in_plan(np.array(at), 30).tolist()) for eye, at in FIVE.items()}


def five(model: Floats, eyes: dict[str, Point] = FIVE, **more: Any) -> BuildingCase:
    fixed = {"sees": ("sw nw", "sw hall", "hall ne", "se ne"), "blind": ("nw ne",)}
    return BuildingCase(model, eyes, closed=False, **fixed | {"notes": ("open",)} | more)


HALL = carved([room(0, 0, 10.2, 5)])
SCREEN = sheet((5, 0, 0), (5, 5, 0), (5, 5, 2.8), (5, 0, 2.8))

MODELS = {
    "a house": five(house(), ingest={}),
    "in map coordinates": five(house(), ingest={}, offset=(500_000, 5_400_000, 250)),
    "in inches": five(house(), ingest={}, scale=1 / 0.0254),
    "a lying GLB, set upright": five(house(), ingest={"up": "z"}, file="model.glb"),
    "turned by 30°": five(turned_in_plan(house(), 30), eyes=TURNED, more=True),
    "of 3,840 triangles": five(divided(house())),
    "with tables": five(furnished(house())),
    "without a floor": five(house(floor=False), notes=("open", "no floor")),
    "two rooms between walls 1.8 m thick": BuildingCase(
        castle(2),
        {"a": (4, 5, 1.6), "b": (11, 5, 1.6)},
        gone=((0.9, 5, 1.6), (7.7, 5, 1.6)),
        blind=("a b",),
        cut_off=1,
    ),
    "rooms whose faces have no backs": BuildingCase(TWO_ROOMS, BOTH, sees=("a b",), backs=False),
    "a sheet without a back blocks from both sides": BuildingCase(
        {"building": HALL, "screen": SCREEN}, BOTH, blind=("a b",), cut_off=1, backs=False
    ),
    "a cube": BuildingCase(box((0, 0, 0), (3, 3, 3)), {"inside": (1.5, 1.5, 1.6)}),
    "a room inside out, drawn from both sides": BuildingCase(
        inside_out(carved([A])), {"a": IN_A}, file="model.glb", ingest=AXES | {"two_sided": True}
    ),
}

#: Faces without backs, all of them turned away from whoever could stand there.
EMPTY = {
    "a cube seen from outside": BuildingCase(box((0, 0, 0), (3, 3, 3)), {}, backs=False),
    "a room inside out": BuildingCase(inside_out(carved([A])), {}, file="model.glb"),
    "a house inside out": BuildingCase(inside_out(house()), {}, file="model.glb"),
}
