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
    from ptmtools.pipeline.plan import StagePlan, plan_build
    from ptmtools.pipeline.report import BuildReport, StageReport
    from ptmtools.pipeline.run import Artifacts
    from ptmtools.pipeline.status import DatabaseStatus, StageStatus, database_status
    from ptmtools.pipeline.validation import shoot_segments, validate

_HOME = {
    "Artifacts": "run",
    "BuildOptions": "options",
    "BuildReport": "report",
    "DatabaseFolder": "folder",
    "DatabaseStatus": "status",
    "StagePlan": "plan",
    "StageReport": "report",
    "StageStatus": "status",
    "TextureOptions": "options",
    "build_scene": "build",
    "database_status": "status",
    "make_ach": "build",
    "make_cells": "build",
    "make_files": "build",
    "make_pvs": "build",
    "make_textures": "build",
    "plan_build": "plan",
    "shoot_segments": "validation",
    "validate": "validation",
}

__all__ = [
    "Artifacts",
    "BuildOptions",
    "BuildReport",
    "DatabaseFolder",
    "DatabaseStatus",
    "StagePlan",
    "StageReport",
    "StageStatus",
    "TextureOptions",
    "build_scene",
    "database_status",
    "make_ach",
    "make_cells",
    "make_files",
    "make_pvs",
    "make_textures",
    "plan_build",
    "shoot_segments",
    "validate",
]

__getattr__ = names(__name__, _HOME)
