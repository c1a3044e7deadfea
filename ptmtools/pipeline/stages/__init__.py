"""The table of stages, in the order of their runs. A new stage is a file and a line here."""

from __future__ import annotations

from typing import Any

from ptmtools.pipeline.stage import Stage
from ptmtools.pipeline.stages.ach import ACH
from ptmtools.pipeline.stages.apo import APO
from ptmtools.pipeline.stages.cells import CELLS
from ptmtools.pipeline.stages.emit import EMIT
from ptmtools.pipeline.stages.light import LIGHT
from ptmtools.pipeline.stages.pvs import PVS
from ptmtools.pipeline.stages.relief import RELIEF
from ptmtools.pipeline.stages.scene import SCENE
from ptmtools.pipeline.stages.textures import TEXTURES

__all__ = ["ACH", "APO", "CELLS", "EMIT", "LIGHT", "PVS", "RELIEF", "SCENE", "STAGES", "TEXTURES"]

STAGES: dict[str, Stage[Any]] = {
    stage.name: stage
    for stage in (
        SCENE,
        APO,
        CELLS,
        PVS,
        ACH,
        TEXTURES,
        RELIEF,
        LIGHT,
        EMIT,
    )
}
