"""The same by pymeshlab, the tool of the paper on octree textures, for comparison and on request.

pymeshlab is GPL-3 and needs libGL: it is imported in one function, and only here. It knows plain
meshes only, and neither a face's source nor an error: the source goes through it as a quality of
faces, which collapses keep.
"""

from __future__ import annotations

import ctypes
import sys
from importlib.util import find_spec

import numpy as np

from ptmtools.errors import InputError, MissingComponentError
from ptmtools.simplification.model import Mesh, Simplified, too_many
from ptmtools.simplification.surface import Surface


def by_meshlab(mesh: Mesh, surface: Surface, faces: int) -> Simplified:
    """A plain mesh with about so many faces; its error is not known (NaN).

    Raises InputError PTM-I290 for a mesh with materials, texture coordinates or colours, and
    MissingComponentError PTM-M290 where pymeshlab cannot be used.
    """
    if not mesh.is_plain:
        raise InputError(
            "PTM-I290",
            "pymeshlab simplifies meshes without materials, textures and colours only",
            remedy="choose the method quadric",
        )
    if fault := _absence():
        raise MissingComponentError(
            "PTM-M290",
            f"pymeshlab cannot be used ({fault})",
            remedy="pip install pymeshlab; apt install libopengl0 libgl1; or choose the method "
            "quadric",
        )
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    numbers = np.arange(len(surface.triangle), dtype=np.float64)
    meshes.add_mesh(pymeshlab.Mesh(surface.point, surface.triangle, f_scalar_array=numbers))
    meshes.meshing_decimation_quadric_edge_collapse(targetfacenum=faces)
    found = meshes.current_mesh()
    source = surface.source[np.rint(found.face_scalar_array()).astype(np.int64)]
    points = np.asarray(found.vertex_matrix(), np.float64) * surface.scale + surface.centre
    triangles = np.ascontiguousarray(found.face_matrix(), dtype=np.int32)
    return Simplified(
        Mesh(points, triangles), source, float("nan"), too_many(len(triangles), faces)
    )


def _absence() -> str:
    """Why pymeshlab cannot be used. Without OpenGL it imports, and knows no filter."""
    try:
        if sys.platform == "linux":
            ctypes.CDLL("libOpenGL.so.0")
    except OSError as error:
        return str(error)
    return "" if find_spec("pymeshlab") else "No module named 'pymeshlab'"
