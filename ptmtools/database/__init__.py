"""Artifacts → VRML97, hints and plans; and back: the check of what stands on disk (paper §6)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import names

if TYPE_CHECKING:
    from ptmtools.database.emission import emit
    from ptmtools.database.model import (
        EmitOptions,
        EmitReport,
        GivenViewpoint,
        Issue,
        PlotOptions,
        PlotReport,
        TextureLevel,
        TextureRecord,
        ValidationReport,
        Viewpoint,
    )
    from ptmtools.database.plans import plot_plan
    from ptmtools.database.validation import validate_database, validate_ptm

__all__ = [
    "EmitOptions",
    "EmitReport",
    "GivenViewpoint",
    "Issue",
    "PlotOptions",
    "PlotReport",
    "TextureLevel",
    "TextureRecord",
    "ValidationReport",
    "Viewpoint",
    "emit",
    "plot_plan",
    "validate_database",
    "validate_ptm",
]

_HOME = {
    "EmitOptions": "model",
    "EmitReport": "model",
    "GivenViewpoint": "model",
    "Issue": "model",
    "PlotOptions": "model",
    "PlotReport": "model",
    "TextureLevel": "model",
    "TextureRecord": "model",
    "ValidationReport": "model",
    "Viewpoint": "model",
    "emit": "emission",
    "plot_plan": "plans",
    "validate_database": "validation",
    "validate_ptm": "validation",
}

__getattr__ = names(__name__, _HOME)
