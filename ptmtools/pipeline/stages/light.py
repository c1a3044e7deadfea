"""Bakes the light of the building: a lightmap for each cell, encoded as a texture.

Without ``--light bake`` this stage writes nothing. Lightmaps are encoded with the options of the
textures, and clients fetch them like textures.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ptmtools.lazy import Lazy, component
from ptmtools.light.options import LightOptions
from ptmtools.output.names import cell_name
from ptmtools.pipeline.encoding import ImageFile, TextureOptions, encoded_image, ptm_file
from ptmtools.pipeline.stage import Artifacts, Job, Run, Stage, described
from ptmtools.pipeline.stages.apo import APO, replaced_objects
from ptmtools.pipeline.stages.cells import CELLS
from ptmtools.pipeline.stages.textures import TEXTURES
from ptmtools.quantities import count, size

if TYPE_CHECKING:
    from ptmtools.cells.model import Cells
    from ptmtools.light.cells import Baking, CellLight, Piece
    from ptmtools.light.model import Light
    from ptmtools.store.manifest import StageRecord
    from ptmtools.store.transaction import Transaction


@dataclass(frozen=True)
class LitCells:
    """The shared input of all tasks."""

    baking: Baking
    options: TextureOptions


def lit(shared: LitCells, task: tuple[int, Piece]) -> tuple[CellLight, list[tuple[str, bytes]]]:
    """The light of a cell, and the files of its lightmap as `encoded_image` returns them; none
    without one."""
    from ptmtools.texture.images import png_bytes

    cell, piece = task
    light = shared.baking.light(piece)
    if light.texels is None:
        return light, []
    return light, encoded_image(
        shared.options, ImageFile(f"{lightmap_stem(cell)}.png", png_bytes(light.texels[:, :, None]))
    )


def lightmap_stem(cell: int) -> str:
    """The stem of the files of a lightmap; no image of a model has such a name."""
    return f"light~{cell_name(cell)}"


class LightJob(Job):
    """Bakes the light of all cells."""

    def __init__(self, run: Run, stage: Stage[Light], options: LightOptions) -> None:
        """Raises MissingComponentError: PTM-M100 xatlas is not installed."""
        super().__init__(run, stage, options)
        if options.light != "none":
            component("xatlas", "PTM-M100", "baking lightmaps needs xatlas", "light")

    def make(self, transaction: Transaction, work: StageRecord) -> StageRecord:
        """See `Job.make`."""
        if self.options.light == "none":
            return described(work, {"lightmaps": 0}, ())
        import numpy as np

        from ptmtools.light.cells import Baking
        from ptmtools.light.model import Light
        from ptmtools.light.occlusion import Surroundings
        from ptmtools.output.content import Geometry
        from ptmtools.output.pieces import pieces_of

        run = self.run
        scene, cells = run[APO], run[CELLS]
        glass = np.array([m.opacity < 1 and m.image < 0 for m in scene.materials], np.bool_)
        texel = 1 / self.options.light_density
        pieces = pieces_of(Geometry(scene, cells), cells, glass, texel, replaced_objects(run))
        shared = LitCells(Baking(Surroundings.of(scene), self.options), run.recorded(TEXTURES))
        lights: list[CellLight] = []
        total = 0
        tasks = run.workers.executor.each(lit, shared, enumerate(pieces))
        for cell, (light, files) in enumerate(tasks):
            run.progress(cell, len(pieces), "light")
            lights.append(light)
            for name, data in files:
                transaction.put(name, data)
            total += len(files[0][1]) if files else 0
        run.progress(len(pieces), len(pieces), "light")
        artifact = Light(
            np.array([0 if k.texels is None else len(k.texels) for k in lights], np.int32),
            np.concatenate([light.mapped for light in lights]),
            np.concatenate([light.uv for light in lights]),
            np.concatenate([light.vertex for light in lights]),
        )
        run.keep(LIGHT, artifact)
        transaction.put_arrays(LIGHT.name, artifact.to_arrays())
        crowded = sum(light.crowded for light in lights)
        return described(work, {**_counts(artifact), "ptm_bytes": total}, _notes(crowded))


def _notes(crowded: int) -> Iterator[str]:
    if crowded:
        yield (
            f"the lightmaps of {count(crowded, 'cell')} have too many parts to keep them all "
            "apart; neighbours there run into each other (--light-density)"
        )


def lightmap_files(light: Light | None) -> dict[int, str]:
    """Cell → `.ptm` of its lightmap, relative to the served folder."""
    sides = [] if light is None else light.side.tolist()
    return {cell: ptm_file(lightmap_stem(cell)) for cell, side in enumerate(sides) if side}


def _reads(options: LightOptions) -> tuple[Stage[Any], ...]:
    return () if options.light == "none" else (APO, CELLS)


def _inputs(artifacts: Artifacts, options: LightOptions) -> dict[str, str]:
    """See `Stage.inputs`."""
    if options.light == "none":
        return {}
    return artifacts.files_of(LIGHT.sources(options)) | artifacts.choices(LIGHT)


def _counts(light: Light) -> Mapping[str, Any]:
    return {
        "lightmaps": int((light.side > 0).sum()),
        "texels": int((light.side.astype("int64") ** 2).sum()),
    }


def _summary(n: Mapping[str, Any]) -> str:
    if not n["lightmaps"]:
        return "no light"
    return (
        f"{count(n['lightmaps'], 'lightmap')} of {count(n['texels'], 'texel')}, "
        f"{size(n['ptm_bytes'])}"
    )


def _fits_cells(light: Light, cells: Cells) -> str:
    return "" if len(light.side) == cells.cell_count else "the light belongs to other cells"


LIGHT: Stage[Light] = Stage(
    name="light",
    about="Bake the light of the surfaces into lightmaps.",
    recipe=1,
    options=LightOptions,
    reads=_reads,
    inputs=_inputs,
    heeds=(TEXTURES,),
    artifact=Lazy("ptmtools.light.model:Light"),
    counts=_counts,
    summary=_summary,
    fits={CELLS: _fits_cells},
    job=LightJob,
    optional=True,
)
