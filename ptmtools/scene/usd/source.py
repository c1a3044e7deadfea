"""Traverses a USD stage and makes a `ModelSource` of its meshes, instances, materials and cameras.

Data that a mesh shares with its instances is computed once. Native instances are traversed like
other prims. The prototypes of a point instancer are traversed once, and their triangles are counted
before the transformations of nested instancers are multiplied.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Tf, Usd, UsdGeom

from ptmtools.arrays import Floats
from ptmtools.errors import InputError
from ptmtools.scene.messages import Images
from ptmtools.scene.model import Camera
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.options import too_many_triangles
from ptmtools.scene.sandbox import unreadable
from ptmtools.scene.source import MeshArrays, ModelSource
from ptmtools.scene.usd.layers import (
    LIBRARY,
    TIME,
    metres_of,
    open_stage,
    reason,
    up_axis,
    used_files,
)
from ptmtools.scene.usd.material import UsdMaterialReader, UsdPainter, key_of
from ptmtools.scene.usd.mesh import UsdMesh, array, cut, inconsistency, is_cut, triangles_of

_HIDDEN = (UsdGeom.Tokens.guide, UsdGeom.Tokens.proxy)


@dataclass
class Group:
    """The meshes and point instancers below a prim, each with its name and (4, 4) transformation to
    the group's space; an instancer has the (n, 4, 4) instances of each prototype."""

    parts: list[tuple[str, Floats, Any | list[tuple[Group, Floats]]]] = field(default_factory=list)
    triangles: int = 0
    places: int = 0

    def place_meshes(self, frames: Floats, prefix: str = "") -> Iterator[tuple[Any, str, Floats]]:
        """The prims of the group's meshes, an instance proxy within an instance; their names, see
        `Traversal`; and (k, 4, 4) local to world of each instance, for row vectors.

        ``frames`` are the (k, 4, 4) of the group.
        """
        for name, matrix, part in self.parts:
            with np.errstate(all="ignore"):
                world = matrix @ frames
            if not isinstance(part, list):
                yield part, prefix + name, world
                continue
            for group, instances in part:
                with np.errstate(all="ignore"):
                    nested = (instances[None] @ world[:, None]).reshape(-1, 4, 4)
                yield from group.place_meshes(nested, f"{prefix}{name}/")


class Traversal:
    """The traversal of a stage.

    The name of a mesh is the path of its prim below the stage's default prim, or else below the
    root; that of an instance is the path of its instancer and that of the prim below the parent of
    its prototype.
    """

    def __init__(self, stage: Any, notes: IngestNotes, model: Path) -> None:
        self._stage = stage
        self._notes = notes
        self._model = model
        self._cache = UsdGeom.XformCache(TIME)
        self._prototypes: dict[Any, Group | None] = {}
        self._omitted: Counter[tuple[bool, str, str]] = Counter()
        self.cameras: list[tuple[str, Floats, Any]] = []

    def group(self) -> Group:
        """The drawn prims of the stage; notes the others. Raises InputError PTM-I254."""
        result = self._group_below(self._stage.GetPseudoRoot(), None)
        for (missed, code, message), count in self._omitted.items():
            (self._notes.miss if missed else self._notes.note)(code, message, "", count)
        return result

    def name(self, prim: Any) -> str:
        path = prim.GetPath()
        default = self._stage.GetDefaultPrim()
        if default and path != default.GetPath() and path.HasPrefix(default.GetPath()):
            return str(path.MakeRelativePath(default.GetPath()))
        return str(path)[1:]

    def _group_below(self, root: Any, prototype: Any | None) -> Group:
        """The drawn prims at and below a prim, of a prototype in the space of its parent."""
        group = Group()
        predicate = _predicate(root)
        stack = [(root, UsdGeom.Tokens.default_)]
        while stack:
            prim, purpose = stack.pop()
            if prim.IsA(UsdGeom.Imageable):
                imageable = UsdGeom.Imageable(prim)
                if imageable.GetVisibilityAttr().Get(TIME) == UsdGeom.Tokens.invisible:
                    self._omit("invisible", _surfaces(prim, predicate))
                    continue
                if imageable.GetPurposeAttr().HasAuthoredValue():
                    purpose = imageable.GetPurposeAttr().Get()
            below = prim.GetFilteredChildren(predicate)
            if prim.IsA(UsdGeom.PointInstancer):
                below = []
                if purpose in _HIDDEN:
                    self._omit(f"of purpose {purpose}", 1)
                else:
                    self._instancer(group, prim, prototype)
            elif prim.IsA(UsdGeom.Gprim):
                if purpose in _HIDDEN:
                    self._omit(f"of purpose {purpose}", 1)
                elif is_cut(prim):
                    group.parts.append((*self._place(prim, prototype), prim))
                    group.triangles += triangles_of(prim)
                    group.places += 1
                else:
                    surface = not prim.IsA(UsdGeom.Curves) and not prim.IsA(UsdGeom.Points)
                    kind = str(prim.GetTypeName())
                    code = "PTM-N214" if surface else "PTM-N215"
                    self._omitted[surface, code, f"{kind}: not drawn"] += 1
            elif prim.IsA(UsdGeom.Camera) and prototype is None:
                self.cameras.append((*self._place(prim, None), prim))
            if (
                prim.IsA(UsdGeom.Xformable)
                and UsdGeom.Xformable(prim).TransformMightBeTimeVarying()
            ):
                message = "animated prims drawn at their first position"
                self._omitted[False, "PTM-N215", message] += 1
            stack += [(child, purpose) for child in reversed(below)]
        return group

    def _omit(self, reason: str, count: int) -> None:
        if count:
            self._omitted[False, "PTM-N215", f"surfaces {reason}: not drawn"] += count

    def _place(self, prim: Any, prototype: Any | None) -> tuple[str, Floats]:
        """The name and the (4, 4) of a prim: below a prototype, or in the world."""
        if prototype is None:
            return self.name(prim), np.array(self._cache.GetLocalToWorldTransform(prim))
        parent = prototype.GetPath().GetParentPath()
        matrix, _ = self._cache.ComputeRelativeTransform(prim, prototype)
        return str(prim.GetPath().MakeRelativePath(parent)), np.array(matrix)

    def _instancer(self, group: Group, prim: Any, prototype: Any | None) -> None:
        instancer, place = UsdGeom.PointInstancer(prim), str(prim.GetPath())
        index = array(instancer.GetProtoIndicesAttr().Get(TIME), np.int64)
        if not len(index):
            return
        targets = instancer.GetPrototypesRel().GetForwardedTargets()
        positions = array(instancer.GetPositionsAttr().Get(TIME), np.float64, 3)
        if not 0 <= index.min() <= index.max() < len(targets) or len(positions) != len(index):
            raise inconsistency(self._model, place, "inconsistent arrays of the instancer")
        frames = instancer.ComputeInstanceTransformsAtTime(
            TIME,
            TIME,
            UsdGeom.PointInstancer.IncludeProtoXform,
            UsdGeom.PointInstancer.IgnoreMask,
        )
        frames = array(frames, np.float64, 4, 4)
        if len(frames) != len(index):
            raise inconsistency(self._model, place, "inconsistent arrays of the instancer")
        mask = instancer.ComputeMaskAtTime(TIME)
        visible = np.array(mask, dtype=bool) if mask else np.ones(len(index), dtype=bool)
        if hidden := int((~visible).sum()):
            self._omitted[False, "PTM-N215", "invisible instances: not drawn"] += hidden
        parts: list[tuple[Group, Floats]] = []
        for number, target in enumerate(targets):
            instances = frames[visible & (index == number)]
            below = self._prototype(target) if len(instances) else None
            if below is not None and below.parts:
                parts.append((below, instances))
                group.triangles += below.triangles * len(instances)
                group.places += below.places * len(instances)
        group.parts.append((*self._place(prim, prototype), parts))

    def _prototype(self, path: Any) -> Group | None:
        """The drawn prims of a prototype, None if it is missing or contains itself."""
        if path not in self._prototypes:
            self._prototypes[path] = None
            prim = self._stage.GetPrimAtPath(path)
            if prim:
                self._prototypes[path] = self._group_below(prim, prim)
        if self._prototypes[path] is None:
            self._omitted[True, "PTM-N214", f"{path}: no such prototype"] += 1
        return self._prototypes[path]


def _predicate(root: Any) -> Any:
    """The filter of traversed prims: active, loaded, defined and not abstract. The root may be a
    class, or below an over, as prototypes often are so that they are not drawn themselves."""
    accepted: Any = Usd.PrimIsActive & Usd.PrimIsLoaded
    if root.IsDefined():
        accepted = accepted & Usd.PrimIsDefined
    if not root.IsAbstract():
        accepted = accepted & ~Usd.PrimIsAbstract
    return Usd.TraverseInstanceProxies(accepted)


def _surfaces(prim: Any, predicate: Any) -> int:
    """The number of meshes and instancers at and below a prim."""
    below = Usd.PrimRange(prim, predicate)
    return sum(p.IsA(UsdGeom.Gprim) or p.IsA(UsdGeom.PointInstancer) for p in below)


def make_source(
    path: Path, notes: IngestNotes, limit: int
) -> tuple[ModelSource, Images, list[str]]:
    """The model without textures; the images of its materials by number; and the names of its
    files. Raises the errors of `ptmtools.scene.usd.reader.read_usd`.
    """
    try:
        return _make(path, notes, limit)
    except Tf.ErrorException as error:  # damage that is detected when a value is read
        raise unreadable(LIBRARY, path, reason(error)) from None


def _make(path: Path, notes: IngestNotes, limit: int) -> tuple[ModelSource, Images, list[str]]:
    stage, files = open_stage(path, notes)
    traversal = Traversal(stage, notes, path)
    group = traversal.group()
    if group.triangles > limit or group.places > limit:
        raise too_many_triangles(limit, path)
    if not group.triangles:
        raise InputError("PTM-I247", "no faces", file=path, remedy="use a model with meshes")
    painter = UsdPainter(UsdMaterialReader(notes, path), notes)
    shapes: dict[str, UsdMesh] = {}
    arrays = MeshArrays()
    for prim, name, frames in group.place_meshes(np.eye(4)[None]):
        key = key_of(prim)
        if key not in shapes:
            shapes[key] = cut(prim, notes, path)
        shape = shapes[key]
        if len(shape.corner):
            material, uv, colors = painter.paint(prim, shape, key)
            arrays.add(
                arrays.add_objects(name, len(frames)),
                shape.points,
                shape.triangles,
                frames=frames.transpose(0, 2, 1),  # the library's are for row vectors
                uv=uv,
                material=material,
                colors=colors,
            )
    if not arrays.names:
        raise InputError("PTM-I247", "no faces", file=path, remedy="use a model with meshes")
    source = arrays.source(
        materials=painter.materials,
        cameras=_cameras(traversal.cameras, notes),
        metres=metres_of(stage),
        up=up_axis(stage),
    )
    return source, painter.images, list(dict.fromkeys(files) | used_files(stage, path, notes))


def _cameras(definitions: list[tuple[str, Floats, Any]], notes: IngestNotes) -> tuple[Camera, ...]:
    cameras: list[Camera] = []
    for name, matrix, prim in definitions:
        definition, view = UsdGeom.Camera(prim), 0.0
        height = definition.GetVerticalApertureAttr().Get(TIME) or 0.0
        distance = definition.GetFocalLengthAttr().Get(TIME) or 0.0
        perspective = definition.GetProjectionAttr().Get(TIME) == UsdGeom.Tokens.perspective
        # Both lengths are in the same unit, a tenth of the stage's.
        if perspective and height > 0 < distance and math.isfinite(height / distance):
            view = 2 * math.atan(height / (2 * distance))
        cameras += notes.camera(name, name, matrix[3, :3], 0.0 - matrix[2, :3], view)
    return tuple(cameras)
