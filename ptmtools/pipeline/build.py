"""The stages in their order: each one function, and `build_scene` all of them.

Reading and subdividing go together: nothing is committed before a model has proved to be one that
can be cut into cells. Textures depend on nothing that the stages between have to say, and cutting
is the work of one thread; so textures are encoded meanwhile by what workers there are besides.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING, Any

from ptmtools.executors.aside import Aside, Begin, asked
from ptmtools.executors.local import Local
from ptmtools.executors.model import Executor
from ptmtools.executors.opening import open_executor, processors
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
#: So many textures are worth starting a process, which takes a second.
WORTH_A_PROCESS = 8
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
        _Workers(options.workers, options.scheduler) as workers,
    ):
        run = Run(writer, progress)
        with _Beside(run, options.textures, workers) as textures:
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
        _Workers(workers, None) as local,
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

    def encode(run: Run, workers: _Workers) -> None:
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
    stage: Callable[[Run, _Workers], None],
) -> BuildReport:
    start = time.perf_counter()
    with DatabaseWriter.open_for_stage(db) as writer, _Workers(workers, scheduler) as used:
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


class _Workers:
    """Executors as the user wants them, opened when there is first something to do."""

    def __init__(self, workers: int, scheduler: str | None) -> None:
        self._asked = workers, scheduler
        self._opened: Executor | None = None

    @property
    def here(self) -> int:
        """How many threads of this machine may be used."""
        workers, scheduler = self._asked
        return processors() if scheduler else workers or processors()

    @property
    def one_spare(self) -> bool:
        """Whether what is done `aside` and textures must take turns."""
        return self._asked[1] is None and self.here == 2

    def executor(self) -> Executor:
        """The one of this thread."""
        if self._opened is None:
            self._opened = open_executor(*self._asked)
        return self._opened

    def aside(
        self, worthwhile: bool, ended: Callable[[], object] = lambda: None
    ) -> Begin[Any, Any, Any]:
        """How a task is begun beside this thread, if there is a worker for it; ``ended`` is called
        when that is free again."""
        if self.here == 1 or not worthwhile:
            ended()
            return asked
        return lambda function, shared, task: Aside(function, shared, task, ended)

    def beside(self, textures: int) -> Executor | None:
        """Who encodes so many textures while this thread keeps the interpreter's lock, and `aside`
        one worker: others, if it is worth while, to be closed after use."""
        workers, scheduler = self._asked
        if textures < WORTH_A_PROCESS or (self.here == 1 and not scheduler):
            return None
        if scheduler:
            return open_executor(workers, scheduler)
        return Local(min(max(1, self.here - 2), textures // WORTH_A_PROCESS), threads=False)

    def __enter__(self) -> _Workers:
        return self

    def __exit__(self, *_: object) -> None:
        if self._opened is not None:
            self._opened.close()


class _Beside:
    """The textures stage, done by another thread while this one runs other stages."""

    def __init__(self, run: Run, options: TextureOptions, workers: _Workers) -> None:
        self._run = run
        self._options = options
        self._workers = workers
        self._stage: TextureStage | None = None
        self._stop, self._free = Event(), Event()
        self._pool = ThreadPoolExecutor(1, "textures")
        self._executor: Executor | None = None
        self._task: Future[None] | None = None
        self._progress = run.progress

    def begin(self, cutting: bool, large: bool) -> Begin[Any, Any, Any]:
        """To be called when the scene's images are known, and whether cells are cut next, of a
        ``large`` model; returns how a task is to be begun beside the thread that cuts them."""
        stage = self._stage = TextureStage(self._run, self._options)
        stage.begin()
        self._executor = self._workers.beside(stage.left) if cutting else None
        if self._executor:
            self._task = self._pool.submit(self._encode, stage, self._executor)
        if not self._workers.one_spare:
            self._free.set()
        return self._workers.aside(large, self._free.set)

    def _watched(self, done: int, total: int, what: str) -> None:
        """`Progress` that raises what has gone wrong so far."""
        if self._task is not None and self._task.done():
            self._task.result()
        self._progress(done, total, what)

    def finish(self) -> None:
        """Encodes with all workers what is left, and commits."""
        assert self._stage is not None
        if self._task is not None:
            self._end()
            self._task.result()
        if self._stage.left:
            self._stage.encode(self._workers.executor())
        self._stage.commit()

    def _encode(self, stage: TextureStage, executor: Executor) -> None:
        self._free.wait()
        with executor:
            stage.encode(executor, self._stop)

    def _end(self) -> None:
        self._stop.set()
        self._free.set()

    def __enter__(self) -> _Beside:
        self._run.progress = self._watched
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._run.progress = self._progress
        self._end()
        if kind is not None and self._executor:
            self._executor.close()  # whoever waits for one of its tasks waits no longer
        self._pool.shutdown()


def _read_and_cut(
    run: Run,
    model: Path,
    ingest_options: IngestOptions,
    subdivide_options: SubdivideOptions,
    workers: _Workers,
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


def _look(run: Run, options: PvsOptions, workers: _Workers) -> None:
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


def _sample(run: Run, options: AchOptions, workers: _Workers) -> None:
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
