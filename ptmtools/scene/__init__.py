"""A model file becomes arrays in metres, Y up.

`ingest` reads a model (OBJ, glTF, and others) into a `Scene`; the readers and their libraries
are imported when they are first asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import names

if TYPE_CHECKING:
    from ptmtools.scene.ingestion import ingest
    from ptmtools.scene.model import Camera, Material, Note, Scene, SourceImage, Space
    from ptmtools.scene.options import IngestOptions

__all__ = [
    "Camera",
    "IngestOptions",
    "Material",
    "Note",
    "Scene",
    "SourceImage",
    "Space",
    "ingest",
]

__getattr__ = names(
    __name__,
    {
        **dict.fromkeys(__all__, "model"),
        "IngestOptions": "options",
        "ingest": "ingestion",
    },
)
