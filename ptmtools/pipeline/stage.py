"""The contract of the stages: what a stage declares and overrides, and its turn in one run.

A stage is the instance of a class in a file of its own in `stages/`, with a line in the table
there, or an entry point of the group ``ptmtools.stages`` in another package. Build, plan, status,
info, validate, tradeoff and the command line loop over that table.

`ptmtools.pipeline.command` completes the command of their `Rebuild` remedies.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Generic, TypeVar, cast

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

#: The options of a run of a stage: an instance of its `Stage.options`.
Options = Any
Counts = Mapping[str, Any]


class Stage(Generic[A]):
    """One step from the model to the served files.

    A subclass sets `name`, `about`, `recipe` and `options`. Most also set `reads` and `artifact`,
    and override `compute`, `counts`, `notes` and `summary`. All else is for few stages.

    Attributes
    ----------
    name: in the manifest, as a command, and of its arrays' file.
    about: one sentence for ``--help``.
    recipe: a number that rises when the stage gives other bytes for the same inputs, so that a new
        release repeats only the stages that it changed.
    options: the frozen class of its options.
    reads: the stages whose artifacts `compute` takes, in this order.
    artifact: the class of its artifact, with ``to_arrays`` and ``from_arrays``; None if it writes
        files only.
    changed: the visible effect of the last rise of the recipe.
    heeds: stages whose options it depends on, besides its own; `Artifacts.choices` are inputs.
    changes: the stage whose artifact it replaces by another of the same class, for all stages that
        read it. If it stores no arrays, the artifact is unchanged.
    represents: whether it adds to the served files what `represented` returns.
    optional: it may have nothing to write. Then it is not reported; databases from before its
        package was installed lack its record.
    joined: it has no command of its own, and its outputs belong to those of the next stage: a model
        that cannot be cut into cells leaves no database behind, and changes none.
    from_model: its command takes a model, and runs the stages before it too.
    one_thread: it leaves the other processors to later stages that can begin.
    opens_inputs: `inputs` opens artifacts, so a plan cannot know them before they are written.
    details_about: the help of the option ``--report`` of its command, which prints `details`.
    """

    name: str
    about: str
    recipe: int
    options: type
    reads: tuple[Stage[Any], ...] = ()
    artifact: Lazy[Any] | None = None
    changed: str = ""
    heeds: tuple[Stage[Any], ...] = ()
    changes: Stage[A] | None = None
    represents: bool = False
    optional: bool = False
    joined: bool = False
    from_model: bool = False
    one_thread: bool = False
    opens_inputs: bool = False
    details_about: str = ""

    def compute(self, *args: Any, **kwargs: Any) -> A:
        """``compute(*artifacts, options, progress, executor)`` returns the artifact."""
        raise NotImplementedError

    def counts(self, artifact: A, /) -> Counts:
        """The figures of an artifact, for the manifest; ``ptm validate`` checks them."""
        return {}

    def notes(self, artifact: A, options: Options, /) -> Iterable[str]:
        """Lines on an artifact and the options; those of type `Warned` are warnings."""
        return ()

    def summary(self, counts: Counts, /) -> str:
        """One line from the recorded counts."""
        return ""

    def misfit(self, artifact: A, source: Stage[Any], contents: Any, /) -> str:
        """The fault of an artifact that does not fit the artifact ``contents`` of another stage;
        "" if it does, or refers to nothing there."""
        return ""

    def details(self, artifacts: Artifacts, *, verbose: bool) -> tuple[Any, Iterable[str]]:
        """A longer report on the stored artifact: a dataclass, and lines of text."""
        raise NotImplementedError

    def tells(self, counts: Counts, /) -> bool:
        """Whether a run of an optional stage that wrote nothing is reported all the same."""
        return False

    def read_with(self, options: Options, /) -> tuple[Stage[Any], ...]:
        """`reads`, of a run with these options."""
        return self.reads

    def sources(self, options: Options, /) -> tuple[Stage[Any], ...]:
        """The stages whose files it reads: those of `read_with`, each followed by the ones that
        change its artifact before this stage runs."""
        sources: dict[Stage[Any], None] = {}
        for read in self.read_with(options):
            sources |= dict.fromkeys((read, *changes_before(self, read)))
        return tuple(sources)

    def inputs(self, artifacts: Artifacts, options: Options, /) -> dict[str, str]:
        """Name → SHA-256 of the inputs of a run with these options; raises PTM-D004, PTM-D002."""
        return artifacts.files_of(self.sources(options))

    def changed_input(self, names: list[str], /) -> str:
        """What an error names, of inputs that have changed since the last run."""
        return min(names)

    def check_options(self, options: Options, /) -> None:
        """Raises MissingComponentError before anything runs, if the options need a component."""

    def check_model(self, run: Run, options: Options, /) -> None:
        """Raises the error of a model that the options do not suit, once it has been read: before
        stages that take long."""

    def make(
        self, run: Run, options: Options, transaction: Transaction, work: StageRecord, /
    ) -> StageRecord:
        """Puts the outputs into the transaction; returns the record, still without outputs.

        Stages with other outputs than one artifact override this in place of `compute`.
        """
        reads = [run[read] for read in self.read_with(options)]
        executor = run.workers.alone if self.one_thread else run.workers.executor
        with naming(run.model if self.from_model else None):
            artifact: Any = self.compute(*reads, options, run.progress, executor)
        run.keep(self, artifact)
        transaction.put_arrays(self.name, artifact.to_arrays())
        return complete(work, self.counts(artifact), self.notes(artifact, options))

    def load(self, artifacts: Artifacts, arrays: Mapping[str, NDArray[np.generic]], /) -> A:
        """The artifact of the stored arrays; raises one of `artifacts.FAULTS` on damaged ones."""
        assert self.artifact
        return cast(A, self.artifact.load().from_arrays(arrays))

    def missing(self, artifacts: Artifacts, artifact: A, /) -> Iterable[tuple[str, str, str]]:
        """The files that an artifact refers to and the database lacks, as (file, place, message),
        for ``ptm validate``."""
        return ()

    def origin(self, artifacts: Artifacts, /) -> SceneOrigin:
        """Of a stage that changes the scene and has stored arrays: where its triangles come
        from."""
        raise NotImplementedError

    def represented(self, artifacts: Artifacts, /) -> Represented | None:
        """What it adds to the served files, if it `represents` objects."""
        return None

    def foresee(self, artifacts: Artifacts, work: StageRecord, /) -> bool:
        """Whether the files that other stages read are known before a run that would do ``work``;
        ``artifacts`` are then as after that run."""
        return False

    def tasks(self, artifacts: Artifacts, work: StageRecord, /) -> list[str]:
        """The tasks that a run would do, for a stage that consists of tasks."""
        return []

    def turn(self, run: Run, options: Options, /) -> Turn:
        """Its turn in a run."""
        return Turn(run, self, options)

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
    return tuple(change for change in declared if change.changes is stage)


def changes_before(reader: Stage[Any], stage: Stage[Any]) -> tuple[Stage[Any], ...]:
    """Of `changes_of` those that run before a stage that reads the artifact."""
    changes = changes_of(stage)
    return changes[: changes.index(reader)] if reader in changes else changes


class Turn:
    """The turn of a stage in one run. That of a stage that can begin before it is a subclass."""

    def __init__(self, run: Run, stage: Stage[Any], options: Options) -> None:
        """Raises as `Stage.check_options`."""
        self.run, self.stage, self.options = run, stage, options
        stage.check_options(options)

    def begin(self) -> None:
        """Begins in the background, once all inputs are known, while a stage of one thread runs."""

    def raise_failure(self) -> None:
        """Raises the exception that ended the background work."""

    def abandon(self) -> None:
        """Ends the background work: the run has failed."""

    def take(self) -> None:
        """Runs the stage unless it is current, and reports."""
        start = time.perf_counter()
        run, stage = self.run, self.stage
        work, why = self.planned()
        if why:
            transaction = run.begin(stage)
            run.settle(stage, transaction, stage.make(run, self.options, transaction, work))
        run.end(stage, why, time.perf_counter() - start)

    def planned(self) -> tuple[StageRecord, tuple[str, ...]]:
        """The work, and why it has to be done; no reasons if the stage is current.

        Raises
        ------
        DatabaseError: PTM-D002, PTM-D004; PTM-D008 if a stage that it reads is outdated.
        """
        run, stage = self.run, self.stage
        work = stage.work(self.options, stage.inputs(run, self.options))
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


def complete(work: StageRecord, counts: Counts, notes: Iterable[str]) -> StageRecord:
    """The record of a run with its counts and notes; those of type `Warned` are its warnings."""
    notes = tuple(notes)
    return replace(work, counts=counts, notes=tuple(map(str, notes)), warnings=warnings_in(notes))
