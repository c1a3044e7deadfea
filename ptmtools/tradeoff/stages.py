"""The experiments of a database's stages, with the options that it was built with."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from typing import Any, TypeVar

from ptmtools.cells import SubdivideOptions
from ptmtools.coverage.options import AchOptions
from ptmtools.pipeline import Artifacts
from ptmtools.pipeline.stages import CELLS, PVS, SCENE
from ptmtools.texture import EncodeOptions
from ptmtools.tradeoff.cells import CellsTrade
from ptmtools.tradeoff.experiment import Experiment
from ptmtools.tradeoff.hints import CoverageTrade
from ptmtools.tradeoff.textures import TexturesTrade
from ptmtools.tradeoff.visibility import VisibilityTrade
from ptmtools.visibility.options import PvsOptions

#: Those with an experiment, in the order in which they run.
STAGES = ("cells", "pvs", "ach", "textures")

T = TypeVar("T")


def experiments(
    artifacts: Artifacts, cells_tried: int, reference_points: int
) -> Mapping[str, Callable[[], Experiment]]:
    """Stage → what prepares its experiment, in the order of the pipeline; ``cells_tried`` and
    ``reference_points`` as in `CoverageTrade`."""

    def told(stage: str, cls: type[T]) -> T:
        """The options of a stage's last run, as far as they are of ``cls``."""
        record = artifacts.db.manifest.stages.get(stage)
        given: Mapping[str, Any] = record.parameters if record else {}
        names = {f.name for f in fields(cls)} & set(given)  # type: ignore[arg-type]
        return cls(**{name: _plain(given[name]) for name in names})

    return {
        "cells": lambda: CellsTrade(artifacts[SCENE], told("cells", SubdivideOptions)),
        "pvs": lambda: VisibilityTrade(artifacts[CELLS], told("pvs", PvsOptions)),
        "ach": lambda: CoverageTrade(
            artifacts[SCENE],
            artifacts[CELLS],
            artifacts[PVS],
            _open(told("ach", AchOptions)),
            cells_tried,
            reference_points,
        ),
        "textures": lambda: TexturesTrade(artifacts[SCENE].images, told("textures", EncodeOptions)),
    }


def _open(options: AchOptions) -> AchOptions:
    """Without what settings choose."""
    return replace(options, samples=None, face=None, placement=None, tolerance=None)


def _plain(value: Any) -> Any:
    """JSON's lists as tuples."""
    return tuple(map(_plain, value)) if isinstance(value, list) else value
