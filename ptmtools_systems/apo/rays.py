"""Renders as `shader`, by rays: Embree finds the triangle of each pixel, numpy does the rest.

Derivatives are those of quads of two by two pixels, as in graphics hardware: the plane of a pixel's
own triangle, under the other pixel of the quad in its row or column.
"""

from __future__ import annotations

from importlib.metadata import version

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.embree import ray_tree
from ptmtools_systems.apo.model import Octree
from ptmtools_systems.apo.traversal import look_up, stop_depth
from ptmtools_systems.apo.view import Look, OctreePicture, OctreeView

#: Rays cast at a time.
_RAYS = 1 << 18


def draw(
    octree: Octree, corners: Floats, normal: Floats, view: OctreeView, look: Look
) -> OctreePicture:
    """See `shader.draw`; Embree has float32, which suffices in the cube."""
    shape = (view.height, view.width)
    row, column = (k.ravel() for k in np.indices(shape))
    triangle = _first_hits(corners, view.eye, view.rays(column, row))
    shown = np.flatnonzero(triangle >= 0)
    row, column, triangle = row[shown], column[shown], triangle[shown]
    first = corners[triangle, 0]
    across = np.cross(corners[triangle, 1] - first, corners[triangle, 2] - first)
    reach = ((first - view.eye) * across).sum(axis=1)

    def place(right: Ints, down: Ints) -> Floats:
        """(n, 3) intersections of the triangles' planes with the rays of pixels."""
        ray = view.rays(right, down)
        distance = reach / (ray * across).sum(axis=1)
        return np.asarray(view.eye + distance[:, None] * ray)

    with np.errstate(divide="ignore", invalid="ignore"):
        q = place(column, row)
        away = [
            np.linalg.norm(place(*neighbour) - q, axis=1)
            for neighbour in ((column ^ 1, row), (column, row ^ 1))
        ]
        stop = stop_depth(np.nan_to_num(np.fmin(*away), nan=1.0, posinf=1.0))
    address, depths, places = np.full(shape, -2), np.zeros(shape, np.int64), np.zeros((*shape, 3))
    picture = np.empty((*shape, 3), dtype=np.uint8)
    picture[:] = look.background
    if look.levels:
        nodes = look_up(octree, q, look.levels, stop)
        normals, at = nodes.normals, nodes.address
    else:
        normals, at = (
            _interpolate_normals(corners[triangle], normal[triangle], q),
            np.full(len(q), -1),
        )
    colors = octree.colors[at] if octree.colors is not None and look.levels else None
    picture[row, column] = np.rint(255 * look.shade(normals, colors, view))
    address[row, column], depths[row, column], places[row, column] = at, stop, q
    return OctreePicture(picture, address, places, depths, f"Embree (embreex {version('embreex')})")


def _first_hits(corners: Floats, eye: Floats, rays: Floats) -> Ints:
    """(n,) the first of (T, 3, 3) triangles hit by each of (n, 3) rays from an eye, or -1."""
    result = np.full(len(rays), -1, dtype=np.int64)
    if not len(corners):
        return result
    tree = ray_tree(corners)
    for first in range(0, len(rays), _RAYS):
        along = np.ascontiguousarray(rays[first : first + _RAYS], dtype=np.float32)
        start = np.tile(eye.astype(np.float32), (len(along), 1))
        result[first : first + _RAYS] = tree.run(start, along, query="INTERSECT")
    return result


def _interpolate_normals(corners: Floats, normals: Floats, places: Floats) -> Floats:
    """(n, 3) unit normals at places (n, 3) in the planes of triangles, from the corners (n, 3, 3)
    of these and their normals (n, 3, 3)."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    offset = places - corners[:, 0]
    aa, ab, bb = ((x * y).sum(axis=1) for x, y in ((a, a), (a, b), (b, b)))
    oa, ob = (offset * a).sum(axis=1), (offset * b).sum(axis=1)
    area = aa * bb - ab * ab
    with np.errstate(divide="ignore", invalid="ignore"):
        u, v = (bb * oa - ab * ob) / area, (aa * ob - ab * oa) / area
    weight = np.nan_to_num(np.stack([1 - u - v, u, v], axis=1), nan=1 / 3)
    normal = (weight[:, :, None] * normals).sum(axis=1)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return np.asarray(normal / np.where(length > 0, length, 1.0))
