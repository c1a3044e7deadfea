"""VRML97: a root, a file for every cell, and the hints that refer to these."""

from __future__ import annotations

from ptmtools.database.emitters.emitter import Emitter
from ptmtools.database.names import CELL_FOLDER, HINTS, ROOT

VRML = Emitter(
    name="vrml",
    title="VRML97 files and hints.json",
    owns=(ROOT, HINTS, f"{CELL_FOLDER}/"),
    entry=ROOT,
    writer="ptmtools.database.vrml.files:vrml_files",
    reader="ptmtools.database.validation.vrml:read_file",
    check="ptmtools.database.validation.vrml:check_files",
)
