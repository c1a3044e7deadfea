"""All that was computed becomes the served files (paper §6)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ptmtools.lazy import Lazy
from ptmtools.output.model import EmitOptions
from ptmtools.pipeline.stage import Stage
from ptmtools.pipeline.stages.ach import ACH
from ptmtools.pipeline.stages.apo import APO
from ptmtools.pipeline.stages.cells import CELLS
from ptmtools.pipeline.stages.pvs import PVS
from ptmtools.pipeline.stages.textures import TEXTURES
from ptmtools.quantities import count, size


def _summary(n: Mapping[str, Any]) -> str:
    of = ""
    if "owners" in n:  # not in databases of former versions
        of = f" from {n['visible']:,} of the model (uncut they would be {n['owners']:,})"
    looks = n.get("first_look")
    looked = f" ({size(looks)} of first-look bundles)" if looks else ""
    return (
        f"{count(n['files'], 'file')}, {size(n['bytes'])}{looked}; "
        f"{count(n['triangles'], 'triangle')}{of}, {count(n['viewpoints'], 'viewpoint')}"
    )


EMIT: Stage[None] = Stage(
    name="emit",
    about="Write the served files: cells and hints.",
    recipe=9,
    changed="the hints say what each level of a texture adds, its mean colour, and what a texel "
    "takes on a GPU, and how fine each is needed in each cell; --first-look writes a bundle of "
    "coarse levels for each cell; "
    "viewpoints look where pictures are; hulls with slivers and portals with short edges are "
    "convex in float32 and in float64",
    options=EmitOptions,
    reads=(APO, CELLS, PVS, ACH, TEXTURES),
    files=(APO,),
    job=Lazy("ptmtools.pipeline.emission:EmissionJob"),
    summary=_summary,
)
