"""Samples of the simplified mesh, and their normals and colours from the source (paper 2, §3.1).

`spread` places points evenly on triangles, in rows parallel to the longest edge: thin triangles get
no more points than their area requires, and no gaps along their length. `nearest` finds the source
point of each sample by rays both ways along the normal; the nearest hit that faces the same way
counts, and surfaces that face away are passed through. `Paint` has the colours at points of the
source: materials, vertices and texels of the finest level, multiplied as in the model.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, Singles, areas
from ptmtools.embree import ray_tree
from ptmtools.scene.model import Scene

#: Factor of the spacing while there are too many points.
_FARTHER = 1.25


class Points(NamedTuple):
    """Points of triangles.

    Attributes
    ----------
    triangle: (n,) triangle of each point, ascending. weight: (n, 3) of its corners; the sum is 1.
    """

    triangle: Ints
    weight: Floats


def longest_first(corner: Floats) -> Ints:
    """(m,) the first corner of the longest edge of each of (m, 3, 3) triangles."""
    edge = np.linalg.norm(np.roll(corner, -1, axis=1) - corner, axis=2)
    result: Ints = edge.argmax(axis=1)
    return result


def spacing_for(corner: Floats, count: float) -> float:
    """The distance between ``count`` points on (m, 3, 3) triangles.

    It follows from the area, unless thin triangles, which have a row of points however thin they
    are, would then have more than as many again: then it is larger.
    """
    area = areas(corner)
    longest = np.linalg.norm(np.roll(corner, -1, axis=1) - corner, axis=2).max(axis=1)
    height = np.divide(2 * area, longest, out=np.zeros(len(corner)), where=longest > 0)
    spacing = float(np.sqrt(area.sum() / count))
    if not spacing:
        return spacing
    # Each triangle has at least one point, so this ends.
    while _points(height, longest, spacing) > 2 * max(count, len(corner)):
        spacing *= _FARTHER
    return spacing


def _points(height: Floats, longest: Floats, spacing: float) -> float:
    """The approximate number of points of triangles."""
    rows = np.maximum(height / spacing, 1)
    return float((rows * np.maximum(longest / (2 * spacing), 1)).sum())


def spread(corner: Floats, spacing: float) -> Points:
    """Points on (m, 3, 3) triangles, about ``spacing`` apart; at least one on each."""
    count = len(corner)
    first = longest_first(corner)
    number = np.arange(count)
    begin, end = (corner[number, (first + k) % 3] for k in range(2))
    longest = np.linalg.norm(end - begin, axis=1)
    height = np.divide(2 * areas(corner), longest, out=np.zeros(count), where=longest > 0)
    rows = np.maximum(np.rint(height / spacing), 1).astype(np.int64)
    row_triangle, row = _enumerate_items(rows)
    up = (row + 0.5) / rows[row_triangle]
    width = longest[row_triangle] * (1 - up)
    columns = np.maximum(np.rint(width / spacing), 1).astype(np.int64)
    point_row, column = _enumerate_items(columns)
    along = (column + 0.5) / columns[point_row]
    triangle, up = row_triangle[point_row], up[point_row]
    turned = np.stack([(1 - up) * (1 - along), (1 - up) * along, up], axis=1)
    # Back to the order of the triangles' corners.
    place = (np.arange(3) - first[triangle][:, None]) % 3
    return Points(triangle, np.take_along_axis(turned, place, axis=1))


def _enumerate_items(counts: Ints) -> tuple[Ints, Ints]:
    """For each of ``counts`` items: (n,) its owner, and its number among the owner's."""
    owner = np.repeat(np.arange(len(counts)), counts)
    begin = np.cumsum(counts) - counts
    return owner, np.arange(len(owner)) - begin[owner]


def interpolate(values: Floats, points: Points) -> Floats:
    """(n, k) interpolation of (m, 3, k) values of corners at points."""
    result: Floats = np.einsum("ij,ijk->ik", points.weight, values[points.triangle])
    return result


_WHITE = np.full((1, 1, 3), 255, np.uint8)


@dataclass(frozen=True)
class Paint:
    """
    Attributes
    ----------
    corner: (T, 3, 3) uint8 sRGB factors of the texels.
    uv: (T, 3, 2) float32, origin at the lower left. image: (T,) index into `images`, -1 for none.
    clamped: (T, 2) whether u and v stop at the edge of the image.
    images: (h, w, 3) uint8 each, rows from the top.
    """

    corner: NDArray[np.uint8]
    uv: Singles
    image: NDArray[np.int32]
    clamped: NDArray[np.bool_]
    images: tuple[NDArray[np.uint8], ...]

    def colors(self, triangle: Ints, weight: Floats) -> Floats:
        """(n, 3) sRGB, 0 to 1, at points of triangles; ``weight`` (n, 3) of the corners."""
        result: Floats = np.einsum("ij,ijk->ik", weight, self.corner[triangle] / 255.0)
        image = self.image[triangle]
        for number in np.unique(image[image >= 0]).tolist():
            rows = np.flatnonzero(image == number)
            triangle_, texels = triangle[rows], self.images[number]
            uv = np.einsum("ij,ijk->ik", weight[rows], self.uv[triangle_].astype(np.float64))
            kept = np.where(self.clamped[triangle_], np.clip(uv, 0, 1), uv - np.floor(uv))
            height, width = texels.shape[:2]
            column = np.minimum((kept[:, 0] * width).astype(np.int64), width - 1)
            row = np.minimum(((1 - kept[:, 1]) * height).astype(np.int64), height - 1)
            result[rows] *= texels[row, column] / 255.0
        return result


def paint_of(scene: Scene, kept: Ints) -> Paint:
    """The paint of the triangles ``kept`` of a scene; decodes its images. Raises the errors of
    reading an image."""
    from ptmtools.errors import naming
    from ptmtools.texture.images import load_image
    from ptmtools.texture.samples import in_eight_bits

    materials = scene.materials
    material = scene.triangle_material[kept]
    color = np.array([m.color for m in materials])[material]
    corner = np.repeat(color[:, None], 3, axis=1)
    if scene.colors is not None:
        corner = corner * (scene.colors[kept] / 255.0)
    clamped = np.array([[m.wrap_s == "clamp", m.wrap_t == "clamp"] for m in materials])
    images = []
    for image in scene.images:
        with naming(image.name):
            shown = in_eight_bits(load_image(image.load()).array())
        rgb = shown[..., :3] if shown.shape[2] >= 3 else np.repeat(shown[..., :1], 3, axis=2)
        images.append(np.ascontiguousarray(rgb) if rgb.size else _WHITE)
    return Paint(
        np.rint(corner.clip(0, 1) * 255).astype(np.uint8),
        scene.uv[kept].astype(np.float32),
        np.array([m.image for m in materials], np.int32)[material],
        clamped[material],
        tuple(images),
    )


#: Distance of the origin of a ray behind its point, and behind a surface it passes through: sixteen
#: roundings of a float32 within the cube, as a share of the cube.
STEP = 2.0**-20
#: Length of a ray, as a share of the cube. Farther surfaces are other parts of the source.
REACH = 0.1
#: Most surfaces facing away that a ray passes through.
LAYERS = 4


@dataclass(frozen=True)
class Source:
    """The mesh with the original normals, in the cube of the octree.

    Attributes
    ----------
    points: (V, 3) float32. triangles: (T, 3) int32.
    normals: (T, 3, 3) float32 unit normals of the corners.
    paint: colours of the triangles, if kept.
    """

    points: Singles
    triangles: NDArray[np.int32]
    normals: Singles
    paint: Paint | None = None

    @cached_property
    def facing(self) -> Singles:
        """(T, 3) normals of the triangles, of any length."""
        a, b, c = (self.points[self.triangles[:, k]] for k in range(3))
        return np.cross(b - a, c - a)

    @cached_property
    def tree(self) -> Any:
        """Embree's tree."""
        return ray_tree(self.points, self.triangles)

    def __getstate__(self) -> dict[str, Any]:
        """Without derived members: Embree's tree cannot be pickled."""
        return {name: value for name, value in vars(self).items() if name not in ("facing", "tree")}


@dataclass(frozen=True)
class Hits:
    """Points of the source.

    Attributes
    ----------
    triangle: (n,) -1 for none. weight: (n, 3) of its corners. distance: (n,) shares of the cube.
    """

    triangle: Ints
    weight: Singles
    distance: Singles


def nearest(source: Source, origin: Floats, normal: Floats) -> Hits:
    """The source points of (n, 3) points of the cube with (n, 3) unit normals."""
    forth = _cast(source, origin, normal, normal, np.full(len(origin), REACH, np.float32))
    back = _cast(source, origin, -normal, normal, forth.distance)
    better = back.triangle >= 0
    return Hits(
        np.where(better, back.triangle, forth.triangle),
        np.where(better[:, None], back.weight, forth.weight),
        np.where(better, back.distance, forth.distance),
    )


def _cast(source: Source, origin: Floats, along: Floats, normal: Floats, limit: Singles) -> Hits:
    """The first hit of each ray on a surface that faces the way of ``normal``, nearer than
    ``limit``."""
    count = len(origin)
    triangle, weight = np.full(count, -1, np.int64), np.zeros((count, 3), np.float32)
    distance = limit.copy()
    waiting, gone = np.arange(count), np.full(count, -STEP)
    for _ in range(LAYERS + 1):
        rays = along[waiting].astype(np.float32)
        begin = (origin[waiting] + gone[waiting, None] * along[waiting]).astype(np.float32)
        reach = np.maximum(limit[waiting] - gone[waiting], 0).astype(np.float32)
        hits = source.tree.run(begin, rays, dists=reach, output=True)
        hit = hits["primID"].astype(np.int64)
        met = hit >= 0
        travelled = gone[waiting] + hits["tfar"]
        same = met & _same_way(source.facing[hit], normal[waiting])
        taken = waiting[same]
        u, v = hits["u"][same], hits["v"][same]
        triangle[taken], distance[taken] = hit[same], np.abs(travelled[same])
        weight[taken] = np.stack([1 - u - v, u, v], axis=1)
        on = met & ~same & (travelled < limit[waiting])
        gone[waiting[on]] = travelled[on] + STEP
        waiting = waiting[on]
        if not len(waiting):
            break
    return Hits(triangle, weight, distance)


def _same_way(facing: Singles, normal: Floats) -> Bools:
    same: Bools = np.einsum("ij,ij->i", facing, normal) > 0
    return same
