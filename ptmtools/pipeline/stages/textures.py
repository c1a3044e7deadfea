"""The images of the scene become progressive textures (paper §4)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ptmtools.lazy import Lazy
from ptmtools.pipeline.options import TextureOptions
from ptmtools.pipeline.stage import Stage
from ptmtools.pipeline.stages.apo import APO
from ptmtools.pipeline.stages.cells import CELLS
from ptmtools.pipeline.stages.pvs import PVS
from ptmtools.pipeline.stages.scene import SCENE
from ptmtools.quantities import count, size


def _summary(n: Mapping[str, Any]) -> str:
    raw, stored = n["raw_bytes"], n["ptm_bytes"]
    share = f" ({stored / raw:.1%})" if raw else ""
    trim = ""
    if unresolved := n.get("unresolved"):
        trim = f"; of {count(unresolved, 'texture')} {size(n['unresolved_bytes'])} left out"
    return f"{count(n['textures'], 'texture')}, {size(raw)} → {size(stored)}{share}{trim}"


TEXTURES: Stage[None] = Stage(
    name="textures",
    about="Encode the model's images as progressive textures.",
    recipe=4,
    changed="what each level adds, and the mean colour of each texture, are kept for the hints",
    options=TextureOptions,
    reads=lambda options: (SCENE, APO, CELLS, PVS) if options.trim else (SCENE,),
    inputs=Lazy("ptmtools.pipeline.textures:inputs_of"),
    job=Lazy("ptmtools.pipeline.textures:TexturesJob"),
    tasks=Lazy("ptmtools.pipeline.textures:waiting_textures"),
    summary=_summary,
)
