"""What a model looks like with one or the other of its axes up: the signs by which `space` judges.

Each is a share or a length that holds in any unit, wherever the model lies, and however finely its
walls are divided: areas, and what sample lines cross. No sign is certain, and each has buildings
that lack it: walls without floors, a hall of one room, a tower.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.scene.lines import Crossings, SampleLines

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
        room, alike = _free_height(crossed[axis], float(side[axis]) / scale)
        width = float(side[[u, v]].max())
        as_called = float(area @ ((level & lies) | (upright & stands)))
        doors = [np.ptp(local[triangles[each], axis]) for each in named.doors]
        found[up] = Look(
            width=width,
            height=float(side[axis]),
            built=_built(lines, crossed[axis], axis, room) * scale or width,
            room=room * scale,
            alike=alike,
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


def _free_height(crossed: Crossings, height: float) -> tuple[float, float]:
    """The free height that most space has, and how much of the height of the model it takes up, on
    average over the lines that cross it twice."""
    before, gaps = crossed.gaps()
    if not len(gaps) or not height > 0:
        return 0.0, 0.0
    lines = len(np.unique(crossed.line[before]))
    gaps = np.sort(gaps)
    reach = np.concatenate([[0.0], np.cumsum(gaps)])
    end = np.searchsorted(gaps, gaps * (1 + _SAME), "right")
    space = reach[end] - reach[:-1]
    most = int(space.argmax())
    return float(space[most] / (end[most] - most)), float(space[most] / (lines * height))
