"""The files of the hints, in the order in which they refer to each other: the index comes last."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ptmtools.database.hints.first_look import FirstLooks
from ptmtools.database.hints.index import index_text
from ptmtools.database.hints.record import RecordWriter
from ptmtools.database.hints.statistics import statistics_text
from ptmtools.database.names import FIRST_LOOK_FILES, HINTS, RECORD_FILES, STATISTICS, path_of

if TYPE_CHECKING:
    from ptmtools.database.content import Content


def hints_files(content: Content) -> Iterator[tuple[str, str | bytes]]:
    """Path, relative to the served folder, and contents of each file.

    Raises DatabaseError: PTM-D601 a number is not finite: for the index, at once.
    """
    return _files(content, index_text(content))


def _files(content: Content, index: str) -> Iterator[tuple[str, str | bytes]]:
    looks = FirstLooks(content) if content.options.first_look else None
    writer, count = RecordWriter(content), content.cells.cell_count
    for cell in range(count):
        content.progress(cell, count, "hints")
        pieces = looks.pieces(cell) if looks else None
        yield path_of(cell, RECORD_FILES), writer.record(cell, pieces)
        if looks and pieces:
            yield path_of(cell, FIRST_LOOK_FILES), looks.bundle(pieces)
    content.progress(count, count, "hints")
    yield STATISTICS, statistics_text(content)
    yield HINTS, index
