"""Ingest: reads a model file (OBJ, glTF and others) into a `Scene`: arrays in metres, Y up.

Readers and their libraries are imported on first use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import lazy_exports

if TYPE_CHECKING:
    from ptmtools.scene.ingestion import ingest as ingest
    from ptmtools.scene.model import (
        Camera as Camera,
        Material as Material,
        Note as Note,
        Scene as Scene,
        SourceImage as SourceImage,
        Space as Space,
    )
    from ptmtools.scene.options import IngestOptions as IngestOptions

__getattr__ = lazy_exports(
    __name__,
    {
        "ptmtools.scene.ingestion": "ingest",
        "ptmtools.scene.model": "Camera Material Note Scene SourceImage Space",
        "ptmtools.scene.options": "IngestOptions",
    },
)
