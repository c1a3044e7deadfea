"""Makes triangles of a USD stage: each mesh as often as it is shown, with what it is painted with.

What a mesh and all of its instances have in common is made once.

What of a USD stage is drawn, and where: meshes with the places at which they stand.

Native instances are gone through like all else. The prototypes of a point instancer are gone
through once; what they come to is counted before any place is multiplied with another."""

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
from ptmtools.scene.messages import NamedImage
from ptmtools.scene.model import Camera
from ptmtools.scene.notes import Findings
from ptmtools.scene.rows import Rows
from ptmtools.scene.sandbox import unreadable
from ptmtools.scene.source import Source, too_many_triangles
from ptmtools.scene.usd.layers import (
    LIBRARY,
    TIME,
    metres_of,
    open_stage,
    reason,
    up_of,
    used_files,
)
from ptmtools.scene.usd.material import MaterialReader, Painter, key_of
from ptmtools.scene.usd.mesh import Shape, array, cut, is_cut, triangles_of, unfit

_HIDDEN = (UsdGeom.Tokens.guide, UsdGeom.Tokens.proxy)


@dataclass(frozen=True)
class Placed:
    """A mesh.

    Attributes
    ----------
    prim: an instance proxy, if it stands in an instance.
    name: see `Traversal`.
    frames: (k, 4, 4) its space to the world's, for row vectors, as often as it is shown.
    """

    prim: Any
    name: str
    frames: Floats


@dataclass
class Group:
    """What is drawn below a prim: meshes and point instancers, each with its (4, 4) transformation
    to the group's space; of an instancer each prototype with the (n, 4, 4) of its instances."""

    parts: list[tuple[str, Floats, Any | list[tuple[Group, Floats]]]] = field(default_factory=list)
    triangles: int = 0
    places: int = 0

    def placed(self, frames: Floats, above: str = "") -> Iterator[Placed]:
        """Its meshes, of a group that stands at (k, 4, 4) frames."""
        for name, matrix, what in self.parts:
            with np.errstate(all="ignore"):
                here = matrix @ frames
            if not isinstance(what, list):
                yield Placed(what, above + name, here)
                continue
            for group, instances in what:
                with np.errstate(all="ignore"):
                    each = (instances[None] @ here[:, None]).reshape(-1, 4, 4)
                yield from group.placed(each, f"{above}{name}/")


class Traversal:
    """Goes through a stage once.

    The name of a mesh is the path of its prim below the stage's default prim, or else below the
    root; that of an instance, the path of its instancer and that of the prim below its prototype.
    """

    def __init__(self, stage: Any, findings: Findings, model: Path) -> None:
        self._stage = stage
        self._findings = findings
        self._model = model
        self._cache = UsdGeom.XformCache(TIME)
        self._prototypes: dict[Any, Group | None] = {}
        self._left_out: Counter[tuple[bool, str, str]] = Counter()
        self.cameras: list[tuple[str, Floats, Any]] = []

    def group(self) -> Group:
        """All that is drawn, and notes of what is not. Raises InputError PTM-I254."""
        found = self._below(self._stage.GetPseudoRoot(), None)
        for (missed, code, message), count in self._left_out.items():
            (self._findings.miss if missed else self._findings.note)(code, message, "", count)
        return found

    def name(self, prim: Any) -> str:
        path = prim.GetPath()
        default = self._stage.GetDefaultPrim()
        if default and path != default.GetPath() and path.HasPrefix(default.GetPath()):
            return str(path.MakeRelativePath(default.GetPath()))
        return str(path)[1:]

    def _below(self, root: Any, prototype: Any | None) -> Group:
        """What is drawn at and below a prim, of a prototype in its parent's place."""
        group = Group()
        predicate = _predicate(root)
        stack = [(root, UsdGeom.Tokens.default_)]
        while stack:
            prim, purpose = stack.pop()
            if prim.IsA(UsdGeom.Imageable):
                imageable = UsdGeom.Imageable(prim)
                if imageable.GetVisibilityAttr().Get(TIME) == UsdGeom.Tokens.invisible:
                    self._leave_out("invisible", _surfaces(prim, predicate))
                    continue
                if imageable.GetPurposeAttr().HasAuthoredValue():
                    purpose = imageable.GetPurposeAttr().Get()
            below = prim.GetFilteredChildren(predicate)
            if prim.IsA(UsdGeom.PointInstancer):
                below = []
                if purpose in _HIDDEN:
                    self._leave_out(f"of purpose {purpose}", 1)
                else:
                    self._instancer(group, prim, prototype)
            elif prim.IsA(UsdGeom.Gprim):
                if purpose in _HIDDEN:
                    self._leave_out(f"of purpose {purpose}", 1)
                elif is_cut(prim):
                    group.parts.append((*self._place(prim, prototype), prim))
                    group.triangles += triangles_of(prim)
                    group.places += 1
                else:
                    surface = not prim.IsA(UsdGeom.Curves) and not prim.IsA(UsdGeom.Points)
                    kind = str(prim.GetTypeName())
                    code = "PTM-N214" if surface else "PTM-N215"
                    self._left_out[surface, code, f"{kind}: not drawn"] += 1
            elif prim.IsA(UsdGeom.Camera) and prototype is None:
                self.cameras.append((*self._place(prim, None), prim))
            if (
                prim.IsA(UsdGeom.Xformable)
                and UsdGeom.Xformable(prim).TransformMightBeTimeVarying()
            ):
                moved = "what moves is shown where it is at first"
                self._left_out[False, "PTM-N215", moved] += 1
            stack += [(child, purpose) for child in reversed(below)]
        return group

    def _leave_out(self, why: str, count: int) -> None:
        if count:
            self._left_out[False, "PTM-N215", f"surfaces {why} are not drawn"] += count

    def _place(self, prim: Any, prototype: Any | None) -> tuple[str, Floats]:
        """The name and the (4, 4) of a prim: below a prototype, or in the world."""
        if prototype is None:
            return self.name(prim), np.array(self._cache.GetLocalToWorldTransform(prim))
        above = prototype.GetPath().GetParentPath()
        matrix, _ = self._cache.ComputeRelativeTransform(prim, prototype)
        return str(prim.GetPath().MakeRelativePath(above)), np.array(matrix)

    def _instancer(self, group: Group, prim: Any, prototype: Any | None) -> None:
        instancer, place = UsdGeom.PointInstancer(prim), str(prim.GetPath())
        index = array(instancer.GetProtoIndicesAttr().Get(TIME), np.int64)
        if not len(index):
            return
        targets = instancer.GetPrototypesRel().GetForwardedTargets()
        positions = array(instancer.GetPositionsAttr().Get(TIME), np.float64, 3)
        if not 0 <= index.min() <= index.max() < len(targets) or len(positions) != len(index):
            raise unfit(self._model, place, "the arrays of the instancer do not fit together")
        frames = instancer.ComputeInstanceTransformsAtTime(
            TIME,
            TIME,
            UsdGeom.PointInstancer.IncludeProtoXform,
            UsdGeom.PointInstancer.IgnoreMask,
        )
        frames = array(frames, np.float64, 4, 4)
        if len(frames) != len(index):
            raise unfit(self._model, place, "the arrays of the instancer do not fit together")
        mask = instancer.ComputeMaskAtTime(TIME)
        shown = np.array(mask, dtype=bool) if mask else np.ones(len(index), dtype=bool)
        if hidden := int((~shown).sum()):
            self._left_out[False, "PTM-N215", "instances that are invisible are not drawn"] += (
                hidden
            )
        found: list[tuple[Group, Floats]] = []
        for number, target in enumerate(targets):
            each = frames[shown & (index == number)]
            below = self._prototype(target) if len(each) else None
            if below is not None and below.parts:
                found.append((below, each))
                group.triangles += below.triangles * len(each)
                group.places += below.places * len(each)
        group.parts.append((*self._place(prim, prototype), found))

    def _prototype(self, path: Any) -> Group | None:
        """What is drawn of a prototype, None if there is none or it contains itself."""
        if path not in self._prototypes:
            self._prototypes[path] = None
            prim = self._stage.GetPrimAtPath(path)
            if prim:
                self._prototypes[path] = self._below(prim, prim)
        if self._prototypes[path] is None:
            self._left_out[True, "PTM-N214", f"{path}: no such prototype"] += 1
        return self._prototypes[path]


def _predicate(root: Any) -> Any:
    """Which prims are gone through: those that are active, loaded, defined and not abstract. The
    root may be a class, or below an over, as prototypes often are so as not to be drawn."""
    plain: Any = Usd.PrimIsActive & Usd.PrimIsLoaded
    if root.IsDefined():
        plain = plain & Usd.PrimIsDefined
    if not root.IsAbstract():
        plain = plain & ~Usd.PrimIsAbstract
    return Usd.TraverseInstanceProxies(plain)


def _surfaces(prim: Any, predicate: Any) -> int:
    """How many meshes and instancers stand at and below a prim."""
    below = Usd.PrimRange(prim, predicate)
    return sum(each.IsA(UsdGeom.Gprim) or each.IsA(UsdGeom.PointInstancer) for each in below)


def make_source(
    path: Path, findings: Findings, most: int
) -> tuple[Source, dict[int, NamedImage], list[str]]:
    """The model without textures; the images of its materials by number; and the names of the files
    that it is composed of. Raises what `ptmtools.scene.usd.read_usd` does.
    """
    try:
        return _make(path, findings, most)
    except Tf.ErrorException as error:  # damage that shows when a value is asked for
        raise unreadable(LIBRARY, path, reason(error)) from None


def _make(
    path: Path, findings: Findings, most: int
) -> tuple[Source, dict[int, NamedImage], list[str]]:
    stage, files = open_stage(path, findings)
    traversal = Traversal(stage, findings, path)
    group = traversal.group()
    if group.triangles > most or group.places > most:
        raise too_many_triangles(most, path)
    if not group.triangles:
        raise InputError("PTM-I247", "no faces", file=path, remedy="give a model with meshes")
    painter = Painter(MaterialReader(findings, path), findings)
    shapes: dict[str, Shape] = {}
    rows = Rows()
    for placed in group.placed(np.eye(4)[None]):
        key = key_of(placed.prim)
        if key not in shapes:
            shapes[key] = cut(placed.prim, findings, path)
        shape = shapes[key]
        if len(shape.corner):
            material, uv, colors = painter.paint(placed.prim, shape, key)
            frames = placed.frames.transpose(0, 2, 1)  # of the library, for rows of coordinates
            first = len(rows.names)
            rows.names += [placed.name] * len(frames)
            rows.add(frames, shape.points, shape.triangles, uv, material, colors, first)
    if not rows.names:
        raise InputError("PTM-I247", "no faces", file=path, remedy="give a model with meshes")
    source = rows.source(
        materials=painter.materials,
        cameras=_cameras(traversal.cameras, findings),
        metres=metres_of(stage),
        up=up_of(stage),
    )
    return source, painter.images, list(dict.fromkeys(files) | used_files(stage, path, findings))


def _cameras(found: list[tuple[str, Floats, Any]], findings: Findings) -> tuple[Camera, ...]:
    cameras: list[Camera] = []
    for name, matrix, prim in found:
        camera = UsdGeom.Camera(prim)
        direction, position = 0.0 - matrix[2, :3], matrix[3, :3]
        with np.errstate(all="ignore"):
            length = float(np.linalg.norm(direction))
        height = camera.GetVerticalApertureAttr().Get(TIME) or 0.0
        distance = camera.GetFocalLengthAttr().Get(TIME) or 0.0
        usable = np.isfinite(position).all() and math.isfinite(length) and length > 0
        flat = camera.GetProjectionAttr().Get(TIME) != UsdGeom.Tokens.perspective
        # Both are in the same unit, a tenth of the stage's.
        if flat or not (
            usable and math.isfinite(height / (distance or 1)) and height > 0 < distance
        ):
            findings.note("PTM-N215", f"camera {name} has no perspective, skipped", name)
            continue
        x, y, z = position.tolist()
        dx, dy, dz = (direction / length).tolist()
        view = 2 * math.atan(height / (2 * distance))
        cameras.append(Camera(name, (x, y, z), (dx, dy, dz), view))
    return tuple(cameras)
