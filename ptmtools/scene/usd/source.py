"""Makes triangles of a USD stage: each mesh as often as it is shown, with what it is painted with.

What a mesh and all of its instances have in common is made once.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Tf, UsdGeom

from ptmtools.arrays import Floats, Ints
from ptmtools.errors import InputError
from ptmtools.scene.apart import unreadable
from ptmtools.scene.handed import NamedImage
from ptmtools.scene.model import Camera
from ptmtools.scene.source import Findings, Source, too_many_triangles
from ptmtools.scene.usd.drawn import Placed, Traversal
from ptmtools.scene.usd.layers import LIBRARY, TIME, metres_of, open_stage, reason, up_of
from ptmtools.scene.usd.material import MaterialReader
from ptmtools.scene.usd.mesh import Shape, cut
from ptmtools.scene.usd.paint import Painter, key_of


@dataclass
class _Rows:
    """What has been made so far, an entry for each mesh."""

    points: list[Floats] = field(default_factory=list)
    triangles: list[Ints] = field(default_factory=list)
    uv: list[Floats] = field(default_factory=list)
    colors: list[NDArray[np.uint8] | None] = field(default_factory=list)
    object: list[Ints] = field(default_factory=list)
    material: list[Ints] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    count: int = 0

    def add(
        self,
        placed: Placed,
        shape: Shape,
        material: Ints,
        uv: Floats,
        colors: NDArray[np.uint8] | None,
    ) -> None:
        """A mesh at each of its places, each of them an object."""
        frames, triangles = placed.frames, shape.triangles
        k, p, t = len(frames), len(shape.points), len(triangles)
        with np.errstate(all="ignore"):
            points = shape.points @ frames[:, :3, :3] + frames[:, 3:, :3]
            mirrored = np.linalg.det(frames[:, :3, :3]) < 0
        first = self.count + p * np.arange(k)
        each = triangles + first[:, None, None]
        each_uv = np.broadcast_to(uv, (k, t, 3, 2)).copy()
        each_colors = None if colors is None else np.broadcast_to(colors, (k, t, 3, 3)).copy()
        # A mirror turns faces over.
        each[mirrored] = each[mirrored][..., ::-1]
        each_uv[mirrored] = each_uv[mirrored][..., ::-1, :]
        if each_colors is not None:
            each_colors[mirrored] = each_colors[mirrored][..., ::-1, :]
            each_colors = each_colors.reshape(-1, 3, 3)
        self.points.append(points.reshape(-1, 3))
        self.triangles.append(each.reshape(-1, 3))
        self.uv.append(each_uv.reshape(-1, 3, 2))
        self.colors.append(each_colors)
        self.object.append(np.repeat(len(self.names) + np.arange(k), t))
        self.material.append(np.tile(material, k))
        self.names += [placed.name] * k
        self.count += k * p

    def all_colors(self) -> NDArray[np.uint8] | None:
        """(T, 3, 3); None if no mesh has any."""
        if all(each is None for each in self.colors):
            return None
        return np.concatenate(
            [
                np.full((len(rows), 3, 3), 255, np.uint8) if each is None else each
                for each, rows in zip(self.colors, self.triangles, strict=True)
            ]
        )


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
    rows = _Rows()
    for placed in group.placed(np.eye(4)[None]):
        key = key_of(placed.prim)
        if key not in shapes:
            shapes[key] = cut(placed.prim, findings, path)
        shape = shapes[key]
        if len(shape.corner):
            rows.add(placed, shape, *painter.paint(placed.prim, shape, key))
    if not rows.names:
        raise InputError("PTM-I247", "no faces", file=path, remedy="give a model with meshes")
    source = Source(
        points=np.concatenate(rows.points),
        triangles=np.concatenate(rows.triangles),
        uv=np.concatenate(rows.uv),
        triangle_object=np.concatenate(rows.object),
        triangle_material=np.concatenate(rows.material),
        objects=tuple(rows.names),
        materials=painter.materials,
        cameras=_cameras(traversal.cameras, findings),
        metres=metres_of(stage),
        up=up_of(stage),
        colors=rows.all_colors(),
    )
    return source, painter.images, files


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
            findings.say("PTM-N225", f"camera {name} has no perspective, skipped", name)
            continue
        x, y, z = position.tolist()
        dx, dy, dz = (direction / length).tolist()
        view = 2 * math.atan(height / (2 * distance))
        cameras.append(Camera(name, (x, y, z), (dx, dy, dz), view))
    return tuple(cameras)
