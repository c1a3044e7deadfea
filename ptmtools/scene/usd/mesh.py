"""Cuts meshes of USD into triangles, and evaluates their primvars at the corners.

A mesh is drawn as its control cage: subdivision would require another library, and buildings
contain few smooth surfaces. Cubes and planes are drawn too; spheres, cylinders and the like, for
which the library has no mesh, are not.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import UsdGeom

from ptmtools.arrays import Floats, Ints
from ptmtools.errors import InputError
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.polygon import triangulate
from ptmtools.scene.usd.layers import TIME

#: The corners of a cube of two units, and its faces.
_CUBE = np.array([[x, y, z] for x in (-1.0, 1) for y in (-1.0, 1) for z in (-1.0, 1)])
_CUBE_FACES = np.array(
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
)
#: A square of two units, and the directions of the width and the length of a plane by its axis. A
#: plane faces along its axis, so the square is reversed if the axis is not the cross product of the
#: sides.
_SQUARE = np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])
_PLANE_SIDES = {
    "X": ((0, 0, 1), (0, 1, 0)),
    "Y": ((1, 0, 0), (0, 0, 1)),
    "Z": ((1, 0, 0), (0, 1, 0)),
}


@dataclass(frozen=True)
class UsdMesh:
    """A mesh cut into triangles.

    Attributes
    ----------
    points: (P, 3) float64 used points in the space of its prim.
    triangles: (T, 3) int64 into `points`, counter-clockwise seen from the front.
    corner: (T, 3) int64 the same triangles as indices of corners of the mesh's faces.
    vertex: (C,) int64 the point of the mesh at each corner of its faces.
    face: (T,) int64 the mesh's face of each triangle.
    vertices, faces: numbers of points and faces of the mesh.
    """

    points: Floats
    triangles: Ints
    corner: Ints
    vertex: Ints
    face: Ints
    vertices: int
    faces: int


def array(value: Any, kind: Any, *shape: int) -> NDArray[Any]:
    """An array of the library as a numpy array, (0, *shape) without one."""
    if value is None or not len(value):
        return np.zeros((0, *shape), dtype=kind)
    return np.asarray(value).astype(kind).reshape(-1, *shape)


def is_cut(prim: Any) -> bool:
    """Whether a prim is a mesh, a cube or a plane, which are drawn."""
    return any(prim.IsA(kind) for kind in (UsdGeom.Mesh, UsdGeom.Cube, UsdGeom.Plane))


def triangles_of(prim: Any) -> int:
    """An upper bound of the number of triangles of a prim, before cutting."""
    return int(np.maximum(_faces(prim)[1] - 2, 0).sum())


def _faces(prim: Any) -> tuple[Floats, Ints, Ints]:
    """(P, 3) points, (F,) numbers of corners of the faces, and (C,) the points of the corners."""
    if prim.IsA(UsdGeom.Cube):
        half = (UsdGeom.Cube(prim).GetSizeAttr().Get(TIME) or 0.0) / 2
        return _CUBE * half, np.full(6, 4), _CUBE_FACES.ravel()
    if prim.IsA(UsdGeom.Plane):
        plane = UsdGeom.Plane(prim)
        half_width = (plane.GetWidthAttr().Get(TIME) or 0.0) / 2
        half_length = (plane.GetLengthAttr().Get(TIME) or 0.0) / 2
        axis = str(plane.GetAxisAttr().Get(TIME))
        sides = _PLANE_SIDES.get(axis, _PLANE_SIDES["Z"])
        points = _SQUARE @ (np.array(sides, dtype=np.float64) * [[half_width], [half_length]])
        corners = np.arange(4)[::-1] if axis in ("X", "Y") else np.arange(4)
        return points, np.array([4]), corners
    mesh = UsdGeom.Mesh(prim)
    return (
        array(mesh.GetPointsAttr().Get(TIME), np.float64, 3),
        array(mesh.GetFaceVertexCountsAttr().Get(TIME), np.int64),
        array(mesh.GetFaceVertexIndicesAttr().Get(TIME), np.int64),
    )


def cut(prim: Any, notes: IngestNotes, model: Path) -> UsdMesh:
    """Cuts a prim of `is_cut` into triangles. Raises InputError PTM-I245 or PTM-I254 if its arrays
    are inconsistent."""
    place = str(prim.GetPath())
    points, counts, vertex = _faces(prim)
    if (counts < 0).any() or counts.sum() != len(vertex):
        raise inconsistency(
            model, place, f"faces of {counts.sum()} corners, but {len(vertex)} indices"
        )
    if len(vertex) and not 0 <= vertex.min() <= vertex.max() < len(points):
        raise InputError("PTM-I245", "a face refers to a missing point", file=model, place=place)
    kept = counts >= 3
    if short := int((~kept).sum()):
        notes.miss("PTM-N214", "faces of fewer than three corners", place, short)
    if prim.IsA(UsdGeom.Mesh):
        holes = array(UsdGeom.Mesh(prim).GetHoleIndicesAttr().Get(TIME), np.int64)
        kept[holes[(holes >= 0) & (holes < len(counts))]] = False
        _note(prim, UsdGeom.Mesh(prim), notes)
    face = np.flatnonzero(kept)
    corner = np.arange(len(vertex))[np.repeat(kept, counts)]
    start = np.concatenate([[0], np.cumsum(counts[face])])
    triangulation = triangulate(points[vertex[corner]], start)
    triangulation.note(notes, place)
    result = corner[triangulation.corner]
    if UsdGeom.Gprim(prim).GetOrientationAttr().Get(TIME) == UsdGeom.Tokens.leftHanded:
        result = result[:, ::-1]
    # Unused points would be repeated for each instance.
    used, triangles = np.unique(vertex[result], return_inverse=True)
    return UsdMesh(
        points=points[used],
        triangles=triangles.reshape(-1, 3),
        corner=result,
        vertex=vertex,
        face=face[triangulation.polygon],
        vertices=len(points),
        faces=len(counts),
    )


def inconsistency(model: Path, place: str, reason: str) -> InputError:
    """The error for inconsistent arrays, PTM-I254."""
    remedy = "the file may be damaged, export it again"
    return InputError("PTM-I254", reason, file=model, place=place, remedy=remedy)


def at_corners(primvar: Any, shape: UsdMesh) -> Floats | None:
    """(T, 3, n) values of a primvar; None if they do not match the mesh."""
    raw = primvar.Get(TIME)
    if raw is None or not hasattr(raw, "__len__") or primvar.GetElementSize() != 1:
        return None
    try:
        values = np.asarray(raw).astype(np.float64)
    except (TypeError, ValueError):
        return None
    if values.ndim == 1 and primvar.GetTypeName().isArray:
        values = values[:, None]
    elif values.ndim == 1:  # one value, not an array of them
        values = values[None]
    if primvar.IsIndexed():
        index = array(primvar.GetIndices(TIME), np.int64)
        if not len(values) or not len(index) or not 0 <= index.min() <= index.max() < len(values):
            return None
        values = values[index]
    kind = primvar.GetInterpolation()
    rows, needed = {
        UsdGeom.Tokens.constant: (np.zeros_like(shape.corner), 1),
        UsdGeom.Tokens.uniform: (np.repeat(shape.face[:, None], 3, axis=1), shape.faces),
        UsdGeom.Tokens.faceVarying: (shape.corner, len(shape.vertex)),
    }.get(kind, (shape.vertex[shape.corner], shape.vertices))
    return values[rows] if len(values) >= needed else None


def _note(prim: Any, mesh: Any, notes: IngestNotes) -> None:
    """Notes the unsupported properties of a mesh."""
    scheme = mesh.GetSubdivisionSchemeAttr().Get(TIME)
    if scheme not in (None, UsdGeom.Tokens.none):
        notes.note("PTM-N215", f"subdivision surfaces ({scheme}) drawn as their control cages")
    if prim.HasAttribute("primvars:skel:jointIndices"):
        notes.note("PTM-N215", "skins drawn in their rest pose")
    if prim.HasRelationship("skel:blendShapeTargets"):
        notes.note("PTM-N215", "blend shapes dropped")
    if any(
        attribute.ValueMightBeTimeVarying()
        for attribute in (mesh.GetPointsAttr(), mesh.GetFaceVertexIndicesAttr())
    ):
        notes.note("PTM-N215", "animated meshes drawn at their first time")
