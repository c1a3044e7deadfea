"""What a build would do, and why, without doing it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from ptmtools.pipeline.build import chosen_options
from ptmtools.pipeline.changes import reasons
from ptmtools.pipeline.run import Artifacts, work_of
from ptmtools.pipeline.stage import Options, Stage
from ptmtools.pipeline.stages import STAGES
from ptmtools.store.folder import DatabaseFolder
from ptmtools.store.writer import admitted

Plan = Literal["current", "run", "maybe"]


@dataclass(frozen=True)
class StagePlan:
    """What would become of a stage.

    Attributes
    ----------
    stage: its name.
    plan: "current": nothing; "run"; "maybe": it would run if a stage before it makes other files
        than there are.
    reasons: why, one line each.
    textures: of the stage of this name, those that would be encoded, as far as is known.
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
    """The stages in their order, and what `build_scene` would do with each. Nothing is written.

    Raises what `build_scene` raises for a model that is not there, impossible options, and a
    folder that is not this model's database.
    """
    from ptmtools.scene.ingestion import check_file

    chosen = chosen_options(options)
    check_file(Path(model))
    folder = Path(db)
    artifacts = Artifacts(
        DatabaseFolder(folder, admitted(folder, Path(model).name, force=force)), Path(model)
    )
    #: Stages of which others may read something else than there is.
    changing: set[Stage[Any]] = set()
    plans = tuple(_plan(artifacts, stage, chosen[stage], changing) for stage in STAGES.values())
    artifacts.db.digests.save()
    return plans


def _outputs(artifacts: Artifacts, stage: Stage[Any]) -> Mapping[str, str]:
    record = artifacts.before(stage)
    return record.outputs if record else {}


def _plan(
    artifacts: Artifacts, stage: Stage[Any], options: Options, changing: set[Stage[Any]]
) -> StagePlan:
    """Of a stage, after those that it reads; it is added to those ``changing`` where it is one."""
    before = artifacts.before(stage)
    anew = [read.name for read in stage.sources(options) if read in changing]
    # What it would do, of the files as they are.
    inputs: dict[str, str] = {}
    if not stage.inputs:
        inputs |= stage.files_read(options, lambda read: _outputs(artifacts, read))
    elif not anew:
        inputs |= stage.inputs.load()(artifacts, options)
    elif before:
        inputs |= before.inputs
    work = work_of(stage, options, inputs)
    why = reasons(before, work, artifacts.db, stage.changed)
    tasks = stage.tasks.load()(artifacts, work) if stage.tasks else []
    plan: Plan = "run" if why else "maybe" if anew else "current"
    if plan == "maybe":
        why = (f"if {' or '.join(anew)} makes other files than there are",)
    known = plan == "run" and stage.foresee and stage.foresee.load()(artifacts, work)
    if plan != "current" and not known:
        changing.add(stage)
    return StagePlan(stage.name, plan, why, tuple(Path(name).stem for name in tasks))
