"""How a model looks to somebody who stands in it, before it is divided: whether it is closed, and
what is taken for a door.

Division decides this exactly (`reach`), and takes its time. Here sight lines are cast from points
at the height of eyes over the floors of rooms, and those are counted that leave the model.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.cells.entrances import Doors
from ptmtools.cells.options import SubdivideOptions
from ptmtools.cells.places import Floors, detail_of, spread
from ptmtools.cells.reach import roofed_share
from ptmtools.cells.structure import Opaque, Structure
from ptmtools.cells.surroundings import Surroundings, spread_over
from ptmtools.scene.model import Scene

#: Points from which sight lines are cast, how high over a floor, metres, and lines from each.
_POINTS, _EYE, _LINES = 400, 1.6, 64
#: Up to this share of lines that leave, the model looks closed: robust rays slip through seams.
CLOSED = 1e-3


@dataclass(frozen=True)
class Enclosure:
    """
    Attributes
    ----------
    doors: names of the door leaves that are recognised, in the order of the file.
    roofed: share of the floor, by area, that has something over it.
    rooms: how many points in rooms, under a roof and between walls, sight lines were cast from.
    leaving: share of these lines that meet nothing; 0 without rooms.
    """

    doors: tuple[str, ...]
    roofed: float
    rooms: int
    leaving: float

    @property
    def closed(self) -> bool:
        """Whether it looks closed."""
        return self.rooms > 0 and self.leaving <= CLOSED


def enclosure(scene: Scene, options: SubdivideOptions | None = None) -> Enclosure:
    """How a scene looks from its inside. Door leaves are shut in that."""
    options = options or SubdivideOptions()
    tolerance = scene.tolerance.for_walls(options.wall_thickness)
    opaque = Opaque.of(scene, options)
    doors, structure = Doors.found(scene, opaque, Structure.made(opaque, tolerance), options)
    corners, names = structure.corners, tuple(leaf.name for leaf in doors.leaves)
    if not len(corners):
        return Enclosure(names, 0.0, 0, 0.0)
    floors = Floors.of(scene, detail_of(scene, structure, options), backs=True)
    around = Surroundings(corners, tolerance)
    points, _ = spread(floors.corners)
    points = spread_over(points, 4 * _POINTS) + [0.0, _EYE, 0.0]
    points = spread_over(points[around.inside(points)], _POINTS)
    leaving = 0.0
    if len(points):
        along = np.tile(_sphere(_LINES), (len(points), 1))
        far, _ = around.first(np.repeat(points, _LINES, axis=0), along)
        leaving = float(np.isinf(far).mean())
    return Enclosure(names, roofed_share(corners, options.wall_area), len(points), leaving)


def _sphere(count: int) -> Floats:
    """(count, 3) unit vectors, spread evenly (Fibonacci's lattice)."""
    step = np.arange(count) + 0.5
    height, turn = 1 - 2 * step / count, np.pi * (1 + np.sqrt(5)) * step
    level = np.sqrt(1 - height**2)
    return np.column_stack([level * np.cos(turn), height, level * np.sin(turn)])
