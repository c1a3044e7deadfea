"""Buildings with doors that are closed in the model, and what must come of them, as in
`made_buildings`."""

from __future__ import annotations

from tests.cells.buildings import WHOLE, Made, carved, moved
from tests.cells.made_buildings import (
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
from tests.scene.made import box

LEAF = box((5.05, 2, 0), (5.1, 2.9, 2.1))
SHUTTER = carved([A, B], [((5, 2, 0.9), (5.2, 3.2, 2.1))]), box((5.05, 2, 0.9), (5.1, 3.2, 2.1))
ENTRANCE = carved([A, B], [DOORWAY, ((-0.2, 2, 0), (0, 2.9, 2.1))])
AJAR = box((-0.15, 2, 0), (-0.1, 2.9, 2.1))

#: Doors that are closed in the model.
DOORS = {
    "two rooms and a door leaf, by its shape": Made(
        {"building": TWO_ROOMS, "panel": LEAF}, BOTH, sees=("a b",)
    ),
    "two rooms and a door leaf, by its name": Made(
        {"building": TWO_ROOMS, "Zimmertür": LEAF}, BOTH, sees=("a b",)
    ),
    "a door of two leaves": Made(
        {
            "building": carved([A, B], [((5, 1.5, 0), (5.2, 3.3, 2.1))]),
            "Door.L": box((5.05, 1.5, 0), (5.1, 2.4, 2.1)),
            "Door.R": box((5.05, 2.4, 0), (5.1, 3.3, 2.1)),
        },
        BOTH,
        sees=("a b",),
    ),
    "three rooms and two door leaves": Made(
        {
            "building": carved([A, B, C], [DOORWAY, NEXT]),
            "door 1": LEAF,
            "door 2": moved(LEAF, 5.2),
        },
        BOTH | {"c": (13, 2.5, 1.6)},
        sees=("a b", "b c", "a c"),
    ),
    "an entrance that stays shut": Made(
        {"building": carved([A], [((-0.2, 2, 0), (0, 2.9, 2.1))]), "front door": AJAR},
        {"a": IN_A},
        gone=(BEFORE_THE_HOUSE,),
    ),
    "an entrance 1.2 m wide, whose leaf is as large as a wall": Made(
        {
            "building": carved([A], [((-0.2, 2, 0), (0, 3.2, 2.1))]),
            "front door": box((-0.15, 2, 0), (-0.1, 3.2, 2.1)),
        },
        {"a": IN_A},
        gone=(BEFORE_THE_HOUSE,),
    ),
    "an entrance that stays shut, and a door leaf that does not": Made(
        {"building": ENTRANCE, "front door": AJAR, "door": LEAF},
        BOTH,
        sees=("a b",),
        gone=(BEFORE_THE_HOUSE,),
    ),
    "a shutter with a sill is no door": Made(
        dict(zip(("building", "shutter"), SHUTTER, strict=True)), BOTH, blind=("a b",), cut_off=1
    ),
    "a door leaf, and doors are closed": Made(
        {"building": TWO_ROOMS, "door": LEAF},
        BOTH,
        blind=("a b",),
        cut_off=1,
        options=WHOLE | {"doors": "closed"},
    ),
    "a door leaf 1.2 m wide, and doors are closed": Made(
        {
            "building": carved([A, B], [((5, 2, 0), (5.2, 3.2, 2.1))]),
            "door": box((5.05, 2, 0), (5.1, 3.2, 2.1)),
        },
        BOTH,
        blind=("a b",),
        cut_off=1,
        options=WHOLE | {"doors": "closed"},
    ),
    "a door leaf, and doors are hidden": Made(
        {"building": TWO_ROOMS, "door": LEAF},
        BOTH,
        sees=("a b",),
        options=WHOLE | {"doors": "hidden"},
    ),
}
