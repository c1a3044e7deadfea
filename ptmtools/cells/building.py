"""The input of the division of a scene: its structure, the planes that may split it and its floor;
and whether dividing it further saves visitors anything.

At some sizes of the tree, the **cost** of the leaves so far is estimated: the share of all surfaces
that visitors see, by lines through the openings so far. Division ends, everywhere, if it has not
lowered the cost by the threshold since the last look: sight goes around the walls or over them, as
in a street, and the next ones would take as long again.

Buildings with rooms are divided to the end: on a large plot most floor is outside, and doors come
last. (Tried: to stop by districts of the tree. A few leaves that are not divided join the rooms,
and the hollows of the walls, of a museum of a thousand rooms.)
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ptmtools.arrays import Bools, Floats, normals, sum_by_group
from ptmtools.cells.bsp import Tree
from ptmtools.cells.doors import Doors
from ptmtools.cells.fabric import Fabric
from ptmtools.cells.floors import Floors, ceiling_height
from ptmtools.cells.hangings import without_hangings
from ptmtools.cells.model import descend
from ptmtools.cells.named_rooms import Contact, Volumes, contacts
from ptmtools.cells.options import SubdivideOptions, Walker
from ptmtools.cells.places import Places, find_places, spread
from ptmtools.cells.planar import counting
from ptmtools.cells.planes import Polyhedron, bounds
from ptmtools.cells.portals import ends_of, find_portals
from ptmtools.cells.sight import sampled_sight
from ptmtools.cells.split_planes import Reveals
from ptmtools.cells.structure import (
    LOOKS,
    Structure,
    Surroundings,
    WallPlane,
    find_walls,
    spread_over,
)
from ptmtools.cells.ways import floors_with_ways
from ptmtools.executor import Executor
from ptmtools.portal_flow.flow import Portals
from ptmtools.scene.model import Scene
from ptmtools.scene.orientation.main_axes import main_axes
from ptmtools.tolerance import Tolerance

#: Points that represent the viewers, and the surfaces.
_POINTS = 100_000


@dataclass(frozen=True)
class Viewing:
    """Viewers, and the surfaces that they may see."""

    viewers: tuple[Floats, Floats]  # (n, 3) the middles of bodies, and (n,) their m² of floor
    surfaces: tuple[Floats, Floats]  # (n, 3) points beside the structure, and (n,) their m²
    tolerance: Tolerance

    @staticmethod
    def from_places(
        places: Places, middle: float, structure: Floats, tolerance: Tolerance
    ) -> Viewing:
        """``middle``: height of the middle of a body; ``structure``: (n, 3, 3) triangles."""
        points, area = _thin(*spread(places.triangles(tolerance)))
        beside = points_beside(structure, 2 * tolerance.plane)
        return Viewing((points + [0.0, middle, 0.0], area), beside, tolerance)

    def cost(self, tree: Tree) -> float:
        """The mean share of all surfaces that a viewer sees from any point of a leaf, in a tree
        that may not be complete. Surfaces that no viewer sees do not count."""
        viewers, surface = (
            _weight_by_leaf(tree, *points) for points in (self.viewers, self.surfaces)
        )
        with counting():  # what is undecided here decides nothing
            sees = sampled_sight(_openings(tree, self.tolerance))
        seen_share, seen = 0.0, np.zeros(len(surface), dtype=np.bool_)
        for leaf in np.flatnonzero(viewers):
            seen_share += viewers[leaf] * surface[sees[leaf]].sum()
            seen |= sees[leaf]
        everything = viewers.sum() * surface[seen].sum()
        return float(seen_share / everything) if everything > 0 else 1.0


def _openings(tree: Tree, tolerance: Tolerance) -> Portals:
    portals = [portal for portal in find_portals(tree, tolerance) if not portal.passage]
    return Portals(
        leaf_count=len(tree.leaves),
        leaf=ends_of(portals).astype(np.int32),
        normal=tree.planes[[portal.node for portal in portals], :3].reshape(-1, 3),
        point=np.concatenate([np.zeros((0, 3)), *(portal.polygon for portal in portals)]),
        start=np.cumsum([0, *(len(portal.polygon) for portal in portals)]),
        tolerance=tolerance,
    )


def _weight_by_leaf(tree: Tree, points: Floats, weight: Floats) -> Floats:
    """(L,) the weight of the points in each leaf."""
    leaf = -2 - descend(tree.planes, tree.children, points)
    return sum_by_group(leaf, weight, len(tree.leaves))


def points_beside(corners: Floats, distance: float) -> tuple[Floats, Floats]:
    """Points spread over triangles, half of them at a distance to either side, and their m²."""
    facing = normals(corners)
    length = np.linalg.norm(facing, axis=1)
    sound = length > 0
    step = distance * facing[sound] / length[sound, None]
    sides = [_thin(*spread(corners[sound] + turn * step[:, None])) for turn in (1.0, -1.0)]
    points, area = zip(*sides, strict=True)
    return np.concatenate(points), np.concatenate(area) / 2


def _thin(points: Floats, weight: Floats) -> tuple[Floats, Floats]:
    """Some of the points, which represent them all."""
    step = -(-len(points) // _POINTS) or 1
    return points[::step], weight[::step] * step


#: Margin of the first root box around the model, as a share of the model's extent.
BOX_MARGIN = 0.01
#: Side of a patch of floor, in radii of a body.
GRAIN = 0.5
#: A model has rooms if this much of its places, m², is in them, and the number of samples.
_ROOM, _SAMPLES = 20.0, 1 << 17


@dataclass(frozen=True, kw_only=True)
class Building:
    """The structure of a scene, and the planes that may split it."""

    structure: Structure
    wide: Polyhedron  # the first root box, along the main axes of the model and wider than it
    tight: Floats  # (2, 3) the second one, around the walls
    walls: list[WallPlane]
    reveals: Reveals
    places: Places  # shut door leaves do not block, unless they act as walls
    doors: Doors
    ceiling: float | None  # `ceiling_height`
    options: SubdivideOptions
    volumes: Volumes
    contacts: tuple[Contact, ...]  # of the volumes
    cameras: Floats  # (c, 3) where the model has cameras
    furniture: tuple[str, ...]  # the objects with detail by shape, those with most of it first
    shaped: int  # triangles of detail by shape
    facets: int  # planes of a scanned surface, which do not split
    hangings: int  # polygons before larger walls, which do not either

    @staticmethod
    def from_scene(
        scene: Scene, options: SubdivideOptions, executor: Executor | None = None
    ) -> Building:
        tolerance = scene.tolerance.for_walls(options.wall_thickness)
        fabric = Fabric.from_scene(scene, options)
        doors, structure = Doors.recognise(fabric, Structure.from_fabric(fabric, tolerance))
        forced = bool(options.structural)
        walls, facets = find_walls(structure, options.wall_area, facets=forced)
        hangings = 0
        if not forced:
            sizes = options.wall_area, options.wall_thickness
            walls, hangings = without_hangings(walls, structure, *sizes)
        walker = Walker(*options.walker)
        solid = structure.corners[~structure.door | (options.doors == "closed")]
        floors = Floors.from_fabric(fabric, GRAIN * walker.radius)
        places = find_places(floors, solid, walker, tolerance, executor)
        ceiling = None
        if options.ceiling == "auto":
            ceiling = ceiling_height(doors.floor, walls, walker)
        volumes = Volumes.from_scene(scene, options)
        wide, tight = _root_boxes(fabric, structure)
        shaped = fabric.source[fabric.shaped]
        owners, size = np.unique(scene.triangle_object[shaped], return_counts=True)
        return Building(
            structure=structure,
            wide=wide,
            tight=tight,
            walls=walls,
            reveals=Reveals(structure, options.wall_thickness),
            places=places,
            doors=doors,
            ceiling=ceiling,
            options=options,
            volumes=volumes,
            contacts=contacts(volumes.rooms, options, tolerance),
            cameras=np.array([camera.position for camera in scene.cameras]).reshape(-1, 3),
            furniture=tuple(scene.objects[i] for i in owners[np.argsort(-size, kind="stable")]),
            shaped=len(shaped),
            facets=facets,
            hangings=hangings,
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
        return Viewing.from_places(
            places, self.walker.middle, structure.corners, structure.tolerance
        )

    def _has_rooms(self) -> bool:
        """Whether some of the places are inside a building that is not solid."""
        structure = self.structure
        points, size = spread(self.places.triangles(structure.tolerance))
        points = spread_over(points, _SAMPLES) + [0.0, self.walker.middle, 0.0]
        around = structure.rays
        inside = around.enclose(points)
        some = spread_over(points[inside], LOOKS)
        hollow = np.mean([not around.solid(point[None]) for point in some]) if len(some) else 0.0
        return bool(inside.mean() * hollow * size.sum() >= _ROOM)

    @cached_property
    def has_way(self) -> Bools:
        """(r,) whether visitors stand in each region of the places: a way leads there from a
        room."""
        structure, tolerance = self.structure, self.structure.tolerance
        solid = ~structure.door | (self.options.doors == "closed")
        if self.options.standing != "places" or not solid.any():
            return np.ones(len(self.places.plan), dtype=np.bool_)
        around = structure.rays
        if not solid.all():
            around = Surroundings(structure.corners[solid], tolerance)
        eyes = np.array([*self.options.viewpoints, *self.cameras.tolist()]).reshape(-1, 3)
        rooms, roofless = self.volumes.rooms, self.ceiling is not None
        return floors_with_ways(self.places, around, self.walker, tolerance, rooms, eyes, roofless)


def _root_boxes(fabric: Fabric, structure: Structure) -> tuple[Polyhedron, Floats]:
    """`Building.wide` and `Building.tight`; the latter has a height in every direction: a mere
    floor still has one cell above it."""
    corners, tolerance = fabric.scene.corners, structure.tolerance
    axes, margin = main_axes(corners), BOX_MARGIN * tolerance.extent
    low, high = bounds(corners @ axes.T)
    wide = Polyhedron.box(low - margin, high + margin)
    low, high = bounds(structure.corners if len(structure.corners) else corners)
    tight = np.array([low, np.where(high - low < tolerance.thin, low + margin, high)])
    return replace(wide, points=wide.points @ axes), tight
