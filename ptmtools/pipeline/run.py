"""One run over a database: its artifacts, read once, and the record of what each stage did."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, fields, is_dataclass, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells.model import Cells
from ptmtools.coverage.model import Ach
from ptmtools.errors import DatabaseError
from ptmtools.pipeline.folder import DatabaseFolder, DatabaseWriter
from ptmtools.pipeline.manifest import StageRecord
from ptmtools.progress import Progress, silent
from ptmtools.scene.model import Scene
from ptmtools.version import __version__
from ptmtools.visibility.model import Pvs

T = TypeVar("T")

IMAGES = "stages/images"


@dataclass(frozen=True)
class StageReport:
    """What became of a stage.

    Attributes
    ----------
    stage: its name.
    ran: False if it was current and nothing had to be done.
    seconds: that it took, checking included.
    counts: the figures recorded in the manifest.
    notes: what it has to say, one line each.
    """

    stage: str
    ran: bool
    seconds: float
    counts: Mapping[str, Any]
    notes: tuple[str, ...] = ()


class Artifacts:
    """The results of the stages of a database, read when they are first asked for."""

    def __init__(self, db: DatabaseFolder) -> None:
        self.db = db
        self._held: dict[str, Any] = {}

    @property
    def scene(self) -> Scene:
        """Raises PTM-D004 to PTM-D006, as do the others."""
        return self._artifact("scene", lambda arrays: Scene.from_arrays(arrays, self._image))

    @property
    def cells(self) -> Cells:
        return self._artifact("cells", Cells.from_arrays)

    @property
    def pvs(self) -> Pvs:
        return self._artifact("pvs", Pvs.from_arrays)

    @property
    def ach(self) -> Ach:
        return self._artifact("ach", Ach.from_arrays)

    def hold(self, stage: str, result: Scene | Cells | Pvs | Ach) -> None:
        """Keeps a result that was just computed."""
        self._held[stage] = result

    def _artifact(self, stage: str, build: Callable[[Mapping[str, NDArray[np.generic]]], T]) -> T:
        if stage not in self._held:
            arrays = self.db.read_arrays(stage, "this command")
            try:
                self._held[stage] = build(arrays)
            except (KeyError, ValueError, TypeError, IndexError) as fault:
                raise DatabaseError(
                    "PTM-D006",
                    f"damaged: {type(fault).__name__} {fault}",
                    file=self.db.path / f"stages/{stage}.npz",
                    remedy="run `ptm build-scene` again to rebuild it",
                ) from fault
        result: T = self._held[stage]
        return result

    def _image(self, digest: str) -> bytes:
        return self.db.read(f"{IMAGES}/{digest}", digest)


class Run(Artifacts):
    """A database being written: skips the stages that are current, records those that are not."""

    def __init__(self, db: DatabaseWriter, progress: Progress = silent) -> None:
        super().__init__(db)
        self.writer = db
        self.progress = progress
        self.reports: list[StageReport] = []

    def inputs(self, *stages: str) -> dict[str, str]:
        """Name → SHA-256 of the arrays of these stages, for the record of one that reads them.

        Raises
        ------
        DatabaseError: PTM-D004 if one has not been run; PTM-D008 if one was computed from what
            has been replaced since.
        """
        found = {}
        for stage in stages:
            record = self.db.record(stage)
            current = self.db.manifest.outputs()
            for name, digest in record.inputs.items():
                if stage != "scene" and name.startswith("stages/") and current.get(name) != digest:
                    raise DatabaseError(
                        "PTM-D008",
                        f"the {stage} stage was computed from another {name}",
                        file=self.db.path,
                        remedy=f"run `ptm {stage} DB` or `ptm build-scene MODEL -o DB` first",
                    )
            found[f"stages/{stage}.npz"] = record.outputs[f"stages/{stage}.npz"]
        return found

    def stage(
        self,
        name: str,
        options: Any,
        inputs: Mapping[str, str],
        compute: Callable[[], tuple[Mapping[str, Any], tuple[str, ...]]],
    ) -> None:
        """Runs a stage unless it is current. ``compute`` puts its outputs into the database and
        returns (counts, notes)."""
        start = time.perf_counter()
        work = work_of(options, inputs)
        ran = not self.writer.is_current(name, work)
        if ran:
            counts, notes = compute()
            outputs = self.writer.pending()
            self.writer.commit({name: replace(work, outputs=outputs, counts=counts, notes=notes)})
        self.report(name, ran, start)

    def report(self, name: str, ran: bool, start: float, end: float | None = None) -> None:
        """Notes for the final report that a stage has been dealt with, from ``start`` to ``end``
        (now)."""
        record = self.db.manifest.stages[name]
        seconds = (time.perf_counter() if end is None else end) - start
        self.reports.append(StageReport(name, ran, seconds, record.counts, tuple(record.notes)))


def work_of(options: Any, inputs: Mapping[str, str]) -> StageRecord:
    """What a stage is to do, as its record will say; without outputs."""
    return StageRecord(__version__, parameters(options), dict(inputs), {})


def parameters(options: Any) -> dict[str, Any]:
    """The options that can change an artifact, as JSON reads them back. How many workers share
    the task is none of them."""
    if not is_dataclass(options) or isinstance(options, type):
        raise TypeError(f"{options!r} is not an options dataclass")
    plain = asdict(options)
    for field in fields(options):
        if field.name == "workers" or not field.compare:
            del plain[field.name]
    result: dict[str, Any] = json.loads(json.dumps(plain))
    return result


def peak_memory() -> int:
    """Most bytes that this process has held at once; 0 where the system does not tell."""
    try:
        import resource
    except ImportError:
        return 0
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024
