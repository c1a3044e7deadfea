"""Levels of detail of objects with many triangles: coarser meshes that clients draw first.

A cell's GLB holds the coarsest mesh of such an object, and a file for each finer one follows, the
last of which is the object as modelled. The hints say by how much each mesh is off
(docs/formats/hints.md), so that a client fetches a finer one where the difference can be seen, by
worth per byte like a level of a texture. Each cell's part of an object is simplified by itself: a
client needs no mesh of a cell that it does not see.

Each level has an eighth of the triangles of the next, a third of its lengths: in the pictures of
texture pyramids, one and a half levels. (Rejected: progressive meshes, which refine by single
vertices. Their records take two to three times the bytes of a compressed mesh, so the two coarser
meshes, an eighth of the whole, cost less.)
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Ints, Singles
from ptmtools.output.geometry import Geometry, Shape, normal_steps, smooth_normals
from ptmtools.progress import Progress, silent

if TYPE_CHECKING:
    from ptmtools.simplification import Mesh

#: Triangles of an object in a cell from which it has levels.
MANY = 4096
#: Each level has this share of the triangles of the finer one, and at least as many.
SHARE, FEWEST = 8, 256
#: A level whose error is a greater share of half the diagonal of the object is left out.
LARGEST_ERROR = 0.02
#: A level that keeps a greater multiple of the wanted triangles is left out, with coarser ones:
#: seams or borders hold them.
MISSED = 2


@dataclass(frozen=True)
class DetailLevel:
    """A simplified mesh of an object.

    Attributes
    ----------
    point, uv: (n, 3), (k, 2) float32, the tables that ``shapes`` refer to.
    shapes: as those of the object that they replace; one without triangles is left out.
    error: `Simplified.error` with those of all finer levels, metres.
    """

    point: Singles
    uv: Singles
    shapes: tuple[Shape, ...]
    error: float


@dataclass(frozen=True)
class MeshLevels:
    """The levels of an object in a cell.

    Attributes
    ----------
    cell, object: of it.
    box: (6,) least and greatest coordinates, metres.
    levels: the simplified meshes, the coarsest first; at least one.
    first: number of the file of the second one among all files of meshes.
    """

    cell: int
    object: int
    box: Singles
    levels: tuple[DetailLevel, ...]
    first: int

    @property
    def files(self) -> range:
        """The numbers of its files: of all levels but the coarsest, and of the object itself."""
        return range(self.first, self.first + len(self.levels))

    @property
    def errors(self) -> list[float]:
        """The error of each mesh, metres, the coarsest first; 0 of the last, as modelled."""
        return [*(level.error for level in self.levels), 0.0]


def mesh_levels(
    geometry: Geometry, left_out: Collection[int] = (), progress: Progress = silent
) -> tuple[MeshLevels, ...]:
    """The levels of all objects that have some, except of those ``left_out``, by cell and object;
    ``progress`` is called for every object."""
    meshes: list[MeshLevels] = []
    first = 0
    heavy = list(_heavy(geometry, left_out))
    for done, (cell, rows) in enumerate(heavy):
        progress(done, len(heavy), "simplifying objects")
        shapes = [geometry.shape(s) for s in rows]
        if levels := _levels(geometry, shapes):
            point = geometry.point[np.concatenate([shape.point for shape in shapes])]
            box = np.concatenate([point.min(axis=0), point.max(axis=0)])
            meshes.append(MeshLevels(cell, shapes[0].object, box, levels, first))
            first += len(levels)
    return tuple(meshes)


def _heavy(geometry: Geometry, left_out: Collection[int]) -> Iterator[tuple[int, range]]:
    """The cell and the shapes of each object in a cell with `MANY` triangles or more, except of the
    objects ``left_out``."""
    for cell, (begin, end) in enumerate(pairwise(geometry.cell_start.tolist())):
        changes = np.flatnonzero(np.diff(geometry.object[begin:end])) + begin + 1
        for a, b in pairwise([begin, *changes.tolist(), end]):
            count = geometry.triangle_start[b] - geometry.triangle_start[a]
            # Coarser meshes have no place in a lightmap.
            mapped = geometry.light is not None and geometry.light.mapped[a:b].any()
            if count >= MANY and int(geometry.object[a]) not in left_out and not mapped:
                yield cell, range(a, b)


def _levels(geometry: Geometry, shapes: Sequence[Shape]) -> tuple[DetailLevel, ...]:
    from ptmtools.simplification import SimplifyOptions, simplify

    mesh = _join_shapes(geometry, shapes)
    size = float(np.linalg.norm(np.ptp(mesh.points, axis=0))) / 2
    levels: list[DetailLevel] = []
    error = 0.0
    while (faces := len(mesh.triangles) // SHARE) >= FEWEST:
        simplified = simplify(mesh, SimplifyOptions(faces, keep_parts=True))
        mesh = simplified.mesh
        error += simplified.error
        if error > LARGEST_ERROR * size or len(mesh.triangles) > MISSED * faces:
            break
        levels.insert(0, _level(mesh, shapes, error))
    return tuple(levels)


def _join_shapes(geometry: Geometry, shapes: Sequence[Shape]) -> Mesh:
    """One mesh of shapes, the materials of which are their places."""
    from ptmtools.simplification import Mesh

    corner = np.concatenate([shape.point[shape.triangle] for shape in shapes])
    uv = np.concatenate([shape.uv[shape.uv_triangle] for shape in shapes])
    used, triangles = np.unique(corner, return_inverse=True)
    count = [len(shape.triangle) for shape in shapes]
    colors = None
    if any(shape.color is not None for shape in shapes):
        white = [np.full((n, 3, 3), 255, np.uint8) for n in count]
        painted = [w if s.color is None else s.color for w, s in zip(white, shapes, strict=True)]
        colors = np.concatenate(painted)
    coordinates = geometry.uv[uv].astype(np.float64)
    return Mesh(
        geometry.point[used].astype(np.float64),
        triangles.reshape(-1, 3).astype(np.int32),
        np.repeat(np.arange(len(shapes), dtype=np.int32), count),
        coordinates if coordinates.any() else None,
        colors,
    )


def _level(mesh: Mesh, shapes: Sequence[Shape], error: float) -> DetailLevel:
    uv = np.zeros((len(mesh.triangles), 3, 2)) if mesh.uv is None else mesh.uv
    table, corner = np.unique(uv.reshape(-1, 2).astype(np.float32), axis=0, return_inverse=True)
    corner = corner.reshape(-1, 3)
    assert mesh.material is not None
    normals = None
    if any(shape.normals is not None for shape in shapes):
        group = np.zeros(len(corner), np.int64)
        normals = normal_steps(smooth_normals(mesh.points[mesh.triangles], group))
    parts = []
    for place, shape in enumerate(shapes):
        selected = np.flatnonzero(mesh.material == place)
        if not len(selected):
            continue
        point, triangle = _compact(mesh.triangles[selected])
        coordinates, uv_triangle = _compact(corner[selected])
        color = None if mesh.colors is None or shape.color is None else mesh.colors[selected]
        parts.append(
            Shape(
                shape.object,
                shape.material,
                shape.two_sided,
                point,
                coordinates,
                triangle,
                uv_triangle,
                color,
                lit=shape.lit,
                reflects=shape.reflects,
                normals=None if shape.normals is None or normals is None else normals[selected],
            )
        )
    return DetailLevel(mesh.points.astype(np.float32), table, tuple(parts), error)


def _compact(corner: NDArray[np.integer]) -> tuple[Ints, Ints]:
    used, place = np.unique(corner, return_inverse=True)
    return used.astype(np.int64), place.reshape(-1, 3).astype(np.int64)


def row_fault(row: Mapping[str, Any], cells: int) -> tuple[str, str]:
    """The member of a row of the hints that is wrong, and a message; two empty texts if it is
    right. ``cells``: their number."""
    errors = row["errors"]
    if row["cell"] >= cells:
        return "cell", f"the index {row['cell']} is out of range"
    if len(errors) != len(row["files"]) + 1 or errors[-1] or errors != sorted(errors)[::-1]:
        return "errors", "is not one error more than files, descending to 0"
    return "", ""
