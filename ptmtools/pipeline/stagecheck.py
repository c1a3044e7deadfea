"""The artifacts of the stages: whether each can be read and belongs to the others, and whether the
manifest counts it right.

They are read as the stages read them. A file whose hash is wrong is left to the check of the
hashes; here are those that are damaged although the hash is right: a manifest repaired by hand, a
stage taken from another build.
"""

from __future__ import annotations

import os
from collections.abc import Collection
from contextlib import suppress
from typing import Any

from ptmtools.database.validation.findings import CODES
from ptmtools.errors import DatabaseError
from ptmtools.findings import Findings, Issue
from ptmtools.pipeline.run import Artifacts
from ptmtools.pipeline.stage import Stage
from ptmtools.pipeline.stages import STAGES
from ptmtools.store.folder import DatabaseFolder
from ptmtools.store.layout import MANIFEST


def check_stages(db: DatabaseFolder, astray: Collection[str] = ()) -> tuple[Issue, ...]:
    """What is wrong with the stages that have run. ``astray`` are files of which that is known,
    relative to the database: what needs them is passed over."""
    found = Findings(CODES)
    for name in db.manifest.stages.keys() - STAGES.keys():
        found.add("PTM-D650", MANIFEST, f"stages.{name}", "this ptmtools has no such stage")
    together = Artifacts(db)
    for stage in STAGES.values():
        if stage.name in db.manifest.stages:
            _check_stage(stage, db, together, astray, found)
        if not together.is_stored(stage):
            with suppress(DatabaseError):  # which is that of the stage that it could have changed
                together[stage]
    return found.issues()


def _check_stage(
    stage: Stage[Any],
    db: DatabaseFolder,
    together: Artifacts,
    astray: Collection[str],
    found: Findings,
) -> None:
    alone = Artifacts(db)
    if alone.record(stage).recipe != stage.recipe:
        if stage.artifact:  # what is served stands by itself
            message = "made by another release of ptmtools; run build-scene"
            found.add("PTM-D656", MANIFEST, f"stages.{stage.name}", message)
        return
    try:
        alone.recorded(stage)
    except DatabaseError as fault:
        found.add("PTM-D650", MANIFEST, f"stages.{stage.name}.parameters", fault.message)
    if stage.artifact is None or not alone.is_stored(stage):
        return
    try:
        made = alone[stage]
    except DatabaseError as fault:
        _add("PTM-D720", fault, db, astray, found)
        return
    try:
        together[stage]
    except DatabaseError as fault:
        _add("PTM-D721", fault, db, astray, found)
    assert stage.counts
    recorded = alone.record(stage).counts
    for name, true in stage.counts(made).items():
        if name in recorded and recorded[name] != true:
            message = f"is {recorded[name]!r}, but the stage has {true!r}"
            found.add("PTM-D659", MANIFEST, f"stages.{stage.name}.counts.{name}", message)
    if stage.check:
        for file, place, message in stage.check.load()(alone, made):
            found.add("PTM-D721", file, place, message)


def _add(
    code: str, fault: DatabaseError, db: DatabaseFolder, astray: Collection[str], found: Findings
) -> None:
    file = os.path.relpath(fault.file or db.path, db.path).replace(os.sep, "/")
    if file not in astray:
        found.add(code, MANIFEST if file == "." else file, "", fault.message)
