"""The fabric of a building: the faces of a scene in flat regions, and their roles.

**Facets.** Triangles that share edges and lie in one plane are gathered into regions; a region of
many is replaced by as few as its outline allows, if that saves three quarters. No corner moves.
Corners are left out only where an outline runs on straight, so a crack beside one is narrower than
a hairline.

**Roles** are structural, detail or door, by the names and classes of objects and by shape. The
class of an object acts like an option that names the object, unless the user names the triangle in
`--structural`, `--detail` or `--door`; but triangles that are structural by class divide the
building only if their area suffices. Detail by shape is furniture, statues and plants: small, dense
and round connected pieces, or whole objects, since a plant is a thousand pieces. Errors are safe:
detail hides nothing, so visible sets can only grow.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import partial

import numpy as np
import shapely
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, normals, sum_by_group
from ptmtools.cells.options import SubdivideOptions
from ptmtools.cells.planar import build_areas, count, simplify, triangulate_polygons
from ptmtools.cells.planes import UPWARD, plane_axes
from ptmtools.cells.search import connect, distinct
from ptmtools.scene.model import Scene
from ptmtools.tolerance import Tolerance, rank


@dataclass(frozen=True)
class Welded:
    """The distinct triangles among some: neither repeated, whatever their winding, nor flat."""

    point: Floats  # (V, 3) distinct positions
    triangle: NDArray[np.int32]  # (n, 3) rows of them
    source: Ints  # (n,) the first of the original triangles equal to each, ascending

    @staticmethod
    def from_triangles(points: Floats, triangles: NDArray[np.integer]) -> Welded:
        """The mesh of (T, 3) triangles over (V, 3) points."""
        first, row = distinct(points)
        renamed = row[triangles]
        low, middle, high = np.sort(renamed, axis=1).T
        whole = np.flatnonzero((low < middle) & (middle < high))
        once, _ = distinct(np.stack([low, middle, high], axis=1)[whole])
        source = whole[once]
        return Welded(points[first], renamed[source].astype(np.int32), source)

    @property
    def corners(self) -> Floats:
        """(n, 3, 3) metres."""
        return self.point[self.triangle]


def across_edges(triangle: NDArray[np.integer], turned: Bools) -> NDArray[np.int32]:
    """(n, 3) the triangle beyond the edge from corner k to corner k + 1 of (n, 3) triangles, or -1
    where there is none or several, or it has the edge in the same direction. Triangles ``turned``
    count as wound the other way."""
    count = len(triangle)
    start, end = triangle.astype(np.int64), np.roll(triangle, -1, axis=1).astype(np.int64)
    low, high = np.minimum(start, end).ravel(), np.maximum(start, end).ravel()
    upward = ((start < end) ^ turned[:, None]).ravel()
    key = low * (int(high.max(initial=0)) + 1) + high
    order = np.argsort(key, kind="stable")
    begin = np.flatnonzero(np.append(True, key[order[1:]] != key[order[:-1]])[: len(order)])
    pairs = begin[np.diff(np.append(begin, len(order))) == 2]
    a, b = order[pairs], order[pairs + 1]
    facing = upward[a] != upward[b]
    a, b = a[facing], b[facing]
    beyond = np.full(3 * count, -1, dtype=np.int32)
    beyond[a], beyond[b] = b // 3, a // 3
    return beyond.reshape(-1, 3)


#: A corner lies in the plane of a region if it is within this share of the on-plane distance.
_FLAT_SHARE = 1 / 4
#: A corner may be left out if its distance from the outline is at most this share of it: more than
#: the rounding of single precision.
_STRAIGHT_SHARE = 1 / 32
#: Regions of fewer triangles are left alone, and those of which less than this share is saved.
_MANY = 16
_SAVED = 3 / 4


@dataclass(frozen=True)
class Facets:
    """The flat regions of a mesh."""

    mesh: Welded
    beyond: NDArray[np.int32]  # (n, 3) see `across_edges`
    turned: Bools  # (n,) whether a triangle faces away from `UPWARD`
    region: Ints  # (n,) the region of each triangle
    areas: Floats  # (n,) m² of each triangle
    area: Floats  # (r,) m² of each region
    normal: Floats  # (r, 3) unit vectors
    whole: Bools  # (r,) whether all of it lies in one plane

    @staticmethod
    def from_mesh(mesh: Welded, tolerance: Tolerance) -> Facets:
        """The regions of a mesh, the largest triangles first."""
        from ptmtools.cells.kernels import grow_regions

        corners = mesh.corners
        normal = normals(corners)
        turned = normal @ UPWARD < 0
        normal *= np.where(turned, -1.0, 1.0)[:, None]
        double = np.linalg.norm(normal, axis=1)
        beyond = across_edges(mesh.triangle, turned)
        region, queue = np.full(len(turned), -1), np.empty(len(turned), dtype=np.int64)
        slack = _FLAT_SHARE * tolerance.plane
        seeds = rank(double)
        count = grow_regions(mesh.point, mesh.triangle, beyond, normal, seeds, slack, region, queue)
        mean = np.stack([sum_by_group(region, column, count) for column in normal.T], axis=1)
        mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), np.finfo(float).tiny)
        height = np.einsum("tci,ti->tc", corners, mean[region])
        level = sum_by_group(region, double * height.mean(axis=1), count)
        weight = sum_by_group(region, double, count)
        level = np.divide(level, weight, out=level, where=weight > 0)
        away = np.abs(height - level[region, None]).max(axis=1) > 2 * slack
        whole = np.bincount(region, away, count) == 0
        return Facets(mesh, beyond, turned, region, double / 2, weight / 2, mean, whole)

    def reduce(self, which: Bools, tolerance: Tolerance) -> tuple[Floats, Ints]:
        """The surface of the triangles ``which``, (n,), in fewer triangles, (m, 3, 3), and (m,) the
        triangle of the mesh that each is, or the first of its region, ascending."""
        size = np.bincount(self.region, which, len(self.area))
        rim = which[:, None] & (self.beyond < 0)
        inner = ~rim & which[:, None]
        neighbour = np.where(inner, self.beyond, 0)
        rim |= inner & ((self.region[neighbour] != self.region[:, None]) | ~which[neighbour])
        edges = np.bincount(self.region, rim.sum(axis=1), len(self.area))
        # An outline of e edges takes e - 2 triangles or more; most of its corners are on straights.
        many = self.whole & (size >= _MANY) & (edges <= size / 2)
        chosen = np.flatnonzero(many)
        outline = rim & many[self.region][:, None]
        area = sum_by_group(self.region, self.areas * which, len(self.area))[chosen]
        corners, owner = self._retriangulate(chosen, area, outline, tolerance)
        # Wound as most of the region is.
        facing = self.areas * which * np.where(self.turned, -1.0, 1.0)
        facing = sum_by_group(self.region, facing, len(self.area))[chosen]
        turn = np.einsum("ij,ij->i", normals(corners), self.normal[chosen[owner]])
        back = turn * facing[owner] < 0
        corners[back] = corners[back][:, ::-1]
        count = np.bincount(owner, minlength=len(chosen))
        saved = (count > 0) & (count <= (1 - _SAVED) * size[chosen])
        kept = which.copy()
        replaced = np.zeros(len(self.area), dtype=bool)
        replaced[chosen[saved]] = True
        kept &= ~replaced[self.region]
        first = np.full(len(self.area), len(which))
        np.minimum.at(first, self.region, np.where(which, np.arange(len(which)), len(which)))
        fresh = saved[owner]
        source = np.concatenate([np.flatnonzero(kept), first[chosen[owner[fresh]]]])
        every = np.concatenate([self.mesh.corners[kept], corners[fresh]])
        order = np.argsort(source, kind="stable")
        return every[order], source[order]

    def _retriangulate(
        self, chosen: Ints, area: Floats, outline: Bools, tolerance: Tolerance
    ) -> tuple[Floats, Ints]:
        """Triangles (m, 3, 3) of the chosen regions, whose ``area`` these (n, 3) edges outline, and
        (m,) the region of each; regions whose outline bounds another area or has no triangulation
        are left out."""
        if not len(chosen):
            return np.zeros((0, 3, 3)), np.zeros(0, dtype=np.int64)
        at, k = np.nonzero(outline)
        place = np.full(len(self.area), -1)
        place[chosen] = np.arange(len(chosen))
        owner = place[self.region[at]]
        order = np.argsort(owner, kind="stable")
        at, k, owner = at[order], k[order], owner[order]
        ends = np.stack([self.mesh.triangle[at, k], self.mesh.triangle[at, (k + 1) % 3]], axis=1)
        u, v = plane_axes(self.normal[chosen])
        space = self.mesh.point[ends]
        flat = np.stack(
            [np.einsum("eki,ei->ek", space, u[owner]), np.einsum("eki,ei->ek", space, v[owner])],
            axis=2,
        )
        areas = build_areas(flat, owner)
        straight = _STRAIGHT_SHARE * tolerance.plane
        areas = simplify(areas, straight)
        allowed = straight * shapely.length(areas) + tolerance.rounding * tolerance.extent
        sound = shapely.is_valid(areas) & (np.abs(shapely.area(areas) - area) <= allowed)
        sound_rows = np.flatnonzero(sound)
        rings, which = triangulate_polygons(areas[sound_rows])
        return self._lift(rings, sound_rows[which], flat, owner, space)

    def _lift(
        self, rings: Floats, which: Ints, flat: Floats, owner: Ints, space: Floats
    ) -> tuple[Floats, Ints]:
        """(m, 3, 3) positions of (k, 3, 2) triangles of regions ``which``, those of the ends of
        edges, ``flat`` and in ``space``, (e, 2, …), of the regions ``owner``; and (m,) the region
        of each. None of a region with a corner where no edge ends: two of its edges cross."""
        known = np.column_stack([np.repeat(owner, 2).astype(np.float64), flat.reshape(-1, 2)])
        corners = np.column_stack([np.repeat(which, 3).astype(np.float64), rings.reshape(-1, 2)])
        first, row = distinct(np.concatenate([known, corners]))
        origin = first[row[len(known) :]]
        fresh = (origin >= len(known)).reshape(-1, 3).any(axis=1)
        crossed = np.unique(which[fresh])
        count(["triangles"] * len(crossed))
        kept = ~np.isin(which, crossed)
        return space.reshape(-1, 3)[origin.reshape(-1, 3)[kept]], which[kept]


#: Words for a door, in lower case.
_DOOR = re.compile(
    r"doors?|port[ea]s?|puertas?|tür(en)?|tuer(en)?|deur(en)?|dörr(ar)?|døre?r?|drzwi|dv[eě]ře|ajtó|"
    r"двер[ьи]"
)
#: Compounds that end in such a word, like Haustür, or begin with it, like doorleaf.
_COMPOUND = re.compile(
    r".*(doors?|tür|tuer|deur|dörr|dør)|"
    r"(door|tür|tuer|deur|dörr|dør)(leaf|panel|slab|wing|blatt|flügel|fluegel|blad)"
)
#: Words that only end like one, and parts of a doorway that are no leaf.
_NO_DOOR = re.compile(
    r"(out|in)doors?|way|frame|jamb|lintel|casing|handle|knob|mat|walls?|wand|mur[ao]?|pared|"
    r"pare[td]e|muur|vägg|væg|ściana|стена|rahmen|zarge|griff|cadre|dormant|marco|telaio|kozijn|karm"
)
#: Words of a name: runs of letters, each beginning where a capital follows a small letter.
_WORD = re.compile(r"[^\W\d_]+")
_HUMP = re.compile(r"(?<=[^\W\d_A-ZÀ-ÖØ-Þ])(?=[A-ZÀ-ÖØ-Þ])|(?<=[A-Z])(?=[A-Z][a-z])")


def matches(name: str, patterns: Sequence[str]) -> bool:
    """Whether a name matches one of the patterns, with * and ?."""
    return any(fnmatchcase(name, pattern) for pattern in patterns)


def is_door_name(name: str) -> bool:
    """Whether a name is that of a door: `door_leaf_03`, `IfcDoor`, `Haustür`, but not `doorway`,
    `door_frame` or `outdoor_wall`."""
    composed = unicodedata.normalize("NFC", name)
    words = [word.lower() for word in _WORD.findall(_HUMP.sub(" ", composed))]
    if any(map(_NO_DOOR.fullmatch, words)):
        return False
    return any(_DOOR.fullmatch(word) or _COMPOUND.fullmatch(word) for word in words)


#: Detail fits into a box of this side, metres: the longest sofas and shelves.
LARGEST = 3.0
#: It is dense: it has at least this many triangles,
DENSE = 256
#: and compact: neither a sheet nor a rod. Its box's shortest side over its longest.
COMPACT = 0.1
#: Flat regions smaller than this share of `SubdivideOptions.wall_area` neither split nor block.
FLAT_SHARE = 0.01
#: No flat region of it is larger than this share of `SubdivideOptions.wall_area`,
LARGEST_FLAT_SHARE = 0.25
#: and no more of its surface than this is flat.
FLAT = 2 / 3


def detail_by_shape(facets: Facets, object_of: NDArray[np.integer], wall_area: float) -> Bools:
    """(n,) which triangles of a mesh are detail by shape; ``object_of``: (n,) their objects."""
    result = np.zeros(len(object_of), dtype=bool)
    if not len(object_of):
        return result
    corners = facets.mesh.corners
    # The area of the flat region of each triangle: what could split or block.
    region = np.where(facets.whole, facets.area, 0.0)[facets.region]
    flat = np.where(region >= FLAT_SHARE * wall_area, facets.areas, 0.0)
    for group in (connected_pieces(facets.mesh), np.unique(object_of, return_inverse=True)[1]):
        size = np.bincount(group)
        order, begin = np.argsort(group, kind="stable"), np.cumsum(size) - size
        low = np.minimum.reduceat(corners[order].min(axis=1), begin)
        high = np.maximum.reduceat(corners[order].max(axis=1), begin)
        shortest, _, longest = np.sort(high - low, axis=1).T
        detail = (size >= DENSE) & (longest <= LARGEST) & (shortest >= COMPACT * longest)
        flat_area, area = (sum_by_group(group, part, len(size)) for part in (flat, facets.areas))
        detail &= flat_area <= FLAT * area
        detail &= np.maximum.reduceat(region[order], begin) <= LARGEST_FLAT_SHARE * wall_area
        result |= detail[group]
    return result


def connected_pieces(mesh: Welded) -> Ints:
    """(n,) the connected piece of each triangle; pieces share no corners."""
    point = connect(len(mesh.point), mesh.triangle)
    return np.unique(point[mesh.triangle[:, 0]], return_inverse=True)[1].reshape(-1)


@dataclass(frozen=True, kw_only=True)
class Fabric:
    """The T faces of a scene with their roles by name and class, none structural and something
    else; and the flat regions of the n that are opaque and no detail so."""

    scene: Scene
    options: SubdivideOptions
    forced: Bools  # (T,) whether it divides the building whatever its area
    structural: Bools  # (T,) forced, or structural by class
    detail: Bools  # (T,)
    door: Bools  # (T,)
    facets: Facets
    source: Ints  # (n,) the triangle of the scene that each is, ascending
    shaped: Bools  # (n,) whether it is detail by shape

    @staticmethod
    def from_scene(scene: Scene, options: SubdivideOptions) -> Fabric:
        """The roles that the options name, and otherwise those of the objects' classes."""
        forced, detail, door = (
            triangles_named(scene, partial(matches, patterns=patterns))
            for patterns in (options.structural, options.detail, options.door)
        )
        structural = forced
        if scene.kinds:
            free = ~(forced | detail | door)
            kind = np.array(scene.kinds)[scene.triangle_object]
            structural = structural | (free & (kind == "structural"))
            detail = detail | (free & (kind == "detail"))
            door = door | (free & (kind == "door"))
        detail &= ~structural
        facets, source = facets_of(scene, np.flatnonzero(scene.opaque & ~detail))
        shaped = np.zeros(len(source), dtype=bool)
        if options.detail_by_shape:
            shaped = detail_by_shape(facets, scene.triangle_object[source], options.wall_area)
            shaped &= ~structural[source]
        return Fabric(
            scene=scene,
            options=options,
            forced=forced,
            structural=structural,
            detail=detail,
            door=door & ~structural,
            facets=facets,
            source=source,
            shaped=shaped,
        )

    def find_detail(self) -> Bools:
        """(T,) which triangles are detail by name, class or shape, including glass."""
        scene, detail = self.scene, self.detail.copy()
        detail[self.source[self.shaped]] = True
        glass = np.flatnonzero(~(scene.opaque | detail | self.structural))
        if self.options.detail_by_shape and len(glass):
            facets, source = facets_of(scene, glass)
            owner, wall_area = scene.triangle_object[source], self.options.wall_area
            detail[source] = detail_by_shape(facets, owner, wall_area)
        return detail


def triangles_named(scene: Scene, test: Callable[[str], bool]) -> Bools:
    """(T,) which triangles have an object or a material whose name passes a test."""
    objects = np.array([test(name) for name in scene.objects], dtype=bool)
    materials = np.array([test(material.name) for material in scene.materials], dtype=bool)
    return np.asarray(objects[scene.triangle_object] | materials[scene.triangle_material])


def facets_of(scene: Scene, triangles: Ints) -> tuple[Facets, Ints]:
    """The flat regions of some of a scene's triangles, and (n,) the triangle that each is."""
    mesh = Welded.from_triangles(scene.points, scene.triangles[triangles])
    return Facets.from_mesh(mesh, scene.tolerance), triangles[mesh.source]
