"""One run over a database: its artifacts, read once, and the record of what each stage did."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeVar

from ptmtools.errors import DatabaseError
from ptmtools.pipeline.changes import reasons
from ptmtools.pipeline.folder import DatabaseFolder
from ptmtools.pipeline.manifest import StageRecord
from ptmtools.pipeline.report import StageReport
from ptmtools.pipeline.stages import (
    IMAGE_LIST,
    IMAGES,
    READS,
    RECIPES,
    STAGES,
    arrays_of,
    image_rows,
    parameters,
)
from ptmtools.pipeline.transaction import Transaction
from ptmtools.pipeline.writer import DatabaseWriter
from ptmtools.progress import Progress, silent

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ptmtools.cells.model import Cells
    from ptmtools.coverage.model import Ach
    from ptmtools.scene.model import Scene, SourceImage
    from ptmtools.visibility.model import Pvs

T = TypeVar("T")

#: What damaged contents make their readers raise.
_FAULTS = (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError)


class Artifacts:
    """The results of the stages of a database, read when they are first asked for."""

    def __init__(self, db: DatabaseFolder) -> None:
        self.db = db
        self._held: dict[str, Any] = {}

    @property
    def images(self) -> tuple[SourceImage, ...]:
        """The scene's, each read when it is loaded; raises PTM-D004 to PTM-D006."""
        from ptmtools.scene.model import SourceImage

        if "images" not in self._held:
            data = self.db.read_output("scene", IMAGE_LIST)

            def loader(digest: str) -> Callable[[], bytes]:
                return lambda: self.db.read(f"{IMAGES}/{digest}", digest)

            with self._reading(IMAGE_LIST):
                self._held["images"] = tuple(
                    SourceImage(
                        row["name"],
                        row["sha256"],
                        loader(row["sha256"]),
                        tuple(row["files"]),
                        row["plain"],
                    )
                    for row in image_rows(data)
                )
        images: tuple[SourceImage, ...] = self._held["images"]
        return images

    @property
    def image_digests(self) -> dict[str, str]:
        """Name → SHA-256 of the scene's images, in their order; raises as `images`."""
        if "images" in self._held:
            return {image.name: image.sha256 for image in self.images}
        data = self.db.read_output("scene", IMAGE_LIST)
        with self._reading(IMAGE_LIST):
            return {row["name"]: row["sha256"] for row in image_rows(data)}

    @property
    def scene(self) -> Scene:
        """Raises PTM-D004 to PTM-D006, as do the others: also where they do not fit together."""
        from ptmtools.scene.model import Scene

        return self._artifact("scene", lambda arrays: Scene.from_arrays(arrays, self.images))

    @property
    def cells(self) -> Cells:
        from ptmtools.cells.model import Cells

        return self._artifact("cells", Cells.from_arrays)

    @property
    def pvs(self) -> Pvs:
        from ptmtools.visibility.model import Pvs

        return self._artifact("pvs", Pvs.from_arrays)

    @property
    def ach(self) -> Ach:
        from ptmtools.coverage.model import Ach

        return self._artifact("ach", Ach.from_arrays)

    def hold(self, stage: str, result: Scene | Cells | Pvs | Ach) -> None:
        """Keeps a result that was just computed."""
        self._held[stage] = result

    def hold_images(self, images: Sequence[SourceImage]) -> None:
        """Keeps the images of a scene that was just read."""
        self._held["images"] = tuple(images)

    def _artifact(self, stage: str, build: Callable[[Mapping[str, NDArray[np.generic]]], T]) -> T:
        if stage not in self._held:
            arrays = self.db.read_arrays(stage, "this command")
            with self._reading(arrays_of(stage)):
                made = build(arrays)
                self._fit({**self._held, stage: made})
            self._held[stage] = made
        result: T = self._held[stage]
        return result

    @staticmethod
    def _fit(held: Mapping[str, Any]) -> None:
        """Raises ValueError if one artifact counts what another has not."""
        scene, cells, pvs, ach = (held.get(name) for name in ("scene", "cells", "pvs", "ach"))
        if scene and cells and (cells.triangle_source >= len(scene.triangles)).any():
            raise ValueError("a piece is of no triangle of the scene")
        if cells and pvs and cells.cell_count != pvs.cell_count:
            raise ValueError("the sets are of other cells")
        if (
            pvs
            and ach
            and not (len(pvs.start) == len(ach.start) and (pvs.start == ach.start).all())
        ):
            raise ValueError("the hints are of other sets")
        if scene and ach and (ach.texture >= len(scene.images)).any():
            raise ValueError("a share is of no image")

    def _reading(self, name: str) -> _Reading:
        return _Reading(self.db, name)


@dataclass(frozen=True)
class _Reading:
    """What is wrong with the contents of a file of a database becomes PTM-D006."""

    db: DatabaseFolder
    name: str

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: object, fault: BaseException | None, trace: object) -> None:
        if isinstance(fault, _FAULTS):
            raise DatabaseError(
                "PTM-D006",
                f"damaged: {type(fault).__name__} {fault}",
                file=self.db.path / self.name,
                remedy="run `ptm build-scene` again to rebuild it",
            ) from fault


class Run(Artifacts):
    """A database being written: skips the stages that are current, records those that are not."""

    def __init__(self, db: DatabaseWriter, progress: Progress = silent) -> None:
        super().__init__(db)
        self.writer = db
        self.progress = progress
        self._reports: dict[str, StageReport] = {}

    @property
    def reports(self) -> tuple[StageReport, ...]:
        """Of the stages that were dealt with, in their order."""
        return tuple(self._reports[stage] for stage in STAGES if stage in self._reports)

    def inputs(self, *stages: str) -> dict[str, str]:
        """Name → SHA-256 of the arrays of these stages, for the record of one that reads them.

        Raises
        ------
        DatabaseError: PTM-D002 if one has no arrays; PTM-D004 if one has not been run; PTM-D008 if
            one was computed from what has been replaced since.
        """
        current = self.db.manifest.outputs()
        found = {}
        for stage in stages:
            record = self.db.record(stage)
            for name, digest in record.inputs.items():
                if stage != "scene" and name.startswith("stages/") and current.get(name) != digest:
                    raise DatabaseError(
                        "PTM-D008",
                        f"the {stage} stage was computed from another {name}",
                        file=self.db.path,
                        remedy=f"run `ptm {stage} DB` or `ptm build-scene MODEL -o DB` first",
                    )
            found[arrays_of(stage)] = self.db.output(stage, arrays_of(stage))
        return found

    def stage(
        self,
        name: str,
        options: Any,
        compute: Callable[[Transaction], tuple[Mapping[str, Any], Sequence[str]]],
        also: Mapping[str, str] | None = None,
    ) -> None:
        """Runs a stage unless it is current.

        Parameters
        ----------
        compute: puts the outputs into the transaction that it is given, and returns counts and
            notes.
        also: inputs besides the arrays that the stage reads.
        """
        start = time.perf_counter()
        work = work_of(name, options, {**self.inputs(*READS[name]), **(also or {})})
        why = reasons(self.db.manifest.stages.get(name), work, self.db)
        if why:
            transaction = self.writer.begin(name)
            counts, notes = compute(transaction)
            outputs = transaction.pending()
            transaction.commit({name: replace(work, outputs=outputs, counts=counts, notes=notes)})
        self.report(name, why, start)

    def report(
        self,
        name: str,
        why: tuple[str, ...],
        start: float,
        end: float | None = None,
        tasks: tuple[int, int, int] | None = None,
    ) -> None:
        """Notes that a stage has been dealt with, from ``start`` to ``end`` (now)."""
        record = self.db.manifest.stages[name]
        seconds = (time.perf_counter() if end is None else end) - start
        self._reports[name] = StageReport(
            name, bool(why), seconds, record.counts, tuple(record.notes), why, tasks
        )


def work_of(stage: str, options: Any, inputs: Mapping[str, str]) -> StageRecord:
    """What a stage is to do, as its record will say; without outputs."""
    return StageRecord(RECIPES[stage], parameters(options), dict(inputs), {})
