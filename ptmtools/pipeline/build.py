"""Runs the stages: all of them from a model, or one stage of a database.

Stages run in the order of their table. While a stage of one thread runs, later ones whose inputs
are all known begin in the background. Meanwhile another process compiles the kernels that the
later stages need.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable
from contextlib import ExitStack
from typing import Any

from ptmtools.parallel import Workers
from ptmtools.pipeline.artifacts import Run
from ptmtools.pipeline.command import naming_command
from ptmtools.pipeline.records import StageReport
from ptmtools.pipeline.report import BuildReport, Visitor, peak_memory
from ptmtools.pipeline.stage import Options, Stage
from ptmtools.pipeline.stages import STAGES
from ptmtools.progress import Progress, silent
from ptmtools.store.layout import MANIFEST
from ptmtools.store.remote import folder_to_build, model_file
from ptmtools.store.writer import DatabaseWriter

PathLike = str | os.PathLike[str]
Tell = Callable[[StageReport], None]


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
    tell: Tell | None = None,
) -> BuildReport:
    """Builds a database, or brings it up to date: only stages run whose inputs, options or recipe
    have changed, and only the textures are encoded that have changed.

    Parameters
    ----------
    model, db: paths, or URLs such as ``s3://bucket/prefix``, see `ptmtools.store.remote`.
    options: of stages, such as ``IngestOptions(unit="cm")``; other stages have their defaults.
    until: the last stage to run; all by default.
    workers, scheduler: of the executor, see `open_executor`. They do not change the result.
    force: write into a foreign folder, or over the database of another model.
    rebuild: run every stage, also those that are current.
    tell: called with the report of each stage when it ends.

    Raises
    ------
    InputError, LimitError: the model is wrong, from `ingest` and the other stages.
    OutputError, DatabaseError: the database is wrong, from `DatabaseWriter`.
    """
    start = time.perf_counter()
    stages = list(STAGES.values())
    if until:
        stages = stages[: stages.index(until) + 1]
    chosen = chosen_options(options)
    with ExitStack() as stack:
        file, folder_url = stack.enter_context(model_file(model))
        if not file.is_file():
            from ptmtools.scene.ingestion import check_file

            check_file(file)
        folder, remote = stack.enter_context(folder_to_build(db, new=True, force=force))
        writer = stack.enter_context(DatabaseWriter.open_for_model(folder, file.name, force=force))
        used = stack.enter_context(Workers(workers, scheduler))
        run = Run(
            writer, used, progress, file, rebuild=rebuild, remote=remote, folder_url=folder_url
        )
        return _run(run, stages, chosen, start, tell)


def run_stage(
    db: PathLike,
    options: Options,
    *,
    workers: int = 0,
    scheduler: str | None = None,
    rebuild: bool = False,
    progress: Progress = silent,
    tell: Tell | None = None,
) -> BuildReport:
    """Runs the stage of a database whose options are given: ``PvsOptions()`` runs the visibility
    stage. The other parameters are those of `build_scene`."""
    start = time.perf_counter()
    chosen = chosen_options([options])
    stages = [stage for stage in STAGES.values() if isinstance(options, stage.options)]
    with ExitStack() as stack:
        folder, remote = stack.enter_context(folder_to_build(db))
        stack.enter_context(naming_command(folder))
        writer = stack.enter_context(DatabaseWriter.open_for_stage(folder))
        used = stack.enter_context(Workers(workers, scheduler))
        run = Run(writer, used, progress, rebuild=rebuild, remote=remote)
        return _run(run, stages, chosen, start, tell)


def chosen_options(options: Iterable[Options]) -> dict[Stage[Any], Options]:
    """The options of every stage: the given ones, and defaults.

    Raises TypeError for options of no stage, or two of the same stage.
    """
    given = list(options)
    chosen = {}
    for stage in STAGES.values():
        matching = [value for value in given if isinstance(value, stage.options)]
        if len(matching) > 1:
            raise TypeError(f"the {stage.name} stage is given options twice")
        chosen[stage] = matching[0] if matching else stage.options()
        given = [value for value in given if value not in matching]
    if given:
        raise TypeError(f"{given[0]!r} are the options of no stage")
    return chosen


def _run(
    run: Run,
    stages: list[Stage[Any]],
    options: dict[Stage[Any], Options],
    start: float,
    tell: Tell | None,
) -> BuildReport:
    done = run.db.manifest.stages
    run.writer.provisional = all(STAGES[name].joined for name in done if name in STAGES) and (
        bool(done) or not (run.db.path / MANIFEST).exists()
    )
    turns = [stage.turn(run, options[stage]) for stage in stages]
    shown = run.progress

    def progress(done: int, total: int, unit: str) -> None:
        for turn in turns:
            turn.raise_failure()
        shown(done, total, unit)

    run.progress = progress
    finished: set[Stage[Any]] = set()
    try:
        for i, turn in enumerate(turns):
            if turn.stage.one_thread and turn.planned()[1]:
                for later in turns[i + 1 :]:
                    if finished.issuperset(later.stage.sources(later.options)):
                        later.begin()
            reported = len(run.reports)
            turn.take()
            for report in run.reports[reported:]:
                if tell:
                    tell(report)
            finished.add(turn.stage)
            if i == 0:  # the model has been read
                for later in turns[1:]:
                    later.stage.check_model(run, later.options)
    except BaseException:
        with ExitStack() as abandoned:
            for turn in turns:
                abandoned.callback(turn.abandon)
        raise
    if run.remote:
        run.remote.commit()
    emitted = any("visit" in report.counts for report in run.reports)
    return BuildReport(
        model=run.db.manifest.model,
        database=run.remote.url if run.remote else str(run.db.path),
        stages=tuple(run.reports),
        seconds=time.perf_counter() - start,
        peak_memory=peak_memory(),
        peak_memory_of_workers=peak_memory(of_workers=True),
        visitor=Visitor.of(run.db.manifest) if emitted else None,
    )
