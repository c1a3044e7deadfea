"""The artifacts of a database, read when a stage first asks for them, and those of a run.

An artifact is that of its stage as later stages have changed it; artifacts that are read together
must fit together.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeVar, cast

from ptmtools.errors import DatabaseError, Rebuild
from ptmtools.pipeline.records import StageReport, parameters
from ptmtools.pipeline.stage import Options, Stage, changes_of
from ptmtools.progress import Progress, silent
from ptmtools.store.layout import MANIFEST, arrays_of, sha256

if TYPE_CHECKING:
    from pathlib import Path

    from ptmtools.parallel import Workers
    from ptmtools.store.folder import DatabaseFolder
    from ptmtools.store.manifest import StageRecord
    from ptmtools.store.remote import RemoteDatabase
    from ptmtools.store.transaction import Transaction
    from ptmtools.store.writer import DatabaseWriter

A = TypeVar("A")
T = TypeVar("T")

#: The exceptions that damaged contents cause in their readers.
FAULTS = (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError)


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
            return stage.load(self, arrays)

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

        Databases lack the optional stages of packages that were installed later.
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
            inputs = stage.inputs(self, options)
        except DatabaseError:
            return ""  # the fault is in the stage that it reads
        names = inputs.keys() | record.inputs.keys()
        changed = [name for name in names if record.inputs.get(name) != inputs.get(name)]
        return stage.changed_input(changed) if changed else ""

    def _check_fit(self, stage: Stage[A], artifact: A) -> None:
        """Raises ValueError if an artifact does not fit those that were read before."""
        known: dict[Stage[Any], Any] = {**self._artifacts, stage: artifact}
        pairs = [(reader, stage) for reader in known] + [(stage, shown) for shown in known]
        for reader, shown in pairs:
            for read in filter(None, (shown, shown.changes)):
                seen = self._last_change(read) is shown
                if seen and (fault := reader.misfit(known[reader], read, known[shown])):
                    raise ValueError(fault)

    @contextmanager
    def reading(self, name: str) -> Iterator[None]:
        """Turns faults in the contents of a file of the database into PTM-D006."""
        from ptmtools.store.folder import damage_error

        try:
            yield
        except FAULTS as fault:
            raise damage_error(self.db.path / name, f"{type(fault).__name__} {fault}") from fault


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
        tell (`Stage.tells`).
        """
        record = self.record(stage)
        committed = self.db.manifest.stages.get(stage.name)
        if self._joint and (not stage.joined or self.writer.provisional):
            self._joint.commit(self._uncommitted)
            self._joint, self._uncommitted = None, {}
            self.writer.provisional &= stage.joined
        idle = not record.outputs and not record.notes and not (committed and committed.outputs)
        if not (stage.optional and idle) or stage.tells(record.counts):
            notes, warnings = tuple(record.notes), tuple(record.warnings)
            self.reports.append(
                StageReport(
                    stage.name, bool(why), seconds, record.counts, notes, why, tasks, warnings
                )
            )
