"""What a build would do, and why, without doing it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from ptmtools.errors import DatabaseError
from ptmtools.pipeline.changes import reasons
from ptmtools.pipeline.folder import DatabaseFolder
from ptmtools.pipeline.manifest import StageRecord
from ptmtools.pipeline.options import BuildOptions
from ptmtools.pipeline.run import work_of
from ptmtools.pipeline.scenes import repainted, scene_work
from ptmtools.pipeline.stages import IMAGE_LIST, READS, STAGES, arrays_of, image_rows
from ptmtools.pipeline.textures import stale_textures, texture_inputs
from ptmtools.pipeline.writer import admitted
from ptmtools.texture.options import check_options

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
    model: str | os.PathLike[str], db: str | os.PathLike[str], options: BuildOptions | None = None
) -> tuple[StagePlan, ...]:
    """The stages in their order, and what `build_scene` would do with each. Nothing is written.

    Raises what `build_scene` raises for a model that is not there, impossible options, and a
    folder that is not this model's database.
    """
    from ptmtools.scene.ingestion import check_file

    options = options or BuildOptions()
    check_options(options.textures)
    check_file(Path(model))
    folder = Path(db)
    return _Planning(
        DatabaseFolder(folder, admitted(folder, Path(model).name, force=options.force)),
        Path(model),
        options,
    ).stages()


class _Planning:
    def __init__(self, db: DatabaseFolder, model: Path, options: BuildOptions) -> None:
        self._db = db
        self._model = model
        self._options = options
        self._plans: dict[str, StagePlan] = {}

    def stages(self) -> tuple[StagePlan, ...]:
        scene = scene_work(
            self._model, self._options.ingest, self._before("scene"), self._db.digests
        )
        why = reasons(self._before("scene"), scene, self._db)
        images, known = self._images(scene)
        self._note("scene", why, ())
        # Where only plain images have been painted over, the arrays of the scene stay.
        source = () if known else ("scene",)
        self._plan("cells", self._options.subdivide, source)
        self._plan("pvs", self._options.pvs, ("cells",))
        self._plan("ach", self._options.ach, (*source, "cells", "pvs"))
        self._plan_textures(images, source)
        self._plan("emit", self._options.emit, (*source, "cells", "pvs", "ach", "textures"))
        self._db.digests.save()
        return tuple(self._plans[stage] for stage in STAGES)

    def _before(self, stage: str) -> StageRecord | None:
        return self._db.manifest.stages.get(stage)

    def _images(self, work: StageRecord) -> tuple[dict[str, str], bool]:
        """Name → SHA-256 of the images as they would be, and whether that is known before the
        scene is read."""
        before = self._before("scene")
        try:
            rows = image_rows(self._db.read_output("scene", IMAGE_LIST))
        except (DatabaseError, ValueError, KeyError, TypeError):
            return {}, False
        changed = None if before is None else repainted(before, work, rows)
        if changed is None:
            return {}, False
        files = {i: work.inputs[name] for i, name in changed.items()}
        return {r["name"]: files.get(i, r["sha256"]) for i, r in enumerate(rows)}, True

    def _plan(self, stage: str, options: Any, after: tuple[str, ...]) -> None:
        there = self._db.manifest.outputs()
        inputs = {arrays_of(name): there.get(arrays_of(name), "") for name in READS[stage]}
        if stage == "emit" and (textures := self._before("textures")):
            inputs |= textures.outputs
        work = work_of(stage, options, inputs)
        self._note(stage, reasons(self._before(stage), work, self._db), after)

    def _plan_textures(self, images: dict[str, str], source: tuple[str, ...]) -> None:
        before = self._before("textures")
        if source:
            inputs: Mapping[str, str] = before.inputs if before else {}
        else:
            inputs = texture_inputs(images)
        work = work_of("textures", self._options.textures, inputs)
        names = tuple(Path(name).stem for name in stale_textures(before, work))
        self._note("textures", reasons(before, work, self._db), source, names)

    def _note(
        self,
        stage: str,
        why: tuple[str, ...],
        after: tuple[str, ...],
        textures: tuple[str, ...] = (),
    ) -> None:
        """``after`` are the stages whose files it reads."""
        anew = [name for name in after if self._plans[name].plan != "current"]
        if not why and anew:
            told = f"if {' or '.join(anew)} makes other files than there are"
            self._plans[stage] = StagePlan(stage, "maybe", (told,), textures)
        else:
            self._plans[stage] = StagePlan(stage, "run" if why else "current", why, textures)
