"""Bakes the probes of cells with surfaces that reflect, as textures: part of the stage `light`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from ptmtools.output.names import cell_name
from ptmtools.pipeline.artifacts import Artifacts, Run
from ptmtools.pipeline.encoding import (
    TextureOptions,
    bake_textures,
    encode_image,
    ptm_file,
)
from ptmtools.pipeline.stages.cells import CELLS
from ptmtools.pipeline.stages.scene import SCENE, image_digests
from ptmtools.pipeline.stages.textures import TEXTURES, texture_files
from ptmtools.store.layout import SERVED

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ptmtools.light.building import BuildingLight
    from ptmtools.light.cells import CellLight
    from ptmtools.light.model import CellSurfaces, Light
    from ptmtools.light.probes import Probe, ProbeBaking
    from ptmtools.light.reflectance import SmallImages
    from ptmtools.output.geometry import Geometry
    from ptmtools.scene.lights import Lights
    from ptmtools.scene.model import Scene
    from ptmtools.store.transaction import Transaction


@dataclass(frozen=True)
class ProbedCells:
    """The shared input of all tasks."""

    baking: ProbeBaking
    options: TextureOptions


def bake_probe(
    shared: ProbedCells, task: tuple[int, NDArray[np.float64]]
) -> tuple[tuple[Probe, int], list[tuple[str, bytes]]]:
    """The probe of a cell, whose centre is one of some points, with the bytes of its image that are
    served, and the files of it as `encode_image` returns them."""
    from ptmtools.light.model import lossy_codes

    cell, points = task
    probe = shared.baking.probe(points)
    name, data = lossy_codes(probe.texels, _QUALITY)
    files = encode_image(shared.options, f"{probe_stem(cell)}.{name}", data)
    served = sum(len(part) for file, part in files if file.startswith(f"{SERVED}/"))
    return (replace(probe, texels=probe.texels[:0]), served), files


#: Quality of the images of probes.
_QUALITY = {"avif": 75, "webp": 80}


def probe_stem(cell: int) -> str:
    """The stem of the files of a probe; no image of a model has such a name."""
    return f"probe~{cell_name(cell)}"


def probe_files(light: Light | None) -> dict[int, str]:
    """Cell → `.ptm` of its probe, relative to the served folder."""
    whites = [] if light is None else light.probe[:, 0].tolist()
    return {cell: ptm_file(probe_stem(cell)) for cell, white in enumerate(whites) if white}


def reflective_shapes(
    scene: Scene, lights: Lights | None, geometry: Geometry, unlit: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """(S,) the shapes that show a probe: glossy ones with light, and panes. ``unlit``: (S,) those
    without light."""
    import numpy as np

    glossy = np.array([m.glossy for m in scene.materials], np.bool_)
    pane = np.array([m.pane for m in scene.materials], np.bool_)
    if lights is not None:
        pane &= ~lights.unlit
    material = geometry.material
    return np.asarray((glossy[material] & ~unlit) | pane[material])


@dataclass(frozen=True)
class BakedBuilding:
    """Lit surfaces that probes see.

    Attributes
    ----------
    pieces, lights: of each cell.
    tint: (T, 3) base colours of the scene's faces beside their images, linear light.
    unlit: what a white surface without light sends.
    """

    building: BuildingLight
    pieces: Sequence[CellSurfaces]
    lights: Sequence[CellLight]
    tint: NDArray[np.float64]
    unlit: float


def bake_probes(
    run: Run, transaction: Transaction, lit: BakedBuilding, chosen: Sequence[int]
) -> tuple[NDArray[np.float64], int]:
    """(C, 11) the probes of the chosen cells, as `Light.probe`, and their bytes."""
    import numpy as np

    from ptmtools.light.baked import BakedSurfaces
    from ptmtools.light.probes import ProbeBaking, candidates

    scene, cells = run[SCENE], run[CELLS]
    rows = np.zeros((len(lit.pieces), 11))
    if not chosen:
        return rows, 0
    surfaces = BakedSurfaces.of_scene(
        scene,
        lit.pieces,
        lit.lights,
        lit.tint,
        lit.building.shine[scene.triangle_material],
        small_images(run),
        lit.unlit,
    )
    faces = np.flatnonzero(scene.opaque)
    baking = ProbeBaking(lit.building, surfaces, faces, scene.corners[faces])
    # Options that leave out levels of the model's images do not concern probes.
    levels = {"min_level": 0, "max_level": -1, "min_side": 1, "max_side": 0}
    shared = ProbedCells(baking, replace(run.recorded(TEXTURES), **levels))
    tasks = [(cell, candidates(cells, cell)) for cell in chosen]
    baked, _ = bake_textures(run, transaction, bake_probe, shared, tasks, "probes")
    for cell, (probe, _) in zip(chosen, baked, strict=True):
        rows[cell] = [probe.white, probe.mean, *probe.centre, *probe.low, *probe.high]
    return rows, sum(served for _, served in baked)


def small_images(artifacts: Artifacts) -> SmallImages:
    """Those of the scene: of each its finest level that is small enough, or every n-th texel of its
    coarsest."""
    import numpy as np

    from ptmtools.light.reflectance import SIDE, SmallImages
    from ptmtools.texture import reader
    from ptmtools.texture.samples import in_eight_bits

    db, result = artifacts.db, []
    for name in texture_files(image_digests(artifacts)):
        source = db.source(
            f"{SERVED}/{name}", artifacts.db.output(TEXTURES.name, f"{SERVED}/{name}")
        )
        with reader.open(source) as ptm:
            levels = ptm.header.levels
            small = [k for k, level in enumerate(levels) if max(level.width, level.height) <= SIDE]
            texels = in_eight_bits(ptm.level(small[-1] if small else 0))
        colors = texels[:, :, :3] if texels.shape[2] >= 3 else texels[:, :, [0, 0, 0]]
        step = math.ceil(max(colors.shape) / SIDE)
        result.append(np.ascontiguousarray(colors[::step, ::step]))
    return SmallImages.of_texels(result)
