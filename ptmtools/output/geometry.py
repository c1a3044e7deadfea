"""The geometry of all cells as emitters write it: indexed shapes.

A cell has one shape for each object, material and sidedness. Positions and texture coordinates are
rounded to float32 once for the whole scene and welded by equality, so that a vertex shared by two
pieces is one vertex in the file, and a corner shared by two cells has the same text in both. Pieces
of which two corners become one in that rounding have no area left; they are dropped and counted.

What is curved and reflects has normals, since facets show in reflections. They are computed: many
models state none, or those of facets.
"""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, Singles, areas, normals, sum_by_group, units
from ptmtools.cells.model import Cells
from ptmtools.errors import DatabaseError
from ptmtools.output.numbers import single
from ptmtools.scene.colors import encode_srgb, gradients, to_linear
from ptmtools.scene.model import Scene

if TYPE_CHECKING:
    from ptmtools.light.model import Light
    from ptmtools.output.object_maps import ObjectMaps

#: The step of coordinates in normal maps, far below a texel.
_RELIEF_STEP = 2.0**-20
#: Steps of normals to 1. Faces whose normals differ by less than this cosine, 40°, are taken for
#: parts of one curved surface: a column of ten sides is one, the edges of a bar of eight are edges.
NORMAL_STEPS, _CREASE = 127, 0.766
#: Normals at a corner that agree to a part of this many are one, so that tips of fans cost little.
_DIRECTIONS = 16


@dataclass(frozen=True)
class Shape:
    """Triangles of one object with one material, all of them solid or all two-sided.

    Attributes
    ----------
    object, material: indices into the scene's.
    two_sided: whether both sides are seen.
    point, uv: (n,), (k,) rows of `Geometry.point` and `Geometry.uv`.
    triangle, uv_triangle: (m, 3) indices into `point` and `uv`.
    color: (m, 3, 3) uint8 sRGB of the corners, None where all are white.
    light: (m, 3, 2) float32 coordinates of the corners in the lightmap of the cell, origin at the
        lower left; None where it does not light the shape.
    relief: (m, 3, 9) float32 coordinates of the corners in the normal map of the object, likewise,
        and the frames there, see `NormalMap`; None without one.
    normal: (m, 3, 2) float32 coordinates of the corners in the normal map of the material,
        likewise, if that has its own; else None.
    lit: whether it has light, in the lightmap or, as a factor of its colours, at its corners.
    reflects: whether it shows the probe of the cell.
    normals: (m, 3, 3) int8 unit vectors of the corners, in `NORMAL_STEPS`; None of what is flat or
        does not reflect.
    """

    object: int
    material: int
    two_sided: bool
    point: Ints
    uv: Ints
    triangle: Ints
    uv_triangle: Ints
    color: NDArray[np.uint8] | None = None
    light: Singles | None = None
    relief: Singles | None = None
    normal: Singles | None = None
    lit: bool = False
    reflects: bool = False
    normals: NDArray[np.int8] | None = None


class Geometry:
    """All shapes of all cells, by cell, object, material and sidedness.

    Lists of varying length are CSR, as in `Cells`.

    Attributes
    ----------
    point, uv: (n, 3), (k, 2) float32, the distinct positions and texture coordinates.
    cell_start: (C + 1,) the shapes of each cell.
    object, material, two_sided: (S,) of each shape.
    triangle, uv_triangle: (M, 3) corners as indices into `shape_point` and `shape_uv`, counted
        from the shape's first.
    triangle_start: (S + 1,) the triangles of each shape.
    shape_point, point_start: (P,) rows of `point`, ascending; (S + 1,) those of each shape.
    shape_uv, uv_start: the same for `uv`.
    color: (M, 3, 3) uint8 sRGB of the corners of triangles; None if the scene has no colours.
    normal: (M, 3, 2) float32 as in `Shape`; None if no normal map has its own coordinates.
    piece: (M,) the piece of `Cells` that each triangle is.
    collapsed: pieces dropped by the rounding, over all cells.
    light: the light of the cells, or None.
    relief: (M, 3, 9) as in `Shape`, 0 of objects without a normal map; relieved: (S,) whether a
        shape has one.
    normals, curved: (M, 3, 3) as in `Shape`, 0 of flat shapes; (S,) whether a shape has normals.
    """

    light: Light | None = None
    normals: NDArray[np.int8] | None = None
    curved: Bools
    relief: Singles | None = None
    relieved: Bools

    def __init__(self, scene: Scene, cells: Cells) -> None:
        piece, cell = cells.emitted(scene.two_sided)
        self.point, point_of = _weld(single(cells.vertex, "vertices"))
        self.uv, uv_of = _weld(single(cells.vertex_uv, "texture coordinates"))
        corner = point_of[cells.triangle[piece]].reshape(-1, 3)
        flat = (corner == np.roll(corner, 1, axis=1)).any(axis=1)
        self.collapsed = int(flat.sum())
        piece, cell, corner = piece[~flat], cell[~flat], corner[~flat]
        source = cells.triangle_source[piece]
        thing, material = scene.triangle_object[source], scene.triangle_material[source]
        things, materials = max(len(scene.objects), 1), max(len(scene.materials), 1)
        key = cell.astype(np.int64) * things + thing
        key = (key * materials + material) * 2 + scene.two_sided[source]
        order = np.argsort(key, kind="stable")
        key = key[order]
        change = np.ones(len(order), dtype=np.bool_)
        change[1:] = key[1:] != key[:-1]
        first = np.flatnonzero(change)
        shape = np.cumsum(change) - 1
        first_piece = order[first]
        self.object, self.material = thing[first_piece], material[first_piece]
        self.two_sided = scene.two_sided[source[first_piece]]
        self.triangle_start = np.append(first, len(order))
        self.cell_start = np.searchsorted(cell[first_piece], np.arange(cells.cell_count + 1))
        self.shape_point, self.point_start, self.triangle = _index_rows(
            corner[order], shape, len(first), len(self.point)
        )
        self.piece = piece[order]
        self.color = _corner_colors(scene, cells, self.piece)
        self.normal = _normal_coordinates(scene, cells, self.piece)
        has_own_map = [m.normal is not None and m.normal.own for m in scene.materials]
        self._own_normal = np.array(has_own_map, np.bool_)[self.material]
        uv_corner = uv_of[cells.triangle[self.piece]].reshape(-1, 3)
        self.shape_uv, self.uv_start, self.uv_triangle = _index_rows(
            uv_corner, shape, len(first), len(self.uv)
        )

    def with_light(self, light: Light) -> Geometry:
        """The same geometry with a light: lightmaps, and colours where that is at vertices.

        Raises DatabaseError PTM-D008 if it is that of other geometry.
        """
        if len(light.uv) != len(self.triangle) or len(light.mapped) != len(self.object):
            raise DatabaseError(
                "PTM-D008",
                "the stages do not belong together: the light is that of other geometry",
                remedy="run the stage `light` again",
            )
        result = copy(self)
        result.light = light
        if (light.vertex < 255).any():
            color = light.vertex
            if self.color is not None:
                color = encode_srgb(to_linear(color / 255) * to_linear(self.color / 255))
            result.color = color
        return result

    def with_object_maps(self, maps: ObjectMaps, scene: Scene, cells: Cells) -> Geometry:
        """The same geometry with the normal maps of objects."""
        result = copy(self)
        result.relieved = np.isin(self.object, maps.objects)
        row = np.full(len(scene.triangles), -1)
        row[np.isin(scene.triangle_object, maps.objects)] = np.arange(len(maps.uv))
        relieved = np.repeat(result.relieved, np.diff(self.triangle_start))
        source = row[cells.triangle_source[self.piece[relieved]]]
        uv = np.zeros((len(scene.triangles), 3, 2))
        uv[row >= 0] = maps.uv
        uv = np.clip(_carry_over(scene, cells, self.piece[relieved], uv), 0, 1)
        result.relief = np.zeros((len(self.triangle), 3, 9), np.float32)
        # Pieces of one triangle, and neighbours, have the same numbers at a corner.
        result.relief[relieved, :, :2] = np.rint(uv / _RELIEF_STEP) * _RELIEF_STEP
        result.relief[relieved, :, 2:] = maps.frame[source][:, None]
        return result

    def with_normals(self, scene: Scene, cells: Cells) -> Geometry:
        """The same geometry, lit, with the normals of what is curved and reflects."""
        light = self.light
        assert light is not None
        reflects = light.reflects
        faces = np.flatnonzero(np.isin(scene.triangle_object, self.object[reflects]))
        if not len(faces):
            return self
        corners = single(scene.points[scene.triangles[faces]], "vertices")
        value = np.zeros((len(scene.triangles), 3, 3))
        value[faces] = smooth_normals(corners, scene.triangle_object[faces])
        curved = np.zeros(len(value), np.bool_)
        curved[faces] = bends(corners.astype(np.float64), value[faces])
        count = np.diff(self.triangle_start)
        bent = curved[cells.triangle_source[self.piece]] & np.repeat(reflects, count)
        result = copy(self)
        result.curved = np.add.reduceat(bent, self.triangle_start[:-1]) > 0
        rows = np.repeat(result.curved, count)
        result.normals = np.zeros((len(rows), 3, 3), np.int8)
        result.normals[rows] = normal_steps(_carry_over(scene, cells, self.piece[rows], value))
        return result

    def areas(self) -> Floats:
        """(S,) m² of each shape."""
        count = np.diff(self.triangle_start)
        first = np.repeat(self.point_start[:-1], count)[:, None]
        corners = self.point[self.shape_point[first + self.triangle]].astype(np.float64)
        return sum_by_group(np.repeat(np.arange(len(count)), count), areas(corners), len(count))

    def shape(self, s: int) -> Shape:
        """One shape."""
        points, uvs, rows = (
            slice(*start[s : s + 2].tolist())
            for start in (self.point_start, self.uv_start, self.triangle_start)
        )
        return Shape(
            int(self.object[s]),
            int(self.material[s]),
            bool(self.two_sided[s]),
            self.shape_point[points],
            self.shape_uv[uvs],
            self.triangle[rows],
            self.uv_triangle[rows],
            None if self.color is None or (self.color[rows] == 255).all() else self.color[rows],
            self.light.uv[rows] if self.light is not None and self.light.mapped[s] else None,
            self.relief[rows] if self.relief is not None and self.relieved[s] else None,
            self.normal[rows] if self.normal is not None and self._own_normal[s] else None,
            self.light is not None and bool(self.light.lit[s]),
            self.light is not None and bool(self.light.reflects[s]),
            self.normals[rows] if self.normals is not None and self.curved[s] else None,
        )

    def shapes(self, cell: int) -> Iterator[Shape]:
        """The shapes of a cell."""
        return map(self.shape, range(*self.cell_start[cell : cell + 2].tolist()))


def _corner_colors(
    scene: Scene, cells: Cells, piece: NDArray[np.integer]
) -> NDArray[np.uint8] | None:
    """(M, 3, 3) the colours of pieces' corners, interpolated over their source triangles; None if
    the scene has none."""
    if scene.colors is None:
        return None
    interpolated = _carry_over(scene, cells, piece, scene.colors)
    return np.asarray(np.clip(np.rint(interpolated), 0, 255).astype(np.uint8))


def _normal_coordinates(scene: Scene, cells: Cells, piece: NDArray[np.integer]) -> Singles | None:
    """(M, 3, 2) the coordinates of pieces' corners in the normal maps that have their own."""
    if scene.normal_uv is None:
        return None
    uv = _carry_over(scene, cells, piece, scene.normal_uv)
    return (np.rint(uv / _RELIEF_STEP) * _RELIEF_STEP).astype(np.float32)


def _carry_over(
    scene: Scene, cells: Cells, piece: NDArray[np.integer], values: NDArray[Any]
) -> Floats:
    """(M, 3, k) at the corners of pieces, interpolated between the (T, 3, k) values of the corners
    of the scene's triangles."""
    source = cells.triangle_source[piece]
    corners, value = scene.corners[source], values[source].astype(np.float64)
    away = cells.vertex[cells.triangle[piece]] - corners[:, :1]
    return np.asarray(value[:, :1] + np.einsum("mkx,mcx->mck", gradients(corners, value), away))


def smooth_normals(corner: NDArray[np.floating], group: NDArray[np.integer]) -> Floats:
    """(T, 3, 3) unit normals of the corners of triangles (T, 3, 3): the means, weighted by area and
    angle, over the triangles of the same (T,) group that have a corner in the same place, and a
    normal within the crease angle; 0 of what has no area."""
    _, place = _weld(corner.reshape(-1, 3).astype(np.float32))
    points = corner.astype(np.float64)
    face = units(normals(points))
    ahead = units(np.roll(points, -1, axis=1) - points)
    cosine = -np.einsum("tcx,tcx->tc", ahead, np.roll(ahead, 1, axis=1))
    weight = (np.arccos(np.clip(cosine, -1, 1)) * areas(points)[:, None]).ravel()
    # Equal directions at one corner of a group become one; they follow each other in their order.
    side = 2 * _DIRECTIONS + 1
    cube = np.rint(_DIRECTIONS * face).astype(np.int64) + _DIRECTIONS
    direction = np.repeat((cube[:, 0] * side + cube[:, 1]) * side + cube[:, 2], 3)
    at = np.repeat(group.astype(np.int64), 3) * (int(place.max(initial=0)) + 1) + place
    keys, row = np.unique(at * side**3 + direction, return_inverse=True)
    row = row.ravel()
    weighted = weight[:, None] * np.repeat(face, 3, axis=0)
    part = np.stack([sum_by_group(row, weighted[:, axis], len(keys)) for axis in range(3)], axis=1)
    mean, total, at = units(part), part.copy(), keys // side**3
    first, step = np.arange(len(keys) - 1), 1
    while len(first := first[at[first] == at[first + step]]):
        near = np.einsum("nx,nx->n", mean[first], mean[first + step]) > _CREASE
        a, b = first[near], first[near] + step
        total[a] += part[b]
        total[b] += part[a]
        step += 1
        first = first[first < len(keys) - step]
    return units(total)[row].reshape(-1, 3, 3)


def bends(corner: Floats, normal: Floats) -> Bools:
    """(T,) whether the (T, 3, 3) normals of the corners of triangles are others than their own."""
    apart = np.abs(normal - units(normals(corner))[:, None]).max(axis=(1, 2))
    return np.asarray(NORMAL_STEPS * apart > 0.5)


def normal_steps(normal: Floats) -> NDArray[np.int8]:
    """Vectors (..., 3) as unit vectors in `NORMAL_STEPS`; those of no length point up."""
    unit = units(normal)
    unit[~unit.any(axis=-1)] = [0.0, 1.0, 0.0]
    return np.asarray(np.rint(NORMAL_STEPS * unit), np.int8)


def _index_rows(corner: Ints, shape: Ints, shapes: int, count: int) -> tuple[Ints, Ints, Ints]:
    """The rows used by the triangles of each shape, the start of each shape among them, and the
    (m, 3) corners as indices into them, counted from the shape's first."""
    used, place = np.unique(shape[:, None] * count + corner, return_inverse=True)
    start = np.searchsorted(used, np.arange(shapes + 1) * count)
    return used % max(count, 1), start, place.reshape(-1, 3) - start[shape][:, None]


def _weld(rows: Singles) -> tuple[Singles, Ints]:
    """The distinct rows of (n, 2 or more) in lexical order, and the place of each row among them.

    Floats become integers of the same order, two of which are sorted as one.
    """
    bits = np.ascontiguousarray(rows.T).view(np.uint32)
    negative = bits >> np.uint32(31) == 1
    columns = np.where(negative, ~bits, bits | np.uint32(1 << 31)).astype(np.uint64)
    rank = columns[0]
    for column in columns[1:]:
        _, place = np.unique((rank << np.uint64(32)) | column, return_inverse=True)
        rank = place.astype(np.uint64)
    welded = np.empty((int(place.max(initial=-1)) + 1, rows.shape[1]), dtype=np.float32)
    welded[place] = rows
    return welded, place.astype(np.int64)
