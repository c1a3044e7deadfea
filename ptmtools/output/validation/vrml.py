"""The check of the VRML files: the root and each cell by itself, and against each other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.diagnostics import Place
from ptmtools.output.emitters import VRML
from ptmtools.output.names import CELL_FOLDER, HINTS, ROOT
from ptmtools.output.validation.cells import ReadCell, check_cell, read_cell
from ptmtools.output.validation.files import ServedDatabase
from ptmtools.output.validation.findings import check_graph
from ptmtools.output.vrml import PATTERN
from ptmtools.output.vrml_reader import Document, parse
from ptmtools.tolerance import Tolerance


@dataclass(frozen=True)
class ReadRoot:
    """The content of the root file.

    Attributes
    ----------
    viewpoints: DEF name of each viewpoint → URL of its cell.
    inlines: URL → (2, 3) centre and size of its bounding box, as written; None without one.
    """

    viewpoints: dict[str, str]
    inlines: dict[str, NDArray[np.float64] | None]


def read_root(document: Document, at: Place) -> ReadRoot:
    """The content of the root file; missing parts are left out, with PTM-D663."""
    for type in ("WorldInfo", "NavigationInfo"):
        if len(document.of_type(type)) != 1:
            at.add("PTM-D663", f"not one {type}")
    names = {node.name for node in document.of_type("Viewpoint")}
    viewpoints: dict[str, str] = {}
    for node in document.of_type("PTMViewpointCell"):
        name, urls = node.fields.get("viewpoint", ""), node.fields.get("cellUrl", ())
        if name not in names or name in viewpoints or len(urls) != 1:
            at.add("PTM-D699", f"{name!r} is not one viewpoint", f"line {node.line}")
        else:
            viewpoints[name] = urls[0]
    if not names or set(viewpoints) != names:
        at.add("PTM-D699", "there is no viewpoint, or one without a cell")
    expected = {f"ptm:viewpoint {name} {url}" for name, url in viewpoints.items()}
    for node in document.of_type("WorldInfo"):
        here, info = at.at(f"line {node.line}"), node.fields.get("info", ())
        if info[:1] != (f"ptm:database {PATTERN}",):
            here.add("PTM-D663", "info does not begin with the pattern")
        if {line for line in info if line.startswith("ptm:viewpoint ")} != expected:
            here.add("PTM-D699", "the viewpoints in info are not those of PTMViewpointCell")
    inlines: dict[str, NDArray[np.float64] | None] = {}
    for node in document.of_type("Inline"):
        if "url" not in node.fields:
            continue
        here, urls = at.at(f"line {node.line}"), node.fields["url"]
        if len(urls) != 1:
            here.add("PTM-D663", "an Inline without a URL")
        elif urls[0] in inlines:
            here.add("PTM-D699", f"{urls[0]} is listed twice")
        elif node.lacks:
            inlines[urls[0]] = None
        else:
            inlines[urls[0]] = np.stack([node.fields["bboxCenter"], node.fields["bboxSize"]])
    return ReadRoot(viewpoints, inlines)


def check_root(root: ReadRoot, boxes: Mapping[str, NDArray[np.float64]], at: Place) -> None:
    """Compares the root with the cells, given as URL → (2, 3) bounds of their geometry."""
    for url, box in boxes.items():
        if url not in root.inlines:
            at.add("PTM-D699", f"{url} is not inlined")
            continue
        if (written := root.inlines[url]) is None:
            continue
        centre, size = written.astype(np.float32).astype(np.float64)
        slack = np.spacing(np.abs(box).max(axis=0).astype(np.float32))
        if not (np.abs(box - centre) <= size / 2 + slack).all():
            at.add("PTM-D699", "the bounding box does not contain the cell", url)


def read_file(path: str, data: bytes) -> Document | None:
    """A VRML file; None of other files."""
    return parse(data) if path.endswith(".wrl") else None


def check_files(database: ServedDatabase) -> Mapping[str, int]:
    """Checks all files; counts shapes, triangles and viewpoints."""
    documents = {p: d for p, d in database.contents.items() if isinstance(d, Document)}
    for path, document in documents.items():
        for node in document.nodes:
            for lack in node.lacks:
                database.at(path, node.place).add("PTM-D663", lack)
    cells = _check_cells(documents, database)
    if ROOT in documents:
        _check_root(documents[ROOT], cells, database)
    _check_index(cells, database)
    nodes = [node for document in documents.values() for node in document.nodes]
    index = [node.at("geometry").get("coordIndex") for node in nodes if node.type == "Shape"]
    return {
        "shapes": sum(corners is not None for corners in index),
        "triangles": sum(len(corners) // 4 for corners in index if corners is not None),
        "viewpoints": sum(node.type == "Viewpoint" for node in nodes),
    }


def _check_cells(
    documents: Mapping[str, Document], database: ServedDatabase
) -> dict[str, ReadCell]:
    """The cells by the names of their files."""
    folder = f"{CELL_FOLDER}/"
    cells: dict[str, ReadCell] = {}
    for path, document in documents.items():
        if path.startswith(folder) and (cell := read_cell(document, database.at(path))):
            cells[path.removeprefix(folder)] = cell
    hulls = [c.hull for c in cells.values() if len(c.hull)]
    points = np.concatenate(hulls) if hulls else np.zeros((1, 3))
    box = np.stack([points.min(axis=0), points.max(axis=0)])
    tolerance = Tolerance.for_points(points)
    for own, cell in cells.items():
        path = folder + own
        check_cell(documents[path], cell, box, tolerance, database.at(path))
        for url in (*cell.adjacent, *cell.visible):
            database.resolve(path, url)
        for urls in cell.textures:
            database.resolve_each(path, "url", urls)
    check_graph(
        {own: cell.adjacent for own, cell in cells.items()},
        {own: cell.visible for own, cell in cells.items()},
        lambda own: database.at(folder + own),
    )
    return cells


def _check_root(
    document: Document, cells: Mapping[str, ReadCell], database: ServedDatabase
) -> None:
    root = read_root(document, database.at(ROOT))
    for url in (*root.inlines, *root.viewpoints.values()):
        database.resolve(ROOT, url)
    boxes = {f"{CELL_FOLDER}/{own}": cell.box for own, cell in cells.items()}
    check_root(root, boxes, database.at(ROOT))


def _check_index(cells: Mapping[str, ReadCell], database: ServedDatabase) -> None:
    """The index names each cell's file, and no other."""
    hints = database.hints
    urls = hints.urls(VRML.name) if hints else None
    if urls is not None:
        database.resolve_each(HINTS, "cells", urls)
        for unlisted in sorted({f"{CELL_FOLDER}/{name}" for name in cells} - set(urls)):
            database.at(HINTS, "cells").add("PTM-D741", f"does not name {unlisted}")
