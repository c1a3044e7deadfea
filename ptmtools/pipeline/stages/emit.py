"""Writes the served files from all artifacts (paper §6)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from ptmtools import plugins
from ptmtools.output.options import EmitOptions
from ptmtools.pipeline.artifacts import Artifacts, Run
from ptmtools.pipeline.encoding import (
    OBJECTS_AHEAD,
    fallback_image,
    preview_file,
    stem_of,
)
from ptmtools.pipeline.stage import Counts, Stage, complete
from ptmtools.pipeline.stages.ach import ACH
from ptmtools.pipeline.stages.cells import CELLS
from ptmtools.pipeline.stages.light import LIGHT, lightmap_files
from ptmtools.pipeline.stages.probes import probe_files
from ptmtools.pipeline.stages.pvs import PVS
from ptmtools.pipeline.stages.scene import SCENE, image_digests
from ptmtools.pipeline.stages.textures import TEXTURES, stored_texture, texture_files
from ptmtools.quantities import count, size
from ptmtools.store.layout import SERVED

if TYPE_CHECKING:
    from ptmtools.coverage.required_levels import Need
    from ptmtools.light.model import Light
    from ptmtools.output.model import TextureRecord
    from ptmtools.output.representation import Represented
    from ptmtools.scene.model import Scene
    from ptmtools.store.manifest import StageRecord
    from ptmtools.store.transaction import Transaction
    from ptmtools.texture.sources import PtmSource


def texture_records(run: Artifacts) -> tuple[TextureRecord, ...]:
    """The textures of the scene's images, for the served files."""
    files = texture_files(image_digests(run))
    return read_records(run, TEXTURES, ((name, {"image": i}) for i, name in enumerate(files)))


def light_records(run: Artifacts, light: Light | None) -> tuple[TextureRecord, ...]:
    """The lightmaps and the probes of the cells, for the served files."""
    files = {"cell": lightmap_files(light), "probe": probe_files(light)}
    rows = (
        (name, {"image": -1, kind: cell})
        for kind, names in files.items()
        for cell, name in names.items()
    )
    return read_records(run, LIGHT, rows)


def representing() -> tuple[Stage[Any], ...]:
    """The stages of other packages that add representations of objects."""
    declared = plugins.declarations("stages", Stage).values()
    return tuple(stage for stage in declared if stage.represents)


def _need(
    run: Run, options: EmitOptions, scene: Scene, textures: Mapping[int, TextureRecord]
) -> Need | None:
    """The required levels of the textures of a scene's images, if the options ask for them."""
    if not options.need:
        return None
    from ptmtools.coverage.required_levels import TextureSize, compute_need

    sizes = {image: TextureSize(*t.finest, t.level_count) for image, t in textures.items()}
    return compute_need(scene, run[CELLS], run[PVS], sizes, options.need, run.progress)


def _representations(run: Artifacts) -> Iterator[Represented]:
    for stage in representing():
        if represented := stage.represented(run):
            yield represented


def read_records(
    run: Artifacts, stage: Stage[Any], files: Iterable[tuple[str, Mapping[str, int]]]
) -> tuple[TextureRecord, ...]:
    """The textures that a stage has encoded: the `.ptm` of each, and its image, cell or object."""
    from ptmtools.output import TextureRecord
    from ptmtools.output.model import PreviewRecord
    from ptmtools.parallel import map_in_order

    db, outputs, options = run.db, run.outputs(stage), run.recorded(TEXTURES)

    def read(name: str) -> bytes:
        return db.read_output(stage.name, name)

    def source(name: str) -> PtmSource:
        return db.source(name, db.output(stage.name, name))

    def one(file: tuple[str, Mapping[str, int]]) -> TextureRecord:
        name, owner = file
        texture = stored_texture(run, name, source, read)
        header, steps, stem = texture.header, texture.steps, stem_of(name)
        png, fallback = f"{name.removesuffix('ptm')}png", None
        level, shared = fallback_image(steps, header, options.fallback_size)
        if f"{SERVED}/{png}" in outputs:
            fallback = png
        elif options.fallback and shared:
            fallback = preview_file(stem, shared)
        served = f"{SERVED}/{fallback}"
        return TextureRecord(
            file=name,
            fallback=fallback,
            width=header.levels[-1].width,
            height=header.levels[-1].height,
            components=header.components,
            levels=header.levels,
            sha256=db.output(stage.name, f"{SERVED}/{name}"),
            fallback_level=level if fallback else None,
            fallback_bytes=db.size(served, db.output(stage.name, served)) if fallback else 0,
            detail=steps.detail,
            stored=source(f"{SERVED}/{name}"),
            errors=steps.errors,
            previews=tuple(
                PreviewRecord(file, preview, source(f"{SERVED}/{file}"))
                for preview in steps.previews
                for file in (preview_file(stem, preview),)
            ),
            **owner,
        )

    return tuple(map_in_order(one, files, OBJECTS_AHEAD))


class EmitStage(Stage[None]):
    """Writes the served files."""

    name = "emit"
    about = "Write the served files: cells and hints."
    recipe = 19
    changed = "walks begin on the storey at the ground, and on the main floor of rooms"
    options = EmitOptions

    def read_with(self, options: EmitOptions) -> tuple[Stage[Any], ...]:
        return (SCENE, CELLS, PVS, ACH, TEXTURES, *representing(), LIGHT)

    def inputs(self, artifacts: Artifacts, options: EmitOptions) -> dict[str, str]:
        return artifacts.files_of(self.sources(options), (LIGHT, *representing()))

    def make(
        self, run: Run, options: EmitOptions, transaction: Transaction, work: StageRecord
    ) -> StageRecord:
        """Raises as `ptmtools.output.emit`."""
        from ptmtools.output import EmitExtras, emit
        from ptmtools.output.representation import object_maps

        light, scene = run.stored(LIGHT), run[SCENE]
        images = texture_records(run)
        represented = tuple(_representations(run))
        maps = tuple(texture for kind in represented for texture in kind.textures)
        places = object_maps(represented)
        textures = (*images, *light_records(run, light), *maps)
        extras = EmitExtras(
            light=light,
            represented=represented,
            need=_need(run, options, scene, {record.image: record for record in images}),
            map_need=_need(run, options, places.scene_with_maps(scene), dict(enumerate(maps)))
            if places
            else None,
            force=True,
            progress=run.progress,
            workers=run.workers.executor.workers,
        )
        report = emit(
            scene,
            run[CELLS],
            run[PVS],
            run[ACH],
            textures,
            transaction.subfolder(SERVED),
            options,
            extras,
        )
        for name in report.files:
            transaction.take(f"{SERVED}/{name}", transaction.folder / SERVED / name)
        counts = {
            "files": len(report.files),
            "bytes": report.bytes,
            "shapes": report.shapes,
            "triangles": report.triangles,
            "visible": run[CELLS].visible,
            "owners": run[CELLS].owners,
            "collapsed": report.collapsed,
            "viewpoints": len(report.viewpoints),
            "visit": asdict(report.visit),
        }
        return complete(work, counts, report.notes)

    def summary(self, n: Counts) -> str:
        return (
            f"{count(n['files'], 'file')}, {size(n['bytes'])}; "
            f"{count(n['triangles'], 'triangle')} in all cells, from {n['visible']:,} of the model "
            f"({n['owners']:,} if none were cut at cell boundaries), "
            f"{count(n['viewpoints'], 'viewpoint')}"
        )


EMIT = EmitStage()
