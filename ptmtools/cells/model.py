"""Convex cells, the BSP tree that locates them, their portals, and the geometry cut to them.

A *leaf* is a convex polyhedron, a reachable leaf of the BSP tree; a *cell* is a union of leaves:
one, or all that make up a room (`leaf_cell`). Index -1 means "no cell": solids, the outside of a
closed model, unreachable or invisible space.

Lists of varying length are CSR: row i of ``x`` is ``x[x_start[i]:x_start[i + 1]]``.

The **eye region** is reached space over walkable floor (`places`), within the body of a visitor
there and up to `Walker.reach` above the floor. Visibility and coverage are computed from there
only: no eye is in a wall's hollow or above a ceiling.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, fans, volumes
from ptmtools.cells.options import WALKER, Walker
from ptmtools.cells.planes import bounds
from ptmtools.cells.search import Nearby, distinct
from ptmtools.store.archive import Stored, texts, without_repeats
from ptmtools.tolerance import Tolerance


class EyeRegion:
    """An eye region as a set of points: above (n, 3, 3) triangles, metres, up to a walker's eyes;
    everywhere without triangles."""

    def __init__(self, floor: Floats, walker: Walker) -> None:
        self._floor, self._reach = floor, walker.reach
        self._nearby = Nearby(floor, 0.0)

    @property
    def everywhere(self) -> bool:
        """Whether eyes may be anywhere."""
        return not len(self._floor)

    def is_near(self, low: Floats, high: Floats) -> bool:
        """Whether any of its floor is near the box between two corners."""
        return len(self._nearby.meeting(low - [0, self._reach, 0], high)) > 0

    def clip(self, low: Floats, high: Floats) -> tuple[Floats, Floats]:
        """The part of the box between two corners where eyes can be, as a box; unchanged if that
        part is flat or empty."""
        corners = self._floor[self._nearby.meeting(low - [0, self._reach, 0], high)].reshape(-1, 3)
        if not len(corners):
            return low, high
        bottom = np.maximum(low, corners.min(axis=0))
        top = np.minimum(high, corners.max(axis=0) + [0, self._reach, 0])
        return (bottom, top) if (bottom < top).all() else (low, high)

    def contains(self, points: Floats) -> Bools:
        """(n,) whether the region contains each of the (n, 3) points."""
        from ptmtools.cells.kernels import above_floor

        inside = np.full(len(points), self.everywhere)
        if len(points) and not self.everywhere:
            low, high = bounds(points)
            floor = self._floor[self._nearby.meeting(low - [0, self._reach, 0], high)]
            order = np.argsort(points[:, 0], kind="stable")
            x, along = points[order, 0], floor[:, :, 0]
            first = np.searchsorted(x, along.min(axis=1))
            end = np.searchsorted(x, along.max(axis=1), side="right")
            ascending = np.zeros(len(points), dtype=np.bool_)
            above_floor(points[order], floor, first, end, self._reach, ascending)
            inside[order] = ascending
        return inside


#: The child of a BSP node without a leaf; leaf i is ``-2 - i``.
OUTSIDE = -1


@dataclass(frozen=True)
class Cells:
    """The subdivision of a scene. Metres, world coordinates, float64.

    Attributes
    ----------
    node_plane: (N, 4) unit normal n and offset d; a point x is in front where n·x + d > 0.
    node_child: (N, 2) int32, (front, back): a node index >= 0, `OUTSIDE`, or leaf i as -2 - i.
        Node 0 is the root; a tree without nodes has the single leaf 0.
    root_box: (2, 3) least and greatest corner of the box that was subdivided.
    leaf_cell: (L,) int32 the cell of each leaf; -1 of a reachable one that no standing viewer can
        see.
    leaf_standing: (L,) bool whether the leaf meets the eye region.
    leaf_point, leaf_point_start: (P, 3) vertices of the leaves; (L + 1,) CSR over leaves.
    face_index, face_start, leaf_face_start: faces as loops of indices into `leaf_point`,
        counter-clockwise seen from outside the leaf; `face_start` (F + 1,) is CSR over faces into
        `face_index`, `leaf_face_start` (L + 1,) is CSR over leaves into faces.
    portal_leaf: (K, 2) int32 the leaves that a portal joins.
    portal_plane: (K, 4) its plane; the normal points from `portal_leaf[:, 0]` into
        `portal_leaf[:, 1]`.
    portal_point, portal_start: (Q, 3) convex polygons, counter-clockwise seen against the normal
        (from the side of `portal_leaf[:, 1]`); (K + 1,) CSR over portals.
    portal_area: (K,) m² truly open, of the shape before its convex hull.
    portal_passage: (K,) bool, ascending, whether a drawn door leaf covers a portal: visitors pass,
        sight does not.
    vertex: (W, 3) positions of the geometry cut to the cells.
    vertex_uv: (W, 2) texture coordinates of those vertices, exact at the cuts.
    triangle: (M, 3) int32 into `vertex`, counter-clockwise seen from the front.
    triangle_source: (M,) int32 index of the scene's triangle of which each is a piece.
    triangle_cell: (M, 2) int32 the cell on its front and on its back. Equal where the piece lies
        inside a cell; different only where it lies in a boundary; -1 where that side is no cell.
        A pixel of the item buffer counts for the viewer's side.
    visible: number of the scene's triangles that some cell emits.
    owners: sum, over these, of the number of cells that emit each: the number of emitted triangles
        if cutting added none.
    eye_floor: (E, 3, 3) triangles above which eyes can be, see `EyeRegion`; none if they may be
        anywhere.
    left_out: (Z, 3, 3) walkable triangles of floor in no cell: unreachable and not kept.
    walker: size of the visitor.
    ceiling: height, metres, of the level plane at which rooms of a building without ceilings end;
        the leaves above belong to cells of their own. None for other buildings.
    tolerance: tolerance of the scene.
    closed: whether the flood never met the root box.
    notes: notes of the subdivision, one line each ("open above: …").
    opened: (n,) int32 the scene's triangles, ascending, of door leaves that visitors pass.
    rooms: names of the model for rooms, in the order of their first cells; several may be equal.
    cell_room: (C,) int32 the room that each cell belongs to, -1 for one without a name; empty if
        no room has one.
    """

    node_plane: NDArray[np.float64]
    node_child: NDArray[np.int32]
    root_box: NDArray[np.float64]
    leaf_cell: NDArray[np.int32]
    leaf_standing: NDArray[np.bool_]
    leaf_point: NDArray[np.float64]
    leaf_point_start: NDArray[np.int64]
    face_index: NDArray[np.int32]
    face_start: NDArray[np.int64]
    leaf_face_start: NDArray[np.int64]
    portal_leaf: NDArray[np.int32]
    portal_plane: NDArray[np.float64]
    portal_point: NDArray[np.float64]
    portal_start: NDArray[np.int64]
    portal_area: NDArray[np.float64]
    portal_passage: NDArray[np.bool_]
    vertex: NDArray[np.float64]
    vertex_uv: NDArray[np.float64]
    triangle: NDArray[np.int32]
    triangle_source: NDArray[np.int32]
    triangle_cell: NDArray[np.int32]
    tolerance: Tolerance
    eye_floor: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 3, 3)))
    left_out: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 3, 3)))
    walker: Walker = WALKER
    ceiling: float | None = None
    closed: bool = True
    notes: tuple[str, ...] = ()
    visible: int = 0
    owners: int = 0
    opened: NDArray[np.int32] = field(default_factory=lambda: np.zeros(0, dtype=np.int32))
    rooms: tuple[str, ...] = ()
    cell_room: NDArray[np.int32] = field(default_factory=lambda: np.zeros(0, dtype=np.int32))

    @property
    def leaf_count(self) -> int:
        return len(self.leaf_cell)

    @property
    def cell_count(self) -> int:
        return int(self.leaf_cell.max()) + 1 if len(self.leaf_cell) else 0

    def room_name(self, cell: int) -> str:
        """The name of the room that a cell belongs to, "" for none."""
        room = int(self.cell_room[cell]) if self.rooms else -1
        return self.rooms[room] if room >= 0 else ""

    @property
    def room_numbers(self) -> NDArray[np.int32]:
        """(C,) `cell_room`, with a number of its own for each cell in no named room."""
        unnamed = np.arange(len(self.rooms), len(self.rooms) + self.cell_count, dtype=np.int32)
        return np.where(self.cell_room >= 0, self.cell_room, unnamed) if self.rooms else unnamed

    @property
    def standing(self) -> NDArray[np.bool_]:
        """(C,) which cells have a standing leaf; the others are only seen."""
        result = np.zeros(self.cell_count, dtype=np.bool_)
        result[self.leaf_cell[self.leaf_standing & (self.leaf_cell >= 0)]] = True
        return result

    @property
    def eyes(self) -> EyeRegion:
        """Where eyes can be."""
        return EyeRegion(self.eye_floor, self.walker)

    @property
    def portal_cell(self) -> NDArray[np.int32]:
        """(K, 2) the cells that each portal joins, equal within one; -1 for no cell."""
        return self.leaf_cell[self.portal_leaf].reshape(-1, 2)

    @property
    def portal_count(self) -> int:
        return len(self.portal_leaf)

    @property
    def in_ceiling(self) -> NDArray[np.bool_]:
        """(K,) which portals lie in the ceiling."""
        if self.ceiling is None:
            return np.zeros(self.portal_count, dtype=np.bool_)
        return np.asarray((self.portal_plane == [0.0, 1.0, 0.0, -self.ceiling]).all(axis=1))

    @property
    def sight_count(self) -> int:
        """Number of the portals that sight passes, the first ones."""
        return int(np.count_nonzero(~self.portal_passage))

    def portal(self, k: int) -> NDArray[np.float64]:
        """(n, 3) polygon of portal ``k``."""
        return self.portal_point[self.portal_start[k] : self.portal_start[k + 1]]

    def leaf_points(self, leaf: int) -> NDArray[np.float64]:
        """(n, 3) vertices of a leaf."""
        return self.leaf_point[self.leaf_point_start[leaf] : self.leaf_point_start[leaf + 1]]

    def tetrahedra(self) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """(n, 4, 3) tetrahedra that fill the leaves, from the middle of their vertices to fans over
        their faces, and (n,) the leaf of each, ascending."""
        points = np.diff(self.leaf_point_start)
        if not len(points):
            return np.zeros((0, 4, 3)), np.zeros(0, np.int64)
        middle = np.add.reduceat(self.leaf_point, self.leaf_point_start[:-1]) / points[:, None]
        corners, face = fans(self.face_start)
        leaf = np.searchsorted(self.leaf_face_start, face, "right") - 1
        triangles = self.leaf_point[self.face_index[corners]]
        return np.concatenate([middle[leaf, None], triangles], axis=1), leaf

    def leaf_volumes(self) -> NDArray[np.float64]:
        """(L,) m³."""
        corners, leaf = self.tetrahedra()
        return np.bincount(leaf, volumes(corners), self.leaf_count).astype(np.float64)

    def cell_volumes(self, *, standing: bool = False) -> NDArray[np.float64]:
        """(C,) m³, of all leaves, or of the ``standing`` ones only."""
        counts = self.leaf_cell >= 0
        counts &= self.leaf_standing | (not standing)
        volume = self.leaf_volumes()[counts]
        return np.bincount(self.leaf_cell[counts], volume, self.cell_count).astype(np.float64)

    def adjacent(self) -> list[NDArray[np.int32]]:
        """For every cell the other cells with which it shares a portal, ascending."""
        ends = self.portal_cell
        both = np.unique(np.concatenate([ends, ends[:, ::-1]]), axis=0)
        both = both[(both[:, 0] != both[:, 1]) & (both >= 0).all(axis=1)]
        cut = np.searchsorted(both[:, 0], np.arange(1, self.cell_count))
        return np.split(both[:, 1].astype(np.int32), cut) if self.cell_count else []

    def locate_leaf(self, points: NDArray[np.float64]) -> NDArray[np.int32]:
        """(n,) leaf that contains each of the (n, 3) points, or -1; a point in a plane is behind
        it."""
        points = np.asarray(points, dtype=np.float64).reshape(-1, 3)
        inside = np.all((points >= self.root_box[0]) & (points <= self.root_box[1]), axis=1)
        at = np.full(len(points), OUTSIDE, dtype=np.int64)
        if self.leaf_count:
            at[inside] = descend(self.node_plane, self.node_child, points[inside])
        return np.where(at <= -2, -2 - at, -1).astype(np.int32)

    def locate(self, points: NDArray[np.float64]) -> NDArray[np.int32]:
        """(n,) cell that contains each of the (n, 3) points, or -1."""
        leaf = self.locate_leaf(points)
        if self.leaf_count == 0:
            return leaf
        return np.where(leaf >= 0, self.leaf_cell[leaf], -1).astype(np.int32)

    def emitted(self, two_sided: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
        """The pieces that each cell emits; ``two_sided`` is the scene's (T,) flag.

        Returns (triangle, cell), both (n,), ordered by cell, then triangle. A piece belongs to
        the cell that it faces; a two-sided piece lying in a boundary to the cells on both sides
        (design, "Ownership"). One-sided pieces whose front is no cell have no owner.
        """
        front, back = self.triangle_cell[:, 0], self.triangle_cell[:, 1]
        behind = (back != front) & two_sided[self.triangle_source]
        triangle = np.concatenate([np.arange(len(front)), np.flatnonzero(behind)])
        cell = np.concatenate([front, back[behind]])
        kept = cell >= 0
        triangle, cell = triangle[kept], cell[kept]
        order = np.lexsort((triangle, cell))
        return triangle[order].astype(np.int64), cell[order].astype(np.int32)

    def to_arrays(self) -> dict[str, NDArray[np.generic]]:
        """The subdivision as plain arrays."""
        arrays = {f.name: getattr(self, f.name) for f in fields(self)}
        names = ("walker", "ceiling", "closed", "notes", "visible", "owners")
        about = {name: arrays.pop(name) for name in names}
        rooms, cell_room = arrays.pop("rooms"), arrays.pop("cell_room")
        if rooms:
            about["rooms"], arrays["cell_room"] = rooms, cell_room
        text = json.dumps(about, sort_keys=True, ensure_ascii=False)
        arrays |= arrays.pop("tolerance").to_arrays()
        floor = arrays["eye_floor"].reshape(-1, 3)
        first, corner = distinct(floor)
        arrays["eye_point"] = floor[first]
        arrays["eye_floor"] = corner.reshape(-1, 3).astype(np.int32)
        arrays = without_repeats(arrays, "vertex_uv", "triangle_cell")
        return {**arrays, "about": np.frombuffer(text.encode(), dtype=np.uint8)}

    @staticmethod
    def from_arrays(arrays: Mapping[str, NDArray[np.generic]]) -> Cells:
        """Inverse of `to_arrays`.

        Raises KeyError, TypeError or ValueError for invalid arrays. `triangle_source` is not
        checked against the scene.
        """
        stored = Stored(arrays)
        about = json.loads(stored.array("about", np.uint8, None).tobytes().decode())
        leaf_cell = stored.array("leaf_cell", np.int32, None)
        leaves, cells = len(leaf_cell), int(leaf_cell.max(initial=-1)) + 1
        rooms = texts(about.get("rooms", []), "rooms")
        cell_room = np.zeros(0, dtype=np.int32)
        if rooms:
            cell_room = stored.indices("cell_room", np.int32, cells, low=-1, high=len(rooms))
        eyes = stored.array("eye_point", np.float64, None, 3, finite=True)
        return Cells(
            **_read_leaves(stored, leaves),
            **_read_portals(stored, leaves),
            **_read_geometry(stored, cells),
            tolerance=Tolerance.from_arrays(arrays),
            eye_floor=eyes[stored.indices("eye_floor", np.int32, None, 3, high=len(eyes))],
            left_out=stored.array("left_out", np.float64, None, 3, 3, finite=True),
            walker=Walker(*map(float, about["walker"])),
            ceiling=None if about["ceiling"] is None else float(about["ceiling"]),
            closed=bool(about["closed"]),
            notes=texts(about["notes"], "notes"),
            visible=int(about["visible"]),
            owners=int(about["owners"]),
            rooms=rooms,
            cell_room=cell_room,
        )


def _read_leaves(stored: Stored, leaves: int) -> dict[str, NDArray[Any]]:
    """The tree and its leaves, checked, by their names in `Cells`."""
    planes = stored.array("node_plane", np.float64, None, 4, finite=True)
    nodes = len(planes)
    children = stored.indices("node_child", np.int32, nodes, 2, low=-1 - leaves, high=nodes)
    if ((children >= 0) & (children <= np.arange(nodes)[:, None])).any():
        raise ValueError("node_child leads back")
    points = stored.array("leaf_point", np.float64, None, 3, finite=True)
    corners = stored.indices("face_index", np.int32, None, high=len(points))
    face_start = _solid_starts(stored, "face_start", None, len(corners), 3)
    return {
        "node_plane": planes,
        "node_child": children,
        "root_box": stored.array("root_box", np.float64, 2, 3, finite=True),
        "leaf_cell": stored.indices("leaf_cell", np.int32, leaves, low=-1, high=leaves),
        "leaf_standing": stored.array("leaf_standing", np.bool_, leaves),
        "leaf_point": points,
        "leaf_point_start": _solid_starts(stored, "leaf_point_start", leaves, len(points), 4),
        "face_index": corners,
        "face_start": face_start,
        "leaf_face_start": _solid_starts(stored, "leaf_face_start", leaves, len(face_start) - 1, 4),
    }


def _read_portals(stored: Stored, leaves: int) -> dict[str, NDArray[Any]]:
    """The portals, checked, by their names in `Cells`."""
    points = stored.array("portal_point", np.float64, None, 3, finite=True)
    ends = stored.indices("portal_leaf", np.int32, None, 2, high=leaves)
    passage = stored.array("portal_passage", np.bool_, len(ends))
    if (passage[:-1] > passage[1:]).any():
        raise ValueError("portal_passage does not ascend")
    return {
        "portal_leaf": ends,
        "portal_plane": stored.array("portal_plane", np.float64, len(ends), 4, finite=True),
        "portal_point": points,
        "portal_start": _solid_starts(stored, "portal_start", len(ends), len(points), 3),
        "portal_area": stored.array("portal_area", np.float64, len(ends), finite=True),
        "portal_passage": passage,
    }


def _read_geometry(stored: Stored, cells: int) -> dict[str, NDArray[Any]]:
    """The pieces of the model, checked, by their names in `Cells`."""
    vertex = stored.array("vertex", np.float64, None, 3, finite=True)
    triangle = stored.indices("triangle", np.int32, None, 3, high=len(vertex))
    n = len(triangle)
    stored = stored.repeat_rows(len(vertex), "vertex_uv").repeat_rows(n, "triangle_cell")
    return {
        "vertex": vertex,
        "vertex_uv": stored.array("vertex_uv", np.float64, len(vertex), 2, finite=True),
        "triangle": triangle,
        "triangle_source": stored.indices("triangle_source", np.int32, n, high=1 << 31),
        "triangle_cell": stored.indices("triangle_cell", np.int32, n, 2, low=-1, high=cells),
        "opened": stored.indices("opened", np.int32, None, high=1 << 31),
    }


def _solid_starts(
    stored: Stored, name: str, rows: int | None, total: int, least: int
) -> NDArray[np.int64]:
    """The row starts of a CSR whose rows have at ``least`` so many entries: none is flat."""
    start = stored.starts(name, rows, total)
    if (np.diff(start) < least).any():
        raise ValueError(f"{name} has a flat row")
    return start


def descend(
    planes: NDArray[np.float64], children: NDArray[np.int32], points: NDArray[np.float64]
) -> NDArray[np.int64]:
    """(n,) the ends of points in a BSP tree, as in `Cells.node_child`: `OUTSIDE`, or leaf i as
    -2 - i; a point in a plane is behind it."""
    at = np.full(len(points), 0 if len(planes) else -2, dtype=np.int64)
    active = np.flatnonzero(at >= 0)
    while len(active):
        plane = planes[at[active]]
        front = np.einsum("ij,ij->i", plane[:, :3], points[active]) + plane[:, 3] > 0
        at[active] = children[at[active], np.where(front, 0, 1)]
        active = active[at[active] >= 0]
    return at
