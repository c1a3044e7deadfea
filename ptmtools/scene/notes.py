"""The notes of an ingest: their collection, their text, and which of them are warnings.

docs/formats/codes.md lists the codes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import unquote

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.errors import InputError
from ptmtools.scene.model import Camera, Note
from ptmtools.scene.reference import ModelFolder

#: Codes of warnings in the order of printing, the most serious first: orientation and unit, which
#: make all numbers wrong; a model that is inside out; missing materials and images; missing faces
#: and products.
WARNINGS = (
    "PTM-N234",
    "PTM-N232",
    "PTM-N236",
    "PTM-N227",
    "PTM-N233",
    "PTM-N235",
    "PTM-N203",
    "PTM-N204",
    "PTM-N205",
    "PTM-N206",
    "PTM-N207",
    "PTM-N126",
    "PTM-N210",
    "PTM-N253",
    "PTM-N244",
)
#: Warnings of which each is printed: what was converted differs from image to image.
EACH = ("PTM-N126",)
#: The second best up axis: not a warning, but a build prints it without ``-v``.
RUNNER_UP = "PTM-N238"
#: What a description of a model prints without ``-v``.
GUESSES = ("PTM-N201", "PTM-N202", RUNNER_UP)
#: Inside out, and rooms of impossible size: irrelevant for models that are viewed from outside,
#: such as statues and campus buildings, whose faces are turned away from the rooms.
OF_ROOMS = ("PTM-N235", "PTM-N236")


class IngestNotes:
    """The notes of one ingest, and the folder in which its files are looked up.

    A *miss* is a note on something that the model requires and that is unavailable: a file, a
    material, a face. With ``strict`` a miss is an error. Note and error share their number: note
    PTM-N203 is error PTM-I203.
    """

    def __init__(self, model: Path, allow_outside: bool = False) -> None:
        self.model = model
        self.folder = ModelFolder(model.absolute().parent, allow_outside)
        self._notes: dict[tuple[str, str, str], int] = {}
        self._misses: dict[tuple[str, str, str], None] = {}
        self._required = True

    def note(self, code: str, message: str, place: str = "", count: int = 1) -> None:
        """Records a guess, a conversion or an omission."""
        key = (code, message, place)
        self._notes[key] = self._notes.get(key, 0) + count

    def miss(self, code: str, message: str, place: str = "", count: int = 1) -> None:
        """Records a note that is an error with ``strict``."""
        if self._required and (code, message, place) not in self._notes:
            self._misses[code, message, place] = None
        self.note(code, message, place, count)

    @contextmanager
    def optional(self) -> Iterator[None]:
        """A context in which the model does not require what it names: a miss is a note."""
        self._required = False
        try:
            yield
        finally:
            self._required = True

    def locate(
        self,
        name: str,
        what: str,
        place: str,
        missing: str = "PTM-N204",
        base: Path | None = None,
        hint: str = "",
    ) -> Path | None:
        """`ModelFolder.find` with a note if the file is elsewhere, outside or missing.

        ``what`` begins the message, ``hint`` ends it if the file is missing.
        """
        result = self.folder.find(name, base)
        if result.outcome == "outside":
            self.miss("PTM-N205", f"{what}: lies outside the model's folder", place)
        elif result.path is None:
            self.miss(missing, f"{what}: not found{hint}", place)
        elif result.outcome == "elsewhere":
            self.note("PTM-N208", f"{what}: found as {self.folder.label(result.path)}", place)
        return result.path

    def locate_first(
        self, uris: Sequence[str], what: str, place: str, base: Path | None = None
    ) -> Path | None:
        """`locate` of the first URI that names a file, or else of the first one; percent signs
        stand for themselves or begin an escape."""
        names = [name for uri in uris for name in (uri, unquote(uri))]
        known = (name for name in names if self.folder.find(name, base).path is not None)
        return self.locate(next(known, names[1]), what, place, base=base)

    def camera(
        self,
        name: str,
        place: str,
        position: Floats,
        direction: Floats,
        field_of_view: float,
    ) -> list[Camera]:
        """The camera of a model, whose direction may have any length; none, and a note, unless it
        is a perspective camera with finite values."""
        with np.errstate(all="ignore"):
            length = float(np.linalg.norm(direction))
        finite = bool(np.isfinite(position).all()) and np.isfinite(length) and length > 0
        if not (finite and 0 < field_of_view < np.pi):
            self.note("PTM-N215", f"camera {name} has no perspective, skipped", place)
            return []
        x, y, z = position.tolist()
        dx, dy, dz = (direction / length).tolist()
        return [Camera(name, (x, y, z), (dx, dy, dz), float(field_of_view))]

    def records(self) -> list[tuple[str, str, str, int, bool]]:
        """All notes for `add_records` in another process: code, message, place, count, and whether
        the note is a miss."""
        return [(*key, count, key in self._misses) for key, count in self._notes.items()]

    def add_records(self, records: Iterable[tuple[str, str, str, int, bool]]) -> None:
        """Adds the `records` of another process."""
        for code, message, place, count, missed in records:
            (self.miss if missed else self.note)(code, message, place, count)

    @property
    def entries(self) -> tuple[Note, ...]:
        return tuple(Note(*key, count) for key, count in self._notes.items())

    def enforce(self) -> None:
        """Raises InputError for the first miss, and names all others."""
        if not self._misses:
            return
        (code, message, place), *others = self._misses
        lines = [line(Note(*miss)) for miss in others]
        raise InputError(
            code.replace("-N", "-I"),
            "; ".join((message, *lines)),
            file=self.model,
            place=place or None,
            remedy="correct the model, or build without --strict",
        )


def exterior_notes(notes: Iterable[Note]) -> list[Note]:
    """The notes that are relevant for a model that is viewed from outside."""
    return [note for note in notes if note.code not in OF_ROOMS]


def line(note: Note, more: int = 0) -> str:
    """The text of a note, with the number of further notes of its code."""
    where = f"{note.place}: " if note.place else ""
    times = f" ({note.count:,} times)" if note.count > 1 else ""
    others = f", and {more:,} more like it" if more else ""
    return f"{where}{note.message}{times}{others} [{note.code}]"


def lines(notes: Iterable[Note]) -> list[str]:
    """The text of notes, one line for those that differ by a name before a colon only."""
    alike: dict[tuple[str, str], list[Note]] = {}
    for note in notes:
        alike.setdefault((note.code, note.message.split(": ", 1)[-1]), []).append(note)
    return [line(group[0], len(group) - 1) for group in alike.values()]


def warnings(notes: Iterable[Note]) -> Iterator[str]:
    """The text of the warnings among some notes, one line for each code but those of `EACH`."""
    by_code: dict[str, list[Note]] = {}
    for note in notes:
        by_code.setdefault(note.code, []).append(note)
    for code in WARNINGS:
        for note in by_code.get(code, ()) if code in EACH else by_code.get(code, ())[:1]:
            yield line(note, 0 if code in EACH else len(by_code[code]) - 1)
