"""Running stages: all of them, from a model, or one.

Stages run in the order of their table. While one of a single thread has its turn, later ones for
which all is known that they read are begun in the background.

What a database means for a visitor, beside the model that it was made of; from what its stages
have recorded.

What a build would do, and why, without doing it."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from ptmtools.ahead import Task, compile_ahead
from ptmtools.lazy import Lazy
from ptmtools.parallel import Workers
from ptmtools.pipeline.command import naming_command
from ptmtools.pipeline.report import BuildReport, StageReport, peak_memory
from ptmtools.pipeline.stage import Artifacts, Run, reasons, work_of
from ptmtools.pipeline.stage import Options, Stage
from ptmtools.pipeline.stages import EMIT, SCENE, STAGES
from ptmtools.progress import Progress, silent
from ptmtools.quantities import size
from ptmtools.store.folder import DatabaseFolder
from ptmtools.store.manifest import Manifest
from ptmtools.store.writer import DatabaseWriter, admitted

#: What takes at least this many times the bytes of the model is called heavier.
HEAVIER = 1.05


@dataclass(frozen=True)
class Visitor:
    """
    Attributes
    ----------
    model: bytes of the model's files but for its images; None where they were not recorded.
    images: bytes of the files of its images, not of those inside the model's; likewise.
    visit: the fields of `ptmtools.output.model.Visit`.
    """

    model: int | None
    images: int | None
    visit: Mapping[str, Any]

    @staticmethod
    def of(manifest: Manifest) -> Visitor | None:
        """Of what a manifest says; None if nothing is served, or by an earlier release."""
        emitted, read = manifest.stages.get(EMIT.name), manifest.stages.get(SCENE.name)
        visit = emitted.counts.get("visit") if emitted else None
        if not isinstance(visit, Mapping):
            return None
        counts = read.counts if read else {}
        return Visitor(counts.get("model_bytes"), counts.get("image_bytes"), visit)

    def lines(self) -> list[str]:
        """What there is to say, a line each; of a manifest that makes no sense nothing."""
        try:
            return self._lines()
        except (ArithmeticError, LookupError, TypeError, ValueError):
            return []

    def _lines(self) -> list[str]:
        visit, whole = self.visit, None
        lines = []
        if self.model is not None and self.images is not None:
            whole = self.model + self.images
            parts = f" ({size(self.model)}, and {size(self.images)} of image files)"
            lines.append(f"the model as it was: {size(whole)}{parts if self.images else ''}")

        def told(count: int) -> str:
            heavier = whole and count > HEAVIER * whole
            return size(count) + (", heavier than the model" if heavier else "")

        if visit["browser"] is not None:
            lines.append(f"a VRML browser fetches {told(visit['browser'])}")
        lines.append(f"the first room is complete after {told(visit['first_room'])}")
        for what, when in (("mean", "on average"), ("most", "at most")):
            shares = f"{visit[f'{what}_volume']:.1%} of the volume"
            if visit[f"{what}_texels"] is not None:
                shares += f" and {visit[f'{what}_texels']:.1%} of the texels"
            held = told(visit[f"{what}_at_hand"])
            lines.append(f"at hand {when} {shares}: {held}")
        return lines


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


Plan = Literal["current", "run", "maybe"]


@dataclass(frozen=True)
class StagePlan:
    """What would become of a stage.

    Attributes
    ----------
    stage: its name.
    plan: "current": nothing; "run"; "maybe": it would run if a stage before it makes other files
        than there are.
    reasons: why, one line each.
    textures: of the stage of this name, those that would be encoded, as far as is known.
    """

    stage: str
    plan: Plan
    reasons: tuple[str, ...] = ()
    textures: tuple[str, ...] = ()


def plan_build(
    model: str | os.PathLike[str],
    db: str | os.PathLike[str],
    *options: Options,
    force: bool = False,
) -> tuple[StagePlan, ...]:
    """The stages in their order, and what `build_scene` would do with each. Nothing is written.

    Raises what `build_scene` raises for a model that is not there, impossible options, and a
    folder that is not this model's database.
    """
    from ptmtools.scene.ingestion import check_file

    chosen = chosen_options(options)
    check_file(Path(model))
    folder = Path(db)
    artifacts = Artifacts(
        DatabaseFolder(folder, admitted(folder, Path(model).name, force=force)), Path(model)
    )
    #: Stages of which others may read something else than there is.
    changing: set[Stage[Any]] = set()
    plans = tuple(_plan(artifacts, stage, chosen[stage], changing) for stage in STAGES.values())
    artifacts.db.digests.save()
    return plans


def _outputs(artifacts: Artifacts, stage: Stage[Any]) -> Mapping[str, str]:
    record = artifacts.before(stage)
    return record.outputs if record else {}


def _plan(
    artifacts: Artifacts, stage: Stage[Any], options: Options, changing: set[Stage[Any]]
) -> StagePlan:
    """Of a stage, after those that it reads; it is added to those ``changing`` where it is one."""
    before = artifacts.before(stage)
    anew = [read.name for read in stage.sources(options) if read in changing]
    # What it would do, of the files as they are.
    inputs: dict[str, str] = {}
    if not stage.inputs:
        inputs |= stage.files_read(options, lambda read: _outputs(artifacts, read))
    elif not anew:
        inputs |= stage.inputs.load()(artifacts, options)
    elif before:
        inputs |= before.inputs
    work = work_of(stage, options, inputs)
    why = reasons(before, work, artifacts.db, stage.changed)
    tasks = stage.tasks.load()(artifacts, work) if stage.tasks else []
    plan: Plan = "run" if why else "maybe" if anew else "current"
    if plan == "maybe":
        why = (f"if {' or '.join(anew)} makes other files than there are",)
    known = plan == "run" and stage.foresee and stage.foresee.load()(artifacts, work)
    if plan != "current" and not known:
        changing.add(stage)
    return StagePlan(stage.name, plan, why, tuple(Path(name).stem for name in tasks))
