"""Artifacts → VRML97, hints and plans; and back: the check of what stands on disk (paper §6)."""

from __future__ import annotations

from importlib import import_module
from typing import Any

_HOME = {
    "emit": "emission",
    "plot_plan": "plan",
    "validate_database": "validate",
    "validate_ptm": "validate",
    **dict.fromkeys(
        (
            "EmitOptions",
            "EmitReport",
            "GivenViewpoint",
            "Issue",
            "PlotOptions",
            "TextureLevel",
            "TextureRecord",
            "ValidationReport",
            "Viewpoint",
        ),
        "model",
    ),
}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
