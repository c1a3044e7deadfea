"""All VRML files of a database: the cells, and `root.wrl`, where a walk can begin."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from ptmtools.database.content import Content
from ptmtools.database.floats import decimal, row_texts, single
from ptmtools.database.names import ROOT, VRML_FILES, path_of
from ptmtools.database.vrml.cell import CellWriter
from ptmtools.database.vrml.pattern import HEADER, PATTERN, VIEWPOINT_CELL, declaration
from ptmtools.database.vrml.text import listed, quoted


def vrml_files(content: Content) -> Iterator[tuple[str, str]]:
    """Path, relative to the served folder, and text of each file.

    Raises DatabaseError: PTM-D601 a number is not finite in float32; PTM-D603 a cell is flat: at
    once.
    """
    return _files(content, CellWriter(content))


def _files(content: Content, writer: CellWriter) -> Iterator[tuple[str, str]]:
    boxes, count = [], content.cells.cell_count
    for c in range(count):
        content.progress(c, count, "cells")
        text, box = writer.cell(c)
        boxes.append(box)
        yield path_of(c, VRML_FILES), text
    content.progress(count, count, "cells")
    yield ROOT, _root_text(content, boxes)


def _root_text(content: Content, boxes: Sequence[NDArray[np.float32]]) -> str:
    """The root file; ``boxes`` are the (2, 3) bounds of every cell's contents."""
    viewpoints, options = content.viewpoints, content.options
    info = [quoted(f"ptm:database {PATTERN}")]
    entered = [path_of(v.cell, VRML_FILES) for v in viewpoints]
    info += [
        quoted(f"ptm:viewpoint {v.name} {url}") for v, url in zip(viewpoints, entered, strict=True)
    ]
    avatar = ", ".join(decimal(x) for x in options.avatar(content.cells.walker))
    parts = [
        HEADER,
        declaration(*VIEWPOINT_CELL),
        f"WorldInfo {{\n  title {quoted(options.title)}\n  info {listed(info, 1)}\n}}\n",
        f'NavigationInfo {{ type [ "WALK", "ANY" ] avatarSize [ {avatar} ] headlight TRUE }}\n',
    ]
    poses = (
        row_texts(single([np.ravel(getattr(v, name)) for v in viewpoints], "viewpoints"))
        for name in ("position", "orientation", "field_of_view")
    )
    parts += [
        f"DEF {v.name} Viewpoint {{ position {position} orientation {turn}"
        f" fieldOfView {field} description {quoted(v.description)} }}\n"
        for v, position, turn, field in zip(viewpoints, *poses, strict=True)
    ]
    parts += [
        f"PTMViewpointCell {{ viewpoint {quoted(v.name)} cellUrl [ {quoted(url)} ] }}\n"
        for v, url in zip(viewpoints, entered, strict=True)
    ]
    for cell, (centre, size) in enumerate(zip(*map(row_texts, _centred(boxes)), strict=True)):
        url = quoted(path_of(cell, VRML_FILES))
        parts.append(f"Inline {{ url [ {url} ] bboxCenter {centre} bboxSize {size} }}\n")
    return "".join(parts)


def _centred(
    boxes: Sequence[NDArray[np.float32]],
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Centres and sizes (n, 3) in float32 that together hold the boxes (n, 2, 3): sizes are rounded
    up."""
    low, high = np.moveaxis(np.array(boxes, np.float64), 1, 0)
    centre = single((low + high) / 2, "bounding boxes")
    half = np.maximum(high - centre, centre - low)
    size = single(2 * half, "bounding boxes")
    short = size.astype(np.float64) < 2 * half
    return centre, np.where(short, np.nextafter(size, np.float32(np.inf)), size)
