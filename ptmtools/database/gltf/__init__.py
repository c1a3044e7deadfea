"""Artifacts → glTF 2.0: a GLB for every cell, beside its VRML file; and back: their strict reader.

docs/gltf.md says what is in them. The textures are those of the VRML files, referred to by URI;
no extension is used. `gltf/hints.json` is written by `ptmtools.database.hints`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import names

if TYPE_CHECKING:
    from ptmtools.database.gltf.cell import gltf_files
    from ptmtools.database.gltf.names import GLTF_FOLDER, GLTF_HINTS, UP, glb_file

__all__ = ["GLTF_FOLDER", "GLTF_HINTS", "UP", "glb_file", "gltf_files"]

__getattr__ = names(
    __name__,
    {
        "GLTF_FOLDER": "names",
        "GLTF_HINTS": "names",
        "UP": "names",
        "glb_file": "names",
        "gltf_files": "cell",
    },
)
