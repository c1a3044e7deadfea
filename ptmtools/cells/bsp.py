"""The BSP tree: convex leaves, best splits first (Airey 1990; Teller & Séquin 1991).

A node holds a convex polyhedron and the wall fragments inside it, one (multi)polygon per wall
plane. The plane with the best score

    0.5 · occlusion + 0.3 · balance + 0.2 · (1 − splits)

splits it, but what curved walls cut, or what cuts them, weighs 1.0; nodes are split in the order of
the wall area that their best plane brings. Where no wall is left, reveals may split, then door
leaves, then caps (`split_planes`). A side thinner than a leaf may be is refused, so that no leaf is
flat after rounding to float32; where a side would be thinner than the cluster distance, the wall
must close an opening of the near boundary, or be the other face of a thin wall (`_seals`), for
which it waits until no other wall splits.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, ranges
from ptmtools.cells.model import OUTSIDE
from ptmtools.cells.options import SubdivideOptions
from ptmtools.cells.planar import Geometry, buffer, difference, intersection, open_part
from ptmtools.cells.planes import Polyhedron, clip_polygon, cut, section
from ptmtools.cells.split_planes import DoorPlanes, Reveals, find_caps
from ptmtools.cells.structure import Structure, WallPlane
from ptmtools.progress import Progress
from ptmtools.tolerance import TIE_SHARE, Tolerance, rank

OCCLUSION_WEIGHT = 0.5
BALANCE_WEIGHT = 0.3
SPLIT_WEIGHT = 0.2
#: Cuts of facets of a curved wall, and by them, weigh this much more: one plane cuts them all.
CURVE_WEIGHT = 0.8
#: A fragment smaller than this share of `SubdivideOptions.wall_area` no longer splits.
FRAGMENT_SHARE = 0.01
#: Up to this many fragments of a node are tested by their corners, more by their boxes first.
_FEW = 64
#: Up to this many pairs of a plane and a fragment are compared in a node.
_PAIRS = 1 << 21
#: Number of leaves at which a division is first examined for its worth, and the factor to the next.
_FIRST_LOOK, _LOOKS = 512, 8
_NOWHERE = np.zeros((0, 3))  # no points
#: Sources of splits, in this order.
_WALLS, _REVEALS, _DOORS, _CAPS = range(4)


@dataclass(frozen=True, kw_only=True)
class Tree:
    """A BSP tree over the root box, with every leaf, reachable or not."""

    walls: tuple[WallPlane, ...]  # the nodes' planes, and the polygons in them
    children: NDArray[np.int32]  # (N, 2) as in `Cells.node_child`
    leaves: tuple[Polyhedron, ...]  # face tags are node indices
    unsplit: int = 0  # leaves with walls that the limit on leaves kept from splitting
    ended: bool = False  # whether further splits are not worth it
    # The bodies that caps and doors split, by node.
    capped: Mapping[int, Polyhedron] = field(default_factory=dict)
    hung: frozenset[int] = frozenset()  # nodes in the planes of door leaves that hide

    @cached_property
    def planes(self) -> Floats:
        """(N, 4) the nodes' planes."""
        return np.array([wall.frame.plane for wall in self.walls]).reshape(-1, 4)


class _Fragment(NamedTuple):
    """The part of one wall plane inside a node."""

    wall: WallPlane
    shape: Geometry
    area: float
    points: Floats  # (n, 3) the corners of the shape
    outline: Floats  # (m, 3) the node's cross-section with the plane
    section_area: float


class _Task(NamedTuple):
    """A node that waits for its split, the source of its fragments, walls, reveals, doors or caps,
    and known caps. Priorities are distinct."""

    priority: tuple[bool, int, int, int]
    body: Polyhedron
    fragments: list[_Fragment]
    best: int
    parent: tuple[int, int]
    source: int
    caps: Sequence[WallPlane] = ()


@dataclass(frozen=True, kw_only=True)
class SplitPlanes:
    """The planes that may split a box, in the order of their use; caps are those of the
    ``structure``."""

    ceiling: WallPlane | None  # splits first
    walls: list[WallPlane]
    reveals: Reveals
    doors: DoorPlanes
    structure: Structure


def build_tree(
    box: Polyhedron,
    planes: SplitPlanes,
    options: SubdivideOptions,
    progress: Progress,
    cost: Callable[[Tree], float] | None = None,
) -> Tree:
    """Split ``box`` by planes, in the order that the module describes. Splitting ends if the
    ``cost`` of the tree so far, 1 before the first split, is lowered too little between
    `_FIRST_LOOK` and every `_LOOKS` times as many leaves."""
    growth = _Growth(planes, options)
    growth.plant(box)
    look, present = _FIRST_LOOK, 1.0
    while growth.queue:
        if cost and growth.leaf_count >= look:
            look *= _LOOKS
            before, present = present, cost(growth.tree())
            if present > (1 - options.gain) * before:
                return replace(growth.tree(), ended=True)
        growth.split_next()
        progress(len(growth.leaves), growth.leaf_count, "splitting")
    return growth.tree()


class _Growth:
    """A tree that is being split, and the nodes that wait for their split, the best first."""

    def __init__(self, planes: SplitPlanes, options: SubdivideOptions) -> None:
        self._planes, self._options = planes, options
        self._tolerance = planes.structure.tolerance
        self._least = (FRAGMENT_SHARE * options.wall_area, 0.0, 0.0, 0.0)
        self._walls: list[WallPlane] = []
        self._children: list[list[int]] = []
        self._unsplit = 0
        self._capped: dict[int, Polyhedron] = {}
        self._hung: set[int] = set()
        self.leaves: list[Polyhedron] = []
        self.queue: list[_Task] = []

    @property
    def leaf_count(self) -> int:
        """The number of leaves if no waiting node is split."""
        return len(self.leaves) + len(self.queue)

    def tree(self) -> Tree:
        """The tree so far; waiting nodes are leaves."""
        children = np.array(self._children, dtype=np.int32).reshape(-1, 2)
        for k, task in enumerate(self.queue):
            if task.parent[0] >= 0:
                children[task.parent] = -2 - len(self.leaves) - k
        return Tree(
            walls=tuple(self._walls),
            children=children,
            leaves=(*self.leaves, *(task.body for task in self.queue)),
            unsplit=self._unsplit,
            capped=dict(self._capped),
            hung=frozenset(self._hung if self._options.doors in ("pass", "closed") else ()),
        )

    def plant(self, box: Polyhedron) -> None:
        """Begins with the root."""
        fragments = _sections(box, self._planes.walls, self._tolerance)
        ceiling = [self._planes.ceiling] if self._planes.ceiling else []
        if above := _sections(box, ceiling, self._tolerance):
            first = (False, 0, 0, 0)
            heapq.heappush(self.queue, _Task(first, box, [*above, *fragments], 0, (-1, 0), _WALLS))
        else:
            self._push(box, fragments, (-1, 0), _WALLS)

    def split_next(self) -> None:
        """Splits the first of the waiting nodes, unless that would exceed the limit on leaves."""
        task = heapq.heappop(self.queue)
        if self.leaf_count + 2 > self._options.max_leaves:
            self._finish(task.body, task.parent)
            self._unsplit += task.source <= _REVEALS
            return
        tolerance, wall = self._tolerance, task.fragments[task.best].wall
        plane, node = wall.frame.plane, len(self._walls)
        self._walls.append(wall)
        self._children.append([OUTSIDE, OUTSIDE])
        if task.source > _REVEALS:
            self._capped[node] = task.body
        if task.source == _DOORS:
            self._hung.add(node)
        self._place(task.parent, node)
        capping = task.caps  # caps of a body are caps of its parts
        if task.source == _CAPS:
            capping = [f.wall for i, f in enumerate(task.fragments) if i != task.best]
        extents = _Extents(task.fragments)
        ahead = [extents.ahead(facing, tolerance) for facing in (plane, -plane)]
        cut_by = ahead[0] & ahead[1]
        for side, body in enumerate(cut(task.body, plane, node, tolerance.rounding)):
            if body is None:
                raise AssertionError("a split that was accepted has two sides")
            # A part of a node that a door or a cap split may have further reveals and doors.
            if task.source > _REVEALS:
                self._push(body, [], (node, side), _REVEALS, capping)
                continue
            facing = plane if side == 0 else -plane
            rows = [i for i in np.flatnonzero(ahead[side]).tolist() if i != task.best]
            inherited = [
                f._replace(outline=clip_polygon(f.outline, facing, tolerance.rounding))
                for f in (task.fragments[i] for i in rows)
            ]
            whole = [not cut_by[i] for i in rows]
            inside = _fragments(inherited, whole, tolerance)
            self._push(body, inside, (node, side), task.source, capping)

    def _push(
        self,
        body: Polyhedron,
        fragments: list[_Fragment],
        parent: tuple[int, int],
        source: int,
        capping: Sequence[WallPlane] = (),
    ) -> None:
        """Lets a body wait with its best split, of the first source that has one; a leaf if none
        has. ``capping``: caps of a body around it."""
        walls, tolerance = self._walls, self._tolerance
        best = _best_split(body, fragments, self._least[source], walls, tolerance)
        if best < 0 and source == _WALLS:
            best = _best_split(body, fragments, self._least[source], walls, tolerance, sheets=True)
        while best < 0 and source < _CAPS:
            source += 1
            fragments = self._of_source(source, body, capping)
            best = _best_split(body, fragments, self._least[source], walls, tolerance)
        if best < 0:
            self._finish(body, parent)
            return
        share = fragments[best].area / tolerance.extent**2
        priority = (source > _REVEALS, -round(share / TIE_SHARE), len(walls), parent[1])
        task = _Task(priority, body, fragments, best, parent, source, capping)
        heapq.heappush(self.queue, task)

    def _of_source(
        self, source: int, body: Polyhedron, capping: Sequence[WallPlane]
    ) -> list[_Fragment]:
        """The fragments inside a body of the planes of a source other than walls."""
        planes, tolerance = self._planes, self._tolerance
        if source == _REVEALS:
            return _sections(body, planes.reveals.select(body, self._walls), tolerance)
        if source == _DOORS:
            return _sections(body, planes.doors.select(body), tolerance)
        return _sections(body, find_caps(planes.structure, body, capping), tolerance, whole=True)

    def _finish(self, body: Polyhedron, parent: tuple[int, int]) -> None:
        self._place(parent, -2 - len(self.leaves))
        self.leaves.append(body)

    def _place(self, parent: tuple[int, int], child: int) -> None:
        node, side = parent
        if node >= 0:
            self._children[node][side] = child


def _sections(
    body: Polyhedron, walls: list[WallPlane], tolerance: Tolerance, whole: bool = False
) -> list[_Fragment]:
    """The fragments of walls inside a body; those that close its ``whole`` section have exactly the
    area of the section."""
    cuts = [
        _Fragment(w, w.walls, 0.0, _NOWHERE, section(body, w.frame.plane, tolerance.rounding), 0.0)
        for w in walls
    ]
    fragments = _fragments(cuts, [False] * len(cuts), tolerance)
    return [f._replace(area=f.section_area) for f in fragments] if whole else fragments


def _fragments(before: list[_Fragment], whole: list[bool], tolerance: Tolerance) -> list[_Fragment]:
    """Fragments of which the outline alone is that of a node, clipped to it unless they are
    ``whole`` in it, without those of no more area than the rounding of the outline."""
    rows = [i for i, f in enumerate(before) if len(f.outline) >= 3]
    if not rows:
        return []
    flat = [before[i].wall.frame.to_plane(before[i].outline) for i in rows]
    owner = np.repeat(np.arange(len(flat)), [len(outline) for outline in flat])
    regions = shapely.polygons(shapely.linearrings(np.concatenate(flat), indices=owner))
    sections = shapely.area(regions).tolist()
    some = np.array([not whole[i] for i in rows], dtype=np.bool_)
    shapes = np.array([before[i].shape for i in rows], dtype=object)
    shapes[some] = intersection(shapes[some], regions[some], tolerance.grid)
    areas = shapely.area(shapes)
    corners, owner = shapely.get_coordinates(shapes[some], return_index=True)
    start = np.searchsorted(owner, np.arange(np.count_nonzero(some) + 1))
    place = np.cumsum(some) - 1
    kept: list[_Fragment] = []
    for i in np.flatnonzero(areas > tolerance.rounding * tolerance.extent).tolist():
        f = before[rows[i]]._replace(section_area=sections[i])
        if some[i]:
            points = f.wall.frame.to_space(corners[start[place[i]] : start[place[i] + 1]])
            f = f._replace(shape=shapes[i], area=float(areas[i]), points=points)
        kept.append(f)
    return kept


class _Extents:
    """Tests which fragments reach in front of planes, by boxes, then by corners where needed."""

    def __init__(self, fragments: list[_Fragment]) -> None:
        self._points = np.concatenate([f.points for f in fragments])
        self._start = np.cumsum([0] + [len(f.points) for f in fragments])
        low = np.minimum.reduceat(self._points, self._start[:-1])
        high = np.maximum.reduceat(self._points, self._start[:-1])
        self._middle, self._half = (low + high) / 2, (high - low) / 2

    def ahead(self, plane: Floats, tolerance: Tolerance) -> Bools:
        """(n,) which fragments have a point in front of the (4,) plane by more than tolerance."""
        if len(self._middle) <= _FEW:
            distance = self._points @ plane[:3] + plane[3]
            return np.asarray(np.maximum.reduceat(distance, self._start[:-1]) > tolerance.plane)
        middle = self._middle @ plane[:3] + (plane[3] - tolerance.plane)
        half = self._half @ np.abs(plane[:3]) + tolerance.rounding
        result: Bools = middle > half
        unsure = np.flatnonzero(~result & (middle > -half))
        if len(unsure):
            count = self._start[unsure + 1] - self._start[unsure]
            points = self._points[ranges(self._start[unsure], count)]
            distance = points @ plane[:3] + plane[3]
            farthest = np.maximum.reduceat(distance, np.cumsum(count) - count)
            result[unsure] = farthest > tolerance.plane
        return result


def _best_split(
    body: Polyhedron,
    fragments: list[_Fragment],
    least: float,
    taken: list[WallPlane],
    tolerance: Tolerance,
    sheets: bool = False,
) -> int:
    """Index of the fragment whose plane splits best, or -1. Fragments nearer to a boundary than the
    cluster distance split if they close an opening of it, or, with ``sheets``, the wall between
    (`_seals`)."""
    if not fragments:
        return -1
    extents = _Extents(fragments)
    curved = np.array([f.wall.curved for f in fragments])
    best, best_score = -1, -np.inf
    for turn, i in _candidates(fragments):
        if turn and best >= 0:
            break
        f = fragments[i]
        if f.area < (1 - TIE_SHARE) * least:
            continue
        plane = f.wall.frame.plane
        reach = body.points @ plane[:3] + plane[3]
        depth = min(reach.max(), -reach.min())
        if depth < tolerance.thin:
            continue
        near = depth < tolerance.cluster
        if near and sheets:
            if not _seals(body, f, taken, tolerance):
                continue
        elif near and _closes(body, f, taken, tolerance) < max(least, tolerance.hairline**2):
            continue
        front, back = extents.ahead(plane, tolerance), extents.ahead(-plane, tolerance)
        others = len(fragments) - 1
        cuts = front & back
        split = int(np.count_nonzero(cuts))
        bent = split if f.wall.curved else int(np.count_nonzero(cuts & curved))
        ahead, behind = int(np.count_nonzero(front)), int(np.count_nonzero(back))
        score = OCCLUSION_WEIGHT * f.area / f.section_area
        score += BALANCE_WEIGHT * (min(ahead, behind) / max(ahead, behind, 1))
        score += SPLIT_WEIGHT * (1.0 - split / max(others, 1))
        score -= CURVE_WEIGHT * bent / max(others, 1)
        if score > best_score + TIE_SHARE:
            best, best_score = i, score
    return best


def _candidates(fragments: list[_Fragment]) -> Iterator[tuple[int, int]]:
    """Turns and the fragments, ascending, whose planes are compared in each: all in the first, or
    the largest of very many, and the others only if none of these splits."""
    count = len(fragments)
    batch = count if count * count <= _PAIRS else max(_FEW, _PAIRS // count)
    order = np.arange(count)
    if batch < count:
        order = rank(np.array([f.area for f in fragments]))
    for turn, first in enumerate(range(0, count, batch)):
        for i in sorted(order[first : first + batch].tolist()):
            yield turn, i


def _closes(
    body: Polyhedron, fragment: _Fragment, taken: list[WallPlane], tolerance: Tolerance
) -> float:
    """The area (m²) that a fragment closes of the boundary plane next to it."""
    frame = fragment.wall.frame
    for tag in sorted({tag for tag in body.tags if tag >= 0}):
        near = taken[tag].frame
        plane = near.plane
        if np.max(np.abs(fragment.points @ plane[:3] + plane[3])) < tolerance.cluster:
            moved = shapely.transform(
                fragment.shape,
                lambda flat, near=near: near.to_plane(frame.to_space(flat)),
            )
            return float(shapely.area(difference(moved, taken[tag].blocking, tolerance.grid)))
    return fragment.area


def _seals(
    body: Polyhedron, fragment: _Fragment, taken: list[WallPlane], tolerance: Tolerance
) -> bool:
    """Whether the slab between a fragment and the boundary near it is open where the edge of the
    fragment meets another side of the body: the inside of a thin wall, at whose faces floor and
    roof end. The slab behind a picture or a panelling is closed there."""
    frame = fragment.wall.frame
    height = body.points @ frame.plane[:3] + frame.plane[3]
    inward = frame.plane if height.max() < -height.min() else -frame.plane
    reach = buffer(fragment.shape, tolerance.plane, more=True)
    for loop, tag in zip(body.faces, body.tags, strict=True):
        if tag < 0:
            continue
        side = taken[tag]
        strip = clip_polygon(body.points[loop], inward, tolerance.rounding)
        if len(strip) < 3 or abs(side.frame.plane[:3] @ inward[:3]) >= tolerance.cosine:
            continue
        strip = shapely.polygons(side.frame.to_plane(strip))
        for part in shapely.get_parts(open_part(strip, side.blocking, tolerance)):
            rim = frame.to_plane(side.frame.to_space(shapely.get_coordinates(part)))
            edge = shapely.intersection(shapely.MultiPoint(rim).convex_hull, reach)
            if shapely.length(edge) > tolerance.hairline:
                return True
    return False
