"""What the VRML files and `hints.json` must satisfy: each by itself, and beside each other."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ptmtools.database.names import CELL_FOLDER, HINTS, ROOT
from ptmtools.database.validation.cells import ReadCell, check_cell, read_cell
from ptmtools.database.validation.hints import (
    Images,
    Row,
    check_against_cells,
    check_hints,
    read_hints,
)
from ptmtools.database.validation.lists import check_graph
from ptmtools.database.validation.root import ReadRoot, check_root, check_viewpoints, read_root
from ptmtools.database.validation.served import ServedDatabase
from ptmtools.database.validation.textures import check_record
from ptmtools.database.vrml.reader import Document, parse
from ptmtools.tolerance import Tolerance


def read_file(path: str, data: bytes) -> Document | Row | None:
    """A VRML file or the hints; nothing of other files."""
    if path == HINTS:
        return read_hints(data)
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
    at, folder = database.at(HINTS), f"{CELL_FOLDER}/"
    cell_images = {
        own: {tuple(database.resolve_each(folder + own, "url", u)) for u in cell.textures}
        for own, cell in cells.items()
    }
    hints: Row | None = database.held.get(HINTS)
    if hints is None:
        return
    check_hints(hints, at)
    urls = [row["url"] for row in hints["cells"]]
    database.resolve_each(HINTS, "cells", urls)
    files = database.resolve_each(HINTS, "textures", [row["file"] for row in hints["textures"]])
    images: list[Images] = []
    for i, (record, path) in enumerate(zip(hints["textures"], files, strict=True)):
        fallback = record["fallback"]
        images.append((path,) if fallback is None else (database.resolve(HINTS, fallback), path))
        if path in database.textures:
            check_record(record, database.textures[path], at.at(f"textures[{i}]"))
    known = [url.removeprefix(folder) for url in urls]
    check_against_cells(hints, known, images, cells, cell_images, at)
    if root is not None:
        check_viewpoints(
            root, hints["viewpoints"], [urls[view["cell"]] for view in hints["viewpoints"]], at
        )
