"""Floor plans of a database, one for each of its storeys: `plan` draws them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import names

if TYPE_CHECKING:
    from ptmtools.database.plans.plan import plot_plan

__all__ = ["plot_plan"]

__getattr__ = names(__name__, {"plot_plan": "plan"})
