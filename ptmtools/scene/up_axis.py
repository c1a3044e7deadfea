"""Which axis of a model is up, and what its unit is: judged together, by several signs.

A reading is an up axis and a unit. A storey of 3 m says as much of the one as of the other, so each
axis is tried with each unit. What a model looks like in a reading (`signs`) costs the more the less
usual it is for a building; the costs are added, and the cheapest reading is the likeliest.

Tried and rejected: the share of level area and the flatness of the box alone. A house of walls
without floors, 19 × 11.4 × 3 m, is then laid on its side: its walls are all the level area there
is. That walls go in two directions tells it from a building with floors and no walls on two sides.
How alike free heights are says little by itself (25 % of the height upright and 59 % lying in the
gallery); that they are lower than rooms are wide says more than the same of the whole building: it
holds in towers. Comparing the free height that most space has, instead of the median by space: in
an atrium with arcades whose outer walls are hollow from the ground to the roof, the hollow is the
commonest height, 13.6 m, and outweighs the arcades.

What a model looks like with one or the other of its axes up: the signs by which `space` judges.

Each is a share or a length that holds in any unit, wherever the model lies, and however finely its
walls are divided: areas, and what sample lines cross. No sign is certain, and each has buildings
that lack it: walls without floors, a hall of one room, a tower."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.scene.facing import Crossings, SampleLines

Up = Literal["y", "z"]
AXES: dict[Up, int] = {"y": 1, "z": 2}

#: Faces whose normal is within 8 degrees of an axis are level, and those whose normal is within 3
#: degrees of being square to it stand upright.
_LEVEL, _UPRIGHT = 0.99, 0.05
#: Free heights within a tenth of one another are the same.
_SAME = 0.1
#: What names of objects and materials say of their faces: words, or how a word begins.
_LEVEL_NAMES = ("floor", "ceiling", "slab", "boden", "decke", "plafond", "suelo", "pavimento")
_UPRIGHT_NAMES = ("wall", "wand", "mur", "pared", "parete")
_DOOR_NAMES = ("door", "tür", "tuer", "porte", "puerta", "porta")
#: So many doors tell how high doors are.
_DOORS = 64
#: Names say something if their faces are at least this share of the model.
_NAMED = 0.05


@dataclass(frozen=True)
class Named:
    """The names in a model: (T,) whose triangles are called level, upright, and the door leaves."""

    level: Bools
    upright: Bools
    doors: tuple[NDArray[np.int64], ...] = ()

    @staticmethod
    def of(
        objects: tuple[Sequence[str], NDArray[np.integer]],
        materials: tuple[Sequence[str], NDArray[np.integer]],
    ) -> Named:
        """Of the names of objects and of materials, each with (T,) which of them a triangle has."""

        def called(words: tuple[str, ...]) -> Bools:
            one, other = (
                np.array([_says(name, words) for name in names], dtype=bool)[index]
                for names, index in (objects, materials)
            )
            return np.asarray(one | other)

        names, index = objects
        doors = [i for i, name in enumerate(names) if _says(name, _DOOR_NAMES)]
        leaves = tuple(np.flatnonzero(index == i) for i in doors[:_DOORS])
        return Named(
            called(_LEVEL_NAMES),
            called(_UPRIGHT_NAMES),
            tuple(each for each in leaves if len(each)),
        )


def _says(name: str, words: tuple[str, ...]) -> bool:
    spaced = re.sub(r"(?<=[a-zäöüß])(?=[A-Z])", " ", name)
    return any(part.startswith(words) for part in re.findall(r"[^\W\d_]+", spaced.lower()))


@dataclass(frozen=True)
class Look:
    """What a model looks like with one axis up; lengths in units of the model.

    Attributes
    ----------
    width, height: of the bounding box, the greater of its level sides first.
    built: the width of what has rooms, without the ground around it; all of it if nothing has.
    room: the free height that most space has; 0 if nothing lies over anything.
    alike: how much of the height rooms of this height take up, on average.
    median: half of the space has at most this free height; 0 if nothing lies over anything.
    level: area of level faces, as a share of all.
    upright: area of level and of upright faces, as a share of all.
    crossed: how far walls go in two directions: 0 if all are parallel, 1 if as many are square to
        them.
    named: the share of the area with telling names that lies or stands as they say; 1 without.
    door: height of a door leaf, the median; 0 if none is named.
    """

    width: float
    height: float
    built: float
    room: float
    alike: float
    median: float
    level: float
    upright: float
    crossed: float
    named: float
    door: float


def looks(points: Floats, triangles: NDArray[np.integer], named: Named) -> dict[Up, Look]:
    """How (T, 3) triangles over (V, 3) finite points look with each axis up."""
    side = np.ptp(points, axis=0)
    scale = float(side.max()) or 1.0
    local = (points - points.min(axis=0)) / scale
    lines = SampleLines(local, triangles)
    crossed = [lines.along(axis) for axis in range(3)]
    face, normal, area = _faces(local, triangles, crossed)
    level, upright = named.level[face], named.upright[face]
    telling = float(area @ (level | upright))
    total = float(area.sum()) or 1.0
    found: dict[Up, Look] = {}
    for up, axis in AXES.items():
        u, v = (k for k in range(3) if k != axis)
        slope = np.abs(normal[:, axis])
        lies, stands = slope > _LEVEL, slope < _UPRIGHT
        wall = area * stands
        room, alike, median = _free_height(crossed[axis], float(side[axis]) / scale)
        width = float(side[[u, v]].max())
        as_called = float(area @ ((level & lies) | (upright & stands)))
        doors = [np.ptp(local[triangles[each], axis]) for each in named.doors]
        found[up] = Look(
            width=width,
            height=float(side[axis]),
            built=_built(lines, crossed[axis], axis, room) * scale or width,
            room=room * scale,
            alike=alike,
            median=median * scale,
            level=float(area @ lies) / total,
            upright=float(area @ (lies | stands)) / total,
            crossed=_least_of_greatest(
                *(float(wall @ (normal[:, i] * normal[:, j])) for i, j in ((u, u), (v, v), (u, v)))
            ),
            named=as_called / telling if telling > _NAMED * total else 1.0,
            door=float(np.median(doors)) * scale if doors else 0.0,
        )
    return found


def _faces(
    points: Floats, triangles: NDArray[np.integer], crossed: Sequence[Crossings]
) -> tuple[Ints, Floats, Floats]:
    """The faces as the lines along the three axes meet them: (n,) triangles, (n, 3) their unit
    normals, and the area that each stands for. Each face is seen along the axis that it is most
    square to."""
    found = []
    for axis, each in enumerate(crossed):
        a, b, c = np.moveaxis(points[triangles[each.triangle]], 1, 0)
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        squarest = np.abs(normal).argmax(axis=1) == axis
        normal = normal[squarest]
        area = each.section[squarest] / np.abs(normal[:, axis])
        found.append((each.triangle[squarest], normal, area))
    face, normals, areas = zip(*found, strict=True)
    return np.concatenate(face), np.concatenate(normals), np.concatenate(areas)


def _least_of_greatest(a: float, b: float, mixed: float) -> float:
    """The ratio of the eigenvalues of [[a, mixed], [mixed, b]], positive semidefinite."""
    mean, apart = (a + b) / 2, np.hypot((a - b) / 2, mixed)
    return max(0.0, float((mean - apart) / (mean + apart))) if mean > 0 else 0.0


def _built(lines: SampleLines, crossed: Crossings, axis: int, room: float) -> float:
    """The width of what has rooms: of where the lines stand that cross one of this height or, at
    least, half of it, which the ground beside a building has not under it."""
    before, gaps = crossed.gaps()
    u, v = (lines.rows(k) for k in range(3) if k != axis)
    at = np.divmod(np.unique(crossed.line[before[gaps >= room / 2]]), len(v))
    return max(float(np.ptp(row[i])) if len(i) else 0.0 for row, i in zip((u, v), at, strict=True))


def _free_height(crossed: Crossings, height: float) -> tuple[float, float, float]:
    """The free height that most space has; how much of the height of the model it takes up, on
    average over the lines that cross it twice; and the median of all free heights, by space."""
    before, gaps = crossed.gaps()
    if not len(gaps) or not height > 0:
        return 0.0, 0.0, 0.0
    lines = len(np.unique(crossed.line[before]))
    gaps = np.sort(gaps)
    reach = np.concatenate([[0.0], np.cumsum(gaps)])
    end = np.searchsorted(gaps, gaps * (1 + _SAME), "right")
    space = reach[end] - reach[:-1]
    most = int(space.argmax())
    median = gaps[np.searchsorted(reach[1:], reach[-1] / 2)]
    room, share = space[most] / (end[most] - most), space[most] / (lines * height)
    return float(room), float(share), float(median)


#: Metres in one unit, in the order of preference where two are equally plausible.
UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
#: What a unit costs beforehand.
PRIOR = {"m": 0.0, "cm": 0.1, "mm": 0.1, "in": 0.5, "ft": 0.5}
#: The up axis by the convention of a format that does not record one, and the cost of the other
#: axis. OBJ: Y. Real OBJ files with Z up cost at least 1.5 more with Y up before this.
USUAL_UP: dict[str, Up] = {".obj": "y"}
CONVENTION, UNUSUAL_UP = "a usual up axis", 0.75
#: A runner-up is printed if it costs at most this many times as much as the best reading.
RUNNER_UP = 3.0
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

    def rivals(self, other: Reading) -> bool:
        """Whether it is cheap enough, compared with the best, to be printed as the runner-up."""
        return self.cost <= RUNNER_UP * other.cost

    def reasons(self, other: Reading) -> list[str]:
        """What speaks for it rather than for the other, the weightiest first."""
        gain = {words: other.costs[words] - cost for words, cost in self.costs.items()}
        telling = [words for words in gain if gain[words] >= _TELLING]
        return sorted(telling, key=lambda words: -gain[words])


def readings(
    looks: Mapping[Up, Look], metres: float | None = None, usual: Up | None = None
) -> list[Reading]:
    """The readings of a model that looks like this with each axis up, the likeliest first, in every
    unit or in the one that is known. ``usual`` is the up axis by convention (`USUAL_UP`)."""
    names = {each: name for name, each in UNITS.items()}
    units = UNITS if metres is None else {names.get(metres, ""): metres}
    axis = {up: {CONVENTION: UNUSUAL_UP * (usual not in (None, up))} for up in looks}
    found = [
        Reading(up, each, unit, look, _costs(look, looks[_OTHER[up]], unit, each) | axis[up])
        for up, look in looks.items()
        for unit, each in units.items()
    ]
    # Rounded, so that the last digits of coordinates decide nothing between equals.
    return sorted(found, key=lambda reading: round(reading.cost, 6))


_OTHER: dict[Up, Up] = {"y": "z", "z": "y"}


def _costs(look: Look, other: Look, unit: str, metres: float) -> dict[str, float]:
    level = look.level + other.level
    # Where nothing lies over anything, there are no rooms to compare.
    rooms = _higher(look.median, other.median) if look.room and other.room else 0.5
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
