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
from ptmtools.store.layout import arrays_of
from ptmtools.store.manifest import StageRecord
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
    planning = _Planning(artifacts, chosen)
    plans = tuple(planning.plan(stage) for stage in STAGES.values())
    artifacts.db.digests.save()
    return plans


class _Planning:
    def __init__(self, artifacts: Artifacts, options: Mapping[Stage[Any], Options]) -> None:
        self._artifacts, self._options = artifacts, options
        #: Stages of which others may read something else than there is.
        self._changing: set[Stage[Any]] = set()

    def plan(self, stage: Stage[Any]) -> StagePlan:
        """Of a stage, after those that it reads."""
        before, work = self._artifacts.before(stage), self._work(stage)
        why = reasons(before, work, self._artifacts.db)
        tasks = stage.tasks.load()(self._artifacts, work) if stage.tasks else []
        textures = tuple(Path(name).stem for name in tasks)
        reads = stage.read_with(self._options[stage])
        anew = [read.name for read in reads if read in self._changing]
        plan: Plan = "run" if why else "maybe" if anew else "current"
        if plan == "maybe":
            why = (f"if {' or '.join(anew)} makes other files than there are",)
        known = plan == "run" and stage.foresee and stage.foresee.load()(self._artifacts, work)
        if plan != "current" and not known:
            self._changing.add(stage)
        return StagePlan(stage.name, plan, why, textures)

    def _work(self, stage: Stage[Any]) -> StageRecord:
        """What the stage would do, of the files as they are."""
        artifacts, options = self._artifacts, self._options[stage]
        before = artifacts.before(stage)
        reads = stage.read_with(options)
        if stage.inputs and not self._changing.intersection(reads):
            inputs = stage.inputs.load()(artifacts)
        elif stage.inputs:
            inputs = before.inputs if before else {}
        else:
            inputs = {}
            for read in reads:
                record = artifacts.before(read)
                outputs = record.outputs if record else {}
                name = arrays_of(read.name)
                inputs |= {name: outputs.get(name, "")} if read.artifact else outputs
        return work_of(stage, options, inputs)
