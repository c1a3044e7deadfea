"""Artifacts → VRML97, glTF, hints and plans (paper §6), and the check of the files on disk."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import lazy_exports

if TYPE_CHECKING:
    from ptmtools.output.content import EmitExtras as EmitExtras
    from ptmtools.output.emission import emit as emit
    from ptmtools.output.model import (
        EmitReport as EmitReport,
        GivenViewpoint as GivenViewpoint,
        PlotOptions as PlotOptions,
        PlotReport as PlotReport,
        TextureRecord as TextureRecord,
        Viewpoint as Viewpoint,
    )
    from ptmtools.output.options import EmitOptions as EmitOptions
    from ptmtools.output.plan import plot_plan as plot_plan
    from ptmtools.output.validation.database import (
        validate_database as validate_database,
        validate_ptm as validate_ptm,
    )

__getattr__ = lazy_exports(
    __name__,
    {
        "ptmtools.output.content": "EmitExtras",
        "ptmtools.output.emission": "emit",
        "ptmtools.output.model": (
            "EmitReport GivenViewpoint PlotOptions PlotReport TextureRecord Viewpoint"
        ),
        "ptmtools.output.options": "EmitOptions",
        "ptmtools.output.plan": "plot_plan",
        "ptmtools.output.validation.database": "validate_database validate_ptm",
    },
)
