"""The order of the stages, their artifacts and their cache.

The names below are loaded when first used, so that importing this package costs nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import names

if TYPE_CHECKING:
    from ptmtools.pipeline.build import build_scene as build_scene
    from ptmtools.pipeline.build import run_stage as run_stage
    from ptmtools.pipeline.options import TextureOptions as TextureOptions
    from ptmtools.pipeline.plan import StagePlan as StagePlan
    from ptmtools.pipeline.plan import plan_build as plan_build
    from ptmtools.pipeline.report import BuildReport as BuildReport
    from ptmtools.pipeline.report import StageReport as StageReport
    from ptmtools.pipeline.run import Artifacts as Artifacts
    from ptmtools.pipeline.status import DatabaseStatus as DatabaseStatus
    from ptmtools.pipeline.status import StageStatus as StageStatus
    from ptmtools.pipeline.status import database_status as database_status
    from ptmtools.pipeline.validation import shoot_segments as shoot_segments
    from ptmtools.pipeline.validation import validate as validate

__getattr__ = names(__name__)
