"""The model becomes arrays in metres, a list of its images, and a copy of each."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ptmtools.lazy import Lazy
from ptmtools.pipeline.stage import Stage
from ptmtools.quantities import count
from ptmtools.scene.options import IngestOptions

if TYPE_CHECKING:
    from ptmtools.scene.model import Scene


def _counts(scene: Scene) -> Mapping[str, Any]:
    return {
        "triangles": len(scene.triangles),
        "objects": len(scene.objects),
        "materials": len(scene.materials),
        "images": len(scene.images),
        "size": (scene.points.max(axis=0) - scene.points.min(axis=0)).tolist(),
        "origin": list(scene.space.origin),
        "metres": scene.space.metres,
        "up": scene.space.up,
        "unit_guessed": scene.space.unit_guessed,
        "up_guessed": scene.space.up_guessed,
    }


def _summary(n: Mapping[str, Any]) -> str:
    guessed = [what for what, key in (("unit", "unit"), ("up axis", "up")) if n[f"{key}_guessed"]]
    how = f" ({' and '.join(guessed)} guessed)" if guessed else ""
    extent = ""
    if "size" in n:  # which databases of earlier releases do not say
        width, height, depth = n["size"]
        extent = f"; {width:.3g} × {depth:.3g} m, {height:.3g} m high"
    return (
        f"{count(n['triangles'], 'triangle')} in {count(n['objects'], 'object')}, "
        f"{count(n['images'], 'image')}; 1 unit = {n['metres']:g} m, {n['up']} up{how}{extent}"
    )


SCENE: Stage[Scene] = Stage(
    name="scene",
    about="Read a model.",
    recipe=7,
    changed="OBJ has Y up by convention, and opaque materials ignore the alpha of textures",
    options=IngestOptions,
    artifact=Lazy("ptmtools.scene.model:Scene"),
    counts=_counts,
    summary=_summary,
    job=Lazy("ptmtools.pipeline.reading:ReadingJob"),
    inputs=Lazy("ptmtools.pipeline.reading:inputs_of"),
    foresee=Lazy("ptmtools.pipeline.reading:foresee"),
    load=Lazy("ptmtools.pipeline.reading:load_scene"),
    check=Lazy("ptmtools.pipeline.reading:missing_images"),
    from_model=True,
    hidden=True,
    joined=True,
)
