"""Makes triangles of a USD stage: each mesh as often as it is shown, with what it is painted with.

What a mesh and all of its instances have in common is made once.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Tf, UsdGeom

from ptmtools.arrays import Floats
from ptmtools.errors import InputError
from ptmtools.scene.apart import unreadable
from ptmtools.scene.handed import NamedImage
from ptmtools.scene.model import Camera
from ptmtools.scene.rows import Rows
from ptmtools.scene.source import Findings, Source, too_many_triangles
from ptmtools.scene.usd.drawn import Traversal
from ptmtools.scene.usd.layers import (
    LIBRARY,
    TIME,
    metres_of,
    open_stage,
    reason,
    up_of,
    used_files,
)
from ptmtools.scene.usd.material import MaterialReader
from ptmtools.scene.usd.mesh import Shape, cut
from ptmtools.scene.usd.paint import Painter, key_of


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
            findings.say("PTM-N225", f"camera {name} has no perspective, skipped", name)
            continue
        x, y, z = position.tolist()
        dx, dy, dz = (direction / length).tolist()
        view = 2 * math.atan(height / (2 * distance))
        cameras.append(Camera(name, (x, y, z), (dx, dy, dz), view))
    return tuple(cameras)
