"""The order of the stages, their artifacts and their cache.

The names below are loaded when first used, so that importing this package costs nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import lazy_exports

if TYPE_CHECKING:
    from ptmtools.pipeline.build import (
        build_scene as build_scene,
        run_stage as run_stage,
    )
    from ptmtools.pipeline.encoding import TextureOptions as TextureOptions
    from ptmtools.pipeline.records import StageReport as StageReport
    from ptmtools.pipeline.report import BuildReport as BuildReport
    from ptmtools.pipeline.stage import Artifacts as Artifacts
    from ptmtools.pipeline.status import (
        DatabaseStatus as DatabaseStatus,
        StagePlan as StagePlan,
        StageStatus as StageStatus,
        database_status as database_status,
        plan_build as plan_build,
    )
    from ptmtools.pipeline.validation import shoot_segments as shoot_segments, validate as validate

__getattr__ = lazy_exports(
    __name__,
    {
        "ptmtools.pipeline.build": "build_scene run_stage",
        "ptmtools.pipeline.encoding": "TextureOptions",
        "ptmtools.pipeline.records": "StageReport",
        "ptmtools.pipeline.report": "BuildReport",
        "ptmtools.pipeline.stage": "Artifacts",
        "ptmtools.pipeline.status": (
            "DatabaseStatus StagePlan StageStatus database_status plan_build"
        ),
        "ptmtools.pipeline.validation": "shoot_segments validate",
    },
)
