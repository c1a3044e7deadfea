"""Converts a model to OBJ files through pymeshlab, in a process of its own (`apart`).

pymeshlab (GPL-3, needs libGL) does not say which face has which texture, but writes it into an
OBJ file. As a program: ``python -P -m ptmtools.scene.meshlab MEMORY MODEL FOLDER`` writes
``0.obj``, … and answers with their labels.
"""

from __future__ import annotations

import ctypes
import os
import sys
from importlib.util import find_spec
from pathlib import Path

from ptmtools.errors import MissingComponentError
from ptmtools.scene.apart import run_apart, serve


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
