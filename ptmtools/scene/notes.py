"""The notes of ingest as lines, and which of them are warnings; codes are in docs/guide/cli.md."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from ptmtools.scene.model import Note

#: The codes of warnings, in the order in which they are told. All numbers are wrong in a model that
#: lies on its side or has another unit; nothing is seen in one that is inside out; surfaces are
#: plain without their materials and images, and there are holes where faces, or whole products, are
#: missing.
WARNINGS = (
    "PTM-N234",
    "PTM-N232",
    "PTM-N227",
    "PTM-N233",
    "PTM-N235",
    "PTM-N203",
    "PTM-N204",
    "PTM-N205",
    "PTM-N206",
    "PTM-N207",
    "PTM-N210",
    "PTM-N253",
    "PTM-N259",
    "PTM-N244",
)


#: The runner-up of the up axis: no warning, and shown without ``-v`` all the same.
RUNNER_UP = "PTM-N238"
#: Of no meaning where a model is looked at from outside, as statues and the buildings of a campus
#: are: there a face that is turned away from all rooms is as it should be.
OF_ROOMS = frozenset({"PTM-N235"})


def outside(notes: Iterable[Note]) -> list[Note]:
    """Those that matter to who stands outside."""
    return [note for note in notes if note.code not in OF_ROOMS]


def line(note: Note, more: int = 0) -> str:
    """A note in one line, which may stand for more of its code."""
    where = f"{note.place}: " if note.place else ""
    times = f" ({note.count:,} times)" if note.count > 1 else ""
    others = f", and {more:,} more like it" if more else ""
    return f"{where}{note.message}{times}{others} [{note.code}]"


def warnings(notes: Iterable[Note]) -> Iterator[str]:
    """The gravest of some notes, a line for each code."""
    by_code: dict[str, list[Note]] = {}
    for note in notes:
        by_code.setdefault(note.code, []).append(note)
    for code in WARNINGS:
        if code in by_code:
            yield line(by_code[code][0], len(by_code[code]) - 1)
