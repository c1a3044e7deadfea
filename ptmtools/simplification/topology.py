"""Handles, parts and small holes: the faces that no collapse can remove.

A part is a set of faces connected by edges; faces that only touch in a vertex are several. A
closed surface of V vertices, E edges and F faces, in c parts with g handles, has V - E + F =
2 c - 2 g. As every face has three edges, each of two faces, F = 2 (V - 2 c) + 4 g: a handle holds
four faces, however small it is, and so does a closed part; one with a border holds one. Marching
cubes of what a scanner saw leave thousands of either.

Small holes are filled where they are too many. A hole that shares its three corners with no other
holds five faces, however small it is: six, as three vertices do in a closed surface, without its
own. Scanners leave thousands where they could not see. Those are filled that are smaller than the
faces that will be left, and far smaller than the part that they are in, so that no sheet is closed
by its own outline.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.search import connected
from ptmtools.jit import plain_kernel as kernel
from ptmtools.simplification.model import Mesh
from ptmtools.simplification.surface import Edges, Surface, edges_of, following

#: Faces that a handle, a closed part and one with a border hold.
PER_HANDLE, PER_CLOSED, PER_OPEN = 4, 4, 1
#: What holds a greater share of the faces that are to be left gives way.
HELD = 0.1


@dataclass(frozen=True)
class Topology:
    """What a mesh has of each.

    Attributes
    ----------
    handles: 0 if more than two faces meet in an edge, where nobody can say.
    closed, bordered: parts without a border, and with one.
    """

    handles: int
    closed: int
    bordered: int

    @property
    def parts(self) -> int:
        """How many there are."""
        return self.closed + self.bordered

    @property
    def held(self) -> int:
        """Faces that handles hold, and parts beside one."""
        parts = PER_CLOSED * self.closed + PER_OPEN * self.bordered
        return PER_HANDLE * self.handles + parts * (self.parts > 1)


def topology(surface: Surface) -> Topology:
    """That of a mesh. A border counts as closed by one face of many corners."""
    triangle = surface.triangle
    edges = edges_of(triangle, len(surface.point))
    part = parts_of(edges, len(triangle))
    lone = edges.order[edges.start[edges.faces == 1]]
    parts, bordered = len(np.unique(part)), len(np.unique(part[lone // 3]))
    handles = 0
    if not (edges.faces > 2).any():
        # Where fans of faces touch in a vertex each has one of its own.
        fan = _fans(edges, triangle.size)
        begin, end = fan[lone], fan[following(lone)]
        borders = len(np.unique(connected(triangle.size, np.stack([begin, end], axis=1))[begin]))
        characteristic = len(np.unique(fan)) - len(edges.start) + len(triangle)
        handles = max(0, (2 * parts - borders - characteristic) // 2)
    return Topology(handles, parts - bordered, bordered)


def parts_of(edges: Edges, faces: int) -> Ints:
    """(T,) of each face the least of its part."""
    same = np.ones(len(edges.order), np.bool_)
    same[edges.start] = False
    later = np.flatnonzero(same)
    return connected(faces, edges.order[np.stack([later - 1, later], axis=1)] // 3)


def _fans(edges: Edges, corners: int) -> Ints:
    """(3 T,) of each corner the least of those about its vertex that edges of two faces join."""
    first = edges.start[edges.faces == 2]
    one, two = edges.order[first], edges.order[first + 1]
    agree = edges.begin[one] != edges.begin[two]
    begin, end = np.where(agree, following(two), two), np.where(agree, two, following(two))
    return connected(corners, np.concatenate([[one, begin], [following(one), end]], axis=1).T)


Kind = TypeVar("Kind", bound=np.generic)

#: Faces that a hole holds.
PER_HOLE = 5
#: A hole is small in its part if its diagonal is no larger than this share of the part's.
SHARE = 0.1
#: No hole of more corners is filled.
MOST = 64
#: In place of the edge on the other side: there is none, or it cannot be told.
BORDER, TANGLED = -1, -2


@dataclass(frozen=True)
class Filled:
    """A mesh whose small holes are filled.

    Attributes
    ----------
    mesh: what fills a hole has the material of a face beside it, and the attributes of the corners
        around it.
    like: (T + n,) the face of the given mesh that each face is, or is like.
    holes: how many there were.
    """

    mesh: Mesh
    like: Ints
    holes: int


class Work(NamedTuple):
    """Storage, whose place is -1 before and after.

    Attributes
    ----------
    seen: (3 T,) the edges of faces that are at no hole, or that were followed.
    place: (V,) where each vertex is on the way. loop: (n,) edges on it.
    """

    seen: Bools
    place: Ints
    loop: Ints


def filled(mesh: Mesh, surface: Surface, faces: int) -> Filled | None:
    """The mesh with its small holes filled, if they hold too many of the ``faces`` that are to be
    left; else None."""
    if not surface.kept.any():
        return None
    triangle = surface.triangle.astype(np.int64)
    edges = edges_of(triangle, len(surface.point))
    opposite = np.full(triangle.size, TANGLED)
    opposite[edges.order[edges.start[edges.faces == 1]]] = BORDER
    one, two = edges.pairs
    opposite[one], opposite[two] = two, one
    following = np.full(triangle.size, TANGLED)
    follow(opposite, following)

    part = connected(len(surface.point), np.stack(edges.ends, axis=1))
    low, high = np.full(surface.point.shape, np.inf), np.full(surface.point.shape, -np.inf)
    np.minimum.at(low, part, surface.point)
    np.maximum.at(high, part, surface.point)
    a, b, c = (surface.point[triangle[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    # The side of the faces that will be left, if all are alike.
    side = np.sqrt(4 / np.sqrt(3) * area / max(faces, 1))
    most = np.minimum(SHARE * np.linalg.norm(high - low, axis=1), side)[part]
    corner, number = np.empty((int((opposite == BORDER).sum()), 3), np.int64), np.zeros(2, np.int64)
    work = Work(following < 0, np.full(len(surface.point), -1), np.empty(len(corner), np.int64))
    fill_holes(triangle, surface.point, following, most, edges.key, work, corner, number)
    holes, corner = int(number[0]), corner[: number[1]]
    if PER_HOLE * holes <= HELD * faces:
        return None

    face, at = surface.source[corner // 3].astype(np.int64), corner % 3
    like = np.concatenate([np.arange(len(mesh.triangles)), face[:, 0]])
    more = Mesh(
        mesh.points,
        _with(mesh.triangles, face, at),
        None if mesh.material is None else mesh.material[like],
        None if mesh.uv is None else _with(mesh.uv, face, at),
        None if mesh.colors is None else _with(mesh.colors, face, at),
    )
    return Filled(more, like, holes)


def _with(values: NDArray[Kind], face: Ints, at: Ints) -> NDArray[Kind]:
    """What corners of faces have, and behind it the same of some corners."""
    return np.concatenate([values, values[face, at]])


@kernel
def follow(opposite: Ints, following: Ints) -> None:
    """Of each edge at a border, 3 t + k, the next one around the same hole; `TANGLED` where faces
    between them disagree."""
    for edge in range(len(opposite)):
        if opposite[edge] != BORDER:
            continue
        at = edge - 2 if edge % 3 == 2 else edge + 1
        while opposite[at] >= 0:
            at = opposite[at]
            at = at - 2 if at % 3 == 2 else at + 1
        if opposite[at] == BORDER:
            following[edge] = at


@kernel
def fill_holes(
    triangle: Ints,
    point: Floats,
    following: Ints,
    most: Floats,
    key: Ints,
    work: Work,
    corner: Ints,
    number: Ints,
) -> None:
    """Fills the holes whose diagonal is no larger than ``most`` (V,) of their vertices.

    Writes faces to ``corner`` (n, 3), three corners of ``triangle`` each, and to ``number`` how
    many holes and faces there are. ``key`` (E,) has all edges, ascending. Where a border comes to a
    vertex again two holes touch, and what lies between is one.
    """
    seen, place, loop = work.seen, work.place, work.loop
    for begin in range(len(following)):
        if seen[begin]:
            continue
        count, edge = 0, begin
        while edge >= 0:
            v = triangle[edge // 3, edge % 3]
            first = place[v]
            if first >= 0:
                for i in range(first, count):
                    place[triangle[loop[i] // 3, loop[i] % 3]] = -1
                hole = loop[first:count]
                small = 3 <= len(hole) <= MOST and span(triangle, point, hole) <= most[v] ** 2
                open_ = small and not is_outline(triangle, point, hole)
                if open_ and cut_ears(triangle, point, hole, key, corner[number[1] :]):
                    number[0] += 1
                    number[1] += count - first - 2
                count = first
            if seen[edge]:
                break
            seen[edge] = True
            place[v], loop[count] = count, edge
            count += 1
            edge = following[edge]
        for i in range(count):
            place[triangle[loop[i] // 3, loop[i] % 3]] = -1


@kernel
def span(triangle: Ints, point: Floats, loop: Ints) -> float:
    """The square of the diagonal of the box around where edges begin."""
    square = 0.0
    for k in range(3):
        low, high = np.inf, -np.inf
        for i in range(len(loop)):
            value = point[triangle[loop[i] // 3, loop[i] % 3], k]
            low, high = min(low, value), max(high, value)
        square += (high - low) ** 2
    return square


@kernel
def is_outline(triangle: Ints, point: Floats, loop: Ints) -> bool:
    """Whether a loop goes around its faces instead of a hole between them: what would fill it
    looks the other way."""
    alike = 0.0
    o = triangle[loop[0] // 3, loop[0] % 3]
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        fill = face = 0.0
        for edge in loop:
            t = edge // 3
            a, b, c = (
                triangle[t, edge % 3],
                triangle[t, (edge + 1) % 3],
                triangle[t, (edge + 2) % 3],
            )
            # The loop has the faces on its left; what fills it goes around the other way.
            fill += (point[b, i] - point[o, i]) * (point[a, j] - point[o, j])
            fill -= (point[b, j] - point[o, j]) * (point[a, i] - point[o, i])
            face += (point[b, i] - point[a, i]) * (point[c, j] - point[a, j])
            face -= (point[b, j] - point[a, j]) * (point[c, i] - point[a, i])
        alike += fill * face
    return alike <= 0.0


@kernel
def cut_ears(
    triangle: Ints, point: Floats, loop: Ints, key: Ints, corner: NDArray[np.int64]
) -> bool:
    """Fills a loop by faces, the shortest new edge first; False if every way has an edge twice."""
    count, made = len(loop), 0
    while count > 3:
        least, best = np.inf, -1
        for i in range(count):
            one, two = loop[i - 1 if i else count - 1], loop[i + 1 if i + 1 < count else 0]
            a, b = triangle[one // 3, one % 3], triangle[two // 3, two % 3]
            edge = min(a, b) * len(point) + max(a, b)
            at = np.searchsorted(key, edge)
            if a == b or (at < len(key) and key[at] == edge):
                continue
            square = 0.0
            for k in range(3):
                square += (point[a, k] - point[b, k]) ** 2
            if square < least:
                least, best = square, i
        if best < 0:
            return False
        corner[made, 0] = loop[best + 1 if best + 1 < count else 0]
        corner[made, 1] = loop[best]
        corner[made, 2] = loop[best - 1 if best else count - 1]
        made += 1
        count -= 1
        for i in range(best, count):
            loop[i] = loop[i + 1]
    corner[made, 0], corner[made, 1], corner[made, 2] = loop[2], loop[1], loop[0]
    return True
