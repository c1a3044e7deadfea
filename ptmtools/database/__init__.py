"""Artifacts → VRML97, hints and plans; and back: the check of what stands on disk (paper §6)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.database.model import (
    EmitOptions,
    EmitReport,
    GivenViewpoint,
    Issue,
    PlotOptions,
    PlotReport,
    TextureRecord,
    ValidationReport,
    Viewpoint,
)
from ptmtools.lazy import names

if TYPE_CHECKING:
    from ptmtools.database.emission import emit
    from ptmtools.database.plans.plan import plot_plan
    from ptmtools.database.validation.database import validate_database, validate_ptm

__all__ = [
    "EmitOptions",
    "EmitReport",
    "GivenViewpoint",
    "Issue",
    "PlotOptions",
    "PlotReport",
    "TextureRecord",
    "ValidationReport",
    "Viewpoint",
    "emit",
    "plot_plan",
    "validate_database",
    "validate_ptm",
]

_HOME = {
    "emit": "emission",
    "plot_plan": "plans.plan",
    "validate_database": "validation.database",
    "validate_ptm": "validation.database",
}

__getattr__ = names(__name__, _HOME)
