"""What the VRML files must satisfy: each by itself, and beside each other and the hints.

What `root.wrl` must satisfy: by itself, beside the cells, and beside the hints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.diagnostics import Place
from ptmtools.output.names import CELL_FOLDER, HINTS, ROOT
from ptmtools.output.validation.cells import ReadCell, check_cell, read_cell
from ptmtools.output.validation.files import ServedDatabase
from ptmtools.output.validation.findings import check_graph
from ptmtools.output.validation.hints import Images, Row
from ptmtools.output.vrml import PATTERN
from ptmtools.output.vrml_reader import Document, parse
from ptmtools.tolerance import PARALLEL_COSINE, Tolerance


@dataclass(frozen=True)
class ReadRoot:
    """The root as its file has it.

    Attributes
    ----------
    viewpoints: DEF name of each viewpoint → URL of its cell.
    poses: DEF name → the viewpoint's fields, which are named as in the hints.
    inlines: URL → (2, 3) centre and size of its bounding box, as written; None if it lacks that.
    """

    viewpoints: dict[str, str]
    poses: dict[str, dict[str, Any]]
    inlines: dict[str, NDArray[np.float64] | None]


def read_root(document: Document, at: Place) -> ReadRoot:
    """The root of a file; parts that are missing are left out, with PTM-D663."""
    for type in ("WorldInfo", "NavigationInfo"):
        if len(document.of_type(type)) != 1:
            at.add("PTM-D663", f"not one {type}")
    poses = {v.name: v.fields for v in document.of_type("Viewpoint")}
    viewpoints: dict[str, str] = {}
    for node in document.of_type("PTMViewpointCell"):
        name, urls = node.fields.get("viewpoint", ""), node.fields.get("cellUrl", ())
        if name not in poses or name in viewpoints or len(urls) != 1:
            at.add("PTM-D699", f"{name!r} names no one viewpoint", f"line {node.line}")
        else:
            viewpoints[name] = urls[0]
    if not poses or set(viewpoints) != set(poses):
        at.add("PTM-D699", "not every viewpoint has a cell, or there is none")
    wanted = {f"ptm:viewpoint {name} {url}" for name, url in viewpoints.items()}
    for node in document.of_type("WorldInfo"):
        here, info = at.at(f"line {node.line}"), node.fields.get("info", ())
        if info[:1] != (f"ptm:database {PATTERN}",):
            here.add("PTM-D663", "info does not begin with the pattern")
        if {line for line in info if line.startswith("ptm:viewpoint ")} != wanted:
            here.add("PTM-D699", "info does not say the same of the viewpoints as PTMViewpointCell")
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
    return ReadRoot(viewpoints, poses, inlines)


def check_root(root: ReadRoot, boxes: Mapping[str, NDArray[np.float64]], at: Place) -> None:
    """Compares with the cells, given as URL → (2, 3) bounds of all that they hold."""
    for url, box in boxes.items():
        if url not in root.inlines:
            at.add("PTM-D699", f"{url} is not inlined")
            continue
        if (written := root.inlines[url]) is None:
            continue
        centre, size = written.astype(np.float32).astype(np.float64)
        slack = np.spacing(np.abs(box).max(axis=0).astype(np.float32))
        if not (np.abs(box - centre) <= size / 2 + slack).all():
            at.add("PTM-D699", "the bounding box does not hold the cell", url)


def check_viewpoints(
    root: ReadRoot, viewpoints: Sequence[Mapping[str, Any]], urls: Sequence[str], at: Place
) -> None:
    """Compares with the viewpoints of the hints and the URLs of their cells."""
    wanted = {view["name"]: url for view, url in zip(viewpoints, urls, strict=True)}
    if wanted != root.viewpoints or len(wanted) < len(viewpoints):
        at.add("PTM-D706", "not those of the root file", "viewpoints")
    for i, view in enumerate(viewpoints):
        for name, written in root.poses.get(view["name"], {}).items():
            if name == "orientation":
                name, same = "direction", _turns(written, view["direction"])
            else:
                same = _same(written, view[name])
            if not same:
                at.add("PTM-D706", "is not that of the root file", f"viewpoints[{i}].{name}")


def _same(written: Any, full: Any) -> bool:
    if isinstance(written, str):
        return bool(written == " ".join(full.split()))
    single = np.asarray(full, np.float64).astype(np.float32)
    return bool((np.asarray(written).astype(np.float32) == single).all())


def _turns(orientation: Sequence[float], direction: Sequence[float]) -> bool:
    """Whether a rotation, axis and angle, brings -Z to a direction, both of them unit vectors."""
    axis, angle = np.array(orientation[:3], np.float64), orientation[3]
    ahead = np.array([0.0, 0.0, -1.0])
    turned = (
        ahead * np.cos(angle)
        + np.cross(axis, ahead) * np.sin(angle)
        + axis * (axis @ ahead) * (1 - np.cos(angle))
    )
    slack = 1 - PARALLEL_COSINE
    units = abs(axis @ axis - 1) <= slack and abs(np.dot(direction, direction) - 1) <= slack
    return bool(units and turned @ direction >= PARALLEL_COSINE)


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
