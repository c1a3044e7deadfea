"""VRML97: a root, a file for every cell, and the hints that refer to these."""

from __future__ import annotations

from ptmtools.database.emitters.emitter import Emitter
from ptmtools.database.names import CELL_FOLDER, HINTS, ROOT
from ptmtools.lazy import Lazy

VRML = Emitter(
    name="vrml",
    about="VRML97 files and hints.json",
    owns=(ROOT, HINTS, f"{CELL_FOLDER}/"),
    entry=ROOT,
    writer=Lazy("ptmtools.database.vrml.root:vrml_files"),
    reader=Lazy("ptmtools.database.validation.vrml:read_file"),
    check=Lazy("ptmtools.database.validation.vrml:check_files"),
)
