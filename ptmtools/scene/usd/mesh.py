"""Meshes of USD as triangles, and their primvars at the corners of these.

A mesh is drawn as its control cage: subdividing it would need another library, and buildings have
little that is meant to be smooth. Of the solids of USD those with flat faces are meshes, too;
balls, cylinders and the like, of which the library knows no mesh, are not.
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
from ptmtools.scene.notes import Findings
from ptmtools.scene.polygon import triangulate
from ptmtools.scene.usd.layers import TIME

#: The corners of a cube of two units, and its faces.
_CUBE = np.array([[x, y, z] for x in (-1.0, 1) for y in (-1.0, 1) for z in (-1.0, 1)])
_CUBE_FACES = np.array(
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
)
#: A square of two units, and where the width and the length of a plane with this axis go. All of
#: them face along their axis, so where that is not the first side's product with the second, the
#: square is turned over.
_SQUARE = np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])
_PLANE_SIDES = {
    "X": ((0, 0, 1), (0, 1, 0)),
    "Y": ((1, 0, 0), (0, 0, 1)),
    "Z": ((1, 0, 0), (0, 1, 0)),
}


@dataclass(frozen=True)
class Shape:
    """A mesh cut into triangles.

    Attributes
    ----------
    points: (P, 3) float64 in the space of its prim, those that are used.
    triangles: (T, 3) int64 into `points`, counter-clockwise seen from the front.
    corner: (T, 3) int64 the same into the corners of the mesh's faces.
    vertex: (C,) int64 the point of the mesh at each corner of its faces.
    face: (T,) int64 the mesh's face of each triangle.
    vertices, faces: how many points and faces the mesh has.
    """

    points: Floats
    triangles: Ints
    corner: Ints
    vertex: Ints
    face: Ints
    vertices: int
    faces: int


def array(value: Any, kind: Any, *shape: int) -> NDArray[Any]:
    """An array of the library's, (0, *shape) if there is none."""
    if value is None or not len(value):
        return np.zeros((0, *shape), dtype=kind)
    return np.asarray(value).astype(kind).reshape(-1, *shape)


def is_cut(prim: Any) -> bool:
    """Whether a prim is drawn: a mesh, a cube or a plane."""
    return any(prim.IsA(kind) for kind in (UsdGeom.Mesh, UsdGeom.Cube, UsdGeom.Plane))


def triangles_of(prim: Any) -> int:
    """How many triangles a prim has at most, before it is cut."""
    return int(np.maximum(_faces(prim)[1] - 2, 0).sum())


def _faces(prim: Any) -> tuple[Floats, Ints, Ints]:
    """(P, 3) points, (F,) how many corners each face has, and (C,) the points of these."""
    if prim.IsA(UsdGeom.Cube):
        half = (UsdGeom.Cube(prim).GetSizeAttr().Get(TIME) or 0.0) / 2
        return _CUBE * half, np.full(6, 4), _CUBE_FACES.ravel()
    if prim.IsA(UsdGeom.Plane):
        plane = UsdGeom.Plane(prim)
        half_width = (plane.GetWidthAttr().Get(TIME) or 0.0) / 2
        half_length = (plane.GetLengthAttr().Get(TIME) or 0.0) / 2
        axis = str(plane.GetAxisAttr().Get(TIME))
        along = _PLANE_SIDES.get(axis, _PLANE_SIDES["Z"])
        points = _SQUARE @ (np.array(along, dtype=np.float64) * [[half_width], [half_length]])
        corners = np.arange(4)[::-1] if axis in ("X", "Y") else np.arange(4)
        return points, np.array([4]), corners
    mesh = UsdGeom.Mesh(prim)
    return (
        array(mesh.GetPointsAttr().Get(TIME), np.float64, 3),
        array(mesh.GetFaceVertexCountsAttr().Get(TIME), np.int64),
        array(mesh.GetFaceVertexIndicesAttr().Get(TIME), np.int64),
    )


def cut(prim: Any, findings: Findings, model: Path) -> Shape:
    """Cuts what `is_cut`. Raises InputError PTM-I245 or PTM-I254 where its arrays do not fit
    together."""
    place = str(prim.GetPath())
    points, counts, vertex = _faces(prim)
    if (counts < 0).any() or counts.sum() != len(vertex):
        raise unfit(model, place, f"its faces have {counts.sum()} corners of {len(vertex)}")
    if len(vertex) and not 0 <= vertex.min() <= vertex.max() < len(points):
        raise InputError(
            "PTM-I245", "a face names a point that does not exist", file=model, place=place
        )
    kept = counts >= 3
    if short := int((~kept).sum()):
        findings.miss("PTM-N214", "faces of fewer than three corners", place, short)
    if prim.IsA(UsdGeom.Mesh):
        holes = array(UsdGeom.Mesh(prim).GetHoleIndicesAttr().Get(TIME), np.int64)
        kept[holes[(holes >= 0) & (holes < len(counts))]] = False
        _note(prim, UsdGeom.Mesh(prim), findings)
    face = np.flatnonzero(kept)
    corner = np.arange(len(vertex))[np.repeat(kept, counts)]
    start = np.concatenate([[0], np.cumsum(counts[face])])
    made = triangulate(points[vertex[corner]], start)
    if made.tangled:
        findings.note(
            "PTM-N211",
            "polygons with crossing edges, or too many corners, were cut into fans of triangles",
            place,
            made.tangled,
        )
    result = corner[made.corner]
    if UsdGeom.Gprim(prim).GetOrientationAttr().Get(TIME) == UsdGeom.Tokens.leftHanded:
        result = result[:, ::-1]
    # Points that no face uses would be there as often as the mesh is shown.
    used, triangles = np.unique(vertex[result], return_inverse=True)
    return Shape(
        points=points[used],
        triangles=triangles.reshape(-1, 3),
        corner=result,
        vertex=vertex,
        face=face[made.polygon],
        vertices=len(points),
        faces=len(counts),
    )


def unfit(model: Path, place: str, what: str) -> InputError:
    """The error for arrays that do not fit together, PTM-I254."""
    return InputError(
        "PTM-I254", what, file=model, place=place, remedy="the file may be damaged, export it again"
    )


def at_corners(primvar: Any, shape: Shape) -> Floats | None:
    """(T, 3, n) values of a primvar; None if they do not fit the mesh."""
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


def _note(prim: Any, mesh: Any, findings: Findings) -> None:
    """Says once for each mesh what of it is not shown."""
    scheme = mesh.GetSubdivisionSchemeAttr().Get(TIME)
    if scheme not in (None, UsdGeom.Tokens.none):
        findings.note("PTM-N215", f"surfaces to be subdivided ({scheme}) are drawn as their cages")
    if prim.HasAttribute("primvars:skel:jointIndices"):
        findings.note("PTM-N215", "skins are shown in their rest pose")
    if prim.HasRelationship("skel:blendShapeTargets"):
        findings.note("PTM-N215", "blend shapes are not carried over")
    if any(
        attribute.ValueMightBeTimeVarying()
        for attribute in (mesh.GetPointsAttr(), mesh.GetFaceVertexIndicesAttr())
    ):
        findings.note("PTM-N215", "meshes that change are shown as they are at first")
