"""Which axis of a model is up, and what its unit is: judged together, by several signs.

A reading is an up axis and a unit. A storey of 3 m says as much of the one as of the other, so each
axis is tried with each unit. What a model looks like in a reading (`signs`) costs the more the less
usual it is for a building; the costs are added, and the cheapest reading is the likeliest.

Tried and rejected: the share of level area and the flatness of the box alone. A house of walls
without floors, 19 × 11.4 × 3 m, is then laid on its side: its walls are all the level area there
is. That walls go in two directions tells it from a building with floors and no walls on two sides.
How alike free heights are says little by itself (25 % of the height upright and 59 % lying in the
gallery); that they are lower than rooms are wide says more than the same of the whole building: it
holds in towers.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from ptmtools.scene.signs import Look, Up

#: Metres in one unit, in the order of preference where two are equally plausible.
UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
#: What a unit costs beforehand.
PRIOR = {"m": 0.0, "cm": 0.1, "mm": 0.1, "in": 0.5, "ft": 0.5}
#: Heights of buildings in metres: below the first nobody can stand; above the second it has
#: several storeys, which is less usual and not impossible.
HEIGHTS = (2.0, 15.0)
#: Widths of buildings, and free heights of their rooms, in metres.
WIDTHS, ROOMS = (3.0, 500.0), (2.2, 6.0)
#: A model lower than this share of the width of its rooms is a plan, and nobody lives in it.
FLAT = 0.003
#: The height of a door in metres, and the share by which doors differ.
DOOR, DOORS_DIFFER = 2.1, 0.2
#: What is out of all proportion costs this, so that the other signs still decide on the axis.
_MOST = 10.0
#: A reading that costs less than this more is close to the cheapest: with another axis, or with
#: another unit.
CLOSE_AXIS, CLOSE_UNIT = 0.5, 0.4
#: A format that says which axis is up is doubted where the other axis costs this much less: more
#: than a corridor or a cube that is right may be cheaper lying on its side.
DOUBT_AXIS = 0.35
#: A sign that costs another reading this much more is named as a reason.
_TELLING = 0.1


@dataclass(frozen=True)
class Reading:
    """A model with one axis up and in one unit.

    Attributes
    ----------
    up, metres: the axis, and how long the unit is.
    unit: its name; "" if it has none.
    look: the model with this axis up, in units.
    costs: how unusual a building it would be, by sign; the signs in words for which a reading that
        costs less is praised.
    """

    up: Up
    metres: float
    unit: str
    look: Look
    costs: Mapping[str, float]

    @property
    def cost(self) -> float:
        """How unusual a building it would be; 0 at the best."""
        return sum(self.costs.values())

    @property
    def flat(self) -> bool:
        """Whether it is a plan rather than a building."""
        return self.look.height <= FLAT * self.look.built

    @property
    def size(self) -> str:
        """Its size in words."""
        look, metres = self.look, self.metres
        width, height = look.width * metres, look.height * metres
        rooms = f", free height mostly {look.room * metres:.3g} m" if look.room else ""
        return f"{width:.3g} m wide and {height:.3g} m high{rooms}"

    def reasons(self, other: Reading) -> list[str]:
        """What speaks for it rather than for the other, the weightiest first."""
        gain = {words: other.costs[words] - cost for words, cost in self.costs.items()}
        telling = [words for words in gain if gain[words] >= _TELLING]
        return sorted(telling, key=lambda words: -gain[words])


def readings(looks: Mapping[Up, Look], metres: float | None = None) -> list[Reading]:
    """The readings of a model that looks like this with each axis up, the likeliest first, in every
    unit or in the one that is known."""
    names = {each: name for name, each in UNITS.items()}
    units = UNITS if metres is None else {names.get(metres, ""): metres}
    found = [
        Reading(up, each, unit, look, _costs(look, looks[_OTHER[up]], unit, each))
        for up, look in looks.items()
        for unit, each in units.items()
    ]
    # Rounded, so that the last digits of coordinates decide nothing between equals.
    return sorted(found, key=lambda reading: round(reading.cost, 6))


_OTHER: dict[Up, Up] = {"y": "z", "z": "y"}


def _costs(look: Look, other: Look, unit: str, metres: float) -> dict[str, float]:
    level = look.level + other.level
    # Where nothing lies over anything, there are no rooms to compare.
    rooms = _higher(look.room, other.room) if look.room and other.room else 0.5
    return {
        "more level faces": 1 - look.level / level if level else 0.5,
        "wider than high": 0.75 * _higher(look.height, other.height),
        "rooms wider than high": 1.5 * rooms,
        "walls in two directions": 1.5 * (1 - look.crossed),
        "fewer slanting faces": 1 - look.upright,
        "rooms of one height": 1 - look.alike,
        "faces lie and stand as they are called": 2 * (1 - look.named),
        "a usual size": _of_size(look, metres),
        "rooms of a usual height": look.alike * _of_room(look.room * metres),
        "doors of a usual height": _of_door(look.door * metres),
        "a usual unit": PRIOR.get(unit, 0.0),
    }


def _higher(height: float, other: float) -> float:
    """How much greater one length is than another: 1 from four times on, 0 the other way round."""
    if not height > 0 or not other > 0:
        return 0.5 + ((height > 0) - (other > 0)) / 2
    return 0.5 + max(-2.0, min(2.0, _orders(height, other) / math.log(2))) / 4


def _of_size(look: Look, metres: float) -> float:
    # In units of the model, so that no length becomes 0 in metres.
    cost = 0.0
    if look.width > 0:
        narrow, wide = WIDTHS[0] / metres, WIDTHS[1] / metres
        too = max(0.0, _orders(narrow, look.width), _orders(look.built, wide))
        cost += min(_MOST, 2 * too)
    if look.height > FLAT * look.built:
        low, high = HEIGHTS[0] / metres, HEIGHTS[1] / metres
        too = max(0.0, min(3.0, 4 * _orders(low, look.height)), 0.25 * _orders(look.height, high))
        cost += min(_MOST, too)
    return cost


def _of_room(height: float) -> float:
    if not height > 0:
        return 0.0
    return min(2.0, max(0.0, 4 * _orders(ROOMS[0], height), _orders(height, ROOMS[1])))


def _of_door(height: float) -> float:
    if not height > 0:
        return 0.0
    return min(1.5, 3 * max(0.0, abs(_orders(height, DOOR)) - DOORS_DIFFER))


def _orders(a: float, b: float) -> float:
    """The logarithm of a / b, which itself may be too small or too large for a number."""
    return math.log(a) - math.log(b)
