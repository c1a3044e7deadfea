"""Reads PLY, STL and OFF through trimesh, and other formats of meshes through pymeshlab.

pymeshlab (GPL-3, needs libGL) does not expose which face has which texture, but writes it into OBJ
files. So a child process (`sandbox`) converts the model to OBJ in a temporary folder, and `obj`
reads the result: ``python -P -m ptmtools.scene.libraries MEMORY MODEL FOLDER`` writes ``0.obj``, …
and replies with their labels. The same path reads files that trimesh cannot read (mixed polygons in
OFF), and PLY whose faces have coordinates, of which trimesh keeps one image. Both libraries cut
polygons as fans.
"""

from __future__ import annotations

import os
import re
import tempfile
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Ints
from ptmtools.errors import InputError, MissingComponentError
from ptmtools.lazy import pymeshlab_absence
from ptmtools.progress import Progress, silent
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.options import IngestOptions, damage
from ptmtools.scene.sandbox import run_in_sandbox, serve
from ptmtools.scene.source import (
    FileRange,
    MeshArrays,
    ModelSource,
    SourceMaterial,
    SourceTexture,
    decode,
)


def convert(path: Path, scratch: Path) -> list[tuple[Path, str]]:
    """Writes the meshes of a model as OBJ files into ``scratch``; returns these with their labels.

    Raises InputError PTM-I254 if pymeshlab cannot read the model, MissingComponentError PTM-M100.
    """
    if fault := pymeshlab_absence():
        raise MissingComponentError(
            "PTM-M100",
            f"pymeshlab is unavailable ({fault})",
            remedy="pip install pymeshlab; apt install libopengl0 libgl1; or convert to GLB",
        )
    labels = run_in_sandbox(__name__, "pymeshlab", path, path.absolute(), scratch)
    return [(scratch / f"{i}.obj", label) for i, label in enumerate(labels)]


def _convert(path: str, scratch: str) -> list[str]:
    """Writes the meshes; returns their labels."""
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    labels: list[str] = []
    meshes.load_new_mesh(path)
    for mesh in meshes:
        if not mesh.face_number():
            continue
        meshes.set_current_mesh(mesh.id())
        meshes.apply_matrix_freeze()
        meshes.save_current_mesh(
            os.path.join(scratch, f"{len(labels)}.obj"),
            save_vertex_normal=False,
            save_vertex_color=False,
            save_textures=False,
        )
        labels.append(mesh.label())
    return labels


#: The names of texture coordinates of vertices, of which trimesh knows some.
_VERTEX_COORDINATES = re.compile(r"^property \w+ (texture_u|u|s)\s", re.MULTILINE)
#: Bytes of a PLY file that contain its header.
_HEADER = 1 << 14


def read_ply(
    path: Path, notes: IngestNotes, options: IngestOptions, progress: Progress = silent
) -> ModelSource:
    """Reads a PLY file: one with coordinates of vertices has one image, and one with coordinates of
    faces any number. Raises the errors of `read_by_pymeshlab`."""
    with open(path, "rb") as stream:
        head = decode(stream.read(_HEADER).split(b"end_header")[0])
    images = re.findall(r"^comment TextureFile (.*?)[ \t\r]*$", head, re.MULTILINE | re.IGNORECASE)
    if images and " red" in head:
        notes.note("PTM-N215", "colours of vertices dropped in favour of textures")
    if not images or _VERTEX_COORDINATES.search(head) is None or "texcoord" in head:
        read = read_by_pymeshlab if images else partial(read_off, kind="ply")
        return read(path, notes, options, progress)
    source = read_off(path, notes, options, progress, kind="ply")
    if len(set(images)) > 1:
        notes.note("PTM-N215", "all textures but the first ignored")
    what = f"TextureFile {images[0]}"
    file = notes.locate(images[0], what, path.name)
    texture = None if file is None else SourceTexture(FileRange(file), file.name, what, path.name)
    return replace(source, materials=tuple(replace(m, texture=texture) for m in source.materials))


def read_off(
    path: Path,
    notes: IngestNotes,
    options: IngestOptions,
    progress: Progress = silent,
    kind: str = "off",
) -> ModelSource:
    """Reads an OFF file, or one of another ``kind``, with pymeshlab if trimesh fails. Raises the
    errors of `read_by_pymeshlab`."""
    try:
        return _read_by_trimesh(path, notes, kind)
    except InputError:
        raise
    except Exception as error:  # trimesh raises any exception for a damaged file
        source = read_by_pymeshlab(path, notes, options, progress)
        message = f"read by pymeshlab because trimesh failed ({type(error).__name__})"
        notes.note("PTM-N208", message)
        return source


def read_stl(
    path: Path, notes: IngestNotes, options: IngestOptions, progress: Progress = silent
) -> ModelSource:
    """Reads an STL file; pymeshlab supports no variants that trimesh lacks.

    Raises InputError PTM-I254 for a damaged file, PTM-I247 without faces.
    """
    try:
        return _read_by_trimesh(path, notes, "stl")
    except InputError:
        raise
    except Exception as error:
        raise damage(path, str(error)) from None


def _read_by_trimesh(path: Path, notes: IngestNotes, kind: str) -> ModelSource:
    import trimesh

    with open(path, "rb") as stream:
        scene = trimesh.load_scene(stream, file_type=kind, process=False)
    arrays = MeshArrays()
    for name in scene.graph.nodes_geometry:
        matrix, geometry = scene.graph.get(name)
        mesh = scene.geometry[geometry]
        faces = np.asarray(getattr(mesh, "faces", np.zeros((0, 3))), dtype=np.int64)
        points = np.asarray(mesh.vertices, dtype=np.float64)
        if len(faces) and not 0 <= faces.min() <= faces.max() < len(points):
            raise InputError("PTM-I245", "a face refers to a missing vertex", file=path)
        number = arrays.add_objects(path.stem if len(scene.geometry) == 1 else str(geometry))
        frame, colors = np.asarray(matrix)[None], _colors(mesh, faces, notes)
        textured = getattr(mesh.visual, "kind", None) == "texture" and len(faces)
        uv = np.asarray(mesh.visual.uv, np.float64)[faces] if textured else None
        arrays.add(number, points, faces, frames=frame, uv=uv, colors=colors)
    if not any(map(len, arrays.triangles)):
        raise _no_faces(path)
    return arrays.source()


def _no_faces(path: Path) -> InputError:
    return InputError("PTM-I247", "no faces", file=path, remedy="use a model with faces")


def _colors(mesh: Any, faces: Ints, notes: IngestNotes) -> NDArray[np.uint8] | None:
    """(T, 3, 3) sRGB of corners, if vertices or faces have colours."""
    kind = getattr(mesh.visual, "kind", None)
    if kind not in ("vertex", "face"):
        return None
    colors = mesh.visual.vertex_colors if kind == "vertex" else mesh.visual.face_colors
    rows = np.asarray(colors, dtype=np.uint8)
    if (rows[:, 3:] < 255).any():
        notes.note("PTM-N215", "opacities of vertices and faces dropped")
    return rows[faces, :3] if kind == "vertex" else np.repeat(rows[:, None, :3], 3, axis=1)


def read_by_pymeshlab(
    path: Path, notes: IngestNotes, options: IngestOptions, progress: Progress = silent
) -> ModelSource:
    """Reads a file of any format of pymeshlab.

    Raises InputError PTM-I254 for a damaged file and PTM-I247 without faces, LimitError PTM-L203
    for too many triangles, and MissingComponentError PTM-M100.
    """
    from ptmtools.scene.obj import read_obj

    parts = []
    with tempfile.TemporaryDirectory() as scratch:
        notes.folder.admit(Path(scratch))
        for converted, label in convert(path, Path(scratch)):
            part = read_obj(converted, notes, options)
            parts.append((label or path.stem, part))
    if not parts:
        raise _no_faces(path)
    arrays = MeshArrays()
    materials: list[SourceMaterial] = []
    for name, part in parts:
        arrays.add(
            arrays.add_objects(name),
            part.points,
            part.triangles,
            uv=part.uv,
            material=part.triangle_material + len(materials),
            colors=part.colors,
        )
        materials += part.materials
    return arrays.source(materials=tuple(materials))


if __name__ == "__main__":
    serve(_convert)
