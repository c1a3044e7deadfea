"""The rooms that a model names (IfcSpace): which volumes are usable, which leaves are in them, and
splits where two of them touch without a wall.

A volume may be anything: open, a duplicate, that of a storey, far too large. One is left out, with
a note, unless it

- is closed: winding numbers are whole at nearly all points of its box;
- has space for a visitor, and is no larger than the building;
- is no duplicate of an earlier one;
- does not consist of other volumes: it is a storey, a flat or an area if at least two others, which
  together have half of its size, lie in it.

A leaf is in a volume if at least half of it is: of the part where eyes can be, if there is any,
because volumes often end at a suspended ceiling. Of several volumes the one counts that has the
largest share, of equal ones the smallest: volumes overlap where programs export areas of several
kinds. Points spread over volumes and leaves decide (intersecting leaves with meshes exactly would
take seconds for a thousand leaves). A room has the name of the volume that most of it is in.

In an open plan, a kitchen and the living room are two rooms of one leaf. A **contact** is the part
that a face of one volume and a face of another share: they face each other and are no farther
apart, or overlap no deeper, than a wall is thick. Its plane, half way between the two, splits the
leaves around it, once all other splits and the flood are done, so that no wall depends on it.
Nothing blocks in it but the structure that lies in it, so it becomes a portal. Volumes often end in
the middle of walls, where a contact would split the wall's inside and every doorway. So both parts
of a leaf must be deeper than a wall may be, and the part of the contact in the leaf wider than a
visitor: volumes overlap their neighbours by some centimetres.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import shapely

from ptmtools.arrays import Bools, Floats, Ints, areas, cross, normals, volumes
from ptmtools.cells.bsp import Tree
from ptmtools.cells.model import Cells
from ptmtools.cells.options import SubdivideOptions
from ptmtools.cells.planar import Geometry, buffer, intersection, unite
from ptmtools.cells.planes import PlaneFrame, Polyhedron, bounds, cut, section
from ptmtools.cells.portals import Portal, find_portals
from ptmtools.cells.structure import Structure, WallPlane
from ptmtools.quantities import count
from ptmtools.scene.model import RoomVolume, Scene
from ptmtools.tolerance import TIE_SHARE, Tolerance, rank

#: Points in the box of a volume, and in a leaf.
_IN_BOX, _IN_LEAF = 216, 32
#: A winding number is whole if it differs from an integer by less; it is at all but this share of
#: the points around a closed mesh.
_WHOLE, _NOT_WHOLE = 0.05, 0.05
#: Of two volumes, one is in the other if this share of it is; and they are the same if each is.
_WITHIN = 0.9
#: A volume consists of others if at least this number, with this share of its size, are in it.
_SEVERAL, _COVERED = 2, 0.5
#: A leaf is in a volume if this share of it is; a room has the name of a volume if more than this
#: share of its standing leaves is in it.
_MOST = 0.5
#: Shares are compared in this many digits.
_DIGITS = 6
#: Pairs of points and triangles that are handled at a time.
_AT_ONCE = 1 << 19
#: Names in a note.
_NAMED = 3
#: Steps of an even sequence in three dimensions (Roberts's R3).
_STEPS = 1 / 1.2207440846057596 ** np.arange(1, 4)


@dataclass(frozen=True)
class Volume:
    """A closed volume: name, (T, 3, 3) corners of its mesh in metres, faces outwards, and m³."""

    name: str
    corners: Floats
    size: float

    @staticmethod
    def from_room(room: RoomVolume) -> Volume:
        """A volume of any mesh, with its faces outwards if it is closed."""
        corners = room.points[room.triangles]
        middle = corners.reshape(-1, 3).sum(axis=0) / max(3 * len(corners), 1)
        a, b, c = (corners - middle).transpose(1, 0, 2)
        size = float(np.einsum("ij,ij->", a, cross(b, c))) / 6
        return Volume(room.name, corners if size >= 0 else corners[:, ::-1], abs(size))

    @cached_property
    def box(self) -> Floats:
        """(2, 3) least and greatest corner."""
        return np.stack([self.corners.min(axis=(0, 1)), self.corners.max(axis=(0, 1))])

    @cached_property
    def samples(self) -> tuple[Floats, Floats]:
        """(n, 3) points of its box, and (n,) how often it winds around each."""
        low, high = self.box
        points = low + _even(_IN_BOX) * (high - low)
        return points, windings(points, self.corners)

    @property
    def is_closed(self) -> bool:
        """Whether the mesh is closed, but for small gaps."""
        winding = self.samples[1]
        return bool((np.abs(winding - np.rint(winding)) >= _WHOLE).mean() <= _NOT_WHOLE)

    def contains(self, points: Floats) -> Bools:
        """(n,) whether each of (n, 3) points is in the volume."""
        low, high = self.box
        result: Bools = ((points >= low) & (points <= high)).all(axis=1)
        result[result] = windings(points[result], self.corners) > 1 / 2
        return result

    def share_in(self, container: Volume) -> float:
        """The share of it that is in another volume."""
        points, winding = self.samples
        inner = points[winding > 1 / 2]
        return float(container.contains(inner).mean()) if len(inner) else 0.0


def windings(points: Floats, corners: Floats) -> Floats:
    """(n,) how often (T, 3, 3) triangles wind around (n, 3) points: 1 within a closed mesh with its
    faces outwards, 0 outside; the solid angle of each triangle by Van Oosterom & Strackee (1983).
    """
    result = np.zeros(len(points))
    step = max(1, _AT_ONCE // max(len(corners), 1))
    for first in range(0, len(points), step):
        a, b, c = (corners - points[first : first + step, None, None]).transpose(2, 0, 1, 3)
        la, lb, lc = (np.linalg.norm(side, axis=-1) for side in (a, b, c))
        up = np.einsum("...i,...i", a, cross(b, c))
        ab, bc, ca = (np.einsum("...i,...i", p, q) for p, q in ((a, b), (b, c), (c, a)))
        angle = np.arctan2(up, la * lb * lc + ab * lc + bc * la + ca * lb)
        result[first : first + step] = angle.sum(axis=1) / (2 * np.pi)
    return result


def _even(count: int) -> Floats:
    """(count, 3) points spread evenly over the unit cube."""
    return np.asarray((np.arange(1, count + 1)[:, None] * _STEPS) % 1.0)


@dataclass(frozen=True)
class Volumes:
    """The usable volumes of a model, in the order of the file, and notes on the others."""

    rooms: tuple[Volume, ...] = ()
    notes: tuple[str, ...] = ()

    @staticmethod
    def from_scene(scene: Scene, options: SubdivideOptions) -> Volumes:
        """The usable volumes of a scene; none with `--spaces none`."""
        if options.spaces == "none" or not scene.rooms:
            return Volumes()
        radius, _, height = options.walker
        least, building_size = (
            (2 * radius) ** 2 * height,
            float(np.ptp(scene.points, axis=0).prod()),
        )
        omitted: dict[str, list[str]] = {}
        rooms: list[Volume] = []
        for room in map(Volume.from_room, scene.rooms):
            if not room.size >= least:
                omitted.setdefault("too small for a visitor", []).append(room.name)
            elif room.size > (1 + TIE_SHARE) * building_size:
                omitted.setdefault("larger than the building", []).append(room.name)
            elif not room.is_closed:
                omitted.setdefault("not closed", []).append(room.name)
            else:
                rooms.append(room)
        kept = []
        for room, fault in zip(rooms, _find_repeats(rooms), strict=True):
            if fault:
                omitted.setdefault(fault, []).append(room.name)
            else:
                kept.append(room)
        notes = tuple(left_out_note(names, fault) for fault, names in omitted.items())
        return Volumes(tuple(kept), notes)

    def assign_leaves(self, cells: Cells) -> Ints:
        """(L,) the volume that each leaf is in, -1 for none."""
        if not self.rooms:
            return np.full(cells.leaf_count, -1, dtype=np.int64)
        points = _points_in_leaves(cells)
        flat = points.reshape(-1, 3)
        weight = cells.eyes.contains(flat).reshape(points.shape[:2])
        weight &= cells.leaf_standing[:, None]
        weight |= ~weight.any(axis=1, keepdims=True)
        total = weight.sum(axis=1)
        low, high = points.min(axis=1), points.max(axis=1)
        best, result = np.zeros(cells.leaf_count), np.full(cells.leaf_count, -1, dtype=np.int64)
        for k in np.argsort([room.size for room in self.rooms], kind="stable").tolist():
            room = self.rooms[k]
            near = np.flatnonzero(((low <= room.box[1]) & (high >= room.box[0])).all(axis=1))
            inside = room.contains(points[near].reshape(-1, 3)).reshape(-1, _IN_LEAF)
            share = np.round((inside & weight[near]).sum(axis=1) / total[near], _DIGITS)
            more = (share >= _MOST) & (share > best[near])
            best[near[more]], result[near[more]] = share[more], k
        return result


def _find_repeats(rooms: Sequence[Volume]) -> list[str]:
    """For each closed volume why it is left out beside the others, or ""."""
    faults = [""] * len(rooms)
    boxes = np.array([room.box for room in rooms]).reshape(-1, 2, 3)
    inner: list[list[int]] = [[] for _ in rooms]
    for i, room in enumerate(rooms):
        meets = ((boxes[:, 0] <= room.box[1]) & (boxes[:, 1] >= room.box[0])).all(axis=1)
        for j in np.flatnonzero(meets).tolist():
            inner_room = rooms[j]
            if i == j or faults[i] or faults[j] or room.size < _WITHIN * inner_room.size:
                continue
            if inner_room.share_in(room) < _WITHIN:
                continue
            if _WITHIN * room.size > inner_room.size or room.share_in(inner_room) < _WITHIN:
                inner[i].append(j)
            else:
                faults[max(i, j)] = "a duplicate of another"
    for i, others in enumerate(inner):
        distinct_rooms = [j for j in others if faults[j] != "a duplicate of another"]
        covered = sum(rooms[j].size for j in distinct_rooms)
        if (
            not faults[i]
            and len(distinct_rooms) >= _SEVERAL
            and covered >= _COVERED * rooms[i].size
        ):
            faults[i] = "around several others"
    return faults


def left_out_note(names: Sequence[str], reason: str) -> str:
    """The note on spaces that were left out."""
    called = ", ".join(name for name in names[:_NAMED] if name)
    more = ", …" if len(names) > _NAMED else ""
    return f"{count(len(names), 'space')} of the model left out, {reason}" + (
        f": {called}{more}" if called else ""
    )


def _points_in_leaves(cells: Cells) -> Floats:
    """(L, n, 3) points spread over the volume of each leaf."""
    corners, leaf = cells.tetrahedra()
    filled = np.cumsum(volumes(corners))
    start = np.searchsorted(leaf, np.arange(cells.leaf_count + 1))
    before = np.append(0.0, filled)[start]
    share = (np.arange(_IN_LEAF) + 1 / 2) / _IN_LEAF
    at = before[:-1, None] + share * np.diff(before)[:, None]
    chosen = np.searchsorted(filled, at)
    chosen = np.clip(chosen, start[:-1, None], start[1:, None] - 1)
    # Uniform over a tetrahedron: the gaps between sorted numbers.
    parts = np.diff(np.sort(_even(_IN_LEAF), axis=1), axis=1, prepend=0.0, append=1.0)
    return np.asarray(np.einsum("nk,lnki->lni", parts, corners[chosen]))


def unused_notes(volumes: Volumes, before: Ints, after: Ints) -> Iterator[str]:
    """Notes on volumes that no leaf is in, or of several rooms: (L,) leaves are in them before
    these are left out, but not after."""
    rooms = range(len(volumes.rooms))
    empty = [k for k in rooms if not (before == k).any()]
    several = [k for k in rooms if (before == k).any() and not (after == k).any()]
    for which, reason in ((empty, "no cell is mostly inside"), (several, "several rooms in one")):
        if which:
            yield left_out_note([volumes.rooms[k].name for k in which], reason)


def name_cells(cells: Cells, volumes: Volumes, volume: Ints, room: Ints) -> Cells:
    """Cells with names: those of the volume that most of their room is in. A cell of several rooms
    has the name of one that is most of it.

    ``volume``, ``room``: (L,) the volume, -1 for none, and the room that each leaf is in.
    """
    leaf = np.flatnonzero(cells.leaf_cell >= 0)
    cell, size = cells.leaf_cell[leaf], cells.leaf_volumes()[leaf]
    rooms, row = np.unique(room[leaf], return_inverse=True)
    row = row.reshape(-1)
    inside = np.zeros((len(rooms), len(volumes.rooms) + 1))  # the last column: in no volume
    np.add.at(inside, (row, volume[leaf]), size * cells.leaf_standing[leaf])
    best = inside[:, :-1].argmax(axis=1)
    mostly = inside[np.arange(len(rooms)), best] > _MOST * inside.sum(axis=1)
    called = [volumes.rooms[k].name * bool(m) for k, m in zip(best.tolist(), mostly, strict=True)]
    pair, part = np.unique(cell.astype(np.int64) * len(rooms) + row, return_inverse=True)
    share = np.bincount(part.reshape(-1), size) / np.bincount(cell, size)[pair // len(rooms)]
    number: dict[int, int] = {}
    cell_room = np.full(cells.cell_count, -1, dtype=np.int32)
    for k in pair[share > _MOST].tolist():
        if called[k % len(rooms)]:
            cell_room[k // len(rooms)] = number.setdefault(k % len(rooms), len(number))
    if not number:
        return cells
    return replace(cells, cell_room=cell_room, rooms=tuple(called[r] for r in number))


#: Contacts are compared by the share of the leaf's section that they cover, in this many digits.
_CONTACT_DIGITS = 4


@dataclass(frozen=True)
class Contact:
    """The plane between two volumes, the part of it in which they touch, and its box in space."""

    frame: PlaneFrame
    shape: Geometry
    low: Floats
    high: Floats


def contacts(
    rooms: Sequence[Volume], options: SubdivideOptions, tolerance: Tolerance
) -> tuple[Contact, ...]:
    """The contacts of volumes with the area of a wall, in the order of the volumes."""
    gap = options.wall_thickness + tolerance.plane
    boxes = np.array([room.box for room in rooms]).reshape(-1, 2, 3)
    layers: dict[int, list[tuple[Floats, Floats]]] = {}
    result = []
    for i, box in enumerate(boxes):
        later = boxes[i + 1 :]
        near = ((later[:, 0] <= box[1] + gap) & (later[:, 1] >= box[0] - gap)).all(axis=1)
        for j in (i + 1 + np.flatnonzero(near)).tolist():
            for k in {i, j} - layers.keys():
                layers[k] = _layers(rooms[k].corners, options.wall_area, tolerance)
            for plane, faces in layers[i]:
                for opposite, opposite_faces in layers[j]:
                    contact = _contact(
                        plane, faces, opposite, opposite_faces, gap, options.wall_area, tolerance
                    )
                    result += [contact] if contact else []
    return tuple(result)


def _layers(corners: Floats, least: float, tolerance: Tolerance) -> list[tuple[Floats, Floats]]:
    """The planes, (4,) facing outwards, in which a mesh has an area of at least ``least`` m², and
    its triangles there."""
    size = areas(corners)
    waiting = rank(size)[: np.count_nonzero(size > 0)]
    result = []
    while len(waiting):
        normal = normals(corners[waiting[:1]])[0]
        normal = normal / np.linalg.norm(normal)
        plane = np.append(normal, -normal @ corners[waiting[0], 0])
        members = _lie_in(plane, corners[waiting], tolerance)
        members[0] = True
        if size[waiting[members]].sum() >= (1 - TIE_SHARE) * least:
            result.append((plane, corners[waiting[members]]))
        waiting = waiting[~members]
    return result


def _lie_in(plane: Floats, corners: Floats, tolerance: Tolerance) -> Bools:
    """(n,) which triangles lie in a plane and face the same side."""
    within = (np.abs(corners @ plane[:3] + plane[3]) <= tolerance.plane).all(axis=1)
    return np.asarray(within & (normals(corners) @ plane[:3] > 0))


def _contact(
    plane: Floats,
    faces: Floats,
    opposite: Floats,
    opposite_faces: Floats,
    gap: float,
    least: float,
    tolerance: Tolerance,
) -> Contact | None:
    """The contact of the ``faces`` of one volume in a plane with those of another volume; None if
    they do not face each other, are more than ``gap`` metres apart or share less than ``least``
    m²."""
    if plane[:3] @ opposite[:3] > -tolerance.cosine:
        return None
    apart = plane[3] + opposite[3]
    if abs(apart) > gap:
        return None
    between = plane.copy()
    between[3] -= apart / 2
    frame = PlaneFrame.from_plane(between)
    first, second = (
        unite(frame.to_plane(part), tolerance.grid) for part in (faces, opposite_faces)
    )
    shape = intersection(np.array([first]), np.array([second]), tolerance.grid)[0]
    if not shapely.area(shape) >= (1 - TIE_SHARE) * least:
        return None
    points = frame.to_space(shapely.get_coordinates(shape))
    return Contact(frame, shape, *bounds(points))


def split_at(
    contacts: Sequence[Contact],
    tree: Tree,
    portals: list[Portal],
    reached: Bools,
    structure: Structure,
    options: SubdivideOptions,
) -> tuple[Tree, list[Portal], Bools]:
    """A tree, its portals and its (L,) reached leaves, with those leaves split at the contacts."""
    tolerance = structure.tolerance
    boxes = np.array([(contact.low, contact.high) for contact in contacts]).reshape(-1, 2, 3)
    leaves, walls = list(tree.leaves), list(tree.walls)
    children = [row.tolist() for row in tree.children]
    parent = {-2 - c: (n, side) for n, row in enumerate(children) for side, c in enumerate(row)}
    waiting = np.flatnonzero(reached).tolist()[::-1] if contacts else []
    stale: set[int] = set()
    while waiting and len(leaves) < options.max_leaves:
        leaf = waiting.pop()
        body = leaves[leaf]
        low, high = bounds(body.points)
        near = ((boxes[:, 0] <= high) & (boxes[:, 1] >= low)).all(axis=1)
        around = [contacts[k] for k in np.flatnonzero(near).tolist()]
        contact = _best(around, body, options, tolerance)
        if contact is None:
            continue
        frame, node, back = contact.frame, len(walls), len(leaves)
        parts = cut(body, frame.plane, node, tolerance.rounding)
        if parts[0] is None or parts[1] is None:
            raise AssertionError("a split that was accepted has two sides")
        if leaf in parent:
            at, side = parent[leaf]
            children[at][side] = node
        children.append([-2 - leaf, -2 - back])
        parent[leaf], parent[back] = (node, 0), (node, 1)
        blocking = structure.unite(frame, structure.find_in(frame.plane))
        walls.append(WallPlane(frame, contact.shape, blocking))
        leaves[leaf] = parts[0]
        leaves.append(parts[1])
        stale.update([node, *(tag for tag in body.tags if tag >= 0)])
        waiting += [back, leaf]
    if not stale:
        return tree, portals, reached
    tree = replace(
        tree,
        walls=tuple(walls),
        children=np.array(children, dtype=np.int32).reshape(-1, 2),
        leaves=tuple(leaves),
    )
    kept = [portal for portal in portals if portal.node not in stale]
    kept += find_portals(tree, tolerance, sorted(stale))
    added = np.ones(len(leaves) - len(reached), dtype=np.bool_)
    return tree, sorted(kept, key=lambda portal: portal.node), np.append(reached, added)


def _best(
    contacts: Sequence[Contact], body: Polyhedron, options: SubdivideOptions, tolerance: Tolerance
) -> Contact | None:
    """The contact that covers the largest share of a body's section, None if none splits it."""
    deep, radius = max(options.wall_thickness, tolerance.thin), options.walker[0]
    best, best_share = None, 0.0
    for contact in contacts:
        plane = contact.frame.plane
        reach = body.points @ plane[:3] + plane[3]
        if min(reach.max(), -reach.min()) < deep:
            continue
        outline = section(body, plane, tolerance.rounding)
        if len(outline) < 3:
            continue
        region = shapely.polygons(contact.frame.to_plane(outline))
        shape = intersection(np.array([contact.shape]), np.array([region]), tolerance.grid)[0]
        share = round(float(shapely.area(shape) / shapely.area(region)), _CONTACT_DIGITS)
        if share > best_share and not shapely.is_empty(buffer(shape, -radius, join_style="mitre")):
            best, best_share = contact, share
    return best
