"""The experiments, as a table under the names of their stages.

To add one: a module with an `Experiment` and a function that prepares it, and a line here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from ptmtools.pipeline import Artifacts
    from ptmtools.tradeoff.experiment import Experiment

#: Stage → "module:function" that makes its experiment of a `Subject`, in the order of the stages.
EXPERIMENTS: dict[str, str] = {
    "cells": "ptmtools.tradeoff.cells:prepare",
    "pvs": "ptmtools.tradeoff.visibility:prepare",
    "ach": "ptmtools.tradeoff.coverage:prepare",
    "textures": "ptmtools.tradeoff.textures:prepare",
}

T = TypeVar("T")


@dataclass(frozen=True)
class Subject:
    """What a stage's experiment is made on: a database, and how much effort to spend.

    Attributes
    ----------
    stage: its name.
    artifacts: those of the database.
    cells_tried, reference_points: as in `CoverageTrade`.
    """

    stage: str
    artifacts: Artifacts
    cells_tried: int
    reference_points: int

    def prepared(self) -> Experiment:
        """The stage's experiment, ready to run."""
        experiment: Experiment = resolve_name(EXPERIMENTS[self.stage])(self)
        return experiment

    def options(self, cls: type[T]) -> T:
        """The options of the stage's last run, as far as they are of ``cls``."""
        record = self.artifacts.db.manifest.stages.get(self.stage)
        given: Mapping[str, Any] = record.parameters if record else {}
        names = {f.name for f in fields(cls)} & set(given)  # type: ignore[arg-type]
        return cls(**{name: _plain(given[name]) for name in names})


def _plain(value: Any) -> Any:
    """JSON's lists as tuples."""
    return tuple(map(_plain, value)) if isinstance(value, list) else value
