"""Reads formats other than OBJ and glTF: PLY, STL and OFF through trimesh, IFC through IfcOpenShell
(`ifc`), USD through usd-core (`usd`), the rest through pymeshlab.

pymeshlab (GPL-3, needs libGL) does not expose which face has which texture, but writes it into OBJ
files. So a child process (`sandbox`) converts the model to OBJ in a temporary folder, and `obj`
reads the result: ``python -P -m ptmtools.scene.formats MEMORY MODEL FOLDER`` writes ``0.obj``, …
and replies with their labels. The same path reads files that trimesh cannot read (mixed polygons in
OFF), and textured PLY, of which trimesh keeps one image. Both libraries cut polygons as fans.
"""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import InputError, MissingComponentError
from ptmtools.lazy import pymeshlab_absence
from ptmtools.scene.notes import Findings
from ptmtools.scene.options import IFC, SUFFIXES, TRIMESH, USD
from ptmtools.scene.sandbox import run_in_sandbox, serve
from ptmtools.scene.source import MAX_VERTICES, Rows, Source, SourceMaterial, too_many_triangles


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


if __name__ == "__main__":
    serve(_convert)


#: Bytes of a PLY file that contain its header.
_HEADER = 1 << 14


def read_other(path: Path, findings: Findings, max_triangles: int = MAX_VERTICES) -> Source:
    """Reads a file that is neither OBJ nor glTF, by its suffix.

    Raises InputError for unknown suffixes and unreadable files, LimitError PTM-L203 for more than
    ``max_triangles``, and MissingComponentError if a required library cannot be imported.
    """
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(
            "PTM-I243",
            f"unsupported format {suffix or '(no suffix)'}",
            file=path,
            remedy=f"use one of {' '.join(SUFFIXES)}",
        )
    if suffix in IFC:
        from ptmtools.scene.ifc.reader import read_ifc

        return read_ifc(path, findings, max_triangles)
    if suffix in USD:
        from ptmtools.scene.usd.reader import read_usd

        return read_usd(path, findings, max_triangles)
    if suffix not in TRIMESH or (suffix == ".ply" and _textured_ply(path, findings)):
        return _read_meshlab(path, findings, max_triangles)
    try:
        source = _read_trimesh(path, findings)
    except InputError:
        raise
    except Exception as error:  # trimesh raises any exception for a damaged file
        if suffix == ".stl":  # pymeshlab supports no variants that trimesh lacks
            raise InputError(
                "PTM-I254", f"damaged ({error})", file=path, remedy="export it again"
            ) from None
        source = _read_meshlab(path, findings, max_triangles)
        findings.note(
            "PTM-N208", f"read by pymeshlab because trimesh failed ({type(error).__name__})"
        )
    if len(source.triangles) > max_triangles:
        raise too_many_triangles(max_triangles, path)
    return source


def _textured_ply(path: Path, findings: Findings) -> bool:
    with open(path, "rb") as stream:
        head = stream.read(_HEADER).split(b"end_header")[0].lower()
    textured = b"texturefile" in head
    if textured and b" red" in head:
        findings.note("PTM-N215", "colours of vertices dropped in favour of textures")
    return textured


def _read_trimesh(path: Path, findings: Findings) -> Source:
    import trimesh

    with open(path, "rb") as stream:
        scene = trimesh.load_scene(stream, file_type=path.suffix.lower()[1:], process=False)
    rows = Rows()
    for name in scene.graph.nodes_geometry:
        matrix, geometry = scene.graph.get(name)
        mesh = scene.geometry[geometry]
        faces = np.asarray(getattr(mesh, "faces", np.zeros((0, 3))), dtype=np.int64)
        points = np.asarray(mesh.vertices, dtype=np.float64)
        if len(faces) and not 0 <= faces.min() <= faces.max() < len(points):
            raise InputError("PTM-I245", "a face refers to a missing vertex", file=path)
        colors, uv = _colors(mesh, faces, findings), np.zeros((len(faces), 3, 2))
        rows.add(np.asarray(matrix)[None], points, faces, uv, 0, colors, len(rows.names))
        rows.names.append(path.stem if len(scene.geometry) == 1 else str(geometry))
    if not any(map(len, rows.triangles)):
        raise _no_faces(path)
    return rows.source(materials=(SourceMaterial("default"),))


def _no_faces(path: Path) -> InputError:
    return InputError("PTM-I247", "no faces", file=path, remedy="use a model with faces")


def _colors(mesh: Any, faces: NDArray[np.int64], findings: Findings) -> NDArray[np.uint8] | None:
    """(T, 3, 3) sRGB of corners, if vertices or faces have colours."""
    kind = getattr(mesh.visual, "kind", None)
    if kind not in ("vertex", "face"):
        return None
    colors = mesh.visual.vertex_colors if kind == "vertex" else mesh.visual.face_colors
    rows = np.asarray(colors, dtype=np.uint8)
    if (rows[:, 3:] < 255).any():
        findings.note("PTM-N215", "opacities of vertices and faces dropped")
    return rows[faces, :3] if kind == "vertex" else np.repeat(rows[:, None, :3], 3, axis=1)


def _read_meshlab(path: Path, findings: Findings, max_triangles: int) -> Source:
    from ptmtools.scene.obj import read_obj

    parts = []
    with tempfile.TemporaryDirectory() as scratch:
        findings.folder.admit(Path(scratch))
        for converted, label in convert(path, Path(scratch)):
            part = read_obj(converted, findings, max_triangles=max_triangles)
            parts.append((label or path.stem, part))
    if not parts:
        raise _no_faces(path)
    rows = Rows()
    materials: list[SourceMaterial] = []
    for name, part in parts:
        first, numbers = len(rows.names), part.triangle_material + len(materials)
        rows.add(np.eye(4)[None], part.points, part.triangles, part.uv, numbers, part.colors, first)
        rows.names.append(name)
        materials += part.materials
    return rows.source(materials=tuple(materials))
