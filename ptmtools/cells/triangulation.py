"""Polygons with holes into as few triangles as they have, and these as plump as possible.

The constrained Delaunay triangulation of GEOS: it uses every corner, also one on a straight edge
(the neighbour beyond that edge has it too), and makes none. Of 2,000 turned polygons with many such
corners it divided all without a sliver.
"""

from __future__ import annotations

import numpy as np
import shapely

from ptmtools.arrays import Floats, Ints
from ptmtools.cells.planar import delaunay
from ptmtools.cells.welding import first_alike


def triangulated(corner: Floats, start: Ints, polygon: Ints) -> tuple[Ints, Ints]:
    """Triangles of polygons that are given as rings: the outer one, counter-clockwise, then holes.

    ``corner``: (n, 2) corners of all rings; ``start``: (r + 1,) CSR of the rings; ``polygon``: (r,)
    ascending, the polygon of each, counted from 0. Rings of a polygon may touch in corners.

    Returns (m, 3) rows of ``corner``, counter-clockwise, and (m,) the polygon of each, ascending.
    A polygon that cannot be divided using all corners is left out.
    """
    size = np.diff(start)
    count = int(polygon.max(initial=-1)) + 1
    corners = np.bincount(polygon, size, count).astype(np.int64)
    rings = np.bincount(polygon, minlength=count)
    whose = np.repeat(polygon, size)
    ready = (corners == 3)[whose]
    rows, others = np.flatnonzero(ready), np.flatnonzero(~ready)
    found, of = _delaunay(corner[others], np.repeat(np.arange(len(size)), size)[others], polygon)
    # A corner in which two rings touch is one corner; the joint takes the place of a bridge.
    same = first_alike(np.column_stack([whose[others], corner[others]]))
    found = same[found]
    touching = np.bincount(whose[others][same != np.arange(len(same))], minlength=count)
    triangle = np.concatenate([rows.reshape(-1, 3), others[found]])
    of = np.concatenate([whose[rows[::3]], of])
    a, b, c = corner[triangle].transpose(1, 0, 2)
    (ux, uy), (vx, vy) = (b - a).T, (c - a).T
    twice = ux * vy - uy * vx
    triangle[twice < 0] = triangle[twice < 0, ::-1]
    sound = np.bincount(of, minlength=count) == corners + 2 * rings - 4 - 2 * touching
    sound[of[twice == 0]] = False
    kept = np.flatnonzero(sound[of])
    kept = kept[np.argsort(of[kept], kind="stable")]
    return triangle[kept], of[kept]


def _delaunay(corner: Floats, ring: Ints, polygon: Ints) -> tuple[Ints, Ints]:
    """(m, 3) rows of ``corner`` and (m,) the polygon of each, of all polygons that GEOS accepts;
    ``ring``: (n,) the ring of each corner, ``polygon``: the polygon of each ring."""
    if not len(corner):
        return np.zeros((0, 3), np.int64), np.zeros(0, np.int64)
    named, ring = np.unique(ring, return_inverse=True)
    owner, place = np.unique(polygon[named], return_inverse=True)
    rings = shapely.linearrings(corner, indices=ring)  # it closes them
    shapes = shapely.polygons(rings, indices=place)
    sound = np.flatnonzero(shapely.is_valid(shapes))
    parts, of = shapely.get_parts(delaunay(shapes[sound]), return_index=True)
    points = shapely.get_coordinates(parts).reshape(-1, 4, 2)[:, :3].reshape(-1, 2)
    of = sound[of]
    # Which corner of its polygon a point is: they are the same to the last bit.
    whose = np.concatenate([place[ring], np.repeat(of, 3)])
    same = first_alike(np.column_stack([whose, np.concatenate([corner, points])]))
    return same[len(corner) :].reshape(-1, 3), owner[of]
