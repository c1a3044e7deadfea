"""The order of the stages, their artifacts and their cache.

The names below are loaded when first used, so that importing this package costs nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import names

if TYPE_CHECKING:
    from ptmtools.pipeline.build import (
        build_scene,
        make_ach,
        make_cells,
        make_files,
        make_pvs,
        make_textures,
    )
    from ptmtools.pipeline.folder import DatabaseFolder
    from ptmtools.pipeline.options import BuildOptions, TextureOptions
    from ptmtools.pipeline.report import BuildReport, StageReport
    from ptmtools.pipeline.run import Artifacts
    from ptmtools.pipeline.validation import shoot_segments, validate

_HOME = {
    "Artifacts": "run",
    "BuildOptions": "options",
    "BuildReport": "report",
    "DatabaseFolder": "folder",
    "StageReport": "report",
    "TextureOptions": "options",
    "build_scene": "build",
    "make_ach": "build",
    "make_cells": "build",
    "make_files": "build",
    "make_pvs": "build",
    "make_textures": "build",
    "shoot_segments": "validation",
    "validate": "validation",
}

__all__ = [
    "Artifacts",
    "BuildOptions",
    "BuildReport",
    "DatabaseFolder",
    "StageReport",
    "TextureOptions",
    "build_scene",
    "make_ach",
    "make_cells",
    "make_files",
    "make_pvs",
    "make_textures",
    "shoot_segments",
    "validate",
]

__getattr__ = names(__name__, _HOME)
