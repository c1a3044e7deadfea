"""Meshes of USD as triangles, and their primvars at the corners of these.

A mesh is drawn as its control cage: subdividing it would need another library, and buildings have
none that is meant to be smooth.
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
from ptmtools.scene.polygon import triangulate
from ptmtools.scene.source import Findings
from ptmtools.scene.usd_layers import TIME


@dataclass(frozen=True)
class Shape:
    """A mesh cut into triangles.

    Attributes
    ----------
    points: (P, 3) float64 in the space of its prim.
    vertex: (C,) int64 the point of each corner of the mesh's faces.
    corner: (T, 3) int64 corners of the mesh's faces, counter-clockwise seen from the front.
    face: (T,) int64 the mesh's face of each triangle.
    faces: how many faces the mesh has.
    """

    points: Floats
    vertex: Ints
    corner: Ints
    face: Ints
    faces: int

    @property
    def triangles(self) -> Ints:
        """(T, 3) int64 into `points`."""
        return self.vertex[self.corner]


def array(value: Any, kind: Any, *shape: int) -> NDArray[Any]:
    """An array of the library's, (0, *shape) if there is none."""
    if value is None or not len(value):
        return np.zeros((0, *shape), dtype=kind)
    return np.asarray(value).astype(kind).reshape(-1, *shape)


def triangles_of(prim: Any) -> int:
    """How many triangles a mesh has at most, before it is cut."""
    counts = array(UsdGeom.Mesh(prim).GetFaceVertexCountsAttr().Get(TIME), np.int64)
    return int(np.maximum(counts - 2, 0).sum())


def cut(prim: Any, findings: Findings, model: Path) -> Shape:
    """Cuts a mesh. Raises InputError PTM-I246 or PTM-I270 where its arrays do not fit together."""
    mesh, place = UsdGeom.Mesh(prim), str(prim.GetPath())
    points = array(mesh.GetPointsAttr().Get(TIME), np.float64, 3)
    counts = array(mesh.GetFaceVertexCountsAttr().Get(TIME), np.int64)
    vertex = array(mesh.GetFaceVertexIndicesAttr().Get(TIME), np.int64)
    if (counts < 0).any() or counts.sum() != len(vertex):
        raise unfit(model, place, f"its faces have {counts.sum()} corners of {len(vertex)}")
    if len(vertex) and not 0 <= vertex.min() <= vertex.max() < len(points):
        raise InputError(
            "PTM-I246", "a face names a point that does not exist", file=model, place=place
        )
    start = np.concatenate([[0], np.cumsum(counts)])
    kept = counts >= 3
    if short := int((~kept).sum()):
        findings.miss("PTM-N220", "faces of fewer than three corners", place, short)
    holes = array(mesh.GetHoleIndicesAttr().Get(TIME), np.int64)
    kept[holes[(holes >= 0) & (holes < len(counts))]] = False
    face = np.flatnonzero(kept)
    corner = np.arange(len(vertex))[np.repeat(kept, counts)]
    cut_start = np.concatenate([[0], np.cumsum(counts[face])])
    made = triangulate(points[vertex[corner]], cut_start)
    if made.tangled:
        findings.say(
            "PTM-N221",
            "polygons with crossing edges, or too many corners, were cut into fans of triangles",
            place,
            made.tangled,
        )
    result = corner[made.corner]
    if mesh.GetOrientationAttr().Get(TIME) == UsdGeom.Tokens.leftHanded:
        result = result[:, ::-1]
    _note(prim, mesh, findings)
    return Shape(points, vertex, result, face[made.polygon], len(start) - 1)


def unfit(model: Path, place: str, what: str) -> InputError:
    """The error for arrays that do not fit together, PTM-I270."""
    return InputError(
        "PTM-I270", what, file=model, place=place, remedy="the file may be damaged, export it again"
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
    }.get(kind, (shape.triangles, len(shape.points)))
    return values[rows] if len(values) >= needed else None


def _note(prim: Any, mesh: Any, findings: Findings) -> None:
    """Says once for each mesh what of it is not shown."""
    scheme = mesh.GetSubdivisionSchemeAttr().Get(TIME)
    if scheme not in (None, UsdGeom.Tokens.none):
        findings.say("PTM-N261", f"surfaces to be subdivided ({scheme}) are drawn as their cages")
    if prim.HasAttribute("primvars:skel:jointIndices"):
        findings.say("PTM-N224", "skins are shown in their rest pose")
    if prim.HasRelationship("skel:blendShapeTargets"):
        findings.say("PTM-N224", "blend shapes are not carried over")
    if any(
        attribute.ValueMightBeTimeVarying()
        for attribute in (mesh.GetPointsAttr(), mesh.GetFaceVertexIndicesAttr())
    ):
        findings.say("PTM-N224", "meshes that change are shown as they are at first")
