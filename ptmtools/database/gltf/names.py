"""Where the glTF files lie."""

from __future__ import annotations

from ptmtools.database.names import HINTS, cell_name

GLTF_FOLDER = "gltf"
#: The hints whose URLs start from the glTF folder.
GLTF_HINTS = f"{GLTF_FOLDER}/{HINTS}"
#: From the glTF folder to the served folder.
UP = "../"


def glb_file(cell: int) -> str:
    """The name of a cell's GLB, as the hints beside it refer to it."""
    return f"{cell_name(cell)}.glb"


def glb_path(cell: int) -> str:
    """A cell's GLB relative to the served folder."""
    return f"{GLTF_FOLDER}/{glb_file(cell)}"
