"""What the VRML files must satisfy: each by itself, and beside each other and the hints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.database.names import CELL_FOLDER, HINTS, ROOT
from ptmtools.database.validation.cells import ReadCell, check_cell, read_cell
from ptmtools.database.validation.hints import Images, Row
from ptmtools.database.validation.lists import check_graph
from ptmtools.database.validation.root import ReadRoot, check_root, check_viewpoints, read_root
from ptmtools.database.validation.served import ServedDatabase
from ptmtools.database.vrml.reader import Document, parse
from ptmtools.tolerance import Tolerance

#: The form of the index that these files are.
_FORM = "vrml"


def read_file(path: str, data: bytes) -> Document | None:
    """A VRML file; nothing of other files."""
    return parse(data) if path.endswith(".wrl") else None


def check_files(database: ServedDatabase) -> Mapping[str, int]:
    """All of them; counts shapes, triangles and viewpoints."""
    documents = {p: d for p, d in database.held.items() if isinstance(d, Document)}
    for path, document in documents.items():
        for node in document.nodes:
            for lack in node.lacks:
                database.at(path, node.place).add("PTM-D663", lack)
    cells = _check_cells(documents, database)
    root = _check_root(documents.get(ROOT), cells, database)
    _check_hints(root, cells, database)
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
    check_graph(
        {own: cell.adjacent for own, cell in cells.items()},
        {own: cell.visible for own, cell in cells.items()},
        lambda own: database.at(folder + own),
    )
    return cells


def _check_root(
    document: Document | None, cells: Mapping[str, ReadCell], database: ServedDatabase
) -> ReadRoot | None:
    if document is None:
        return None
    root = read_root(document, database.at(ROOT))
    for url in (*root.inlines, *root.viewpoints.values()):
        database.resolve(ROOT, url)
    boxes = {f"{CELL_FOLDER}/{own}": cell.box for own, cell in cells.items()}
    check_root(root, boxes, database.at(ROOT))
    return root


def _check_hints(
    root: ReadRoot | None, cells: Mapping[str, ReadCell], database: ServedDatabase
) -> None:
    folder = f"{CELL_FOLDER}/"
    cell_images = {
        own: {tuple(database.resolve_each(folder + own, "url", u)) for u in cell.textures}
        for own, cell in cells.items()
    }
    hints = database.hints
    urls = hints.urls(_FORM) if hints else None
    if hints is None or urls is None:
        return
    database.resolve_each(HINTS, "cells", urls)
    known = [url.removeprefix(folder) for url in urls]
    for absent in sorted(set(cells) - set(known)):
        database.at(HINTS).add("PTM-D701", f"{absent} is missing")
    for i, row in hints.known():
        if (cell := cells.get(known[i])) is not None:
            for field in _differences(row, cell, known, hints.images, cell_images[known[i]]):
                at = database.at(hints.paths[i], field)
                at.add("PTM-D701", f"differs from {folder}{known[i]}")
    if root is not None:
        views = hints.index["viewpoints"]
        check_viewpoints(root, views, [urls[view["cell"]] for view in views], database.at(HINTS))


def _differences(
    row: Row, cell: ReadCell, known: Sequence[str], images: Sequence[Images], shown: set[Images]
) -> list[str]:
    """In which fields a record differs from the cell's file.

    Parameters
    ----------
    known: for each cell the name of its file in cells/.
    images: for each texture of the hints its files.
    shown: the files of each of the cell's image textures.
    """
    listed = {images[t] for textures in row["textures"][:1] for t in textures}
    complete = not any(None in files for files in listed | shown)
    same: dict[str, bool] = {
        "name": row["name"] == cell.name,
        "adjacent": tuple(known[c] for c in row["adjacent"]) == cell.adjacent,
        "visible": tuple(known[c] for c in row["visible"]) == cell.visible,
        "ach": _equal_single(row["ach"], cell.ach),
        "leaves": _same_leaves(row["leaves"], cell),
        "textures": listed == shown or not complete,
    }
    return [field for field, equal in same.items() if not equal]


def _equal_single(given: Sequence[Any], written: NDArray[np.float64]) -> bool:
    return np.array_equal(np.array(given, np.float32), written.astype(np.float32))


def _same_leaves(leaves: Sequence[Row], cell: ReadCell) -> bool:
    """Whether the leaves are those of the file, if it has some, and reach as far as its hull."""
    if len(leaves) != max(len(cell.leaves), 1) or not len(cell.hull):
        return False
    points = [point for leaf in leaves for point in leaf["points"]]
    pairs = zip(leaves, cell.leaves, strict=False)
    return all(_equal_single(leaf["points"], written) for leaf, written in pairs) and all(
        _equal_single(end(points, axis=0), end(cell.hull, axis=0)) for end in (np.min, np.max)
    )
