"""The state of a database, and the plan of a build.

The state: which stages are done, stale or damaged, and which process is writing. The plan: which
stages a build would run, and why. Neither runs a stage or writes to the database.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from ptmtools.errors import DatabaseError
from ptmtools.pipeline.artifacts import Artifacts
from ptmtools.pipeline.build import chosen_options
from ptmtools.pipeline.command import naming_command
from ptmtools.pipeline.records import reasons
from ptmtools.pipeline.stage import Options, Stage
from ptmtools.pipeline.stages import STAGES
from ptmtools.store.folder import DatabaseFolder, read_manifest
from ptmtools.store.layout import LOCK, STAGING
from ptmtools.store.lock import holder, is_held
from ptmtools.store.manifest import Manifest
from ptmtools.store.remote import folder_to_build, model_file
from ptmtools.store.transaction import finished_tasks
from ptmtools.store.writer import starting_manifest

State = Literal["done", "not run", "stale", "damaged"]


@dataclass(frozen=True)
class StageStatus:
    """The state of a stage.

    Attributes
    ----------
    stage: its name.
    state: "done", "not run", "stale" (an input has changed since) or "damaged" (an output is
        missing or has other contents).
    why: the changed input or damaged output.
    counts: those of its last run.
    files, bytes: of its outputs that exist.
    """

    stage: str
    state: State
    why: str
    counts: Mapping[str, Any]
    files: int
    bytes: int


@dataclass(frozen=True)
class DatabaseStatus:
    """The state of a database.

    Attributes
    ----------
    database: the folder.
    model: the model's file name; None if nothing has been committed yet.
    stages: all stages, in their order.
    finished: whether all are done.
    writer: the process that is writing now, or None.
    interrupted: whether an interrupted run has left files that are not committed.
    waiting: number of its finished tasks, which the next run takes over.
    """

    database: str
    model: str | None
    stages: tuple[StageStatus, ...]
    finished: bool
    writer: str | None
    interrupted: bool
    waiting: int


def database_status(path: str | os.PathLike[str]) -> DatabaseStatus:
    """The state of a database. Files that have changed since the last comparison are compared with
    their recorded hash.

    Raises
    ------
    DatabaseError: PTM-D001 no database there; PTM-D002 damaged manifest; PTM-D003 schema of
        another version.
    """
    with folder_to_build(path, new=True, force=True) as (folder, remote):
        with naming_command(folder):
            manifest = read_manifest(folder)
        begun = (folder / STAGING).is_dir()
        if manifest is None and not begun and not (folder / LOCK).exists():
            DatabaseFolder.open(folder)  # raises
        db = DatabaseFolder(folder, manifest or Manifest(""))
        db.elsewhere = remote
        db.manifest = db.without_lost()
        artifacts = Artifacts(db)
        stages = tuple(_status(artifacts, stage) for stage in STAGES.values())
        db.digests.save()
        locked = is_held(folder)
        return DatabaseStatus(
            database=os.fspath(path),
            model=manifest.model if manifest else None,
            stages=stages,
            finished=all(stage.state == "done" for stage in stages),
            writer=str(holder(folder) or "an unknown process") if locked else None,
            interrupted=begun and not locked,
            waiting=finished_tasks(folder),
        )


def _status(artifacts: Artifacts, stage: Stage[Any]) -> StageStatus:
    db = artifacts.db
    record = db.manifest.stages.get(stage.name)
    if lost := db.manifest.lost.get(stage.name):
        return StageStatus(stage.name, "damaged", f"{lost} is missing or damaged", {}, 0, 0)
    if record is None:
        # Databases lack the optional stages of packages that were installed later.
        later = list(STAGES)[list(STAGES).index(stage.name) + 1 :]
        done = stage.optional and any(name in db.manifest.stages for name in later)
        return StageStatus(stage.name, "done" if done else "not run", "", {}, 0, 0)
    sizes: list[int] = []
    for name, digest in record.outputs.items():
        with suppress(DatabaseError):
            sizes.append(db.size(name, digest))
    state: State = "done"
    why = ""
    if lost := db.first_damage(record.outputs):
        state, why = "damaged", f"{lost} is missing or damaged"
    elif earlier := artifacts.outdated(stage):
        state, why = "stale", f"made from an earlier {earlier}"
    return StageStatus(stage.name, state, why, record.counts, len(sizes), sum(sizes))


Plan = Literal["current", "run", "maybe"]


@dataclass(frozen=True)
class StagePlan:
    """The plan for a stage.

    Attributes
    ----------
    stage: its name.
    plan: "current": it would not run; "run"; "maybe": it would run if a stage before it changes its
        outputs.
    reasons: one line each.
    textures: for the stage of this name, the textures that it would encode, as far as known.
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
    """The plan of `build_scene` for each stage, in their order.

    Raises the errors of `build_scene` for a missing model, impossible options, and a folder that is
    not this model's database.
    """
    from ptmtools.scene.ingestion import check_file

    chosen = chosen_options(options)
    with (
        model_file(model) as (file, _),
        folder_to_build(db, new=True, force=force) as (folder, remote),
    ):
        check_file(file)
        database = DatabaseFolder(folder, starting_manifest(folder, file.name, force=force))
        database.elsewhere = remote
        database.manifest = database.without_lost()
        artifacts = Artifacts(database, file, planned=True)
        artifacts.chosen = chosen
        #: Stages whose outputs may change.
        changing: set[Stage[Any]] = set()
        plans = tuple(_plan(artifacts, stage, chosen[stage], changing) for stage in STAGES.values())
        database.digests.save()
    return plans


def _plan(
    artifacts: Artifacts, stage: Stage[Any], options: Options, changing: set[Stage[Any]]
) -> StagePlan:
    """The plan of a stage, after those that it reads; adds it to ``changing`` if it belongs
    there."""
    before = artifacts.before(stage)
    anew = [read.name for read in stage.sources(options) if read in changing]
    if stage.opens_inputs and anew:
        recorded, choices = before.inputs if before else {}, artifacts.choices(stage)
        inputs = {name: choices.get(name, digest) for name, digest in recorded.items()}
    else:
        inputs = stage.inputs(artifacts, options)
    work = stage.work(options, inputs)
    why = reasons(stage.name, before, work, artifacts.db, stage.changed)
    tasks = stage.tasks(artifacts, work)
    plan: Plan = "run" if why else "maybe" if anew else "current"
    if plan == "maybe":
        why = (f"if the stage {' or '.join(f'`{name}`' for name in anew)} changes its files",)
    known = plan == "run" and stage.foresee(artifacts, work)
    if plan != "current" and not known:
        changing.add(stage)
    return StagePlan(stage.name, plan, why, tuple(Path(name).stem for name in tasks))
