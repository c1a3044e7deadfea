"""Ranks the possible up axes and units of a model by how usual a building each pair gives.

A *candidate* is an up axis with a unit. A storey of 3 m is evidence for both, so every axis is
combined with every unit. `evidence` measures the model with each axis up, in units of the model:
areas, and the crossings of sample lines (`facing`), independent of position and of the division of
walls into triangles. `candidates` turns the evidence into costs, higher for less usual buildings,
and adds them; the candidate of the lowest cost is the most likely one. No single criterion is
reliable, because each has buildings that violate it: walls without floors, a hall of one room, a
tower.

The unit follows from the size of the building and from its rooms (`room_sizes`): their clear
height, and whether a visitor can stand in them. The second excludes every unit that is too short,
and only these: low buildings are rare, high ones are not. So the cost of a high room is low. Of the
39 made buildings of test_up_axis.py, as OBJ with Y up, the guess is right for 38 in metres, 37 in
centimetres, 38 in millimetres, 30 in inches and 8 in feet. Rooms of 10 m in metres and of 10 feet
have the same numbers: of 36 in feet, feet are the guess or named beside it.

Tried and rejected: the share of level area and the flatness of the bounding box alone. They lay a
house of walls without floors, 19 × 11.4 × 3 m, on its side, since its walls are then all the level
area; that walls go in two directions separates it from a building with floors and no walls on two
sides. The uniformity of free heights is weak evidence (25 % of the height upright and 59 % lying in
the gallery); rooms lower than wide are stronger evidence than the same ratio of the whole building,
and hold in towers. Comparing the most frequent free height instead of the median by space: in an
atrium with arcades whose outer walls are hollow from the ground to the roof, the hollow gives the
most frequent height, 13.6 m, and outweighs the arcades.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.scene.orientation.facing import Crossings, SampleLines
from ptmtools.scene.orientation.room_sizes import HEIGHT, NO_ROOMS, RoomSizes, room_sizes

Up = Literal["y", "z"]
AXES: dict[Up, int] = {"y": 1, "z": 2}

#: Faces whose normal is within 8 degrees of the up axis are level; faces whose normal is within 3
#: degrees of perpendicular to it are upright.
_LEVEL, _UPRIGHT = 0.99, 0.05
#: Floors and walls of rooms lean less than 26 and 17 degrees, in scans too.
_FLOOR, _WALL = 0.9, 0.3
#: Relative difference of free heights that count as equal.
_SAME = 0.1
#: Words, or their beginnings, in names of objects and materials.
_LEVEL_NAMES = ("floor", "ceiling", "slab", "boden", "decke", "plafond", "suelo", "pavimento")
_UPRIGHT_NAMES = ("wall", "wand", "mur", "pared", "parete")
_DOOR_NAMES = ("door", "tür", "tuer", "porte", "puerta", "porta", "refrigerator", "fridge")
#: Largest number of doors whose height is measured.
_DOORS = 64
#: Smallest share of the model's area with names that count as evidence.
_NAMED = 0.05


@dataclass(frozen=True)
class NamedFaces:
    """The faces whose names state their orientation: (T,) level, (T,) upright, and the triangles of
    each door leaf, or refrigerator, which is as high."""

    level: Bools
    upright: Bools
    doors: tuple[Ints, ...] = ()

    @staticmethod
    def from_names(
        objects: tuple[Sequence[str], NDArray[np.integer]],
        materials: tuple[Sequence[str], NDArray[np.integer]],
    ) -> NamedFaces:
        """From the names of objects and of materials, each with the (T,) index of every triangle
        into them."""

        def matching(words: tuple[str, ...]) -> Bools:
            by_object, by_material = (
                np.array([_has_word(name, words) for name in names], dtype=bool)[index]
                for names, index in (objects, materials)
            )
            return np.asarray(by_object | by_material)

        names, index = objects
        doors = [i for i, name in enumerate(names) if _has_word(name, _DOOR_NAMES)]
        leaves = tuple(np.flatnonzero(index == i) for i in doors[:_DOORS])
        return NamedFaces(
            matching(_LEVEL_NAMES),
            matching(_UPRIGHT_NAMES),
            tuple(leaf for leaf in leaves if len(leaf)),
        )


def _has_word(name: str, words: tuple[str, ...]) -> bool:
    spaced = re.sub(r"(?<=[a-zäöüß])(?=[A-Z])", " ", name)
    return any(part.startswith(words) for part in re.findall(r"[^\W\d_]+", spaced.lower()))


@dataclass(frozen=True)
class Evidence:
    """Measurements of a model with one axis up; lengths in units of the model.

    Attributes
    ----------
    width, height: of the bounding box; the width is the longer of its level sides.
    built: width of the part with rooms, without the ground around it; `width` without rooms.
    room: free height that the most space has; 0 if no face lies over another.
    alike: share of the height that rooms of this height take up, on average.
    median: median free height by space; 0 if no face lies over another.
    level: area of level faces, as a share of all.
    upright: area of level and of upright faces, as a share of all.
    crossed: ratio of wall areas in two directions: 0 if all walls are parallel, 1 if equal.
    named: share of the named area that is level or upright as its names state; 1 without names.
    door: median height of door leaves; 0 if none is named.
    rooms: the size of the rooms with floors and walls.
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
    rooms: RoomSizes = NO_ROOMS

    @property
    def storey(self) -> tuple[float, float]:
        """The clear height of most rooms, and the share of rooms that have it."""
        return self.rooms.storey if self.rooms.heights else (self.room, self.alike)


def evidence(
    points: Floats, triangles: NDArray[np.integer], named: NamedFaces
) -> dict[Up, Evidence]:
    """The evidence of (T, 3) triangles over (V, 3) finite points with each axis up."""
    side = np.ptp(points, axis=0)
    scale = float(side.max()) or 1.0
    local = (points - points.min(axis=0)) / scale
    lines = SampleLines(local, triangles)
    crossings = [lines.crossings(axis) for axis in range(3)]
    normals = [_unit_normals(local, triangles[crossing.triangle]) for crossing in crossings]
    face, normal, area = _sampled_faces(crossings, normals)
    named_level, named_upright = named.level[face], named.upright[face]
    named_area = float(area @ (named_level | named_upright))
    total = float(area.sum()) or 1.0
    result: dict[Up, Evidence] = {}
    for up, axis in AXES.items():
        u, v = (k for k in range(3) if k != axis)
        slope = np.abs(normal[:, axis])
        level, upright = slope > _LEVEL, slope < _UPRIGHT
        wall = area * upright
        room, alike, median = _free_height(crossings[axis], float(side[axis]) / scale)
        width = float(side[[u, v]].max())
        as_named = float(area @ ((named_level & level) | (named_upright & upright)))
        doors = [np.ptp(local[triangles[leaf], axis]) for leaf in named.doors]
        result[up] = Evidence(
            width=width,
            height=float(side[axis]),
            built=_built_width(lines, crossings[axis], axis, room) * scale or width,
            room=room * scale,
            alike=alike,
            median=median * scale,
            level=float(area @ level) / total,
            upright=float(area @ (level | upright)) / total,
            crossed=_eigenvalue_ratio(
                *(float(wall @ (normal[:, i] * normal[:, j])) for i, j in ((u, u), (v, v), (u, v)))
            ),
            named=as_named / named_area if named_area > _NAMED * total else 1.0,
            door=float(np.median(doors)) * scale if doors else 0.0,
            rooms=room_sizes(
                lines,
                crossings,
                np.abs(normals[axis][:, axis]) > _FLOOR,
                [np.abs(unit[:, axis]) < _WALL for unit in normals],
                axis,
            ).times(scale),
        )
    return result


def _unit_normals(points: Floats, triangles: NDArray[np.integer]) -> Floats:
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    return np.asarray(normal)


def _sampled_faces(
    crossings: Sequence[Crossings], normals: Sequence[Floats]
) -> tuple[Ints, Floats, Floats]:
    """The faces that the lines along the three axes cross: (n,) triangles, (n, 3) unit normals, and
    (n,) areas that they represent. Each face counts along the axis nearest to its normal."""
    parts = []
    for axis, (crossing, normal) in enumerate(zip(crossings, normals, strict=True)):
        nearest = np.abs(normal).argmax(axis=1) == axis
        area = crossing.section[nearest] / np.abs(normal[nearest, axis])
        parts.append((crossing.triangle[nearest], normal[nearest], area))
    face, sampled, areas = zip(*parts, strict=True)
    return np.concatenate(face), np.concatenate(sampled), np.concatenate(areas)


def _eigenvalue_ratio(a: float, b: float, mixed: float) -> float:
    """Least by greatest eigenvalue of [[a, mixed], [mixed, b]], positive semidefinite."""
    mean, radius = (a + b) / 2, np.hypot((a - b) / 2, mixed)
    return max(0.0, float((mean - radius) / (mean + radius))) if mean > 0 else 0.0


def _built_width(lines: SampleLines, crossings: Crossings, axis: int, room: float) -> float:
    """The width of the part with rooms: the extent of the lines with a gap of at least half a
    room's height, which excludes the ground beside a building."""
    before, gaps = crossings.gaps()
    u, v = (lines.rows(k) for k in range(3) if k != axis)
    at = np.divmod(np.unique(crossings.line[before[gaps >= room / 2]]), len(v))
    return max(float(np.ptp(row[i])) if len(i) else 0.0 for row, i in zip((u, v), at, strict=True))


def _free_height(crossings: Crossings, height: float) -> tuple[float, float, float]:
    """The free height that the most space has; its share of the height of the model, on average
    over the lines with at least two crossings; and the median free height by space."""
    before, gaps = crossings.gaps()
    if not len(gaps) or not height > 0:
        return 0.0, 0.0, 0.0
    lines = len(np.unique(crossings.line[before]))
    gaps = np.sort(gaps)
    total = np.concatenate([[0.0], np.cumsum(gaps)])
    end = np.searchsorted(gaps, gaps * (1 + _SAME), "right")
    space = total[end] - total[:-1]
    widest = int(space.argmax())
    median = gaps[np.searchsorted(total[1:], total[-1] / 2)]
    room, share = space[widest] / (end[widest] - widest), space[widest] / (lines * height)
    return float(room), float(share), float(median)


#: Metres in one unit, in the order of preference between equally plausible units.
UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
#: Prior cost of each unit.
PRIOR = {"m": 0.0, "cm": 0.1, "mm": 0.1, "in": 0.5, "ft": 0.5}
#: The cost of another axis than that by the convention of a format. Real OBJ files with Z up cost
#: at least 1.5 more with Y up before this.
CONVENTION, UNUSUAL_UP = "usual up axis", 0.75
#: The runner-up is printed if it costs at most this many times as much as the best candidate.
RUNNER_UP = 3.0
#: Heights of buildings in metres: a visitor cannot stand below the first; above the second a
#: building has several storeys, which costs little.
HEIGHTS = (2.0, 15.0)
#: Widths of buildings and clear heights of rooms, in metres.
WIDTHS, ROOMS = (3.0, 500.0), (2.1, 6.0)
#: The cost of a room grows with the logarithm of its height up to the first cost, then with this
#: share of it: halls and blocks of a city may have any height.
HALL, HIGHER = 0.5, 0.2
#: The cost of rooms in which no visitor can stand, and the share of places from which on it is 0:
#: the rest may lie in furniture and slabs.
NO_VISITOR, ENOUGH = 4.0, 0.5
#: Rooms are impossible if a visitor fits at a smaller share of places than this, or if half of them
#: have a ceiling higher than the first height, in metres, or end above the second.
FEWEST, HIGHEST = 0.4, (40.0, 200.0)
#: Clear heights of most rooms in metres, of houses and of halls, from which units without a name
#: follow; the prior cost of such a unit; and its smallest ratio to every unit with a name.
STOREYS, NUMBER, UNLIKE = (2.7, 5.0), 1.0, 1.5
#: A model lower than this share of the width of its rooms is a plan, not a building.
FLAT = 0.003
#: The height of a door in metres, and the relative deviation without cost.
DOOR, DOORS_DIFFER = 2.1, 0.2
#: Doors of halls may be as high as this share of their height.
PORTAL = 0.3
#: Upper bound of one cost, so that the other criteria still decide on the axis.
_MOST = 10.0
#: A candidate with another axis, or with another unit, is close to the best one if it costs less
#: than this more.
CLOSE_AXIS, CLOSE_UNIT = 0.5, 0.4
#: An axis defined by the format is doubtful if the other axis costs this much less: more than the
#: difference for a correct corridor or cube that would be cheaper on its side.
DOUBT_AXIS = 0.35
#: A unit that the format prescribes, and one that the file records, is impossible only if another
#: one costs this much less.
TRUST = 0.5, 1.5
#: Another unit than a prescribed one, in which rooms have ceilings, is likelier if it costs this
#: much less; of others `CLOSE_UNIT`.
LEAD = 0.1
#: Heights of a storey, metres: a model as high does not lie on its side if its format says so.
STOREY = 2.0, 4.0
#: Smallest difference of costs that counts as a reason.
_REASON = 0.1
_OTHER: dict[Up, Up] = {"y": "z", "z": "y"}


@dataclass(frozen=True)
class Candidate:
    """A model with one axis up and in one unit.

    Attributes
    ----------
    up, metres: the axis, and the length of the unit.
    unit: its name; the length in metres if it has none.
    evidence: of the model with this axis up.
    costs: by criterion; the keys are the reasons in messages.
    stated: whether the format states this unit.
    """

    up: Up
    metres: float
    unit: str
    evidence: Evidence
    costs: Mapping[str, float]
    stated: bool = False

    @property
    def cost(self) -> float:
        """The sum of the costs, at least 0."""
        return sum(self.costs.values())

    @property
    def flat(self) -> bool:
        """Whether it is a plan rather than a building."""
        return self.evidence.height <= FLAT * self.evidence.built

    @property
    def size(self) -> str:
        """Its size in words."""
        measured, metres = self.evidence, self.metres
        width, height = measured.width * metres, measured.height * metres
        room = measured.storey[0] * metres
        has_rooms = measured.rooms.heights or room >= HEIGHT
        rooms = f", clear height of most rooms {room:.3g} m" if has_rooms else ""
        return f"{width:.3g} m wide and {height:.3g} m high{rooms}"

    @property
    def small(self) -> bool:
        """Whether it is lower than a visitor, and no plan."""
        return self.evidence.height < HEIGHT / self.metres and not self.flat

    @property
    def too_low(self) -> bool:
        """Whether no visitor can stand in its rooms, if any, or under the ceilings of most."""
        rooms, least = self.evidence.rooms, HEIGHT / self.metres
        return rooms.share(least) < FEWEST or (rooms.roofed and rooms.storey[0] < least)

    @property
    def usual(self) -> bool:
        """Whether most of its rooms are of a height that rooms and halls may well have."""
        return HEIGHT <= self.evidence.storey[0] * self.metres <= 2 * STOREYS[1]

    @property
    def too_high(self) -> bool:
        """Whether its rooms are higher than any."""
        rooms = self.evidence.rooms
        highest = HIGHEST[not rooms.roofed] / self.metres
        return bool(rooms.heights) and rooms.heights[len(rooms.heights) // 2] > highest

    def rivals(self, best: Candidate) -> bool:
        """Whether its cost is low enough to print it as the second-best guess."""
        return self.cost <= RUNNER_UP * best.cost

    def reasons(self, rival: Candidate) -> list[str]:
        """The criteria that favour this candidate over the rival, the strongest first."""
        gain = {name: rival.costs[name] - cost for name, cost in self.costs.items()}
        return sorted(
            (name for name in gain if gain[name] >= _REASON), key=lambda name: -gain[name]
        )


def candidates(
    measured: Mapping[Up, Evidence],
    metres: float | None = None,
    usual: Up | None = None,
    *,
    numbers: bool = False,
    stated: float | None = None,
) -> list[Candidate]:
    """The candidates for the evidence of each axis, the most likely first: for every unit, or for
    one of ``metres``. ``usual`` is the up axis by convention. With ``numbers`` also units
    without a name, in which the rooms have a usual height. ``stated`` is the unit that the format
    states, of which no prior cost is known."""
    names = {length: name for name, length in UNITS.items()}
    units = UNITS if metres is None else {names.get(metres, f"{metres:g}"): metres}
    result = []
    for up, sides in measured.items():
        extra = {f"{length:g}": length for length in _fitting_units(sides) if numbers}
        if stated is not None:
            extra[names.get(stated, f"{stated:g}")] = stated
        for unit, length in (units | extra).items():
            costs = _costs(sides, measured[_OTHER[up]], length)
            if metres is None:
                # Says nothing on the axis: that with no rooms has no rooms that are too low.
                costs["room for a visitor"] = _visitor_cost(sides.rooms, length)
                costs["usual unit"] = 0.0 if length == stated else PRIOR.get(unit, NUMBER)
            costs[CONVENTION] = UNUSUAL_UP * (usual not in (None, up))
            result.append(Candidate(up, length, unit, sides, costs, length == stated))
    # Rounded, so that the last digits of coordinates decide nothing between equals.
    return sorted(result, key=lambda candidate: round(candidate.cost, 6))


def _fitting_units(measured: Evidence) -> list[float]:
    """The units in which most rooms have a usual height, without those similar to one with a
    name."""
    height, _ = measured.rooms.storey
    fitting = [storey / height for storey in STOREYS] if height > 0 else []
    fitting += [DOOR / measured.door] if measured.door > 0 else []
    return [
        metres
        for metres in (float(f"{length:.2g}") for length in fitting)
        if 0 < metres < math.inf
        and all(abs(_log_ratio(metres, unit)) > math.log(UNLIKE) for unit in UNITS.values())
    ]


def _costs(measured: Evidence, lying: Evidence, metres: float) -> dict[str, float]:
    level = measured.level + lying.level
    # Without free heights along both axes there are no rooms to compare.
    rooms = _higher(measured.median, lying.median) if measured.room and lying.room else 0.5
    return {
        "more level faces": 1 - measured.level / level if level else 0.5,
        "building wider than high": 0.75 * _higher(measured.height, lying.height),
        "rooms wider than high": 1.5 * rooms,
        "walls in two directions": 1.5 * (1 - measured.crossed),
        "fewer sloping faces": 1 - measured.upright,
        "rooms of equal height": 1 - measured.alike,
        "faces match their names": 2 * (1 - measured.named),
        "usual size": _size_cost(measured, metres),
        "usual room height": measured.storey[1] * _room_cost(measured.storey[0] * metres),
        "usual door height": _door_cost(measured.door * metres, measured.storey[0] * metres),
    }


def _higher(height: float, reference: float) -> float:
    """How far one length exceeds another: 1 from a factor of 4 on, 0 from 1/4 down."""
    if not height > 0 or not reference > 0:
        return 0.5 + ((height > 0) - (reference > 0)) / 2
    return 0.5 + max(-2.0, min(2.0, _log_ratio(height, reference) / math.log(2))) / 4


def _size_cost(measured: Evidence, metres: float) -> float:
    # In units of the model, so that no length underflows to 0 in metres.
    cost = 0.0
    if measured.width > 0:
        narrow, wide = WIDTHS[0] / metres, WIDTHS[1] / metres
        excess = _log_ratio(narrow, measured.width), _log_ratio(measured.built, wide)
        cost += min(_MOST, max(0.0, 2 * excess[0], excess[1]))
    if measured.height > FLAT * measured.built:
        low, high = HEIGHTS[0] / metres, HEIGHTS[1] / metres
        too_low = min(3.0, 4 * _log_ratio(low, measured.height))
        cost += min(_MOST, max(0.0, too_low, 0.25 * _log_ratio(measured.height, high)))
    return cost


def _room_cost(height: float) -> float:
    if not height > 0:
        return 0.0
    above = _log_ratio(height, ROOMS[1])
    high = min(above, HALL + HIGHER * (above - HALL))
    return min(2.0, max(0.0, 4 * _log_ratio(ROOMS[0], height), high))


def _visitor_cost(rooms: RoomSizes, metres: float) -> float:
    """From the share of places at which a visitor fits; a place with little more room than that
    counts half."""
    if not rooms.visitors:
        return 0.0
    share = (rooms.share(HEIGHT / metres) + rooms.share(ROOMS[0] / metres)) / 2
    return NO_VISITOR * max(0.0, 1 - share / ENOUGH)


def _door_cost(height: float, room: float) -> float:
    if not height > 0 or DOOR <= height <= PORTAL * room:
        return 0.0
    return min(1.5, 3 * max(0.0, abs(_log_ratio(height, DOOR)) - DOORS_DIFFER))


def _log_ratio(a: float, b: float) -> float:
    """The logarithm of a / b, which itself may overflow or underflow."""
    return math.log(a) - math.log(b)
