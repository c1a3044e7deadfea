"""Bakes the normals of an object into a normal map around its simplified mesh.

The mesh is unwrapped by xatlas. All faces of a chart share one frame: the normal of the chart, and
the direction in which u grows. So the frames take no bytes in a file of vertices, interpolation
leaves them as they are, and every viewer that follows the glTF specification computes the same
normals. (Frames of the smooth normals of the mesh, interpolated between vertices, took 9 bytes a
vertex.)

Texels have the normals of the source by the rule of the octrees (`sampling.nearest`). Sides are
doubled until the map is as near to the source as ``error`` demands, or holds ``density`` texels for
each triangle of the source, or has 2 ** ``depth`` texels a side.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Singles, fill_gaps, normals, sum_by_group
from ptmtools.light.atlas import Atlas, claim, cover, nearest as nearest_on, unwrap
from ptmtools.output.object_maps import frame_axes
from ptmtools_systems.apo.making import Simple
from ptmtools_systems.apo.model import ApoOptions
from ptmtools_systems.apo.normals import corner_normals
from ptmtools_systems.apo.octree import Cube, cube_around
from ptmtools_systems.apo.sampling import Points, Source, interpolate, nearest, spacing_for, spread

#: Least and greatest side of a map, texels.
LEAST, LARGEST = 64, 8192
#: Texels between charts, so that coarse levels do not mix them.
_PADDING = 2
#: The step of frames: coarse enough to take few bytes, and units to within 0.4 %.
_STEP = 2.0**-9
#: Least component along the normal of a chart: glTF has no directions into the surface.
_LEAST_ALONG = 1 / 255
#: Most points at which a map is compared with the source.
_COMPARED = 100_000
#: Rays that are cast at a time.
_AT_ONCE = 1 << 18


@dataclass(frozen=True)
class NormalMap:
    """The normal map of an object.

    Attributes
    ----------
    uv: (T, 3, 2) float32 coordinates of the corners of its faces, in [0, 1], origin at the lower
        left.
    frame: (T, 7) float32 of each face: normal, tangent, and the sign of the bitangent, which is
        their cross product. Normal and tangent are unit vectors to within 0.4 %, and at right
        angles.
    texels: (side, side, 3) uint8, rows from the top: 127.5 (c + 1) for components c along tangent,
        bitangent and normal.
    error: root mean square difference to the source's normals, 0 to 2.
    missed: share of texels whose rays do not hit the source.
    """

    uv: NDArray[np.float32]
    frame: NDArray[np.float32]
    texels: NDArray[np.uint8]
    error: float
    missed: float


def normal_map(
    mesh: Simple, points: Floats, triangles: NDArray[np.int32], options: ApoOptions
) -> NormalMap:
    """The normals of (T, 3) triangles between distinct (P, 3) points as a map of their simplified
    ``mesh``.

    Raises MissingComponentError PTM-M100: xatlas is not installed.
    """
    baking, _ = Baking.from_mesh(mesh, points, triangles)
    largest = min(LARGEST, 2**options.depth, math.sqrt(options.density * len(triangles)))
    compared = baking.comparison(min(_COMPARED, options.density * len(triangles)))
    side = LEAST
    while True:
        atlas = unwrap(
            mesh.points, mesh.triangles, (side,), padding=_PADDING, purpose="baking normals"
        )
        frame = frames(atlas, mesh.points[mesh.triangles])
        texels, missed = baking.texels(atlas, frame, side)
        error = compared.error(atlas, frame, texels)
        if error <= options.error or 2 * side > largest:
            return NormalMap(atlas.uv.astype(np.float32), frame, texels, error, missed)
        side *= 2


def frames(atlas: Atlas, corner: Floats) -> NDArray[np.float32]:
    """(T, 7) the frame of each of (T, 3, 3) faces, see `NormalMap`."""
    chart = np.unique(atlas.chart, return_inverse=True)[1].ravel()
    count = int(chart.max(initial=-1)) + 1
    normal = _units(np.stack([sum_by_group(chart, n, count) for n in normals(corner).T], axis=1), 2)
    # The direction in which u grows, times twice the area of the face in the map.
    (au, av), (bu, bv) = np.moveaxis(atlas.uv[:, 1:] - atlas.uv[:, :1], 0, -1)
    along, up = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    turned = au * bv - av * bu
    mirrored = sum_by_group(chart, turned, count) < 0
    way = (along.T * bv - up.T * av) * np.where(mirrored, -1, 1)[chart]
    tangent = np.stack([sum_by_group(chart, part, count) for part in way], axis=1)
    tangent -= normal * (normal * tangent).sum(axis=1, keepdims=True)
    result = np.empty((count, 7))
    result[:, :3] = np.rint(normal / _STEP) * _STEP
    result[:, 3:6] = np.rint(_units(tangent, 0) / _STEP) * _STEP
    result[:, 6] = np.where(mirrored, -1, 1)
    return result[chart].astype(np.float32)


def _units(vectors: Floats | Singles, axis: int) -> Floats:
    """Unit vectors; along an axis for those of no length."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    otherwise = np.broadcast_to(np.eye(3)[axis], vectors.shape)
    return np.asarray(np.where(length > 0, vectors / np.maximum(length, 1e-300), otherwise))


@dataclass(frozen=True)
class Baking:
    """The source, and the corners and normals (T, 3, 3) of the simplified mesh, in the cube."""

    source: Source
    corner: Floats
    normal: Floats

    @staticmethod
    def from_mesh(
        mesh: Simple, points: Floats, triangles: NDArray[np.int32]
    ) -> tuple[Baking, Cube]:
        """As the arguments of `normal_map`; and the cube."""
        cube = cube_around(np.concatenate([points, mesh.points]))
        source = Source(
            cube.coordinates(points).astype(np.float32),
            triangles,
            corner_normals(points, triangles).astype(np.float32),
        )
        normal = mesh.normals[mesh.triangles].astype(np.float64)
        return Baking(source, cube.coordinates(mesh.points)[mesh.triangles], normal), cube

    def texels(
        self, atlas: Atlas, frame: NDArray[np.float32], side: int
    ) -> tuple[NDArray[np.uint8], float]:
        """The map, and the share of its texels without a point of the source."""
        owner = claim(atlas.uv, cover(atlas.uv, side))
        row, column = np.nonzero(owner >= 0)
        face = owner[row, column].astype(np.int64)
        place = np.stack([(column + 0.5) / side, 1 - (row + 0.5) / side], axis=1)
        points = Points(face, nearest_on(atlas.uv[face], place))
        normal, met = self._normals(points)
        inside = np.linalg.solve(frame_axes(frame)[face], normal[:, :, None])[:, :, 0]
        inside[:, 2] = np.maximum(inside[:, 2], _LEAST_ALONG)
        value = np.zeros((side, side, 3), np.float32)
        value[row, column] = _units(inside, 2)
        full = fill_gaps(value, owner >= 0)
        return _encode(_units(full, 2)), 1 - float(met.mean())

    def comparison(self, count: float) -> Compared:
        """About ``count`` points of the mesh, with the normals of the source."""
        points = spread(self.corner, spacing_for(self.corner, count))
        normal, met = self._normals(points)
        return Compared(Points(points.triangle[met], points.weight[met]), normal[met])

    def _normals(self, points: Points) -> tuple[Floats, NDArray[np.bool_]]:
        """(n, 3) unit normals of the source at points of the mesh, the mesh's own where it has
        none; and where it has."""
        result = _units(interpolate(self.normal, points), 2)
        place = interpolate(self.corner, points)
        met = np.zeros(len(result), np.bool_)
        for first in range(0, len(result), _AT_ONCE):
            part = slice(first, first + _AT_ONCE)
            hits = nearest(self.source, place[part], result[part])
            hit = np.flatnonzero(hits.triangle >= 0)
            source = Points(hits.triangle[hit], hits.weight[hit].astype(np.float64))
            met[first + hit] = True
            met_normal = interpolate(self.source.normals.astype(np.float64), source)
            result[first + hit] = _units(met_normal, 2)
        return result, met


@dataclass(frozen=True)
class Compared:
    """Points of the mesh, and (n, 3) unit normals of the source there."""

    points: Points
    normal: Floats

    def error(self, atlas: Atlas, frame: NDArray[np.float32], texels: NDArray[np.uint8]) -> float:
        """Root mean square difference of a map to the source."""
        shown = look_up_normals(
            texels, interpolate(atlas.uv, self.points), frame[self.points.triangle]
        )
        return float(np.sqrt(((shown - self.normal) ** 2).sum(axis=1).mean()))


def look_up_normals(texels: NDArray[np.uint8], uv: Floats, frame: NDArray[np.float32]) -> Floats:
    """(n, 3) unit normals of a map at (n, 2) coordinates, with bilinear filtering."""
    side = len(texels)
    place = np.stack([uv[:, 0], 1 - uv[:, 1]], axis=1) * side - 0.5
    first = np.floor(place).astype(np.int64)
    share = place - first
    value = np.zeros((len(uv), 3))
    for down in (0, 1):
        for across in (0, 1):
            column, row = np.clip(first + [across, down], 0, side - 1).T
            weight = np.abs(1 - across - share[:, 0]) * np.abs(1 - down - share[:, 1])
            value += weight[:, None] * texels[row, column]
    return _units(np.einsum("nij,nj->ni", frame_axes(frame), value / 127.5 - 1), 2)


def _encode(value: Floats) -> NDArray[np.uint8]:
    return np.rint(127.5 * (value + 1)).astype(np.uint8)
