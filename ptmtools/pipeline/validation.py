"""The check of a database, of another folder that ptmtools writes, or of a `.ptm` file."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells import Cells, structural_triangles
from ptmtools.database import validate_database, validate_ptm
from ptmtools.errors import DatabaseError
from ptmtools.findings import ValidationReport, worst_first
from ptmtools.pipeline.command import open_database
from ptmtools.pipeline.folders import kind_of
from ptmtools.pipeline.run import Artifacts
from ptmtools.pipeline.stagecheck import check_stages
from ptmtools.pipeline.stages import APO, CELLS, PVS
from ptmtools.progress import Progress, silent
from ptmtools.texture.model import Limits
from ptmtools.visibility import Pvs, SegmentReport, check_conservative

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
