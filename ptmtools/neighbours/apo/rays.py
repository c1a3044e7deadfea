"""Renders like `shader`, by rays: Embree finds the triangle of each pixel, numpy does the rest.

Derivatives are those of quads of two by two pixels, as in graphics hardware: the plane of a pixel's
own triangle, under the other pixel of the quad in its row or column.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.neighbours.apo.model import Octree
from ptmtools.neighbours.apo.traversal import look_up, stop_depth
from ptmtools.neighbours.apo.view import Frame, Look, View

#: Rays cast at a time.
_RAYS = 1 << 18


def hits(corners: Floats, eyes: Floats, rays: Floats) -> Ints:
    """(n,) the first of (T, 3, 3) triangles hit by each of (n, 3) rays from (n, 3) eyes, or -1.

    Embree has float32: keep the coordinates near 1.
    """
    result = np.full(len(rays), -1, dtype=np.int64)
    if not len(corners):
        return result
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    tree = EmbreeScene(robust=True)
    TriangleMesh(tree, np.ascontiguousarray(corners, dtype=np.float32))
    for first in range(0, len(rays), _RAYS):
        part = slice(first, first + _RAYS)
        start = np.ascontiguousarray(eyes[part], dtype=np.float32)
        along = np.ascontiguousarray(rays[part], dtype=np.float32)
        result[part] = tree.run(start, along, query="INTERSECT")
    return result


@dataclass(frozen=True)
class VisiblePixels:
    """The n pixels of a view that show the mesh.

    Attributes
    ----------
    row, column: (n,) of the pixels. triangle: (n,) the first along their rays.
    place: (n, 3) intersection with it.
    across, below: (n, 3) intersections of the triangle's plane with the rays of the other pixel of
        the quad in the row, and in the column; not finite without one.
    """

    row: Ints
    column: Ints
    triangle: Ints
    place: Floats
    across: Floats
    below: Floats

    @property
    def step(self) -> Floats:
        """(n,) the smaller of the distances to both."""
        with np.errstate(invalid="ignore"):
            away = (np.linalg.norm(q - self.place, axis=1) for q in (self.across, self.below))
            return np.asarray(np.nan_to_num(np.fmin(*away), nan=1.0, posinf=1.0))


def visible_pixels(corners: Floats, view: View) -> VisiblePixels:
    """The pixels that show (T, 3, 3) corners in a view; both near 1, as Embree has float32."""
    row, column = (k.ravel() for k in np.indices((view.height, view.width)))
    rays = view.rays(column, row)
    triangle = hits(corners, np.broadcast_to(view.eye, rays.shape), rays)
    shown = np.flatnonzero(triangle >= 0)
    row, column, triangle = row[shown], column[shown], triangle[shown]
    first = corners[triangle, 0]
    across = np.cross(corners[triangle, 1] - first, corners[triangle, 2] - first)
    reach = ((first - view.eye) * across).sum(axis=1)

    def place(right: Ints, down: Ints) -> Floats:
        ray = view.rays(right, down)
        with np.errstate(divide="ignore", invalid="ignore"):
            far = reach / (ray * across).sum(axis=1)
            return np.asarray(view.eye + far[:, None] * ray)

    points = place(column, row), place(column ^ 1, row), place(column, row ^ 1)
    return VisiblePixels(row, column, triangle, *points)


def draw(octree: Octree, corners: Floats, own: Floats, view: View, look: Look) -> Frame:
    """See `shader.draw`."""
    from importlib.metadata import version

    shape = (view.height, view.width)
    sight = visible_pixels(corners, view)
    row, column, triangle, q = sight.row, sight.column, sight.triangle, sight.place
    stop = stop_depth(sight.step)
    address, depths, places = np.full(shape, -2), np.zeros(shape, np.int64), np.zeros((*shape, 3))
    picture = np.empty((*shape, 3), dtype=np.uint8)
    picture[:] = look.background
    if look.levels:
        nodes = look_up(octree, q, look.levels, stop)
        normals, at = nodes.normals, nodes.address
    else:
        weight = weights(corners[triangle], q)
        normals, at = interpolated(weight, own[triangle]), np.full(len(q), -1)
    colors = octree.colors[at] if octree.colors is not None and look.levels else None
    picture[row, column] = np.rint(255 * look.shown(normals, colors, view))
    address[row, column], depths[row, column], places[row, column] = at, stop, q
    renderer = f"Embree (embreex {version('embreex')})"
    return Frame(picture, address, places, depths, renderer)


def weights(corners: Floats, places: Floats) -> Floats:
    """(n, 3) weights of the corners (n, 3, 3) of triangles, at places (n, 3) in their planes."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    offset = places - corners[:, 0]
    aa, ab, bb = ((x * y).sum(axis=1) for x, y in ((a, a), (a, b), (b, b)))
    oa, ob = (offset * a).sum(axis=1), (offset * b).sum(axis=1)
    area = aa * bb - ab * ab
    with np.errstate(divide="ignore", invalid="ignore"):
        u, v = (bb * oa - ab * ob) / area, (aa * ob - ab * oa) / area
    return np.asarray(np.nan_to_num(np.stack([1 - u - v, u, v], axis=1), nan=1 / 3))


def interpolated(weight: Floats, normals: Floats) -> Floats:
    """(n, 3) unit normals from (n, 3, 3) normals of corners with weights (n, 3)."""
    normal = (weight[:, :, None] * normals).sum(axis=1)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return np.asarray(normal / np.where(length > 0, length, 1.0))
