"""The check of a database or a `.ptm` file, whichever it is given."""

from __future__ import annotations

import os
from pathlib import Path

from ptmtools.cells import SubdivideOptions, structural_triangles
from ptmtools.database import ValidationReport, validate_database, validate_ptm
from ptmtools.errors import DatabaseError
from ptmtools.pipeline.folder import DatabaseFolder
from ptmtools.pipeline.run import Artifacts
from ptmtools.progress import Progress, silent
from ptmtools.visibility import SegmentReport, check_conservative


def validate(target: str | os.PathLike[str], progress: Progress = silent) -> ValidationReport:
    """Checks a database folder or a `.ptm` file; what is wrong stands in the report.

    Raises
    ------
    DatabaseError: PTM-D001 no database there; PTM-D003 schema of another version.
    InputError: PTM-I602 the file cannot be read.
    """
    if not Path(target).is_dir():
        return validate_ptm(target)
    try:
        DatabaseFolder.open(target)
    except DatabaseError as fault:
        if fault.code != "PTM-D002":  # a damaged manifest is a finding among others
            raise
    return validate_database(target, progress)


def shoot_segments(
    db: str | os.PathLike[str], segments: int, progress: Progress = silent
) -> SegmentReport:
    """Holds the PVS of a database against random segments and the triangles that occlude.

    Raises
    ------
    DatabaseError: PTM-D001 to PTM-D006, as `DatabaseFolder` and `Artifacts`.
    """
    held = Artifacts(DatabaseFolder.open(db))
    cut = held.db.record("cells").parameters
    options = SubdivideOptions(
        structural=tuple(cut.get("structural", ())), detail=tuple(cut.get("detail", ()))
    )
    corners = held.scene.corners[structural_triangles(held.scene, options)]
    return check_conservative(corners, held.cells, held.pvs, segments, progress=progress)
