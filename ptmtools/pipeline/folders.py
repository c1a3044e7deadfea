"""Folders that are no databases: a table of their kinds, each told by the name of its index.

`ptm info` and `ptm validate` look a folder up here, and nothing else branches on a kind: a new one
is a line in the table.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ptmtools.findings import Severity, ValidationReport
from ptmtools.lazy import Lazy
from ptmtools.texture.model import Limits


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
        codes=Lazy("ptmtools.interlace.checking:CODES"),
        check=Lazy("ptmtools.interlace.checking:validate_interlaced"),
        describe=Lazy("ptmtools.interlace.reading:describe"),
    ),
    FolderKind(
        index="apo.json",
        about="octree texture",
        again="ptm apo MESH",
        codes=Lazy("ptmtools.apo.checking:CODES"),
        check=Lazy("ptmtools.apo.checking:check_folder"),
        describe=Lazy("ptmtools.apo.checking:describe"),
    ),
    FolderKind(
        index="campus.json",
        about="campus",
        again="ptm campus MODEL",
        codes=Lazy("ptmtools.campus.validation:CODES"),
        check=Lazy("ptmtools.campus.validation:check_campus"),
        describe=Lazy("ptmtools.campus.description:describe_campus"),
    ),
)
#: By the name of the index.
FOLDERS = {kind.index: kind for kind in _LIST}


def kind_of(folder: Path) -> FolderKind | None:
    """The kind of a folder, or None."""
    return next((kind for kind in FOLDERS.values() if (folder / kind.index).is_file()), None)
