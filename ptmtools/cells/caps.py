"""Caps: small polygons that close the whole cross-section of a leaf.

The planes of walls go on behind them and cut the solids of floors and walls into wedges. A
flight of stairs does so to the floor slab beside it: between the slope and the top of the slab
lie a solid and a piece of the stairwell, and what parts the two is the edge of the slab, smaller
than a wall; nor is it a reveal, for the wedge lies between no two parallel faces. It is
recognised by what it does: no opening is left beside it. Such a split costs one leaf and never a
portal. A polygon that leaves an opening, however small, is none.

No area is too small: a chain of solids is as open as its narrowest end, and in the museum of 50
rooms, with caps of 0.02 m² and more only, all of the 992 leaves stay that 365 are with all caps.
"""

from __future__ import annotations

import numpy as np
import shapely

from ptmtools.arrays import Floats, Ints
from ptmtools.cells.bins import Tries
from ptmtools.cells.planar import left_open
from ptmtools.cells.polyhedron import Polyhedron, section
from ptmtools.cells.structure import Frame, Structure, WallPlane
from ptmtools.cells.vectors import cross
from ptmtools.tolerance import ranked

#: Areas are compared with this share to spare before polygons are.
_SPARE = 1e-3
#: So many planes are cut with a leaf at a time.
_CHUNK = 4096


def closing(structure: Structure, body: Polyhedron) -> list[WallPlane]:
    """The planes in which what lies there leaves no opening between two parts of a body, in the
    order of the model's triangles: many are equally good, and areas of strips some centimetres
    wide keep few digits far from the origin."""
    low, high = body.points.min(axis=0), body.points.max(axis=0)
    near = structure.nearby.meeting(low, high)
    slack, corners = structure.tolerance.plane, structure.corners[near]
    apart = (corners.min(axis=1) > high + slack) | (corners.max(axis=1) < low - slack)
    near = near[~apart.any(axis=1)]
    inside = _reaching_into(body, structure, near)
    areas, planes = structure.areas[inside], structure.planes[inside]
    beside = structure.bins.beside(inside, areas)
    needed = _section_areas(body, planes) * (1 - _SPARE)
    free = needed <= beside
    own = structure.bins.own[inside]
    found: list[tuple[int, WallPlane]] = []
    tries = Tries(np.unique(own, return_inverse=True)[1].reshape(-1), areas)
    for seed in ranked(np.where(free, areas, 0.0))[: np.count_nonzero(free)]:
        if not (free[seed] and tries.worth[seed]):
            continue
        mates = np.flatnonzero(structure.bins.holds(own[seed], inside))
        members = mates[structure.lie_in(planes[seed], inside[mates])]
        free[members] = False
        free[seed] = False
        if areas[members].sum() >= needed[seed]:
            cap = _cap(body, planes[seed], structure, near)
            found += [(int(inside[members[0]]), cap)] if cap else []
        else:
            tries.fail(seed, mates[free[mates]], float(needed[seed]))
    return [cap for _, cap in sorted(found, key=lambda one: one[0])]


def _reaching_into(body: Polyhedron, structure: Structure, triangles: Ints) -> Ints:
    """Those triangles that have a point farther inside each face than lies in its plane: all that
    have a part inside, and few others."""
    found = triangles[structure.areas[triangles] > 0]
    for plane in body.planes:
        height = structure.corners[found] @ plane[:3] + plane[3]
        found = found[height.min(axis=1) < -structure.tolerance.plane]
    return found


def _cap(body: Polyhedron, plane: Floats, structure: Structure, near: Ints) -> WallPlane | None:
    """What lies in a plane, if it leaves no opening in a body's section with it."""
    tolerance = structure.tolerance
    outline = section(body, plane, tolerance.rounding)
    if len(outline) < 3:
        return None
    frame = Frame.of(plane)
    blocking = structure.united(frame, near[structure.lie_in(plane, near)])
    opening = left_open(shapely.polygons(frame.to_plane(outline)), blocking, tolerance)
    return WallPlane(frame, blocking, blocking) if shapely.is_empty(opening) else None


def _section_areas(body: Polyhedron, planes: Floats) -> Floats:
    """(n,) areas (m²) of a body's sections with (n, 4) planes, but for rounding; infinite where a
    plane does not cut it."""
    one, other = body.edges.T
    areas = np.full(len(planes), np.inf)
    for first in range(0, len(planes), _CHUNK):
        plane = planes[first : first + _CHUNK]
        height = plane[:, :3] @ body.points.T + plane[:, 3:]
        crosses = (height[:, one] > 0) != (height[:, other] > 0)
        cut = np.flatnonzero(crosses.any(axis=1))
        a, b, crosses = height[cut][:, one], height[cut][:, other], crosses[cut]
        t = np.divide(a, a - b, out=np.zeros(a.shape), where=crosses)[..., None]
        points = body.points[one] * (1 - t) + body.points[other] * t
        # An edge that is not cut repeats a corner, and adds nothing.
        corner = points[np.arange(len(cut)), crosses.argmax(axis=1)][:, None]
        points = np.where(crosses[..., None], points, corner) - corner
        centre = points.mean(axis=1, keepdims=True)
        areas[first + cut] = _around(points - centre, plane[cut, :3])
    return areas


def _around(points: Floats, normals: Floats) -> Floats:
    """(n,) areas of the convex polygons with corners (n, k, 3), in any order, about 0."""
    axis = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    u = cross(axis, normals)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = cross(normals, u)
    x, y = np.einsum("nki,ni->nk", points, u), np.einsum("nki,ni->nk", points, v)
    order = np.argsort(np.arctan2(y, x), axis=1)
    x, y = np.take_along_axis(x, order, 1), np.take_along_axis(y, order, 1)
    twice: Floats = (x * np.roll(y, -1, 1) - y * np.roll(x, -1, 1)).sum(axis=1)
    return twice / 2
