"""Doors that open, the portals that result, and an estimate of how closed a model is.

The building is divided with all doors shut. A door opens if both its sides are inside: reached by
the flood, or in an unreachable room (`division`). The parts of the tree's planes that its leaf
covered become portals, or passages where the leaf hides what is behind it, and nothing is divided
again; so a closed model stays closed. Where the flood reaches the outside, a point counts as inside
if it has walls around it, glass included, and a roof above, if the building has any.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.bsp import Tree
from ptmtools.cells.ceilings import ROOFED, roofed_share
from ptmtools.cells.doors import DoorLeaf, find_doors
from ptmtools.cells.doorways import RELIEF
from ptmtools.cells.floors import Floors, detail_of
from ptmtools.cells.model import descend
from ptmtools.cells.options import SubdivideOptions
from ptmtools.cells.places import spread
from ptmtools.cells.planar import Geometry
from ptmtools.cells.portals import Portal, find_portals, flood
from ptmtools.cells.split_planes import DoorPlanes
from ptmtools.cells.structure import Opaque, Structure, Surroundings, spread_over
from ptmtools.scene.model import Scene

#: The sides of a leaf are sampled this far in front of it and behind, metres.
_BEYOND = 0.1
#: Points on the way through a door that must be inside, metres from the leaf: the way under a porch
#: soon leaves it.
_WAY = (0.5, 1.0, 2.0)
#: A side of a leaf is inside if a greater share of its points is.
_MOST = 0.5


@dataclass(frozen=True)
class Doors:
    """The door leaves of a building, with the glass and roofs that separate inside and outside."""

    leaves: list[DoorLeaf]
    of: Ints  # (T,) the leaf to which each triangle of the structure belongs, or -1
    glass: Floats  # (n, 3, 3) transparent triangles, metres
    roofed: bool  # whether the building has roofs or ceilings
    planes: DoorPlanes

    @staticmethod
    def recognise(
        scene: Scene, opaque: Opaque, structure: Structure, options: SubdivideOptions
    ) -> tuple[Doors, Structure]:
        """The doors of a scene, and its structure with their triangles unsimplified."""
        leaves = find_doors(scene, opaque, structure, options)
        leaf = np.full(len(scene.triangles), -1)
        for i, door in enumerate(leaves):
            leaf[door.triangles] = i
        glass, roofed = scene.corners[~scene.opaque], True
        if leaves:
            structure = Structure.of(opaque, structure.tolerance, leaf >= 0)
            roofed = roofed_share(structure.corners, options.wall_area) >= ROOFED
        of = leaf[structure.source]
        across = np.array([door.axes[0] for door in leaves]).reshape(-1, 3)
        return Doors(leaves, of, glass, roofed, DoorPlanes.of(structure, of, across)), structure

    def triangles(self, which: Bools) -> NDArray[np.int32]:
        """The triangles of the scene, ascending, of the leaves ``which``, (d,)."""
        each = [self.leaves[i].triangles for i in np.flatnonzero(which)]
        return np.unique(np.concatenate([np.zeros(0, np.int64), *each])).astype(np.int32)

    def sides(self, tree: Tree, within: Bools) -> Bools:
        """(d, 2) which sides of door leaves are in the (L,) tree leaves ``within``."""
        shares = [
            within[-2 - descend(tree.planes, tree.children, side)].mean()
            for door in self.leaves
            for side in door.grid(_BEYOND)
        ]
        return np.array(shares).reshape(-1, 2) > _MOST

    def lead_to_open_rooms(
        self, structure: Structure, tree: Tree, inside: Bools, outside: Bools
    ) -> bool:
        """Whether a door leads from ``inside``, (L,) tree leaves, into a room that the ``outside``,
        (L,), reaches too, such as through a window."""
        which = self.sides(tree, inside).any(axis=1) & self.sides(tree, outside).any(axis=1)
        return bool(which.any()) and bool((which & self.sheltered(structure)).any())

    def sheltered(self, structure: Structure) -> Bools:
        """(d,) which leaves have walls around and a roof above the ways on both sides."""
        around = Surroundings(np.concatenate([structure.corners, self.glass]), structure.tolerance)
        ways = (_ways(door, around) for door in self.leaves)
        each = [all(around.inside(points, self.roofed).all() for points in way) for way in ways]
        return np.array(each, dtype=bool)

    def lead_out(self, portals: list[Portal], outside: Bools) -> Bools:
        """(d,) which leaves have portals around them that lead ``outside``, (L,): some frames leave
        a gap into the wall."""
        out = [p.polygon for p in portals if outside[p.leaves[0]] != outside[p.leaves[1]]]
        reach = np.array([RELIEF, _BEYOND, _BEYOND])
        result = np.zeros(len(self.leaves), dtype=bool)
        if out:
            points = np.concatenate(out)
            first = np.cumsum([0, *(len(polygon) for polygon in out[:-1])])
            for i, door in enumerate(self.leaves):
                local = points @ door.axes.T
                low, high = (f.reduceat(local, first) for f in (np.minimum, np.maximum))
                meets = (high >= door.low - reach) & (low <= door.high + reach)
                result[i] = meets.all(axis=1).any()
        return result


def _ways(door: DoorLeaf, around: Surroundings) -> Iterator[Floats]:
    """The points on the way through a door, in front of it and behind."""
    for side, turn in zip(door.grid(RELIEF), (1.0, -1.0), strict=True):
        start, to = side.mean(axis=0), turn * door.axes[0]
        free = around.first(start[None], to[None])[0][0]
        far = [d for d in _WAY if d < free] or [free / 2]
        yield start + np.array(far)[:, None] * to


def open_doors(
    doors: Doors,
    structure: Structure,
    tree: Tree,
    portals: list[Portal],
    within: Bools,
    outer: Bools,
    hiding: bool,
) -> tuple[Bools, Tree, list[Portal]] | None:
    """The (d,) doors that lead from inside to inside, and the tree and its portals with these open;
    None if none does.

    ``within``: (L,) leaves that are inside. ``outer``: (L,) those at the box around a closed model,
    which the flood must not reach. ``hiding``: whether leaves still block sight.
    """
    which = np.asarray(doors.sides(tree, within).all(axis=1))
    if which.any() and not outer.any():
        which &= doors.sheltered(structure)
    rooms = tuple(np.flatnonzero(within).tolist())
    outside = flood(len(tree.leaves), portals, tuple(np.flatnonzero(outer).tolist()))
    while which.any():
        opened, more = _opened(doors, which, structure, tree, portals, hiding)
        if not (flood(len(tree.leaves), more, rooms) & outer).any():
            return which, opened, more
        out = doors.lead_out(more, outside) & which
        which = which & ~out & out.any()
    return None


def _opened(
    doors: Doors,
    which: Bools,
    structure: Structure,
    tree: Tree,
    portals: list[Portal],
    hiding: bool,
) -> tuple[Tree, list[Portal]]:
    """The tree and its portals with the doors ``which``, (d,), open."""
    free = np.append(which, False)[doors.of]
    near = structure.tolerance.plane
    walls, fresh = list(tree.walls), []
    united: dict[bytes, Geometry] = {}  # of planes with several nodes
    for node, wall in enumerate(tree.walls):
        plane, body = wall.frame.plane, tree.capped.get(node)
        if body is None:
            flat = structure.nearby.between(plane, -near, near)
        else:
            flat = structure.nearby.meeting(body.points.min(axis=0), body.points.max(axis=0))
        if free[flat].any():
            flat = flat[structure.lie_in(plane, flat)]
        if free[flat].any():
            rest = flat[~free[flat]]
            key = plane.tobytes() + rest.tobytes()
            if key not in united:
                united[key] = structure.united(wall.frame, rest)
            barring = united[key]
            walls[node] = (
                replace(wall, barring=barring) if hiding else replace(wall, blocking=barring)
            )
            fresh.append(node)
    tree = replace(tree, walls=tuple(walls))
    stale = set(fresh)
    remaining = [portal for portal in portals if portal.node not in stale]
    remaining += find_portals(tree, structure.tolerance, fresh)
    return tree, sorted(remaining, key=lambda portal: portal.node)


#: Points from which sight lines are cast, how high over a floor, metres, and lines from each.
_POINTS, _EYE, _LINES = 400, 1.6, 64
#: Up to this share of lines that leave, the model looks closed: robust rays slip through seams.
CLOSED = 1e-3


@dataclass(frozen=True)
class Enclosure:
    """
    Attributes
    ----------
    doors: names of the recognised door leaves, in the order of the file.
    roofed: share of the floor, by area, that has a surface above it.
    rooms: number of points in rooms, under a roof and between walls, that sight lines start from.
    leaving: share of these lines that leave the model; 0 without rooms.
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
    """How enclosed a scene is, its door leaves shut."""
    options = options or SubdivideOptions()
    tolerance = scene.tolerance.for_walls(options.wall_thickness)
    opaque = Opaque.of(scene, options)
    doors, structure = Doors.recognise(scene, opaque, Structure.of(opaque, tolerance), options)
    corners, names = structure.corners, tuple(leaf.name for leaf in doors.leaves)
    if not len(corners):
        return Enclosure(names, 0.0, 0, 0.0)
    floors = Floors.of(scene, detail_of(scene, structure, options))
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
