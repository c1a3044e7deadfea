"""The check of a database, of another folder that ptmtools writes, or of a `.ptm` file.

The artifacts of the stages: whether each can be read and belongs to the others, and whether the
manifest counts it right.

They are read as the stages read them. A file whose hash is wrong is left to the check of the
hashes; here are those that are damaged although the hash is right: a manifest repaired by hand, a
stage taken from another build.

Folders that are no databases: a table of their kinds, each told by the name of its index.

`ptm info` and `ptm validate` look a folder up here, and nothing else branches on a kind: a new one
is a line in the table."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells import Cells, structural_triangles
from ptmtools.diagnostics import Findings, Issue, Severity, ValidationReport, worst_first
from ptmtools.errors import DatabaseError
from ptmtools.lazy import Lazy
from ptmtools.output import validate_database, validate_ptm
from ptmtools.output.validation.findings import CODES
from ptmtools.pipeline.command import open_database
from ptmtools.pipeline.stage import Artifacts
from ptmtools.pipeline.stage import Stage
from ptmtools.pipeline.stages import APO, CELLS, PVS, STAGES
from ptmtools.progress import Progress, silent
from ptmtools.store.folder import DatabaseFolder
from ptmtools.store.layout import MANIFEST
from ptmtools.texture.model import Limits
from ptmtools.visibility import Pvs, SegmentReport, check_conservative


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


@dataclass(frozen=True)
class FolderKind:
    """What can be done with a folder.

    Attributes
    ----------
    index: the file in it that says what the others are.
    about: what it is, a noun.
    again: the command that writes it.
    codes: what a check can find: code → its severity, and what it means.
    check: checks a folder; what is wrong stands in the report.
    describe: of a folder, what ``ptm info`` prints, line by line, and its record as JSON. Raises
        what reading the index raises.
    """

    index: str
    about: str
    again: str
    codes: Lazy[Mapping[str, tuple[Severity, str]]]
    check: Lazy[Callable[[Path, Limits], ValidationReport]]
    describe: Lazy[Callable[[Path], tuple[tuple[str, ...], Mapping[str, Any]]]]


_LIST = (
    FolderKind(
        index="interlace.json",
        about="interlaced image",
        again="ptm interlace IMAGE",
        codes=Lazy("ptmtools.neighbours.interlace.reading:CODES"),
        check=Lazy("ptmtools.neighbours.interlace.reading:validate_interlaced"),
        describe=Lazy("ptmtools.neighbours.interlace.reading:describe"),
    ),
    FolderKind(
        index="apo.json",
        about="octree texture",
        again="ptm apo MESH",
        codes=Lazy("ptmtools.neighbours.apo.checking:CODES"),
        check=Lazy("ptmtools.neighbours.apo.checking:check_folder"),
        describe=Lazy("ptmtools.neighbours.apo.checking:describe"),
    ),
    FolderKind(
        index="campus.json",
        about="campus",
        again="ptm campus MODEL",
        codes=Lazy("ptmtools.neighbours.campus.validation:CODES"),
        check=Lazy("ptmtools.neighbours.campus.validation:check_campus"),
        describe=Lazy("ptmtools.neighbours.campus.reading:describe_campus"),
    ),
)
#: By the name of the index.
FOLDERS = {kind.index: kind for kind in _LIST}


def kind_of(folder: Path) -> FolderKind | None:
    """The kind of a folder, or None."""
    return next((kind for kind in FOLDERS.values() if (folder / kind.index).is_file()), None)


_LIMITS = Limits()


def validate(
    target: str | os.PathLike[str],
    progress: Progress = silent,
    *,
    limits: Limits = _LIMITS,
    workers: int = 0,
) -> ValidationReport:
    """Checks a database, a folder of `FOLDERS` or a `.ptm` file; what is wrong is in the report.

    ``limits`` and ``workers`` as for `validate_database`.

    Raises
    ------
    DatabaseError: PTM-D001 no database there; PTM-D003 schema of another version.
    InputError: PTM-I602 the file cannot be read.
    """
    file = Path(target)
    if not file.is_dir() and (file.exists() or file.suffix == ".ptm"):
        return validate_ptm(target, limits=limits)
    if kind := kind_of(file):
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
    """Holds the PVS of a database against random segments and the triangles that occlude.

    Raises
    ------
    DatabaseError: PTM-D001 to PTM-D006, as `DatabaseFolder` and `Artifacts`.
    """
    structural, cells, pvs = structure_of(db)
    return check_conservative(structural, cells, pvs, segments, progress=progress)


def structure_of(db: str | os.PathLike[str]) -> tuple[NDArray[np.float64], Cells, Pvs]:
    """The (T, 3, 3) triangles of a database that occlude, its cells and its PVS.

    Raises as `shoot_segments`.
    """
    artifacts = Artifacts(open_database(db))
    options, scene, cells = artifacts.recorded(CELLS), artifacts[APO], artifacts[CELLS]
    corners = scene.corners[structural_triangles(scene, options, cells.opened)]
    return corners, cells, artifacts[PVS]
