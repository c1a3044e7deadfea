"""Reads the other formats: PLY, STL and OFF through trimesh, IFC through IfcOpenShell (`ifc`), USD
through usd-core (`usd`), the rest through pymeshlab.

What pymeshlab reads it converts to OBJ in a temporary folder (`ptmtools.scene.formats`), and our
own reader reads that. The same way is taken where trimesh gives up (mixed polygons in OFF) and for
textured PLY, of which trimesh keeps one image. Both libraries cut polygons as fans.

Converts a model to OBJ files through pymeshlab, in a process of its own (`apart`).

pymeshlab (GPL-3, needs libGL) does not say which face has which texture, but writes it into an
OBJ file. As a program: ``python -P -m ptmtools.scene.formats MEMORY MODEL FOLDER`` writes
``0.obj``, … and answers with their labels."""

from __future__ import annotations

import ctypes
import os
import sys
import tempfile
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import InputError, MissingComponentError
from ptmtools.scene.options import IFC, SUFFIXES, TRIMESH, USD
from ptmtools.scene.rows import joined_colors
from ptmtools.scene.sandbox import run_apart, serve
from ptmtools.scene.source import MAX_VERTICES, Findings, Source, SourceMaterial, too_many_triangles


def convert(path: Path, scratch: Path) -> list[tuple[Path, str]]:
    """The meshes of a model as OBJ files in ``scratch``, with their labels.

    Raises InputError PTM-I254 for what pymeshlab cannot read, MissingComponentError PTM-M200.
    """
    if fault := _absence():
        raise _missing(fault)
    labels = run_apart(__name__, "pymeshlab", path, path.absolute(), scratch)
    return [(scratch / f"{i}.obj", label) for i, label in enumerate(labels)]


def _absence() -> str:
    """Why pymeshlab cannot be used. Without OpenGL it imports, prints a page of complaints and
    knows no format, so that library is looked for first."""
    try:
        if sys.platform == "linux":
            ctypes.CDLL("libOpenGL.so.0")
    except OSError as error:
        return str(error)
    return "" if find_spec("pymeshlab") else "No module named 'pymeshlab'"


def _missing(why: str) -> MissingComponentError:
    return MissingComponentError(
        "PTM-M200",
        f"pymeshlab cannot be used ({why})",
        remedy="pip install pymeshlab; apt install libopengl0 libgl1; or convert to GLB",
    )


def _convert_here(path: str, scratch: str) -> list[str]:
    """The labels of the meshes that it writes."""
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
    serve(_convert_here)


#: Enough of a PLY file for its header.
_HEADER = 1 << 14


def read_other(path: Path, findings: Findings, max_triangles: int = MAX_VERTICES) -> Source:
    """Read a file that is neither OBJ nor glTF, by its suffix.

    Raises InputError for unknown suffixes and for what no library can read, LimitError PTM-L203 for
    more than ``max_triangles``, and MissingComponentError if a library is needed and cannot be
    imported.
    """
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(
            "PTM-I243",
            f"models of type {suffix or '(no suffix)'} are not supported",
            file=path,
            remedy=f"give one of {' '.join(SUFFIXES)}",
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
    except Exception as error:  # trimesh raises whatever a damaged file provokes
        if suffix == ".stl":  # there are no two kinds of triangles: it is damaged
            raise InputError(
                "PTM-I254", f"is damaged ({error})", file=path, remedy="export it again"
            ) from None
        source = _read_meshlab(path, findings, max_triangles)
        findings.say(
            "PTM-N230", f"read through pymeshlab, as trimesh gave up ({type(error).__name__})"
        )
    if len(source.triangles) > max_triangles:
        raise too_many_triangles(max_triangles, path)
    return source


def _textured_ply(path: Path, findings: Findings) -> bool:
    with open(path, "rb") as stream:
        head = stream.read(_HEADER).split(b"end_header")[0].lower()
    textured = b"texturefile" in head
    if textured and b" red" in head:
        findings.say("PTM-N223", "colours of vertices are not carried over beside textures")
    return textured


def _read_trimesh(path: Path, findings: Findings) -> Source:
    import trimesh

    with open(path, "rb") as stream:
        scene = trimesh.load_scene(stream, file_type=path.suffix.lower()[1:], process=False)
    parts = []
    for name in scene.graph.nodes_geometry:
        matrix, geometry = scene.graph.get(name)
        mesh = scene.geometry[geometry]
        faces = np.asarray(getattr(mesh, "faces", np.zeros((0, 3))), dtype=np.int64)
        local = np.asarray(mesh.vertices, dtype=np.float64)
        if len(faces) and not 0 <= faces.min() <= faces.max() < len(local):
            raise InputError("PTM-I246", "a face names a vertex that does not exist", file=path)
        # Infinite ones are told of with the faces that have them.
        with np.errstate(invalid="ignore", over="ignore"):
            points = local @ matrix[:3, :3].T + matrix[:3, 3]
        parts.append(
            Source(
                points=points,
                triangles=faces,
                uv=np.zeros((len(faces), 3, 2)),
                triangle_object=np.zeros(len(faces), dtype=np.int64),
                triangle_material=np.zeros(len(faces), dtype=np.int64),
                objects=(path.stem if len(scene.geometry) == 1 else str(geometry),),
                materials=(SourceMaterial("default"),),
                colors=_colors(mesh, faces, findings),
            )
        )
    joined = _joined(path, parts)
    material = np.zeros_like(joined.triangle_material)
    return replace(joined, materials=joined.materials[:1], triangle_material=material)


def _colors(mesh: Any, faces: NDArray[np.int64], findings: Findings) -> NDArray[np.uint8] | None:
    """(T, 3, 3) sRGB of corners, if vertices or faces have colours of their own."""
    kind = getattr(mesh.visual, "kind", None)
    if kind not in ("vertex", "face"):
        return None
    own = mesh.visual.vertex_colors if kind == "vertex" else mesh.visual.face_colors
    rows = np.asarray(own, dtype=np.uint8)
    if (rows[:, 3:] < 255).any():
        findings.say("PTM-N223", "opacities of vertices and faces are not carried over")
    return rows[faces, :3] if kind == "vertex" else np.repeat(rows[:, None, :3], 3, axis=1)


def _read_meshlab(path: Path, findings: Findings, max_triangles: int) -> Source:
    from ptmtools.scene.obj import read_obj

    parts = []
    with tempfile.TemporaryDirectory() as scratch:
        findings.folder.admit(Path(scratch))
        for converted, label in convert(path, Path(scratch)):
            part = read_obj(converted, findings, max_triangles=max_triangles)
            parts.append(replace(part, objects=(label or path.stem,)))
    return _joined(path, parts)


def _joined(path: Path, parts: list[Source]) -> Source:
    """One source of several, in order. Raises InputError PTM-I247 if they have no face."""
    if not any(len(part.triangles) for part in parts):
        raise InputError("PTM-I247", "no faces", file=path, remedy="give a model with faces")

    def counted_on(name: str, counted: str) -> NDArray[np.int64]:
        """An array of indices of all of them, behind what the parts before have."""
        first = np.cumsum([0] + [len(getattr(part, counted)) for part in parts])
        rows = [getattr(part, name) + n for part, n in zip(parts, first, strict=False)]
        return np.concatenate(rows)

    return Source(
        points=np.concatenate([part.points for part in parts]),
        triangles=counted_on("triangles", "points"),
        uv=np.concatenate([part.uv for part in parts]),
        triangle_object=counted_on("triangle_object", "objects"),
        triangle_material=counted_on("triangle_material", "materials"),
        objects=tuple(name for part in parts for name in part.objects),
        materials=tuple(material for part in parts for material in part.materials),
        colors=joined_colors([p.colors for p in parts], [len(p.triangles) for p in parts]),
    )
