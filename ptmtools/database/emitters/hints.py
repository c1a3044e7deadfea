"""The hints, which go with every form of the cells: an index, a record of each, statistics."""

from __future__ import annotations

from ptmtools.database.emitters.emitter import Emitter
from ptmtools.database.names import HINTS, HINTS_FOLDER
from ptmtools.lazy import Lazy

HINTS_EMITTER = Emitter(
    name="hints",
    about="hints.json, and a record and a first-look bundle of each cell",
    owns=(HINTS, f"{HINTS_FOLDER}/"),
    writer=Lazy("ptmtools.database.hints.files:hints_files"),
    reader=Lazy("ptmtools.database.validation.hints:read_file"),
    check=Lazy("ptmtools.database.validation.hints:check_files"),
    entry=HINTS,
)
