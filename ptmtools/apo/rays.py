"""What `shader` draws, by rays: Embree finds the triangle of each pixel, numpy does the rest.

Derivatives are those of quads of two by two pixels, as graphics hardware has them: a pixel's own
triangle, continued as a plane, under the other pixel of the quad in its row or column.
"""

from __future__ import annotations

import numpy as np

from ptmtools.apo.model import Octree
from ptmtools.apo.shading import Drawn, Look
from ptmtools.apo.traversal import look_up, stop_depth
from ptmtools.apo.view import View
from ptmtools.arrays import Floats, Ints

#: Rays that are cast at a time.
_RAYS = 1 << 18


def hits(corners: Floats, eyes: Floats, rays: Floats) -> Ints:
    """(n,) the first of (T, 3, 3) triangles that each of (n, 3) rays from (n, 3) eyes meets, or -1.

    Embree has float32: keep the coordinates near 1.
    """
    found = np.full(len(rays), -1, dtype=np.int64)
    if not len(corners):
        return found
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    tree = EmbreeScene(robust=True)
    TriangleMesh(tree, np.ascontiguousarray(corners, dtype=np.float32))
    for first in range(0, len(rays), _RAYS):
        part = slice(first, first + _RAYS)
        start = np.ascontiguousarray(eyes[part], dtype=np.float32)
        along = np.ascontiguousarray(rays[part], dtype=np.float32)
        found[part] = tree.run(start, along, query="INTERSECT")
    return found


def draw(octree: Octree, corners: Floats, own: Floats, view: View, look: Look) -> Drawn:
    """As `OctreeShader.draw`."""
    shape = (view.height, view.width)
    row, column = (k.ravel() for k in np.indices(shape))
    rays = view.rays(column, row)
    triangle = hits(corners, np.broadcast_to(view.eye, rays.shape), rays)
    shown = np.flatnonzero(triangle >= 0)
    row, column, triangle = row[shown], column[shown], triangle[shown]
    first = corners[triangle, 0]
    edges = corners[triangle, 1:] - first[:, None]
    across = np.cross(edges[:, 0], edges[:, 1])
    reach = ((first - view.eye) * across).sum(axis=1)

    def place(right: Ints, down: Ints) -> Floats:
        ray = view.rays(right, down)
        with np.errstate(divide="ignore", invalid="ignore"):
            far = reach / (ray * across).sum(axis=1)
        return np.asarray(view.eye + far[:, None] * ray)

    q = place(column, row)
    with np.errstate(invalid="ignore"):
        steps = [np.linalg.norm(place(*pixel) - q, axis=1) for pixel in _others(column, row)]
    stop = stop_depth(np.nan_to_num(np.fmin(*steps), nan=1.0, posinf=1.0))
    address, depths, places = np.full(shape, -2), np.zeros(shape, np.int64), np.zeros((*shape, 3))
    picture = np.empty((*shape, 3), dtype=np.uint8)
    picture[:] = look.background
    if look.levels:
        found = look_up(octree, q, look.levels, stop)
        normals, at = found.normals, found.address
    else:
        normals, at = _interpolated(q - first, edges, own[triangle]), np.full(len(q), -1)
    colors = octree.colors[at] if octree.colors is not None and look.levels else None
    picture[row, column] = np.rint(255 * look.shown(normals, colors, view))
    address[row, column], depths[row, column], places[row, column] = at, stop, q
    return Drawn(picture, address, places, depths)


def _others(column: Ints, row: Ints) -> tuple[tuple[Ints, Ints], tuple[Ints, Ints]]:
    """The other pixels of each pixel's quad, in its row and in its column."""
    return (column ^ 1, row), (column, row ^ 1)


def _interpolated(offset: Floats, edges: Floats, own: Floats) -> Floats:
    """(n, 3) unit normals at offsets from the first corners of triangles with those edges."""
    a, b = edges[:, 0], edges[:, 1]
    aa, ab, bb = ((x * y).sum(axis=1) for x, y in ((a, a), (a, b), (b, b)))
    oa, ob = (offset * a).sum(axis=1), (offset * b).sum(axis=1)
    area = aa * bb - ab * ab
    with np.errstate(divide="ignore", invalid="ignore"):
        u, v = (bb * oa - ab * ob) / area, (aa * ob - ab * oa) / area
    weight = np.nan_to_num(np.stack([1 - u - v, u, v], axis=1), nan=1 / 3)
    normal = (weight[:, :, None] * own).sum(axis=1)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return np.asarray(normal / np.where(length > 0, length, 1.0))
