"""VRML97: a root, and a file for every cell."""

from __future__ import annotations

from ptmtools.database.emitters.emitter import Emitter
from ptmtools.database.names import CELL_FOLDER, ROOT, VRML_FILES
from ptmtools.lazy import Lazy

VRML = Emitter(
    name="vrml",
    about="VRML97 files",
    owns=(ROOT, f"{CELL_FOLDER}/"),
    writer=Lazy("ptmtools.database.vrml.root:vrml_files"),
    reader=Lazy("ptmtools.database.validation.vrml:read_file"),
    check=Lazy("ptmtools.database.validation.vrml:check_files"),
    entry=ROOT,
    cell_files=VRML_FILES,
)
