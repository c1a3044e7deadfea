"""Walls: the large coplanar polygons of a scene, and the planes that they propose.

Triangles are gathered into *layers*, sets that lie in one plane within tolerance, largest area
first (cf. the area-weighted clustering of Airey 1990). In its plane, the triangles of a layer are
united (shapely) and split into connected polygons; those of at least ``wall_area`` are walls.

Merging layers across the building within 1 cm, as the area-weighted mean or as the heaviest one,
was tried and rejected: real walls of one line differ by millimetres from room to room, the merged
plane then contains few of them, and what it does not contain cannot block. Near-parallel planes are
told apart where they meet, in the BSP.

A polygon blocks a portal only where it lies in the portal's plane within tolerance (design,
"Structure"), so the blocking set of a plane is wider than its walls: every opaque structural
triangle there, whatever its size.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.naming import named, structural_triangles
from ptmtools.cells.nearby import Nearby
from ptmtools.cells.options import SubdivideOptions
from ptmtools.cells.planar import Geometry, neighbours, unite
from ptmtools.cells.vectors import cross, normals
from ptmtools.scene.model import Scene
from ptmtools.tolerance import TIE_SHARE, Tolerance, ranked

#: Normals are binned on a grid of this step, only to find candidates quickly.
_NORMAL_STEP = 0.02
#: So many grids, each moved on by as large a share of the step: one more than a plane has numbers,
#: so that in one of them none of its numbers is nearer to an edge than half that share.
_GRIDS = 5
#: Of the two normals of a plane the one that points this way is taken: no wall lies in the
#: direction, so that rounding never decides.
_UPWARD = np.array([0.5772156649, 0.8346268417, 0.2614972128])


@dataclass(frozen=True)
class Frame:
    """A plane with two axes in it: `to_plane` and `to_space` are inverses up to rounding."""

    plane: Floats  # (4,) unit normal n and offset d, n·x + d = 0
    origin: Floats  # a point of it
    u: Floats  # an orthonormal basis, u × v = n
    v: Floats

    @staticmethod
    def of(plane: Floats) -> Frame:
        """A frame for a (4,) plane; the axes depend on nothing but the plane."""
        normal = plane[:3]
        axis = np.zeros(3)
        axis[np.argmin(np.abs(normal))] = 1.0
        u = cross(axis, normal)
        u /= np.linalg.norm(u)
        return Frame(plane, -plane[3] * normal, u, cross(normal, u))

    def to_plane(self, points: Floats) -> Floats:
        """(…, 2) coordinates of (…, 3) points, projected along the normal."""
        q = points - self.origin
        return np.stack([q @ self.u, q @ self.v], axis=-1)

    def to_space(self, flat: Floats) -> Floats:
        """(…, 3) points of (…, 2) coordinates."""
        space: Floats = self.origin + flat[..., :1] * self.u + flat[..., 1:] * self.v
        return space


@dataclass(frozen=True)
class WallPlane:
    """A plane that may split cells, and what lies in it, in its coordinates."""

    frame: Frame
    walls: Geometry  # the polygons that may split
    blocking: Geometry  # everything opaque and structural


@dataclass(frozen=True)
class Structure:
    """The triangles that may bound a leaf, and what is asked of them again and again."""

    corners: Floats  # (T, 3, 3) metres
    forced: Bools  # (T,) whether `SubdivideOptions.structural` names them
    planes: Floats  # (T, 4) and
    areas: Floats  # (T,), see `planes_of`
    nearby: Nearby
    tolerance: Tolerance

    @staticmethod
    def of(scene: Scene, options: SubdivideOptions, tolerance: Tolerance) -> Structure:
        """The structural triangles of a scene."""
        mask = structural_triangles(scene, options)
        corners, forced = scene.corners[mask], named(scene, options.structural)[mask]
        nearby = Nearby(corners, tolerance.rounding)
        return Structure(corners, forced, *planes_of(corners), nearby, tolerance)

    def lie_in(self, plane: Floats, triangles: Ints) -> Bools:
        """(n,) which of these triangles, by number, lie in a plane."""
        distance = np.abs(self.corners[triangles] @ plane[:3] + plane[3])
        lies: Bools = np.all(distance <= self.tolerance.plane, axis=1)
        return lies

    def united(self, frame: Frame, triangles: Ints) -> Geometry:
        """The union of these triangles in a plane."""
        return unite(frame.to_plane(self.corners[triangles]), self.tolerance.grid)


def find_walls(structure: Structure, wall_area: float) -> list[WallPlane]:
    """The planes that may split leaves, heaviest first."""
    tolerance, forced = structure.tolerance, structure.forced
    least = (1 - TIE_SHARE) * wall_area
    found: list[tuple[float, WallPlane]] = []
    for plane in _layers(structure, least):
        frame = Frame.of(plane)
        near = structure.nearby.between(plane, -tolerance.plane, tolerance.plane)
        flat = near[structure.lie_in(plane, near)]
        blocking = structure.united(frame, flat)
        shapely.prepare(blocking)
        parts = shapely.get_parts(blocking)
        group = neighbours(parts, tolerance.hairline)
        large = np.bincount(group, weights=shapely.area(parts))[group] >= least
        if np.any(forced[flat]):
            large |= shapely.intersects(parts, structure.united(frame, flat[forced[flat]]))
        if np.any(large):
            walls = shapely.multipolygons(parts[large])
            found.append((float(shapely.area(walls)), WallPlane(frame, walls, blocking)))
    return [found[i][1] for i in ranked(np.array([area for area, _ in found]))]


def planes_of(corners: Floats) -> tuple[Floats, Floats]:
    """(n, 4) planes with one sign for both windings, and (n,) areas, of (n, 3, 3) triangles."""
    normal = normals(corners)
    double = np.linalg.norm(normal, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        normal = np.where(double[:, None] > 0, normal / double[:, None], 0.0)
    normal *= np.where(normal @ _UPWARD < 0, -1.0, 1.0)[:, None]
    offset = -np.einsum("ij,ij->i", normal, corners.mean(axis=1))
    return np.concatenate([normal, offset[:, None]], axis=1), double / 2.0


def _layers(structure: Structure, wall_area: float) -> list[Floats]:
    """Planes that hold enough coplanar area to carry a wall, heaviest first.

    Triangles are compared only within bins of similar normal and offset, and a bin is left as soon
    as what is free in it cannot reach ``wall_area``: curved detail and slivers fall away before
    anything quadratic happens.
    """
    planes, areas, forced = structure.planes, structure.areas, structure.forced
    # A bin with a triangle that is forced is never left for want of area.
    bins = _Bins(planes, areas + 2 * wall_area * forced, structure.tolerance)
    free = areas > 0
    layers: list[tuple[float, Floats]] = []
    for seed in ranked(areas):
        if not free[seed]:
            continue
        free[seed] = False
        if bins.weight(seed) < wall_area:
            bins.drop(seed)
            continue
        near = bins.near(seed)
        near = near[free[near]]
        members = np.append(near[structure.lie_in(planes[seed], near)], seed)
        free[members] = False
        bins.drop(members)
        weight = float(areas[members].sum())
        if weight >= wall_area or np.any(forced[members]):
            layers.append((weight, planes[seed]))
    return [layers[i][1] for i in ranked(np.array([weight for weight, _ in layers]))]


class _Bins:
    """Planes in bins of similar normal and offset, so that each finds all that are near it.

    There are `_GRIDS` grids of bins, and a plane is looked up in the one in which it lies furthest
    from the edges of its bin: its neighbours to a tenth of the step are there, wherever it lies.
    """

    def __init__(self, planes: Floats, weights: Floats, tolerance: Tolerance) -> None:
        """``weights``: (n,), of the (n, 4) planes."""
        step = np.array([_NORMAL_STEP] * 3 + [_NORMAL_STEP * tolerance.extent])
        self._weights = weights
        labels, inner, bins = [], [], 0
        for grid in range(_GRIDS):
            at = planes / step + grid / _GRIDS
            key = np.floor(at)
            _, label = np.unique(key.astype(np.int64), axis=0, return_inverse=True)
            labels.append(label.ravel() + bins)
            bins += int(label.max(initial=-1)) + 1
            inner.append(np.minimum(at - key, 1 - (at - key)).min(axis=1))
        self._label = np.stack(labels, axis=1)
        self._grid = np.argmax(np.stack(inner), axis=0)
        every = self._label.ravel()
        order = np.argsort(every, kind="stable") // _GRIDS
        self._rows = np.split(order, np.cumsum(np.bincount(every, minlength=1))[:-1])
        self._free = np.bincount(every, np.repeat(weights, _GRIDS), bins)

    def near(self, plane: int) -> Ints:
        """The planes in the bin of one of them, dropped or not."""
        rows: Ints = self._rows[self._label[plane, self._grid[plane]]]
        return rows

    def weight(self, plane: int) -> float:
        """What is not dropped in that bin weighs so much."""
        return float(self._free[self._label[plane, self._grid[plane]]])

    def drop(self, planes: Ints | int) -> None:
        """Planes weigh no more."""
        weights = np.repeat(self._weights[planes], _GRIDS)
        np.subtract.at(self._free, self._label[planes].ravel(), weights)


def parallel_gap(plane: Floats, other: Floats, tolerance: Tolerance) -> float:
    """Distance of two parallel (4,) planes in metres, whichever way they face; infinite for planes
    that are not parallel."""
    turn = float(plane[:3] @ other[:3])
    if abs(turn) < tolerance.cosine:
        return float("inf")
    return abs(float(plane[3]) - float(np.sign(turn)) * float(other[3]))
