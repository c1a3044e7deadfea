"""Artifacts → VRML97, hints and plans; and back: the check of what stands on disk (paper §6)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import names

if TYPE_CHECKING:
    from ptmtools.database.emission import emit as emit
    from ptmtools.database.model import (
        EmitOptions as EmitOptions,
        EmitReport as EmitReport,
        GivenViewpoint as GivenViewpoint,
        PlotOptions as PlotOptions,
        PlotReport as PlotReport,
        TextureRecord as TextureRecord,
        Viewpoint as Viewpoint,
    )
    from ptmtools.database.plans.plan import plot_plan as plot_plan
    from ptmtools.database.validation.database import (
        validate_database as validate_database,
        validate_ptm as validate_ptm,
    )

__getattr__ = names(__name__)
