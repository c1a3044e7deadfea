"""Buildings with closed doors in the model and their expectations, as in `small_buildings`."""

from __future__ import annotations

from tests.cells.buildings import WHOLE, BuildingCase, carved, moved
from tests.cells.small_buildings import (
    BEFORE_THE_HOUSE,
    BOTH,
    DOORWAY,
    IN_A,
    NEXT,
    TWO_ROOMS,
    A,
    B,
    C,
)
from tests.scene.buildings import box

LEAF = box((5.05, 2, 0), (5.1, 2.9, 2.1))
SHUTTER = carved([A, B], [((5, 2, 0.9), (5.2, 3.2, 2.1))]), box((5.05, 2, 0.9), (5.1, 3.2, 2.1))
ENTRANCE = carved([A, B], [DOORWAY, ((-0.2, 2, 0), (0, 2.9, 2.1))])
AJAR = box((-0.15, 2, 0), (-0.1, 2.9, 2.1))

#: Doors that are closed in the model.
DOORS = {
    "two rooms and a door leaf, by its shape": BuildingCase(
        {"building": TWO_ROOMS, "panel": LEAF}, BOTH, sees=("a b",)
    ),
    "two rooms and a door leaf, by its name": BuildingCase(
        {"building": TWO_ROOMS, "Zimmertür": LEAF}, BOTH, sees=("a b",)
    ),
    "a door of two leaves": BuildingCase(
        {
            "building": carved([A, B], [((5, 1.5, 0), (5.2, 3.3, 2.1))]),
            "Door.L": box((5.05, 1.5, 0), (5.1, 2.4, 2.1)),
            "Door.R": box((5.05, 2.4, 0), (5.1, 3.3, 2.1)),
        },
        BOTH,
        sees=("a b",),
    ),
    "three rooms and two door leaves": BuildingCase(
        {
            "building": carved([A, B, C], [DOORWAY, NEXT]),
            "door 1": LEAF,
            "door 2": moved(LEAF, 5.2),
        },
        BOTH | {"c": (13, 2.5, 1.6)},
        sees=("a b", "b c", "a c"),
    ),
    "an entrance that stays shut": BuildingCase(
        {"building": carved([A], [((-0.2, 2, 0), (0, 2.9, 2.1))]), "front door": AJAR},
        {"a": IN_A},
        gone=(BEFORE_THE_HOUSE,),
    ),
    "an entrance 1.2 m wide, whose leaf is as large as a wall": BuildingCase(
        {
            "building": carved([A], [((-0.2, 2, 0), (0, 3.2, 2.1))]),
            "front door": box((-0.15, 2, 0), (-0.1, 3.2, 2.1)),
        },
        {"a": IN_A},
        gone=(BEFORE_THE_HOUSE,),
    ),
    "an entrance that stays shut, and a door leaf that does not": BuildingCase(
        {"building": ENTRANCE, "front door": AJAR, "door": LEAF},
        BOTH,
        sees=("a b",),
        gone=(BEFORE_THE_HOUSE,),
    ),
    "a shutter with a sill is no door": BuildingCase(
        dict(zip(("building", "shutter"), SHUTTER, strict=True)), BOTH, blind=("a b",), cut_off=1
    ),
    "a door leaf, and doors are closed": BuildingCase(
        {"building": TWO_ROOMS, "door": LEAF},
        BOTH,
        blind=("a b",),
        cut_off=1,
        options=WHOLE | {"doors": "closed"},
    ),
    "a door leaf 1.2 m wide, and doors are closed": BuildingCase(
        {
            "building": carved([A, B], [((5, 2, 0), (5.2, 3.2, 2.1))]),
            "door": box((5.05, 2, 0), (5.1, 3.2, 2.1)),
        },
        BOTH,
        blind=("a b",),
        cut_off=1,
        options=WHOLE | {"doors": "closed"},
    ),
    "a door leaf, and doors are hidden": BuildingCase(
        {"building": TWO_ROOMS, "door": LEAF},
        BOTH,
        sees=("a b",),
        options=WHOLE | {"doors": "hidden"},
    ),
}
