"""Artifacts → VRML97, hints and plans; and back: the check of what stands on disk (paper §6)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import names

if TYPE_CHECKING:
    from ptmtools.database.emission import emit as emit
    from ptmtools.database.model import EmitOptions as EmitOptions
    from ptmtools.database.model import EmitReport as EmitReport
    from ptmtools.database.model import GivenViewpoint as GivenViewpoint
    from ptmtools.database.model import Issue as Issue
    from ptmtools.database.model import PlotOptions as PlotOptions
    from ptmtools.database.model import PlotReport as PlotReport
    from ptmtools.database.model import TextureLevel as TextureLevel
    from ptmtools.database.model import TextureRecord as TextureRecord
    from ptmtools.database.model import ValidationReport as ValidationReport
    from ptmtools.database.model import Viewpoint as Viewpoint
    from ptmtools.database.plans.plan import plot_plan as plot_plan
    from ptmtools.database.validation.database import validate_database as validate_database
    from ptmtools.database.validation.database import validate_ptm as validate_ptm

__getattr__ = names(__name__)
