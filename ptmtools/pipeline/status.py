"""What state a database is in: which stages are done, stale or damaged, and who is at work."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from ptmtools.pipeline.command import naming_command
from ptmtools.pipeline.stage import Artifacts
from ptmtools.pipeline.stage import Stage
from ptmtools.pipeline.stages import STAGES
from ptmtools.store.folder import DatabaseFolder, read_manifest
from ptmtools.store.layout import LOCK, STAGING
from ptmtools.store.lock import holder, is_held
from ptmtools.store.manifest import Manifest
from ptmtools.store.transaction import finished_tasks

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
    """Looks at a database. Every file is compared with its hash, but for those that have not been
    touched since that was last done.

    Raises
    ------
    DatabaseError: PTM-D001 no database there; PTM-D002 damaged manifest; PTM-D003 schema of
        another version.
    """
    folder = Path(path)
    with naming_command(path):
        manifest = read_manifest(folder)
    begun = (folder / STAGING).is_dir()
    if manifest is None and not begun and not (folder / LOCK).exists():
        DatabaseFolder.open(folder)  # says what is wrong
    db = DatabaseFolder(folder, manifest or Manifest(""))
    artifacts = Artifacts(db)
    stages = tuple(_stage(artifacts, stage) for stage in STAGES.values())
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


def _stage(artifacts: Artifacts, stage: Stage[Any]) -> StageStatus:
    db = artifacts.db
    record = db.manifest.stages.get(stage.name)
    if record is None:
        # Databases of earlier releases lack a stage that changes another's artifact: it changed
        # nothing.
        done = stage.changes is not None and stage.changes.name in db.manifest.stages
        return StageStatus(stage.name, "done" if done else "not run", "", {}, 0, 0)
    sizes = []
    for name in record.outputs:
        file = db.path / name
        if file.is_file():
            sizes.append(file.stat().st_size)
    state: State = "done"
    why = ""
    if lost := db.damaged(record.outputs):
        state, why = "damaged", f"{lost} is missing or damaged"
    elif earlier := artifacts.outdated(stage):
        state, why = "stale", f"made from an earlier {earlier}"
    return StageStatus(stage.name, state, why, record.counts, len(sizes), sum(sizes))
