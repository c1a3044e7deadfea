"""One run over a database: its artifacts, read once, and the record of what each stage did.

Why a stage has to be run: its options or inputs have changed, or an output is gone."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeVar, cast

from ptmtools.diagnostics import warnings_in
from ptmtools.errors import DatabaseError, naming
from ptmtools.pipeline.command import build_command, naming_command
from ptmtools.pipeline.report import StageReport
from ptmtools.pipeline.stage import Options, Stage, parameters
from ptmtools.progress import Progress, silent
from ptmtools.store.folder import DatabaseFolder, damaged
from ptmtools.store.layout import MANIFEST, arrays_of
from ptmtools.store.manifest import SCHEMA, StageRecord, damaged_manifest
from ptmtools.store.transaction import Transaction
from ptmtools.store.writer import DatabaseWriter

if TYPE_CHECKING:
    from pathlib import Path

    from ptmtools.parallel import Workers


#: Files that are named one by one.
_NAMED = 3
#: Why a stage is run for the first time.
NEVER_RUN = ("has not been run",)


def reasons(
    before: StageRecord | None, work: StageRecord, db: DatabaseFolder, changed: str = ""
) -> tuple[str, ...]:
    """What makes a stage with this record do ``work``; empty if it is current. ``changed`` is what
    its recipe has changed."""
    if before is None:
        earlier = db.manifest.replaced
        if earlier is None:
            return NEVER_RUN
        return (f"the database has schema {earlier}, this ptmtools writes {SCHEMA}",)
    found = []
    if before.recipe != work.recipe:
        what = f": {changed}" if changed and before.recipe < work.recipe else ""
        found.append(f"this ptmtools computes it differently (recipe {before.recipe} before){what}")
    names = [*before.parameters, *(n for n in work.parameters if n not in before.parameters)]
    for name in names:
        old, new = before.parameters.get(name), work.parameters.get(name)
        both = name in before.parameters and name in work.parameters
        if old != new and (both or before.recipe == work.recipe):
            found.append(f"{name.replace('_', ' ')}: {_text(old)} → {_text(new)}")
    options = bool(found)
    for what, files in _changed(before.inputs, work.inputs).items():
        # What it does not read any more because of its options says nothing beside them.
        if files and not (options and what == "removed"):
            found.append(f"{_listed(files)} {what}")
    if not found and (lost := db.damaged(before.outputs)):
        found.append(f"{lost} is missing or damaged")
    return tuple(found)


def _changed(before: Mapping[str, str], after: Mapping[str, str]) -> dict[str, list[str]]:
    both = [n for n in after if n in before and after[n] != before[n]]
    return {
        "changed": [n for n in both if before[n] and after[n]],
        "added": [n for n in both if not before[n]] + [n for n in after if n not in before],
        "removed": [n for n in both if not after[n]] + [n for n in before if n not in after],
    }


def _listed(files: list[str]) -> str:
    more = f" and {len(files) - _NAMED:,} more" if len(files) > _NAMED else ""
    return ", ".join(files[:_NAMED]) + more


def _text(value: Any) -> str:
    if value is None or value in ("", []):
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return str(value)


A = TypeVar("A")
T = TypeVar("T")

#: What damaged contents make their readers raise.
_FAULTS = (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError)


class Artifacts:
    """What the stages of a database have made: ``artifacts[CELLS]``, read when first asked for.

    ``model`` is the file that it is made of, where that is at hand.
    """

    def __init__(self, db: DatabaseFolder, model: Path | None = None) -> None:
        self.db = db
        self.model = model
        self._held: dict[str, Any] = {}
        self._stages: dict[Stage[Any], Any] = {}

    def __getitem__(self, stage: Stage[A]) -> A:
        """Raises PTM-D004 to PTM-D006, also where artifacts do not fit together; PTM-D008 if
        another release of ptmtools made the artifact."""
        if stage not in self._stages:
            stored = stage if self.is_stored(stage) else stage.changes
            assert stored
            made = self._read(stage) if stored is stage else self[stored]
            with self.reading(arrays_of(stored.name)):
                self._fit(stage, made)
            self._stages[stage] = made
        return cast(A, self._stages[stage])

    def _read(self, stage: Stage[A]) -> A:
        assert stage.artifact is not None
        if self.record(stage).recipe != stage.recipe:
            raise DatabaseError(
                "PTM-D008",
                f"the {stage.name} stage was run by another release of ptmtools",
                file=self.db.path,
                remedy=f"run `{build_command(self.db.path)}` to bring the database up to date",
            )
        with naming_command(self.db.path):
            arrays = self.db.read_arrays(stage.name)
        kind = stage.artifact.load()
        with self.reading(arrays_of(stage.name)):
            made = stage.load.load()(self, arrays) if stage.load else kind.from_arrays(arrays)
        return cast(A, made)

    def keep(self, stage: Stage[A], artifact: A) -> None:
        """Keeps an artifact that was just computed."""
        self._stages[stage] = artifact

    def held(self, name: str, read: Callable[[], T]) -> T:
        """What ``read`` makes of another file of the database, read once; damage is PTM-D006."""
        if name not in self._held:
            with self.reading(name):
                self._held[name] = read()
        return cast(T, self._held[name])

    def hold(self, name: str, value: Any) -> None:
        """Keeps what `held` would read."""
        self._held[name] = value

    def record(self, stage: Stage[Any]) -> StageRecord:
        """The record of a stage's last run; raises PTM-D004 if there was none."""
        with naming_command(self.db.path):
            return self.db.record(stage.name)

    def before(self, stage: Stage[Any]) -> StageRecord | None:
        """The record of a stage as the database has it, or None."""
        return self.db.manifest.stages.get(stage.name)

    def outputs(self, stage: Stage[Any]) -> Mapping[str, str]:
        """What a stage has written: name → SHA-256; raises PTM-D004 if it has not run. One that
        changes another's artifact has then changed nothing: databases of earlier releases lack
        it."""
        if stage.changes and self._known(stage) is None:
            return {}
        return self.record(stage).outputs

    def is_stored(self, stage: Stage[Any]) -> bool:
        """Whether a stage's artifact is its own; False if it is the very one that it could have
        changed. Raises as `outputs`."""
        return not stage.changes or arrays_of(stage.name) in self.outputs(stage)

    def _known(self, stage: Stage[Any]) -> StageRecord | None:
        """The record of a stage's last run, if there was one."""
        return self.db.manifest.stages.get(stage.name)

    def recorded(self, stage: Stage[Any]) -> Options:
        """The options of a stage's last run; raises PTM-D002 if the record has others."""
        record = self.record(stage)
        try:
            return stage.recorded(record)
        except ValueError as fault:
            raise damaged_manifest(self.db.path / MANIFEST, str(fault)) from fault

    def inputs(self, stage: Stage[Any], options: Options) -> dict[str, str]:
        """Name → SHA-256 of what the stage would read now; raises PTM-D004 and PTM-D002."""
        if stage.inputs:
            return dict(stage.inputs.load()(self, options))
        found = stage.files_read(options, self.outputs)
        for read in stage.sources(options):
            if found.get(arrays_of(read.name)) == "":
                self.db.output(read.name, arrays_of(read.name))  # which raises
        return found

    def outdated(self, stage: Stage[Any]) -> str:
        """What a stage that has run was made from and is another by now; "" if there is none."""
        if stage.changes and self._known(stage) is None:
            return ""
        record = self.record(stage)
        if record.recipe != stage.recipe:
            return "release of ptmtools"
        try:
            options = self.recorded(stage)
            if not stage.read_with(options):  # but the model, which need not be at hand
                return ""
            there = self.inputs(stage, options)
        except DatabaseError:
            return ""  # which is the fault of the stage that it reads
        names = there.keys() | record.inputs.keys()
        changed = [name for name in names if record.inputs.get(name) != there.get(name)]
        if not changed:
            return ""
        return stage.read_with(options)[0].name if stage.inputs else min(changed)

    def _fit(self, stage: Stage[A], made: A) -> None:
        """Raises ValueError if an artifact and one that was read before do not fit together."""
        together = {**self._stages, stage: made}
        for one, artifact in together.items():
            for other, check in one.fits.items():
                concerned = stage in (one, other) and other in together
                if concerned and (fault := check(artifact, together[other])):
                    raise ValueError(fault)

    @contextmanager
    def reading(self, name: str) -> Iterator[None]:
        """What is wrong with the contents of a file of the database becomes PTM-D006."""
        try:
            yield
        except _FAULTS as fault:
            raise damaged(self.db.path / name, f"{type(fault).__name__} {fault}") from fault


class Run(Artifacts):
    """A database being written: skips the stages that are current, records those that are not."""

    def __init__(
        self,
        db: DatabaseWriter,
        workers: Workers,
        progress: Progress = silent,
        model: Path | None = None,
        *,
        rebuild: bool = False,
    ) -> None:
        super().__init__(db, model)
        self.writer, self.workers, self.progress, self.rebuild = db, workers, progress, rebuild
        self.reports: list[StageReport] = []
        self._joint: Transaction | None = None
        self._uncommitted: dict[str, StageRecord] = {}

    def record(self, stage: Stage[Any]) -> StageRecord:
        """As `Artifacts.record`, of this run if it is not committed yet."""
        return self._uncommitted.get(stage.name) or super().record(stage)

    def _known(self, stage: Stage[Any]) -> StageRecord | None:
        return self._uncommitted.get(stage.name) or super()._known(stage)

    def before(self, stage: Stage[Any]) -> StageRecord | None:
        """As `Artifacts.before`; None for a run that does everything again."""
        return None if self.rebuild else super().before(stage)

    def work(self, stage: Stage[Any], options: Options) -> StageRecord:
        """What a stage is to do.

        Raises
        ------
        DatabaseError: PTM-D002, PTM-D004; PTM-D008 if a stage that it reads was itself made from
            what has been replaced since.
        """
        inputs = self.inputs(stage, options)
        for read in stage.sources(options):
            if earlier := self.outdated(read):
                raise DatabaseError(
                    "PTM-D008",
                    f"the {read.name} stage was made from an earlier {earlier}",
                    file=self.db.path,
                    remedy=f"run `{build_command(self.db.path)}` first",
                )
        return work_of(stage, options, inputs)

    def begin(self, stage: Stage[Any]) -> Transaction:
        """The transaction for what a stage makes."""
        return self._joint or self.writer.begin(stage.name)

    def settle(self, stage: Stage[Any], transaction: Transaction, record: StageRecord) -> None:
        """Records a stage, whose outputs are what was put into the transaction since the last."""
        earlier = {name for record in self._uncommitted.values() for name in record.outputs}
        outputs = {n: d for n, d in transaction.pending().items() if n not in earlier}
        self._uncommitted[stage.name] = replace(record, outputs=outputs)
        self._joint = transaction

    def commit(self, stage: Stage[Any]) -> None:
        """After a stage's turn: commits what there is, unless it is `Stage.joined` to the next."""
        if self._joint and not stage.joined:
            self._joint.commit(self._uncommitted)
            self._joint, self._uncommitted = None, {}

    def report(
        self,
        stage: Stage[Any],
        why: tuple[str, ...],
        seconds: float,
        tasks: tuple[int, int, int] | None = None,
    ) -> None:
        """Notes that a stage has been dealt with; not of one that could have changed another's
        artifact, and neither did nor had."""
        made, before = self.record(stage), super().before(stage)
        idle = not made.outputs and not made.notes and not (before and before.outputs)
        if stage.changes and idle:
            return
        self.reports.append(
            StageReport(
                stage.name,
                bool(why),
                seconds,
                made.counts,
                tuple(made.notes),
                why,
                tasks,
                tuple(made.warnings),
            )
        )


def work_of(stage: Stage[Any], options: Options, inputs: Mapping[str, str]) -> StageRecord:
    """What a stage is to do, as its record will say; without outputs."""
    return StageRecord(stage.recipe, parameters(options), dict(inputs), {})


class Job:
    """One stage in one run."""

    def __init__(self, run: Run, stage: Stage[Any], options: Options) -> None:
        self.run, self.stage, self.options = run, stage, options

    def begin(self) -> None:
        """Begins in the background what can be done there, once all that it reads is known; the
        turn is then another stage's, of one thread."""

    def do(self) -> None:
        """Makes the stage current, when it is its turn, and reports on it."""
        run, stage = self.run, self.stage
        start = time.perf_counter()
        work, why = self.planned()
        if why:
            transaction = run.begin(stage)
            run.settle(stage, transaction, self.make(transaction, work))
        run.commit(stage)
        run.report(stage, why, time.perf_counter() - start)

    def planned(self) -> tuple[StageRecord, tuple[str, ...]]:
        """What is to be done, and why; no reasons if the stage is current. Raises as `Run.work`."""
        work = self.run.work(self.stage, self.options)
        if self.run.rebuild:
            return work, ("a rebuild was asked for",)
        before, changed = self.run.before(self.stage), self.stage.changed
        return work, reasons(before, work, self.run.db, changed)

    def make(self, transaction: Transaction, work: StageRecord) -> StageRecord:
        """Puts what the stage makes into the transaction; returns ``work`` as it has been done,
        but for the outputs."""
        raise NotImplementedError

    def check(self) -> None:
        """Raises what has gone wrong in the background so far."""

    def abandon(self) -> None:
        """Ends what `begin` began: the run has failed."""


class ArraysJob(Job):
    """A stage that computes an artifact, which is stored as arrays."""

    def make(self, transaction: Transaction, work: StageRecord) -> StageRecord:
        """Computes the artifact."""
        run, stage, options = self.run, self.stage, self.options
        assert stage.compute
        assert stage.counts
        reads = [run[read] for read in stage.read_with(options)]
        executor = run.workers.alone if stage.one_thread else run.workers.executor
        with naming(run.model if stage.from_model else None):
            artifact = stage.compute.load()(*reads, options, run.progress, executor)
        run.keep(stage, artifact)
        transaction.put_arrays(stage.name, artifact.to_arrays())
        said = tuple(stage.notes(artifact, options))
        return replace(
            work,
            counts=stage.counts(artifact),
            notes=tuple(map(str, said)),
            warnings=warnings_in(said),
        )
