"""The input of the division of a scene: its structure, planes that may split it, and its floor."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ptmtools.cells.bsp import Tree
from ptmtools.cells.ceilings import ceiling_height
from ptmtools.cells.floors import Floors, detail_of
from ptmtools.cells.open_doors import Doors
from ptmtools.cells.options import SubdivideOptions, Walker
from ptmtools.cells.places import Places, find_places, spread
from ptmtools.cells.room_planes import Contact, contacts
from ptmtools.cells.room_volumes import Volumes
from ptmtools.cells.split_planes import Reveals
from ptmtools.cells.structure import (
    LOOKS,
    Opaque,
    Structure,
    Surroundings,
    WallPlane,
    built,
    find_walls,
    spread_over,
)
from ptmtools.cells.worth import Viewing
from ptmtools.executor import Executor
from ptmtools.scene.model import Scene

#: Side of a patch of floor, in radii of a body.
GRAIN = 0.5
#: A model has rooms if this much of its places, m², is in them, and the number of samples.
_ROOM, _SAMPLES = 20.0, 1 << 17


@dataclass(frozen=True)
class Building:
    """The structure of a scene, and the planes that may split it."""

    structure: Structure
    walls: list[WallPlane]
    reveals: Reveals
    places: Places  # shut door leaves do not block, unless they act as walls
    doors: Doors
    ceiling: float | None  # `ceiling_height`
    options: SubdivideOptions
    volumes: Volumes = field(default_factory=Volumes)
    contacts: tuple[Contact, ...] = ()  # of the volumes
    facets: int = 0  # planes of a scanned surface, which do not split

    @staticmethod
    def of(scene: Scene, options: SubdivideOptions, executor: Executor | None = None) -> Building:
        tolerance = scene.tolerance.for_walls(options.wall_thickness)
        opaque = Opaque.of(scene, options)
        structure = Structure.of(opaque, tolerance)
        doors, structure = Doors.recognise(scene, opaque, structure, options)
        every = find_walls(structure, options.wall_area)
        walls = every if options.structural else built(every)
        reveals = Reveals(structure, options.wall_thickness)
        walker = Walker(*options.walker)
        detail = detail_of(scene, structure, options)
        floors = Floors.of(scene, detail, GRAIN * walker.radius)
        solid = structure.corners[~structure.door | (options.doors == "closed")]
        places = find_places(floors, solid, walker, tolerance, executor)
        ceiling = None
        if options.ceiling == "auto":
            ceiling = ceiling_height(structure, walls, walker, options.wall_area)
        volumes = Volumes.of(scene, options)
        touching = contacts(volumes.rooms, options, tolerance)
        return Building(
            structure,
            walls,
            reveals,
            places,
            doors,
            ceiling,
            options,
            volumes,
            touching,
            len(every) - len(walls),
        )

    @property
    def walker(self) -> Walker:
        return Walker(*self.options.walker)

    def cost(self, tree: Tree) -> float:
        """`Viewing.cost`; 0 if the model is divided to the end, whatever that saves."""
        return self._viewing.cost(tree) if self._viewing else 0.0

    @cached_property
    def _viewing(self) -> Viewing | None:
        options, structure, places = self.options, self.structure, self.places
        fixed = options.cells == "leaf" or options.standing == "anywhere" or self.doors.leaves
        if fixed or not 0 < options.gain < 1 or not len(places.plan) or self._has_rooms():
            return None
        return Viewing.of(places, self.walker.middle, structure.corners, structure.tolerance)

    def _has_rooms(self) -> bool:
        """Whether some of the places are inside a building that is not solid."""
        structure = self.structure
        points, size = spread(self.places.triangles(structure.tolerance))
        points = spread_over(points, _SAMPLES) + [0.0, self.walker.middle, 0.0]
        around = Surroundings(structure.corners, structure.tolerance)
        inside = around.inside(points)
        some = spread_over(points[inside], LOOKS)
        hollow = np.mean([not around.solid(point[None]) for point in some]) if len(some) else 0.0
        return bool(inside.mean() * hollow * size.sum() >= _ROOM)

    def with_glass(self) -> Surroundings:
        """The surroundings in which glass counts as a wall."""
        structure = self.structure
        walls = np.concatenate([structure.corners, self.doors.glass])
        return Surroundings(walls, structure.tolerance)
