"""Checks a database, another folder that ptmtools writes, or a `.ptm` file.

`check_stages` reads the artifacts as the stages do: each must be readable, fit the others, and have
the counts of the manifest. Files with a wrong hash are reported by `validate_database`; here are
those that are damaged although their hash is right, after a manifest was repaired by hand or a
stage was taken from another build.

Other folders have checks of their own (`ptmtools.folder_kinds`).
"""

from __future__ import annotations

import os
from collections.abc import Collection
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from ptmtools.cells import structural_triangles
from ptmtools.diagnostics import CODES, Findings, Issue, ValidationReport, worst_first
from ptmtools.errors import DatabaseError
from ptmtools.folder_kinds import folder_kind
from ptmtools.output import validate_database, validate_ptm
from ptmtools.pipeline.artifacts import Artifacts
from ptmtools.pipeline.command import open_database
from ptmtools.pipeline.stage import Stage
from ptmtools.pipeline.stages import CELLS, PVS, SCENE, STAGES
from ptmtools.progress import Progress, silent
from ptmtools.store.folder import DatabaseFolder
from ptmtools.store.layout import MANIFEST
from ptmtools.texture.model import Limits
from ptmtools.visibility import SegmentReport, check_conservative


def check_stages(db: DatabaseFolder, faulty: Collection[str] = ()) -> tuple[Issue, ...]:
    """The faults of the stages that have run. ``faulty`` are files with known faults, relative to
    the database: artifacts that need them are not checked."""
    findings = Findings(CODES)
    db.manifest = db.without_lost()
    for name in db.manifest.stages.keys() - STAGES.keys():
        findings.add("PTM-D650", MANIFEST, f"stages.{name}", "this ptmtools has no such stage")
    together = Artifacts(db)
    for stage in STAGES.values():
        if stage.name in db.manifest.stages:
            _check_stage(stage, together, faulty, findings)
        if stage.changes and not together.is_stored(stage):
            with suppress(DatabaseError):  # reported for the stage that it could have changed
                together.original(stage)
    return findings.issues()


def _check_stage(
    stage: Stage[Any], together: Artifacts, faulty: Collection[str], findings: Findings
) -> None:
    """Checks that the artifact of a stage is readable, fits the others, and has its recorded
    counts."""
    db = together.db
    alone = Artifacts(db)
    record = alone.record(stage)
    if record.recipe != stage.recipe:
        if stage.artifact:  # served files do not depend on the release that reads them
            message = "made by another release of ptmtools; run build-scene"
            findings.add("PTM-D656", MANIFEST, f"stages.{stage.name}", message)
        return
    try:
        alone.recorded(stage)
    except DatabaseError as fault:
        findings.add("PTM-D650", MANIFEST, f"stages.{stage.name}.parameters", fault.message)
    if stage.artifact is None or not alone.is_stored(stage):
        return
    try:
        artifact = alone.original(stage)
    except DatabaseError as fault:
        _add("PTM-D720", fault, db, faulty, findings)
        return
    try:
        together.original(stage)
    except DatabaseError as fault:
        _add("PTM-D720", fault, db, faulty, findings)
    for name, count in stage.counts(artifact).items():
        if record.counts.get(name, count) != count:
            message = f"is {record.counts[name]!r}, but the stage has {count!r}"
            findings.add("PTM-D699", MANIFEST, f"stages.{stage.name}.counts.{name}", message)
    for file, place, message in stage.missing(alone, artifact):
        findings.add("PTM-D720", file, place, message)


def _add(
    code: str, fault: DatabaseError, db: DatabaseFolder, faulty: Collection[str], findings: Findings
) -> None:
    file = os.path.relpath(fault.file or db.path, db.path).replace(os.sep, "/")
    if file not in faulty:
        findings.add(code, MANIFEST if file == "." else file, "", fault.message)


_LIMITS = Limits()


def validate(
    target: str | os.PathLike[str],
    progress: Progress = silent,
    *,
    limits: Limits = _LIMITS,
    workers: int = 0,
) -> ValidationReport:
    """Checks a database, a folder of `folder_kinds` or a `.ptm` file.

    ``limits`` and ``workers`` as for `validate_database`.

    Raises
    ------
    DatabaseError: PTM-D001 no database there; PTM-D003 schema of another version.
    InputError: PTM-I122 the file cannot be read.
    """
    file = Path(target)
    if not file.is_dir() and (file.exists() or file.suffix == ".ptm"):
        return validate_ptm(target, limits=limits)
    if kind := folder_kind(file):
        return kind.check.load()(file, limits)
    db = None
    try:
        db = open_database(target)
    except DatabaseError as fault:
        if fault.code != "PTM-D002":  # a damaged manifest is a finding among others
            raise
    report = validate_database(target, progress, limits=limits, workers=workers)
    if db is None:
        return report
    issues = (*report.issues, *check_stages(db, {issue.file for issue in report.issues}))
    return replace(report, issues=worst_first(issues))


def shoot_segments(
    db: str | os.PathLike[str], segments: int, progress: Progress = silent
) -> SegmentReport:
    """Compares the PVS of a database with random segments and the occluding triangles.

    Raises
    ------
    DatabaseError: PTM-D001 to PTM-D006, as `DatabaseFolder` and `Artifacts`.
    """
    artifacts = Artifacts(open_database(db))
    options, scene, cells = artifacts.recorded(CELLS), artifacts[SCENE], artifacts[CELLS]
    corners = scene.corners[structural_triangles(scene, options, cells.opened)]
    return check_conservative(corners, cells, artifacts[PVS], segments, progress=progress)
