"""Running stages: all of them, from a model, or one.

Stages run in the order of their table. While one of a single thread has its turn, later ones for
which all is known that they read are begun in the background.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from ptmtools.ahead import Task, compile_ahead
from ptmtools.lazy import Lazy
from ptmtools.pipeline.background import Workers
from ptmtools.pipeline.command import naming_command
from ptmtools.pipeline.report import BuildReport, StageReport, peak_memory
from ptmtools.pipeline.run import Run
from ptmtools.pipeline.stage import Options, Stage
from ptmtools.pipeline.stages import EMIT, STAGES
from ptmtools.pipeline.visitor import Visitor
from ptmtools.progress import Progress, silent
from ptmtools.store.writer import DatabaseWriter

PathLike = str | os.PathLike[str]
Tell = Callable[[StageReport], None]

#: Calls the kernels of all stages.
WARM_UP: Task = Lazy("ptmtools.pipeline.warm_up:warm_up")


def _nothing(report: StageReport) -> None:
    """Tells nobody."""


def build_scene(
    model: PathLike,
    db: PathLike,
    *options: Options,
    until: Stage[Any] | None = None,
    workers: int = 0,
    scheduler: str | None = None,
    force: bool = False,
    rebuild: bool = False,
    progress: Progress = silent,
    tell: Tell = _nothing,
) -> BuildReport:
    """Builds a database, or brings it up to date: only stages whose inputs, options or recipe
    changed are run, and in the textures stage only what has changed itself.

    Parameters
    ----------
    options: of stages, such as ``IngestOptions(unit="cm")``; a stage without has its defaults.
    until: the last stage to run; all if not given.
    workers, scheduler: of the executor, see `open_executor`. They change nothing in the result.
    force: write into a folder that is not ours, or over the database of another model.
    rebuild: run every stage, whether or not it is current.
    tell: called with the report of each stage as soon as it is done.

    Raises
    ------
    InputError, LimitError: what is wrong with the model, from `ingest` and the other stages.
    OutputError, DatabaseError: what is wrong with the database, from `DatabaseWriter`.
    """
    start = time.perf_counter()
    if not Path(model).is_file():
        from ptmtools.scene.ingestion import check_file

        check_file(Path(model))
    stages = list(STAGES.values())
    if until:
        stages = stages[: stages.index(until) + 1]
    chosen = chosen_options(options)
    with (
        DatabaseWriter.open_for_model(db, Path(model).name, force=force) as writer,
        Workers(workers, scheduler) as used,
    ):
        run = Run(writer, used, progress, Path(model), rebuild=rebuild)
        return _run(run, stages, chosen, start, tell)


def run_stage(
    db: PathLike,
    options: Options,
    *,
    workers: int = 0,
    scheduler: str | None = None,
    rebuild: bool = False,
    progress: Progress = silent,
    tell: Tell = _nothing,
) -> BuildReport:
    """Runs one stage of a database, the one that these options are of: ``PvsOptions()`` runs the
    visibility stage. The others as for `build_scene`."""
    start = time.perf_counter()
    chosen = chosen_options([options])
    stages = [stage for stage in STAGES.values() if isinstance(options, stage.options)]
    with naming_command(db):
        opened = DatabaseWriter.open_for_stage(db)
    with opened as writer, Workers(workers, scheduler) as used:
        run = Run(writer, used, progress, rebuild=rebuild)
        return _run(run, stages, chosen, start, tell)


def chosen_options(given: Iterable[Options]) -> dict[Stage[Any], Options]:
    """The options of every stage: those given, and defaults.

    Raises TypeError if something is given that no stage has, or twice.
    """
    left = list(given)
    found = {}
    for stage in STAGES.values():
        mine = [options for options in left if isinstance(options, stage.options)]
        if len(mine) > 1:
            raise TypeError(f"the {stage.name} stage is given options twice")
        found[stage] = mine[0] if mine else stage.options()
        left = [options for options in left if options not in mine]
    if left:
        raise TypeError(f"{left[0]!r} are the options of no stage")
    return found


def _run(
    run: Run,
    stages: list[Stage[Any]],
    options: dict[Stage[Any], Options],
    start: float,
    tell: Tell,
) -> BuildReport:
    jobs = [stage.job.load()(run, stage, options[stage]) for stage in stages]
    shown = run.progress

    def progress(done: int, total: int, what: str) -> None:
        for job in jobs:
            job.check()
        shown(done, total, what)

    run.progress = progress
    finished: set[Stage[Any]] = set()
    ahead = run.workers.here > 1 and len(stages) == len(STAGES)
    try:
        for i, job in enumerate(jobs):
            if ahead and job.planned()[1]:
                compile_ahead(WARM_UP)
            if job.stage.one_thread and job.planned()[1]:
                for later in jobs[i + 1 :]:
                    if finished.issuperset(later.stage.sources(later.options)):
                        later.begin()
            told = len(run.reports)
            job.do()
            for report in run.reports[told:]:
                tell(report)
            finished.add(job.stage)
    except BaseException:
        with ExitStack() as abandoned:
            for job in jobs:
                abandoned.callback(job.abandon)
        raise
    return BuildReport(
        model=run.db.manifest.model,
        database=str(run.db.path),
        stages=tuple(run.reports),
        seconds=time.perf_counter() - start,
        peak_memory=peak_memory(),
        peak_memory_of_workers=peak_memory(of_workers=True),
        visitor=Visitor.of(run.db.manifest) if EMIT in finished else None,
    )
