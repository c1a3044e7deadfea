"""All VRML files of a database, and the hints beside them, in the order in which they refer to each
other: cells, hints, root."""

from __future__ import annotations

from collections.abc import Iterator

from ptmtools.database.content import Content
from ptmtools.database.names import HINTS, ROOT, cell_path
from ptmtools.database.vrml.cell import CellWriter
from ptmtools.database.vrml.root import root_text


def vrml_files(content: Content) -> Iterator[tuple[str, str]]:
    """Path, relative to the served folder, and text of each file.

    Raises
    ------
    DatabaseError: PTM-D601 a number is not finite in float32; PTM-D603 a cell is flat: at once.
    """
    return _files(content, CellWriter(content))


def _files(content: Content, writer: CellWriter) -> Iterator[tuple[str, str]]:
    boxes, count = [], content.cells.cell_count
    for c in range(count):
        content.progress(c, count, "cells")
        cell = writer.cell(c)
        boxes.append(cell.box)
        yield cell_path(c), cell.text
    content.progress(count, count, "cells")
    yield HINTS, content.hints(cell_path)
    yield ROOT, root_text(content.viewpoints, boxes, content.options)
