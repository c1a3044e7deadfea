"""The order of the stages, their artifacts and their cache.

The names below are loaded when first used, so that importing this package costs nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import names

if TYPE_CHECKING:
    from ptmtools.pipeline.build import build_scene, run_stage
    from ptmtools.pipeline.options import TextureOptions
    from ptmtools.pipeline.plan import StagePlan, plan_build
    from ptmtools.pipeline.report import BuildReport, StageReport
    from ptmtools.pipeline.run import Artifacts
    from ptmtools.pipeline.status import DatabaseStatus, StageStatus, database_status
    from ptmtools.pipeline.validation import shoot_segments, validate

_HOME = {
    "Artifacts": "run",
    "BuildReport": "report",
    "DatabaseStatus": "status",
    "StagePlan": "plan",
    "StageReport": "report",
    "StageStatus": "status",
    "TextureOptions": "options",
    "build_scene": "build",
    "database_status": "status",
    "plan_build": "plan",
    "run_stage": "build",
    "shoot_segments": "validation",
    "validate": "validation",
}

__all__ = [
    "Artifacts",
    "BuildReport",
    "DatabaseStatus",
    "StagePlan",
    "StageReport",
    "StageStatus",
    "TextureOptions",
    "build_scene",
    "database_status",
    "plan_build",
    "run_stage",
    "shoot_segments",
    "validate",
]

__getattr__ = names(__name__, _HOME)
