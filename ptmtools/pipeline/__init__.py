"""The order of the stages, their artifacts and their cache.

The names below are loaded when first used, so that importing this package costs nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import lazy_exports

if TYPE_CHECKING:
    from ptmtools.pipeline.build import (
        StagePlan as StagePlan,
        build_scene as build_scene,
        plan_build as plan_build,
        run_stage as run_stage,
    )
    from ptmtools.pipeline.encoding import TextureOptions as TextureOptions
    from ptmtools.pipeline.report import BuildReport as BuildReport, StageReport as StageReport
    from ptmtools.pipeline.stage import Artifacts as Artifacts
    from ptmtools.pipeline.status import (
        DatabaseStatus as DatabaseStatus,
        StageStatus as StageStatus,
        database_status as database_status,
    )
    from ptmtools.pipeline.validation import shoot_segments as shoot_segments, validate as validate

__getattr__ = lazy_exports(
    __name__,
    {
        "ptmtools.pipeline.build": "StagePlan build_scene plan_build run_stage",
        "ptmtools.pipeline.options": "TextureOptions",
        "ptmtools.pipeline.report": "BuildReport StageReport",
        "ptmtools.pipeline.run": "Artifacts",
        "ptmtools.pipeline.status": "DatabaseStatus StageStatus database_status",
        "ptmtools.pipeline.validation": "shoot_segments validate",
    },
)
