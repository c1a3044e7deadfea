"""Artifacts → VRML97, hints and plans; and back: the check of what stands on disk (paper §6)."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

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
    from ptmtools.database.plan import plot_plan
    from ptmtools.database.validate import validate_database, validate_ptm

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
    "plot_plan": "plan",
    "validate_database": "validate",
    "validate_ptm": "validate",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
