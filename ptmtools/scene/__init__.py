"""A model file becomes arrays in metres, Y up.

`ingest` reads a model (OBJ, glTF, and others) into a `Scene`; the readers and their libraries
are imported when they are first asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ptmtools.scene.ingestion import IngestOptions, ingest
    from ptmtools.scene.model import Camera, Material, Note, Scene, SourceImage, Space

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


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    home = "ingestion" if name in ("IngestOptions", "ingest") else "model"
    return getattr(import_module(f"{__name__}.{home}"), name)
