"""The contract of the stages: a stage's declaration, its artifacts, and its job in one run.

A stage is one frozen value in a file of its own in `stages/`, with a line in the table there, or
an entry point of the group ``ptmtools.stages`` in another package. Build, plan, status, info,
validate, tradeoff and the command line loop over that table.

`ptmtools.pipeline.command` completes the command of their `Rebuild` remedies.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Generic, TypeVar, cast

from ptmtools import plugins
from ptmtools.diagnostics import warnings_in
from ptmtools.errors import DatabaseError, Rebuild, naming
from ptmtools.lazy import Lazy
from ptmtools.pipeline.records import StageReport, options_of, parameters, reasons
from ptmtools.progress import Progress, silent
from ptmtools.store.layout import MANIFEST, arrays_of, sha256

if TYPE_CHECKING:
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

    from ptmtools.output.representation import Represented
    from ptmtools.parallel import Workers
    from ptmtools.store.folder import DatabaseFolder
    from ptmtools.store.manifest import StageRecord
    from ptmtools.store.remote import RemoteDatabase
    from ptmtools.store.transaction import Transaction
    from ptmtools.store.writer import DatabaseWriter

A = TypeVar("A")
T = TypeVar("T")

#: The options of a run of a stage: an instance of its `Stage.options`.
Options = Any
Counts = Mapping[str, Any]

#: The exceptions that damaged contents cause in their readers.
_FAULTS = (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError)


@dataclass(frozen=True, eq=False)
class Stage(Generic[A]):
    """One step from the model to the served files.

    Attributes
    ----------
    name: in the manifest, as a command, and of its arrays' file.
    about: one sentence for ``--help``.
    recipe: a number that rises when the stage gives other bytes for the same inputs, so that a new
        release repeats only the stages that it changed.
    changed: the visible effect of the last rise of the recipe.
    options: the frozen class of its options. A field's metadata may have ``default_before``: a
        recipe, and the default before that.
    reads: the stages whose artifacts `compute` takes, in this order; a function of the options if
        it depends on them.
    before_changes: whether, with these options, it reads artifacts as they are before other stages
        change them.
    files: those of `reads` of which it reads all files, not only the arrays; or a function that
        returns them.
    inputs: ``inputs(artifacts, options)``: name → SHA-256 of its inputs, if these are not the files
        of `reads`.
    heeds: stages whose options it depends on, besides its own; `Artifacts.choices` are inputs.
    changes: the stage whose artifact it replaces by another of the same class, for all stages that
        read it. If it stores no arrays, the artifact is unchanged.
    origin: for a stage that changes the scene: the `SceneOrigin` of an `Artifacts`.
    representation: what it adds to the served files, the `Represented` of an `Artifacts`.
    artifact: the class of its artifact, with ``to_arrays`` and ``from_arrays``; None if it writes
        files only.
    compute: ``compute(*artifacts, options, progress, executor)`` returns the artifact.
    counts: the figures of an artifact, for the manifest; ``ptm validate`` checks them.
    notes: lines on an artifact and the options; those of type `Warned` are warnings.
    summary: one line from the recorded counts.
    fits: for stages whose artifacts this one refers to: a function of both artifacts that returns
        the fault, or "".
    job: the class that runs it.
    optional: it may have nothing to write. Then it is not reported; databases of earlier releases
        lack its record.
    telling: whether a run of an optional stage that wrote nothing is reported all the same, from
        its counts.
    joined: it has no command of its own, and its outputs belong to those of the next stage: a model
        that cannot be cut into cells leaves no database behind, and changes none.
    from_model: its command takes a model, and runs the stages before it too.
    one_thread: it leaves the other processors to later stages that can begin.
    """

    name: str
    about: str
    recipe: int
    options: type
    changed: str = ""
    reads: tuple[Stage[Any], ...] | Callable[[Options], tuple[Stage[Any], ...]] = ()
    files: tuple[Stage[Any], ...] | Callable[[], tuple[Stage[Any], ...]] = ()
    before_changes: Callable[[Options], bool] = field(default=lambda options: False)
    inputs: Callable[[Artifacts, Options], Mapping[str, str]] | None = None
    heeds: tuple[Stage[Any], ...] = ()
    changes: Stage[A] | None = None
    origin: Lazy[Callable[[Artifacts], SceneOrigin]] | None = None
    representation: Lazy[Callable[[Artifacts], Represented | None]] | None = None
    artifact: Lazy[Any] | None = None
    compute: Lazy[Callable[..., A]] | None = None
    counts: Callable[[A], Counts] = field(default=lambda artifact: {})
    notes: Callable[[A, Options], Iterable[str]] = field(default=lambda artifact, options: ())
    summary: Callable[[Counts], str] = field(default=lambda counts: "")
    fits: Mapping[Stage[Any], Callable[[A, Any], str]] = field(default_factory=dict)
    job: type[Job] = field(default_factory=lambda: Job)
    optional: bool = False
    telling: Callable[[Counts], bool] = field(default=lambda counts: False)
    joined: bool = False
    from_model: bool = False
    one_thread: bool = False

    def read_with(self, options: Options) -> tuple[Stage[Any], ...]:
        """The stages that it reads with these options."""
        return self.reads(options) if callable(self.reads) else self.reads

    def sources(self, options: Options) -> tuple[Stage[Any], ...]:
        """The stages whose files it reads: those of `read_with`, each followed by the ones that
        change its artifact before this stage runs."""
        if self.before_changes(options):
            return self.read_with(options)
        sources: dict[Stage[Any], None] = {}
        for read in self.read_with(options):
            sources |= dict.fromkeys((read, *changes_before(self, read)))
        return tuple(sources)

    def summarize(self, counts: Counts) -> str:
        """`summary`, of counts from a manifest, which may be invalid."""
        try:
            return self.summary(counts)
        except (ArithmeticError, LookupError, TypeError, ValueError):
            return "invalid counts"

    def recorded(self, record: StageRecord) -> Options:
        """The options that its record has; raises ValueError if they are impossible."""
        try:
            return options_of(self.options, record)
        except ValueError as fault:
            raise ValueError(f"stage {self.name} has impossible parameters: {fault}") from fault

    def work(self, options: Options, inputs: Mapping[str, str]) -> StageRecord:
        """The record of a run with these options and inputs, still without outputs."""
        from ptmtools.store.manifest import StageRecord

        return StageRecord(self.recipe, parameters(options), dict(inputs), {})


@dataclass(frozen=True)
class SceneOrigin:
    """What a changed scene comes from.

    Attributes
    ----------
    objects: (K,) int32 the numbers of the objects that were replaced, ascending.
    triangle: (T,) int64 for each triangle of the changed scene that of the scene as read which it
        is, or stands for.
    """

    objects: NDArray[np.int32]
    triangle: NDArray[np.int64]


def changes_of(stage: Stage[Any]) -> tuple[Stage[Any], ...]:
    """The stages of other packages that change the artifact of a stage, in the order of their
    runs."""
    declared = plugins.declared("stages", Stage).values()
    return tuple(other for other in declared if other.changes is stage)


def changes_before(reader: Stage[Any], stage: Stage[Any]) -> tuple[Stage[Any], ...]:
    """Of `changes_of` those that run before a stage that reads the artifact."""
    changes = changes_of(stage)
    return changes[: changes.index(reader)] if reader in changes else changes


class Artifacts:
    """The artifacts of a database: ``artifacts[CELLS]``, read at first use, as other stages have
    changed them; `original` is an artifact before.

    Attributes
    ----------
    db: the database.
    model: the model file, where it is known.
    """

    def __init__(
        self, db: DatabaseFolder, model: Path | None = None, *, planned: bool = False
    ) -> None:
        """With ``planned``, a stage that has not run has no outputs, instead of an error."""
        self.db = db
        self.model = model
        self._planned = planned
        #: The options of stages that a planned build would run with.
        self.chosen: dict[Stage[Any], Any] = {}
        self._files: dict[str, Any] = {}
        self._artifacts: dict[Stage[Any], Any] = {}

    def __getitem__(self, stage: Stage[A]) -> A:
        """Raises PTM-D004 to PTM-D006, also where artifacts do not fit together; PTM-D008 if
        another release of ptmtools computed the artifact."""
        return self.original(self._last_change(stage))

    def original(self, stage: Stage[A]) -> A:
        """The artifact of a stage itself; of one that changed nothing, that of the changed stage.
        Raises as `__getitem__`."""
        if stage not in self._artifacts:
            if stage.changes and not self.is_stored(stage):
                artifact = self.original(stage.changes)
            else:
                artifact = self._read(stage)
            with self.reading(arrays_of(stage.name)):
                self._check_fit(stage, artifact)
            self._artifacts[stage] = artifact
        return cast(A, self._artifacts[stage])

    def _last_change(self, stage: Stage[A]) -> Stage[A]:
        """The stage that changed the artifact of a stage last, or itself."""
        changes = (change for change in reversed(changes_of(stage)) if self.is_stored(change))
        return next(changes, stage)

    def _read(self, stage: Stage[A]) -> A:
        self.check_recipe(stage)
        arrays = self.db.read_arrays(stage.name)
        with self.reading(arrays_of(stage.name)):
            return cast(A, stage.job.load(self, stage, arrays))

    def check_recipe(self, stage: Stage[Any]) -> None:
        """Raises PTM-D008 if another release of ptmtools ran a stage."""
        if self.record(stage).recipe != stage.recipe:
            raise DatabaseError(
                "PTM-D008",
                f"the {stage.name} stage was run by another release of ptmtools",
                file=self.db.path,
                remedy=Rebuild("run {} to bring the database up to date"),
            )

    def keep(self, stage: Stage[A], artifact: A) -> None:
        """Sets the artifact that a stage has just computed."""
        self._artifacts[stage] = artifact

    def cached(self, name: str, read: Callable[[], T]) -> T:
        """The result of ``read``, which is called once for each file; damage is PTM-D006."""
        if name not in self._files:
            with self.reading(name):
                self._files[name] = read()
        return cast(T, self._files[name])

    def cache(self, name: str, value: Any) -> None:
        """Sets what `cached` returns."""
        self._files[name] = value

    def record(self, stage: Stage[Any]) -> StageRecord:
        """The record of a stage's last run; raises PTM-D004 if there was none."""
        return self._last(stage) or self.db.record(stage.name)

    def before(self, stage: Stage[Any]) -> StageRecord | None:
        """The record that decides whether a stage is current, or None."""
        return self._last(stage)

    def _last(self, stage: Stage[Any]) -> StageRecord | None:
        return self.db.manifest.stages.get(stage.name)

    def outputs(self, stage: Stage[Any]) -> Mapping[str, str]:
        """The outputs of a stage: name → SHA-256; raises PTM-D004 if it has not run.

        Databases of earlier releases lack optional stages, which wrote nothing.
        """
        if self._last(stage) is None and (stage.optional or self._planned):
            return {}
        return self.record(stage).outputs

    def is_stored(self, stage: Stage[Any]) -> bool:
        """Whether a stage has stored an artifact, which optional ones may not; raises as
        `outputs`."""
        return not stage.optional or arrays_of(stage.name) in self.outputs(stage)

    def stored(self, stage: Stage[A]) -> A | None:
        """The artifact of an optional stage, None if it has stored none; raises as
        `__getitem__`."""
        return self[stage] if self.is_stored(stage) else None

    def recorded(self, stage: Stage[Any]) -> Options:
        """The options of a stage's last run; raises PTM-D002 if they are impossible."""
        from ptmtools.store.manifest import damaged_manifest

        record = self.record(stage)
        try:
            return stage.recorded(record)
        except ValueError as fault:
            raise damaged_manifest(self.db.path / MANIFEST, str(fault)) from fault

    def inputs(self, stage: Stage[Any], options: Options) -> dict[str, str]:
        """Name → SHA-256 of the inputs of a run with these options; raises PTM-D004 and
        PTM-D002."""
        if stage.inputs:
            return dict(stage.inputs(self, options))
        files = stage.files() if callable(stage.files) else stage.files
        return self.files_of(stage.sources(options), files)

    def files_of(
        self, stages: Iterable[Stage[Any]], files: Collection[Stage[Any]] = ()
    ) -> dict[str, str]:
        """Name → SHA-256 of the arrays of some stages; of those without arrays, and of those in
        ``files``, of all outputs. Raises PTM-D004."""
        inputs: dict[str, str] = {}
        for read in stages:
            outputs, arrays = self.outputs(read), arrays_of(read.name)
            if read.artifact is None or read in files:
                inputs |= outputs
            elif arrays in outputs:
                inputs[arrays] = outputs[arrays]
            elif not read.optional:
                inputs[arrays] = "" if self._planned else self.db.output(read.name, arrays)
        return inputs

    def choices(self, stage: Stage[Any]) -> dict[str, str]:
        """An input for each stage that a stage heeds: the digest of its options. None for those
        that have not run, in a plan. Raises PTM-D004."""
        inputs = {}
        for heeded in stage.heeds:
            if heeded in self.chosen:
                values = parameters(self.chosen[heeded])
            elif self._planned and self._last(heeded) is None:
                continue
            else:
                values = dict(self.record(heeded).parameters)
            text = json.dumps(values, sort_keys=True)
            inputs[f"choice of options of {heeded.name}"] = sha256(text.encode())
        return inputs

    def outdated(self, stage: Stage[Any]) -> str:
        """The input of a stage's last run that has changed since; "" if there is none."""
        if stage.optional and self._last(stage) is None:
            return ""
        record = self.record(stage)
        if record.recipe != stage.recipe:
            return "release of ptmtools"
        try:
            options = self.recorded(stage)
            if not stage.read_with(options):  # it reads the model, which may be elsewhere
                return ""
            inputs = self.inputs(stage, options)
        except DatabaseError:
            return ""  # the fault is in the stage that it reads
        names = inputs.keys() | record.inputs.keys()
        changed = [name for name in names if record.inputs.get(name) != inputs.get(name)]
        if not changed:
            return ""
        # The inputs of tasks are the tasks.
        tasks = stage.job.tasks is not Job.tasks
        return stage.read_with(options)[0].name if tasks else min(changed)

    def _check_fit(self, stage: Stage[A], artifact: A) -> None:
        """Raises ValueError if an artifact does not fit those that were read before."""
        known = {**self._artifacts, stage: artifact}
        for reader, dependent in known.items():
            for read, check in reader.fits.items():
                shown = self._last_change(read)
                concerned = stage in (reader, shown) and shown in known
                if concerned and (fault := check(dependent, known[shown])):
                    raise ValueError(fault)

    @contextmanager
    def reading(self, name: str) -> Iterator[None]:
        """Turns faults in the contents of a file of the database into PTM-D006."""
        from ptmtools.store.folder import damaged

        try:
            yield
        except _FAULTS as fault:
            raise damaged(self.db.path / name, f"{type(fault).__name__} {fault}") from fault


class Run(Artifacts):
    """A database being written: the artifacts, and the outputs that are not committed yet."""

    def __init__(
        self,
        db: DatabaseWriter,
        workers: Workers,
        progress: Progress = silent,
        model: Path | None = None,
        *,
        rebuild: bool = False,
        remote: RemoteDatabase | None = None,
        folder_url: str = "",
    ) -> None:
        super().__init__(db, model)
        self.writer, self.workers, self.progress, self.rebuild = db, workers, progress, rebuild
        #: The database at a URL whose copy this is.
        self.remote = db.elsewhere = remote
        #: That of the model's folder, if the model is at a URL.
        self.folder_url = folder_url
        self.reports: list[StageReport] = []
        self._joint: Transaction | None = None
        self._uncommitted: dict[str, StageRecord] = {}

    def _last(self, stage: Stage[Any]) -> StageRecord | None:
        return self._uncommitted.get(stage.name) or super()._last(stage)

    def before(self, stage: Stage[Any]) -> StageRecord | None:
        """See `Artifacts.before`; None if everything is run again."""
        return None if self.rebuild else super()._last(stage)

    def begin(self, stage: Stage[Any]) -> Transaction:
        """The transaction for the outputs of a stage."""
        return self._joint or self.writer.begin(stage.name)

    def settle(self, stage: Stage[Any], transaction: Transaction, record: StageRecord) -> None:
        """Sets the record of a stage, whose outputs were put into the transaction since the last
        call."""
        earlier = {name for record in self._uncommitted.values() for name in record.outputs}
        outputs = {n: d for n, d in transaction.pending().items() if n not in earlier}
        self._uncommitted[stage.name] = replace(record, outputs=outputs)
        self._joint = transaction

    def end(
        self,
        stage: Stage[Any],
        why: tuple[str, ...],
        seconds: float,
        tasks: tuple[int, int, int] | None = None,
    ) -> None:
        """Ends the turn of a stage: commits, unless it is `Stage.joined` to the next in a database
        that has more than such stages, and reports.

        An optional stage that has written nothing, and had not, is not reported, unless its counts
        are `Stage.telling`.
        """
        record = self.record(stage)
        committed = self.db.manifest.stages.get(stage.name)
        if self._joint and (not stage.joined or self.writer.provisional):
            self._joint.commit(self._uncommitted)
            self._joint, self._uncommitted = None, {}
            self.writer.provisional &= stage.joined
        idle = not record.outputs and not record.notes and not (committed and committed.outputs)
        if not (stage.optional and idle) or stage.telling(record.counts):
            notes, warnings = tuple(record.notes), tuple(record.warnings)
            self.reports.append(
                StageReport(
                    stage.name, bool(why), seconds, record.counts, notes, why, tasks, warnings
                )
            )


class Job:
    """One stage in one run: computes the artifact, and stores its arrays.

    A stage with other outputs has a subclass, which also holds the functions that only it needs.
    """

    def __init__(self, run: Run, stage: Stage[Any], options: Options) -> None:
        self.run, self.stage, self.options = run, stage, options

    @staticmethod
    def load(
        artifacts: Artifacts, stage: Stage[Any], arrays: Mapping[str, NDArray[np.generic]]
    ) -> Any:
        """The artifact of the stored arrays; raises one of `_FAULTS` if they are damaged."""
        assert stage.artifact
        return stage.artifact.load().from_arrays(arrays)

    @staticmethod
    def missing(artifacts: Artifacts, artifact: Any) -> Iterable[tuple[str, str, str]]:
        """The files that an artifact refers to and the database lacks, as (file, place, message),
        for ``ptm validate``."""
        return ()

    @staticmethod
    def foresee(artifacts: Artifacts, work: StageRecord) -> bool:
        """Whether the files that other stages read are known before a run that would do ``work``;
        ``artifacts`` are then as after that run."""
        return False

    @staticmethod
    def tasks(artifacts: Artifacts, work: StageRecord) -> list[str]:
        """The tasks that a run would do, for a stage that consists of tasks."""
        return []

    def check_model(self) -> None:
        """Raises the error of a model that the options do not suit, once it has been read: before
        stages that take long."""

    def begin(self) -> None:
        """Begins in the background, once all inputs are known, while a stage of one thread runs."""

    def raise_failure(self) -> None:
        """Raises the exception that ended the background work."""

    def abandon(self) -> None:
        """Ends the background work: the run has failed."""

    def do(self) -> None:
        """Runs the stage unless it is current, and reports."""
        start = time.perf_counter()
        work, why = self.planned()
        if why:
            transaction = self.run.begin(self.stage)
            self.run.settle(self.stage, transaction, self.make(transaction, work))
        self.run.end(self.stage, why, time.perf_counter() - start)

    def planned(self) -> tuple[StageRecord, tuple[str, ...]]:
        """The work, and why it has to be done; no reasons if the stage is current.

        Raises
        ------
        DatabaseError: PTM-D002, PTM-D004; PTM-D008 if a stage that it reads is outdated.
        """
        run, stage = self.run, self.stage
        work = stage.work(self.options, run.inputs(stage, self.options))
        for read in stage.sources(self.options):
            if earlier := run.outdated(read):
                raise DatabaseError(
                    "PTM-D008",
                    f"the {read.name} stage was made from an earlier {earlier}",
                    file=run.db.path,
                    remedy=Rebuild("run {} first"),
                )
        if run.rebuild:
            return work, ("--rebuild was given",)
        return work, reasons(stage.name, run.before(stage), work, run.db, stage.changed)

    def make(self, transaction: Transaction, work: StageRecord) -> StageRecord:
        """Puts the outputs into the transaction; returns the record, still without outputs."""
        run, stage, options = self.run, self.stage, self.options
        assert stage.compute
        reads = [run[read] for read in stage.read_with(options)]
        executor = run.workers.alone if stage.one_thread else run.workers.executor
        with naming(run.model if stage.from_model else None):
            artifact = stage.compute.load()(*reads, options, run.progress, executor)
        run.keep(stage, artifact)
        transaction.put_arrays(stage.name, artifact.to_arrays())
        return described(work, stage.counts(artifact), stage.notes(artifact, options))


def described(work: StageRecord, counts: Counts, notes: Iterable[str]) -> StageRecord:
    """The record of a run with its counts and notes; those of type `Warned` are its warnings."""
    notes = tuple(notes)
    return replace(work, counts=counts, notes=tuple(map(str, notes)), warnings=warnings_in(notes))
