"""Recognition of door leaves, which fill doorways and are no walls.

A leaf is an upright slab of the size of a door, identified by its name, by the opening that it
closes (`doorways`), by the user or by its class. Candidates are connected pieces of objects with a
door's name, and flat rectangles: the rectangles identify a leaf in one piece with its frame or
handle, the piece one made of planks. Parallel slabs behind one another are one leaf, with all
triangles within it.

**Opening.** The building is divided with all doors shut. A door opens if both its sides are inside:
reached by the flood, or in an unreachable room (`space`). The parts of the tree's planes that its
leaf covered become portals, or passages where the leaf hides what is behind it, and nothing is
divided again; so a closed model stays closed. Where the flood reaches the outside, a point counts
as inside if it has walls around it, glass included, and a roof above, if the building has any.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, areas
from ptmtools.cells.bsp import Tree
from ptmtools.cells.doorways import _GRID, RELIEF, Slabs, close_openings, free_on_both_sides
from ptmtools.cells.fabric import (
    Fabric,
    Welded,
    connected_pieces,
    facets_of,
    is_door_name,
    triangles_named,
)
from ptmtools.cells.floors import ROOFED, Floors, SampledFloor
from ptmtools.cells.model import descend
from ptmtools.cells.options import SubdivideOptions, Walker
from ptmtools.cells.planar import Geometry
from ptmtools.cells.planes import bounds
from ptmtools.cells.portals import Portal, find_portals, flood
from ptmtools.cells.search import Nearby, connect, distinct
from ptmtools.cells.split_planes import DoorPlanes
from ptmtools.cells.structure import Structure, Surroundings, sample, spread_over
from ptmtools.scene.model import Scene

#: A leaf is thinner than this, metres,
THICK = 0.12
#: its width, down to one of a narrow pair, and its height are in these ranges.
WIDE, HIGH = (0.3, 2.4), (1.8, 3.0)
#: It fills this share of its rectangle: a frame fills a fifth, a leaf with a window more.
FILLED = 0.5
#: Leaves of a pair are nearer to one another than this, metres.
PAIR = 0.03


@dataclass(frozen=True)
class DoorLeaf:
    """One leaf of a door."""

    name: str
    axes: Floats  # (3, 3) unit vectors: across, along, and up
    low: Floats  # (3,) and
    high: Floats  # (3,) its box along these axes, metres
    triangles: Ints  # of the scene, ascending

    @property
    def middle(self) -> Floats:
        """(3,) metres."""
        return np.asarray((self.low + self.high) / 2 @ self.axes)

    def grid(self, beyond: float) -> tuple[Floats, Floats]:
        """(n, 3) points spread over the leaf, ``beyond`` metres in front of it, and as many
        behind."""
        share = (np.arange(_GRID) + 0.5) / _GRID
        along, up = (a.ravel() for a in np.meshgrid(share, share, indexing="ij"))
        size = self.high - self.low
        rest = np.stack([self.low[1] + along * size[1], self.low[2] + up * size[2]], axis=1)
        front, back = (
            np.column_stack([np.full(len(rest), depth), rest]) @ self.axes
            for depth in (self.high[0] + beyond, self.low[0] - beyond)
        )
        return front, back


def find_doors(fabric: Fabric, structure: Structure) -> list[DoorLeaf]:
    """The door leaves of a scene, in the order of their first triangles in the file."""
    scene, is_door = fabric.scene, fabric.door
    free = is_door | ~(fabric.structural | fabric.detail)
    named = triangles_named(scene, is_door_name) & free
    slack = structure.tolerance.plane
    designated = _pieces(scene, np.flatnonzero(is_door))
    by_name = _named_slabs(scene, np.flatnonzero(named), slack)
    leaf = _leaf_of_slab(by_name, slack)
    by_name = by_name.only(free_on_both_sides(by_name.merge(leaf), structure)[leaf])
    flat = _flat(scene, structure, np.flatnonzero((free & ~is_door)[structure.source]))
    by_shape = _closing(flat, structure, fabric.options.wall_thickness)
    slabs = designated.append(by_name).append(by_shape)
    leaf = _leaf_of_slab(slabs, slack)
    slab_named = np.bincount(leaf, np.arange(len(slabs)) < len(designated) + len(by_name)) > 0
    leaves = _leaves(fabric, slabs.merge(leaf), slab_named, free, is_door | named, slack)
    return sorted(leaves, key=lambda leaf: int(leaf.triangles[0]))


def _door_sized(slabs: Slabs, slack: float) -> Bools:
    """(k,) which slabs are upright and of the size of a door leaf."""
    thick, wide, high = slabs.size.T
    result: Bools = (
        slabs.upright
        & (thick <= THICK + slack)
        & (wide >= WIDE[0] - slack)
        & (wide <= WIDE[1] + slack)
        & (high >= HIGH[0] - slack)
        & (high <= HIGH[1] + slack)
    )
    return result


def _pieces(scene: Scene, triangles: Ints) -> Slabs:
    """The connected pieces of objects, of these triangles."""
    mesh = Welded.from_triangles(scene.points, scene.triangles[triangles])
    source = triangles[mesh.source]
    return Slabs.from_triangles(
        mesh.corners, _cross(connected_pieces(mesh), scene.triangle_object[source])
    )


def _named_slabs(scene: Scene, triangles: Ints, slack: float) -> Slabs:
    """The pieces and the rectangles of these triangles that have the size of a door. A piece with
    several rectangles of that size is no leaf, unless they are the two faces of one slab."""
    facets, source = facets_of(scene, triangles)
    corners, owner = facets.mesh.corners, scene.triangle_object[source]
    piece, region = (_cross(part, owner) for part in (connected_pieces(facets.mesh), facets.region))
    pieces, flat = (Slabs.from_triangles(corners, group) for group in (piece, region))
    whole = np.zeros(len(flat), dtype=np.int64)
    whole[region] = piece
    fits = _door_sized(flat, slack)
    flat, whole = flat.only(fits), whole[fits]
    grid = scene.tolerance.grid
    filled = flat.filled_share(grid) >= FILLED
    flat, whole = flat.only(filled), whole[filled]
    leaf = _leaf_of_slab(flat, slack)
    faces = np.bincount(leaf)[leaf]
    alone = np.bincount(whole)[whole] == 1 if len(whole) else np.zeros(0, dtype=bool)
    pieces = pieces.only(_door_sized(pieces, slack))
    pieces = pieces.only(pieces.filled_share(grid) >= FILLED)
    return pieces.append(flat.only((faces > 1) | alone))


def _flat(scene: Scene, structure: Structure, which: Ints) -> Slabs:
    """The flat regions of the structure of the size of a door, separated by object and material."""
    source = structure.source[which]
    group = _cross(
        structure.region[which], scene.triangle_object[source], scene.triangle_material[source]
    )
    slabs = Slabs.from_triangles(structure.corners[which], group)
    return slabs.only(_door_sized(slabs, structure.tolerance.plane))


def _cross(*names: NDArray[np.integer]) -> Ints:
    """(n,) numbers from 0, one for each combination of (n,) names."""
    result = np.zeros(len(names[0]), dtype=np.int64)
    for name in names:
        key = result * (int(name.max(initial=0)) + 1) + name
        result = np.unique(key, return_inverse=True)[1].reshape(-1)
    return result


def _closing(slabs: Slabs, structure: Structure, wall_thickness: float) -> Slabs:
    """The slabs that close an opening in a wall, alone or as a pair."""
    if not len(slabs):
        return slabs
    leaf = _leaf_of_slab(slabs, structure.tolerance.plane)
    leaves = slabs.merge(leaf)
    fits = _door_sized(leaves, structure.tolerance.plane)
    pair = leaves.find_near_pairs(PAIR)
    first, second = pair.T
    thick, wide, high = np.moveaxis(leaves.overlaps(first, second), -1, 0)
    paired = fits[first] & fits[second] & (np.abs(wide) <= PAIR)
    paired &= (thick >= -structure.tolerance.plane) & (high >= 0.9 * leaves.size[first, 2])
    first, second = first[paired], second[paired]
    door = connect(len(leaves), np.stack([first, second], axis=1))
    door = np.unique(door, return_inverse=True)[1].reshape(-1)
    closes = close_openings(leaves.merge(door), structure, wall_thickness)
    return slabs.only((closes[door] & fits)[leaf])


def _leaf_of_slab(slabs: Slabs, slack: float) -> Ints:
    """(k,) leaves from 0: parallel slabs behind one another are one leaf."""
    pair = slabs.find_near_pairs(THICK)
    first, second = pair.T
    overlap = slabs.overlaps(first, second)
    least = np.minimum(slabs.size[first], slabs.size[second])
    together = slabs.size[first, 0] + slabs.size[second, 0] - overlap[:, 0]
    alike = (together <= THICK + slack) & (overlap[:, 1:] > least[:, 1:] / 2).all(axis=1)
    group = connect(len(slabs), pair[alike])
    return np.unique(group, return_inverse=True)[1].reshape(-1)


def _leaves(
    fabric: Fabric, slabs: Slabs, slab_named: Bools, free: Bools, named: Bools, slack: float
) -> Iterator[DoorLeaf]:
    """The leaves that fill slabs, from those triangles of the scene that are ``free``, (T,).

    A flat region belongs to a leaf if it lies wholly within it. ``slab_named``: (k,) which slabs
    have a door's name, ``named``: (T,) which triangles have; these may project from the slab, like
    handles. Other triangles in the rim of a named slab are the jambs of a wall as thin as the leaf.
    """
    if not len(slabs):
        return
    scene, source = fabric.scene, fabric.source
    corners = scene.corners
    region = np.zeros(len(corners), dtype=np.int64)
    owner = scene.triangle_object[source], scene.triangle_material[source]
    region[source] = 1 + _cross(fabric.facets.region, *owner)
    size = np.bincount(region)
    nearby = Nearby(corners, slack)
    reach = np.array([RELIEF, slack, slack])
    for axes, low, high, is_named in zip(
        slabs.axes, slabs.low, slabs.high, slab_named, strict=True
    ):
        ends = np.stack([low - reach, high + reach])[:, :, None] * axes
        about = nearby.meeting(ends.min(axis=0).sum(axis=0), ends.max(axis=0).sum(axis=0))
        local = corners[about] @ axes.T
        off = np.maximum(low - local, local - high).max(axis=1)
        inside = (off <= reach).all(axis=1) & free[about]
        about, local, off = about[inside], local[inside], off[inside]
        sides = [np.abs(local - side).max(axis=1)[:, 1:] <= slack for side in (low, high)]
        belongs = (off[:, 0] <= slack) & ~(is_named & np.any(sides, axis=(0, 2)))
        belongs |= named[about]
        names, count = np.unique(region[about[belongs]], return_counts=True)
        whole = names[(count == size[names]) | (names == 0)]  # 0: outside all regions
        belongs &= np.isin(region[about], whole)
        belongs[belongs] = ~_find_repeats(corners[about], belongs)
        triangles = about[belongs]
        if len(triangles):
            largest = triangles[np.argmax(areas(corners[triangles]))]
            name = scene.objects[scene.triangle_object[largest]]
            yield DoorLeaf(name, axes, low, high, triangles)


def _find_repeats(corners: Floats, which: Bools) -> Bools:
    """For each triangle ``which``, (n,), of (n, 3, 3), whether one of the others is the same."""
    _, point = distinct(corners.reshape(-1, 3))
    _, row = distinct(np.sort(point.reshape(-1, 3), axis=1))
    return np.isin(row[which], row[~which])


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
    leaf_of_triangle: Ints  # (T,) the leaf to which each triangle of the structure belongs, or -1
    glass: Floats  # (n, 3, 3) transparent triangles, metres
    floor: SampledFloor
    planes: DoorPlanes
    unrecognised: tuple[str, ...]  # objects with a door's name or material, none in a leaf

    @staticmethod
    def recognise(fabric: Fabric, structure: Structure) -> tuple[Doors, Structure]:
        """The doors of a scene, and its structure with their triangles unsimplified."""
        leaves, scene = find_doors(fabric, structure), fabric.scene
        leaf = np.full(len(scene.triangles), -1)
        for i, door in enumerate(leaves):
            leaf[door.triangles] = i
        if leaves:
            structure = Structure.from_fabric(fabric, structure.tolerance, leaf >= 0)
        leaf_of_triangle = leaf[structure.source]
        across = np.array([door.axes[0] for door in leaves]).reshape(-1, 3)
        planes = DoorPlanes.from_structure(structure, leaf_of_triangle, across)
        named = np.unique(scene.triangle_object[triangles_named(scene, is_door_name)])
        walls = np.setdiff1d(named, scene.triangle_object[leaf >= 0])
        unrecognised = tuple(scene.objects[i] for i in walls)
        floor = SampledFloor.from_structure(structure, Walker(*fabric.options.walker).radius)
        glass = scene.corners[~scene.opaque]
        return Doors(leaves, leaf_of_triangle, glass, floor, planes, unrecognised), structure

    def triangles(self, which: Bools) -> NDArray[np.int32]:
        """The triangles of the scene, ascending, of the leaves ``which``, (d,)."""
        chosen = [self.leaves[i].triangles for i in np.flatnonzero(which)]
        return np.unique(np.concatenate([np.zeros(0, np.int64), *chosen])).astype(np.int32)

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
        return bool(which.any()) and bool((which & self.find_sheltered(structure)).any())

    def with_glass(self, structure: Structure) -> Surroundings:
        """The surroundings in which glass counts as a wall."""
        if not len(self.glass):
            return structure.rays
        return Surroundings(np.concatenate([structure.corners, self.glass]), structure.tolerance)

    def find_sheltered(self, structure: Structure) -> Bools:
        """(d,) which leaves have walls around and a roof above the ways on both sides."""
        around = self.with_glass(structure)
        ways = (_ways(door, around) for door in self.leaves)
        roofed = self.floor.roof_share >= ROOFED
        enclosed = [all(around.enclose(points, roofed).all() for points in way) for way in ways]
        return np.array(enclosed, dtype=bool)

    def lead_out(self, portals: list[Portal], outside: Bools) -> Bools:
        """(d,) which leaves have portals around them that lead ``outside``, (L,): some frames leave
        a gap into the wall."""
        # Each leaf's box, a little wider, is compared with the boxes around the n polygons of the
        # portals that lead out, along the axes of the leaf: corners (p, 3), boxes (n, 3).
        ways_out = [p.polygon for p in portals if outside[p.leaves[0]] != outside[p.leaves[1]]]
        reach = np.array([RELIEF, _BEYOND, _BEYOND])
        result = np.zeros(len(self.leaves), dtype=bool)
        if ways_out:
            corners = np.concatenate(ways_out)
            first = np.cumsum([0, *(len(polygon) for polygon in ways_out[:-1])])
            for i, door in enumerate(self.leaves):
                local = corners @ door.axes.T
                low, high = (f.reduceat(local, first) for f in (np.minimum, np.maximum))
                meets = (high >= door.low - reach) & (low <= door.high + reach)
                result[i] = meets.all(axis=1).any()
        return result


def _ways(door: DoorLeaf, around: Surroundings) -> Iterator[Floats]:
    """The points on the way through a door, in front of it and behind."""
    for side, turn in zip(door.grid(RELIEF), (1.0, -1.0), strict=True):
        start, to = side.mean(axis=0), turn * door.axes[0]
        free = around.first(start[None], to[None])[0][0]
        distances = [d for d in _WAY if d < free] or [free / 2]
        yield start + np.array(distances)[:, None] * to


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
        which &= doors.find_sheltered(structure)
    rooms = tuple(np.flatnonzero(within).tolist())
    outside = flood(len(tree.leaves), portals, tuple(np.flatnonzero(outer).tolist()))
    while which.any():
        opened, more = _open(doors, which, structure, tree, portals, hiding)
        if not (flood(len(tree.leaves), more, rooms) & outer).any():
            return which, opened, more
        out = doors.lead_out(more, outside) & which
        which = which & ~out & out.any()
    return None


def _open(
    doors: Doors,
    which: Bools,
    structure: Structure,
    tree: Tree,
    portals: list[Portal],
    hiding: bool,
) -> tuple[Tree, list[Portal]]:
    """The tree and its portals with the doors ``which``, (d,), open."""
    free = np.append(which, False)[doors.leaf_of_triangle]
    near = structure.tolerance.plane
    walls, fresh = list(tree.walls), []
    united: dict[bytes, Geometry] = {}  # of planes with several nodes
    for node, wall in enumerate(tree.walls):
        plane, body = wall.frame.plane, tree.capped.get(node)
        if body is None:
            flat = structure.nearby.find_between(plane, -near, near)
        else:
            flat = structure.nearby.meeting(*bounds(body.points))
        if free[flat].any():
            flat = flat[structure.lie_in(plane, flat)]
        if free[flat].any():
            rest = flat[~free[flat]]
            key = plane.tobytes() + rest.tobytes()
            if key not in united:
                united[key] = structure.unite(wall.frame, rest)
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
    roofed: share of the floor between walls, by area, that has a surface above it.
    rooms: number of points in rooms, under a roof and between walls, that sight lines start from.
    leaving: share of these lines that leave the model; 0 without rooms.
    """

    doors: tuple[str, ...]
    roofed: float
    rooms: int
    leaving: float

    @property
    def looks_closed(self) -> bool:
        """Whether it looks closed."""
        return self.rooms > 0 and self.leaving <= CLOSED


def enclosure(scene: Scene, options: SubdivideOptions | None = None) -> Enclosure:
    """How enclosed a scene is, its door leaves shut."""
    options = options or SubdivideOptions()
    tolerance = scene.tolerance.for_walls(options.wall_thickness)
    fabric = Fabric.from_scene(scene, options)
    doors, structure = Doors.recognise(fabric, Structure.from_fabric(fabric, tolerance))
    corners, names = structure.corners, tuple(leaf.name for leaf in doors.leaves)
    if not len(corners):
        return Enclosure(names, 0.0, 0, 0.0)
    around = Surroundings(corners, tolerance)
    points = sample(Floors.from_fabric(fabric).corners, 4 * _POINTS) + [0.0, _EYE, 0.0]
    points = spread_over(points[around.enclose(points)], _POINTS)
    leaving = 0.0
    if len(points):
        along = np.tile(_sphere(_LINES), (len(points), 1))
        distance, _ = around.first(np.repeat(points, _LINES, axis=0), along)
        leaving = float(np.isinf(distance).mean())
    return Enclosure(names, doors.floor.roof_share, len(points), leaving)


def _sphere(count: int) -> Floats:
    """(count, 3) unit vectors, spread evenly (Fibonacci's lattice)."""
    step = np.arange(count) + 0.5
    height, turn = 1 - 2 * step / count, np.pi * (1 + np.sqrt(5)) * step
    level = np.sqrt(1 - height**2)
    return np.column_stack([level * np.cos(turn), height, level * np.sin(turn)])
