"""The stages in their order: each one function, and `build_scene` all of them.

Reading and subdividing go together: nothing is committed before a model has proved to be one that
can be cut into cells. Textures depend on nothing that the stages between have to say, and cutting
is the work of one thread; so textures are encoded meanwhile by what workers there are besides.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ptmtools.executors.aside import Begin
from ptmtools.pipeline.beside import TexturesBeside
from ptmtools.pipeline.changes import reasons
from ptmtools.pipeline.emission import put_files
from ptmtools.pipeline.manifest import StageRecord
from ptmtools.pipeline.options import BuildOptions, TextureOptions
from ptmtools.pipeline.report import BuildReport, peak_memory
from ptmtools.pipeline.run import Run, work_of
from ptmtools.pipeline.scenes import put_scene
from ptmtools.pipeline.stages import arrays_of
from ptmtools.pipeline.textures import TextureStage
from ptmtools.pipeline.transaction import Transaction
from ptmtools.pipeline.workers import Workers
from ptmtools.pipeline.writer import DatabaseWriter
from ptmtools.progress import Progress, silent
from ptmtools.texture.options import check_options

if TYPE_CHECKING:
    from ptmtools.cells.options import SubdivideOptions
    from ptmtools.coverage.model import Ach
    from ptmtools.coverage.options import AchOptions
    from ptmtools.database.model import EmitOptions
    from ptmtools.scene.options import IngestOptions
    from ptmtools.visibility.options import PvsOptions

PathLike = str | os.PathLike[str]

#: Above this share of cells visible on average, culling by cells does not pay.
CULLING_GAINS_LITTLE = 0.7
#: So many triangles take as long to subdivide as two processes to start.
LARGE = 4000


def build_scene(
    model: PathLike, db: PathLike, options: BuildOptions | None = None, progress: Progress = silent
) -> BuildReport:
    """Builds a database, or brings it up to date: only stages whose inputs, options or recipe
    changed are run, and in the textures stage only what has changed itself.

    Raises
    ------
    InputError, LimitError: what is wrong with the model, from `ingest` and the other stages.
    OutputError, DatabaseError: what is wrong with the database, from `DatabaseWriter`.
    """
    options = options or BuildOptions()
    start = time.perf_counter()
    check_options(options.textures)
    with (
        DatabaseWriter.open_for_model(db, Path(model).name, force=options.force) as writer,
        Workers(options.workers, options.scheduler) as workers,
    ):
        run = Run(writer, progress)
        with TexturesBeside(run, options.textures, workers) as textures:
            _read_and_cut(
                run, Path(model), options.ingest, options.subdivide, workers, textures.begin
            )
            _look(run, options.pvs, workers)
            _sample(run, options.ach, workers)
            textures.finish()
        put_files(run, options.emit)
        return _closing(run, start)


def make_cells(
    model: PathLike,
    db: PathLike,
    ingest_options: IngestOptions | None = None,
    subdivide_options: SubdivideOptions | None = None,
    workers: int = 0,
    *,
    force: bool = False,
    progress: Progress = silent,
) -> BuildReport:
    """Reads a model and cuts it into cells: the first two stages of a database. ``workers`` decode
    images."""
    start = time.perf_counter()
    options = BuildOptions()
    with (
        DatabaseWriter.open_for_model(db, Path(model).name, force=force) as writer,
        Workers(workers, None) as local,
    ):
        run = Run(writer, progress)
        read, cut = ingest_options or options.ingest, subdivide_options or options.subdivide
        _read_and_cut(run, Path(model), read, cut, local, lambda _, large: local.aside(large))
        return _closing(run, start)


def make_pvs(
    db: PathLike,
    options: PvsOptions | None = None,
    workers: int = 0,
    progress: Progress = silent,
    scheduler: str | None = None,
) -> BuildReport:
    """Runs the visibility stage of a database; ``workers`` and ``scheduler`` as in
    `BuildOptions`."""
    asked = options or BuildOptions().pvs
    return _one_stage(db, workers, scheduler, progress, lambda run, w: _look(run, asked, w))


def make_ach(
    db: PathLike,
    options: AchOptions | None = None,
    workers: int = 0,
    progress: Progress = silent,
    scheduler: str | None = None,
) -> BuildReport:
    """Runs the coverage stage of a database; ``workers`` and ``scheduler`` as in
    `BuildOptions`."""
    asked = options or BuildOptions().ach
    return _one_stage(db, workers, scheduler, progress, lambda run, w: _sample(run, asked, w))


def make_textures(
    db: PathLike,
    options: TextureOptions | None = None,
    workers: int = 0,
    progress: Progress = silent,
    scheduler: str | None = None,
) -> BuildReport:
    """Runs the textures stage of a database; ``workers`` and ``scheduler`` as in
    `BuildOptions`."""

    def encode(run: Run, workers: Workers) -> None:
        stage = TextureStage(run, options or TextureOptions())
        stage.begin()
        if stage.left:
            stage.encode(workers.executor())
        stage.commit()

    return _one_stage(db, workers, scheduler, progress, encode)


def make_files(
    db: PathLike, options: EmitOptions | None = None, progress: Progress = silent
) -> BuildReport:
    """Writes the served files of a database."""
    asked = options or BuildOptions().emit
    return _one_stage(db, 1, None, progress, lambda run, _: put_files(run, asked))


def _one_stage(
    db: PathLike,
    workers: int,
    scheduler: str | None,
    progress: Progress,
    stage: Callable[[Run, Workers], None],
) -> BuildReport:
    start = time.perf_counter()
    with DatabaseWriter.open_for_stage(db) as writer, Workers(workers, scheduler) as used:
        run = Run(writer, progress)
        stage(run, used)
        return _closing(run, start)


def _closing(run: Run, start: float) -> BuildReport:
    return BuildReport(
        model=run.db.manifest.model,
        database=str(run.db.path),
        stages=run.reports,
        seconds=time.perf_counter() - start,
        peak_memory=peak_memory(),
        peak_memory_of_workers=peak_memory(of_workers=True),
    )


def _read_and_cut(
    run: Run,
    model: Path,
    ingest_options: IngestOptions,
    subdivide_options: SubdivideOptions,
    workers: Workers,
    read: Callable[[bool, bool], Begin[Any, Any, Any]],
) -> None:
    """The scene and the cells: one transaction, unless the scene is what it was. ``read`` is called
    in between, told whether cells are to be cut and whether the model is large, and says how a task
    is begun beside."""
    start = time.perf_counter()
    transaction = run.writer.begin("scene")
    scene, why_scene = put_scene(run, transaction, model, ingest_options, workers.here)
    records = {"scene": scene} if why_scene else {}
    middle = time.perf_counter()
    inputs = {arrays_of("scene"): scene.outputs[arrays_of("scene")]}
    work = work_of("cells", subdivide_options, inputs)
    why_cells = reasons(run.db.manifest.stages.get("cells"), work, run.db)
    begin = read(bool(why_cells), int(scene.counts["triangles"]) >= LARGE)
    if why_cells:
        records["cells"] = _cut(run, transaction, work, subdivide_options, begin)
    if records:
        transaction.commit(records)
    run.report("scene", why_scene, start, middle)
    run.report("cells", why_cells, middle)


def _cut(
    run: Run,
    transaction: Transaction,
    work: StageRecord,
    options: SubdivideOptions,
    begin: Begin[Any, Any, Any],
) -> StageRecord:
    from ptmtools.cells import subdivide

    cells = subdivide(run.scene, options, run.progress, begin)
    run.hold("cells", cells)
    return replace(
        work,
        outputs=transaction.put_arrays("cells", cells.to_arrays()),
        counts={
            "cells": cells.cell_count,
            "leaves": cells.leaf_count,
            "portals": cells.portal_count,
            "pieces": len(cells.triangle),
            "closed": cells.closed,
        },
        notes=cells.notes,
    )


def _look(run: Run, options: PvsOptions, workers: Workers) -> None:
    def compute(transaction: Transaction) -> tuple[Mapping[str, Any], tuple[str, ...]]:
        from ptmtools.visibility import compute_pvs

        pvs = compute_pvs(run.cells, options, run.progress, workers.executor())
        run.hold("pvs", pvs)
        transaction.put_arrays("pvs", pvs.to_arrays())
        share = pvs.average_share
        notes = []
        if (
            share > CULLING_GAINS_LITTLE and pvs.cell_count > 1
        ):  # of one, the cells stage has said it
            notes.append(
                f"culling by visibility gains little here: on average a cell sees "
                f"{share:.0%} of all cells, as in a single hall"
            )
        if not pvs.conservative:
            notes.append(
                "the visible sets are of what random lines showed: a client that loads by them "
                "will show holes (`--pvs full` or `fast` for use)"
            )
        if pvs.fallbacks:
            notes.append(
                f"the search was cut short at {pvs.fallbacks:,} portals; "
                "their sets are larger than need be, never smaller"
            )
        figures = {
            "average_share": share,
            "fallbacks": pvs.fallbacks,
            "ties": int(pvs.ties.sum()),
            "decided_exactly": int(pvs.decided.sum()),
            "opened": int(pvs.opened.sum()),
            "leaks": len(pvs.leak),
        }
        return figures | {"conservative": pvs.conservative}, tuple(notes)

    run.stage("pvs", options, compute)


def _sample(run: Run, options: AchOptions, workers: Workers) -> None:
    def compute(transaction: Transaction) -> tuple[Mapping[str, Any], tuple[str, ...]]:
        import numpy as np

        from ptmtools.coverage.ach import compute_ach

        given = run.scene, run.cells, run.pvs, options
        ach = compute_ach(*given, run.progress, workers.executor())
        run.hold("ach", ach)
        transaction.put_arrays("ach", ach.to_arrays())
        notes = _coverage_notes(ach, options)
        known = bool(np.isfinite(ach.uncertain).any())
        return {
            "backend": ach.backend,
            "renderer": ach.renderer,
            "samples": int(ach.samples.sum()),
            "rejected": int(ach.rejected.sum()),
            "most_missed": float(ach.missed.max(initial=0.0)),
            "mean_uncertain": float(np.nanmean(ach.uncertain)) if known else None,
        }, notes

    run.stage("ach", options, compute)


def _coverage_notes(ach: Ach, options: AchOptions) -> tuple[str, ...]:
    notes = []
    if blind := int((ach.samples == 0).sum()):
        notes.append(f"no sample point was found in {blind:,} cells")
    if options.tolerance is not None:
        short = int((~(ach.uncertain <= options.tolerance)).sum())
        if short:
            notes.append(
                f"{short:,} cells did not reach the tolerance of {options.tolerance:g} "
                f"with {options.points:,} sample points (`--samples`); their `uncertain` says how "
                "near they came"
            )
    return tuple(notes)
