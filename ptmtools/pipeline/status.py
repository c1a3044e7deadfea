"""What state a database is in: which stages are done, stale or damaged, and who is at work."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from ptmtools.errors import DatabaseError
from ptmtools.pipeline.folder import DatabaseFolder, read_manifest
from ptmtools.pipeline.lock import LOCK, holder, is_held
from ptmtools.pipeline.manifest import Manifest
from ptmtools.pipeline.run import Artifacts
from ptmtools.pipeline.stages import STAGES
from ptmtools.pipeline.textures import texture_inputs
from ptmtools.pipeline.transaction import STAGING, finished_tasks

State = Literal["done", "not run", "stale", "damaged"]


@dataclass(frozen=True)
class StageStatus:
    """What state a stage is in.

    Attributes
    ----------
    stage: its name.
    state: "done", "not run", "stale" (what it read has been made anew since) or "damaged" (a file
        that it wrote is missing or is another).
    why: what is stale or damaged.
    counts: the figures of its last run.
    files, bytes: that it wrote and that are there.
    """

    stage: str
    state: State
    why: str
    counts: Mapping[str, Any]
    files: int
    bytes: int


@dataclass(frozen=True)
class DatabaseStatus:
    """What state a database is in.

    Attributes
    ----------
    database: the folder.
    model: the model's file name; None if nothing has been committed yet.
    stages: all of them, in their order.
    finished: whether all are done.
    writer: the process that is writing at this moment, or None.
    interrupted: whether a run was interrupted and left something for the next to clear away.
    waiting: tasks that it had finished, which the next run takes over.
    """

    database: str
    model: str | None
    stages: tuple[StageStatus, ...]
    finished: bool
    writer: str | None
    interrupted: bool
    waiting: int


def database_status(path: str | os.PathLike[str]) -> DatabaseStatus:
    """Looks at a database. Every file is held against its hash, but for those that have not been
    touched since that was last done.

    Raises
    ------
    DatabaseError: PTM-D001 no database there; PTM-D002 damaged manifest; PTM-D003 schema of
        another version.
    """
    folder = Path(path)
    manifest = read_manifest(folder)
    begun = (folder / STAGING).is_dir()
    if manifest is None and not begun and not (folder / LOCK).exists():
        DatabaseFolder.open(folder)  # says what is wrong
    db = DatabaseFolder(folder, manifest or Manifest(""))
    stages = tuple(_stage(db, stage) for stage in STAGES)
    db.digests.save()
    held = is_held(folder)
    return DatabaseStatus(
        database=os.fspath(path),
        model=manifest.model if manifest else None,
        stages=stages,
        finished=all(stage.state == "done" for stage in stages),
        writer=str(holder(folder) or "an unknown process") if held else None,
        interrupted=begun and not held,
        waiting=finished_tasks(folder),
    )


def _stage(db: DatabaseFolder, stage: str) -> StageStatus:
    record = db.manifest.stages.get(stage)
    if record is None:
        return StageStatus(stage, "not run", "", {}, 0, 0)
    sizes = []
    for name in record.outputs:
        file = db.path / name
        if file.is_file():
            sizes.append(file.stat().st_size)
    state: State = "done"
    why = ""
    if lost := db.damaged(record.outputs):
        state, why = "damaged", f"{lost} is missing or damaged"
    elif earlier := _earlier(db, stage):
        state, why = "stale", f"made from an earlier {earlier}"
    return StageStatus(stage, state, why, record.counts, len(sizes), sum(sizes))


def _earlier(db: DatabaseFolder, stage: str) -> str:
    """An input of a stage that has been made anew since, "" if there is none."""
    record, there = db.manifest.stages[stage], db.manifest.outputs()
    if stage == "textures":
        try:
            images = texture_inputs(Artifacts(db).image_digests)
        except DatabaseError:
            return ""  # which is the scene's fault
        return "" if images == record.inputs else "scene"
    if stage == "scene":
        return ""
    return next((n for n, digest in record.inputs.items() if there.get(n) != digest), "")
