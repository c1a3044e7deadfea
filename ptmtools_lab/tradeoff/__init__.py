"""The price of every stage's options: cost against error on the user's own scene.

`EXPERIMENTS` is the table of experiments, under the names of their stages. To add one: an
`Experiment`, a function that prepares it, and a line here.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from ptmtools.lazy import Lazy
from ptmtools.pipeline.stages import ACH, CELLS, LIGHT, PVS, TEXTURES

if TYPE_CHECKING:
    from ptmtools_lab.tradeoff.experiment import Experiment, Subject

#: Stage → the function that prepares its experiment, in the order of the stages.
EXPERIMENTS: dict[str, Lazy[Callable[[Subject], Experiment]]] = {
    CELLS.name: Lazy("ptmtools_lab.tradeoff.stages:prepare_cells"),
    PVS.name: Lazy("ptmtools_lab.tradeoff.stages:prepare_visibility"),
    ACH.name: Lazy("ptmtools_lab.tradeoff.stages:prepare_coverage"),
    TEXTURES.name: Lazy("ptmtools_lab.tradeoff.stages:prepare_textures"),
}
#: Experiments which are only run if they are named: baked light, the client of the paper, octree
#: textures, interlaced images and campuses.
FURTHER: dict[str, Lazy[Callable[[Subject], Experiment]]] = {
    LIGHT.name: Lazy("ptmtools_lab.tradeoff.light:prepare_lightmaps"),
    "client": Lazy("ptmtools_lab.tradeoff.stages:prepare_client"),
    "apo": Lazy("ptmtools_lab.tradeoff.forms:prepare_octree"),
    "interlace": Lazy("ptmtools_lab.tradeoff.forms:prepare_interlaced"),
    "campus-meshes": Lazy("ptmtools_lab.tradeoff.forms:prepare_coarse"),
    "campus-light": Lazy("ptmtools_lab.tradeoff.forms:prepare_light"),
    "campus-jpeg": Lazy("ptmtools_lab.tradeoff.forms:prepare_jpeg"),
}
