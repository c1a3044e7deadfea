"""The contract of the stages: a stage's declaration, and its job in one run.

A stage is one frozen value in a file of its own in `stages/`, with a line in the table there, or
an entry point of the group ``ptmtools.stages`` in another package. Build, plan, status, info,
validate, tradeoff and the command line loop over that table.

`ptmtools.pipeline.command` completes the command of their `Rebuild` remedies.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from ptmtools import plugins
from ptmtools.diagnostics import warnings_in
from ptmtools.errors import DatabaseError, Rebuild, naming
from ptmtools.lazy import Lazy
from ptmtools.pipeline.records import options_of, parameters, reasons

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ptmtools.output.representation import Represented
    from ptmtools.pipeline.artifacts import Artifacts, Run
    from ptmtools.store.manifest import StageRecord
    from ptmtools.store.transaction import Transaction

A = TypeVar("A")
T = TypeVar("T")

#: The options of a run of a stage: an instance of its `Stage.options`.
Options = Any
Counts = Mapping[str, Any]


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
    options: the frozen class of its options.
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
    optional: it may have nothing to write. Then it is not reported; databases from before its
        package was installed lack its record.
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
    declared = plugins.declarations("stages", Stage).values()
    return tuple(other for other in declared if other.changes is stage)


def changes_before(reader: Stage[Any], stage: Stage[Any]) -> tuple[Stage[Any], ...]:
    """Of `changes_of` those that run before a stage that reads the artifact."""
    changes = changes_of(stage)
    return changes[: changes.index(reader)] if reader in changes else changes


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
        """The artifact of the stored arrays; raises one of `artifacts.FAULTS` on damaged ones."""
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
