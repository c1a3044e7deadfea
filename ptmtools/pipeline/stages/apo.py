"""Objects of the scene become simplified meshes with octree textures; without any nothing is done.

Stages that mean what is shown read this one; those that mean the model and its images read the
scene.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ptmtools.lazy import Lazy
from ptmtools.neighbours.apo.options import ReplaceOptions
from ptmtools.pipeline.stage import Stage
from ptmtools.pipeline.stages.scene import SCENE
from ptmtools.quantities import count, size

if TYPE_CHECKING:
    from ptmtools.scene.model import Scene


def _reads(options: ReplaceOptions) -> tuple[Stage[Any], ...]:
    return (SCENE,) if options.apo else ()


def _counts(scene: Scene) -> Mapping[str, Any]:
    return {"triangles": len(scene.triangles)}


def _summary(n: Mapping[str, Any]) -> str:
    if not n["octrees"]:
        return "no object is replaced"
    return (
        f"{count(n['octrees'], 'object')} of {count(n['source'], 'triangle')} → {n['faces']:,}, "
        f"off by about {n['deviation']:.2g} m; "
        f"{count(n['texels'], 'texel')} of octrees, {size(n['bytes'])}"
    )


APO: Stage[Scene] = Stage(
    name="apo",
    about="Replace objects by simplified meshes with octree textures.",
    recipe=3,
    options=ReplaceOptions,
    changed="meshes of many small holes, handles or parts become as simple as others",
    reads=_reads,
    changes=SCENE,
    artifact=Lazy("ptmtools.scene.model:Scene"),
    counts=_counts,
    summary=_summary,
    job=Lazy("ptmtools.pipeline.replacing:ReplacingJob"),
    foresee=Lazy("ptmtools.pipeline.replacing:foresee"),
    load=Lazy("ptmtools.pipeline.replacing:load_scene"),
    check=Lazy("ptmtools.pipeline.replacing:missing_octrees"),
    hidden=True,
    joined=True,
)
