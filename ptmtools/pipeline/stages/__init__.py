"""The table of stages, in the order of their runs.

A new stage of the product is a file and a line here. Those of other packages are entry points of
the group ``ptmtools.stages``: one that changes an artifact runs after the stage that it changes,
and any other after all stages that it reads or heeds.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ptmtools import plugins
from ptmtools.pipeline.stage import Stage, changes_before
from ptmtools.pipeline.stages.ach import ACH
from ptmtools.pipeline.stages.cells import CELLS
from ptmtools.pipeline.stages.emit import EMIT
from ptmtools.pipeline.stages.light import LIGHT
from ptmtools.pipeline.stages.pvs import PVS
from ptmtools.pipeline.stages.scene import SCENE
from ptmtools.pipeline.stages.textures import TEXTURES

__all__ = ["ACH", "CELLS", "EMIT", "LIGHT", "PVS", "SCENE", "STAGES", "TEXTURES"]

if TYPE_CHECKING:
    STAGES: dict[str, Stage[Any]]

BUILT_IN: tuple[Stage[Any], ...] = (SCENE, CELLS, PVS, ACH, TEXTURES, LIGHT, EMIT)


def __getattr__(name: str) -> Any:
    """`STAGES`, which imports the stages of other packages, and is made when it is first used."""
    if name != "STAGES":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    table = globals()["STAGES"] = {stage.name: stage for stage in _sorted_stages()}
    return table


def _sorted_stages() -> list[Stage[Any]]:
    """All stages, each after those that it depends on."""
    stages = list(BUILT_IN)
    for stage in plugins.declarations("stages", Stage).values():
        needed = [*stage.sources(stage.options()), *stage.heeds]
        if stage.changes:
            needed = [stage.changes, *changes_before(stage, stage.changes)]
        stages.insert(max(map(stages.index, needed), default=-1) + 1, stage)
    return stages
