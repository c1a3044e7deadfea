"""The check of the VRML files: the root and each cell by itself, and against each other."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.diagnostics import Place
from ptmtools.errors import DatabaseError
from ptmtools.output.convexity import convex_hull
from ptmtools.output.names import CELL_FOLDER, HINTS, ROOT, VRML
from ptmtools.output.validation.files import ServedDatabase
from ptmtools.output.validation.findings import check_graph, check_list, check_shares
from ptmtools.output.validation.space import (
    MOST_CORNERS,
    Planes,
    Points,
    SolidError,
    farthest,
    solid_planes,
)
from ptmtools.output.vrml import PATTERN
from ptmtools.output.vrml_reader import Document, Node, parse
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
    """The content of the root file; missing parts are left out, with PTM-D661."""
    for type in ("WorldInfo", "NavigationInfo"):
        if len(document.of_type(type)) != 1:
            at.add("PTM-D661", f"not one {type}")
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
            here.add("PTM-D661", "info does not begin with the pattern")
        if {line for line in info if line.startswith("ptm:viewpoint ")} != expected:
            here.add("PTM-D699", "the viewpoints in info are not those of PTMViewpointCell")
    inlines: dict[str, NDArray[np.float64] | None] = {}
    for node in document.of_type("Inline"):
        if "url" not in node.fields:
            continue
        here, urls = at.at(f"line {node.line}"), node.fields["url"]
        if len(urls) != 1:
            here.add("PTM-D661", "an Inline without a URL")
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
                database.at(path, node.place).add("PTM-D661", lack)
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
    urls = hints.urls(VRML) if hints else None
    if urls is not None:
        database.resolve_each(HINTS, "cells", urls)
        for unlisted in sorted({f"{CELL_FOLDER}/{name}" for name in cells} - set(urls)):
            database.at(HINTS, "cells").add("PTM-D700", f"does not name {unlisted}")


#: Slack of the sum of the ach values in single precision.
_ACH_SLACK = 1e-5


@dataclass(frozen=True)
class ReadCell:
    """The content of a cell file.

    Attributes
    ----------
    name: `cellName`.
    adjacent, visible: URLs as written, relative to the cell's file.
    ach: (n,) float64.
    hull: (h, 3) the hull's points.
    box: (2, 3) least and greatest corner of the hull and all shapes.
    leaves: the (n, 3) points of each leaf; empty if the cell is a single one.
    textures: the URL lists of its image textures, each once, in the order of the file.
    """

    name: str
    adjacent: tuple[str, ...]
    visible: tuple[str, ...]
    ach: NDArray[np.float64]
    hull: NDArray[np.float64]
    box: NDArray[np.float64]
    leaves: tuple[NDArray[np.float64], ...]
    textures: tuple[tuple[str, ...], ...]


def read_cell(document: Document, at: Place) -> ReadCell | None:
    """The cell of a file; None without exactly one (PTM-D661) or if it lacks fields."""
    nodes = document.of_type("PTMCell")
    if len(nodes) != 1:
        at.add("PTM-D661", f"{len(nodes)} PTMCell nodes, not 1")
        return None
    if nodes[0].lacks:
        return None
    fields, shapes = nodes[0].fields, document.of_type("Shape")
    arrays = [fields["hullPoint"], *(s.at("geometry", "coord").get("point", ()) for s in shapes)]
    points = np.concatenate([array for array in arrays if len(array)] or [np.zeros((1, 3))])
    leaves = []
    if "leafPoint" in fields:
        leaves = np.split(fields["leafPoint"], fields["leafStart"][1:])
    textures = [s.at("appearance", "texture") for s in shapes]
    return ReadCell(
        name=fields["cellName"],
        adjacent=fields["adjacentUrl"],
        visible=fields["visibleUrl"],
        ach=fields["ach"],
        hull=fields["hullPoint"],
        box=np.stack([points.min(axis=0), points.max(axis=0)]),
        leaves=tuple(leaves),
        textures=tuple(dict.fromkeys(texture["url"] for texture in textures if "url" in texture)),
    )


def check_cell(
    document: Document, cell: ReadCell, box: NDArray[np.float64], tolerance: Tolerance, at: Place
) -> None:
    """Checks everything that needs no other cell.

    ``box`` (2, 3) holds the hulls of all cells. Geometry beyond a face of that box is accepted: an
    open model is subdivided within its walls, and geometry farther out belongs to the cells at the
    rim. There the hull of several leaves may lean inwards, so geometry before one of the leaves is
    accepted too.
    """
    (node,) = document.of_type("PTMCell")
    own, here = at.file.rpartition("/")[2], at.at(f"line {node.line}")
    hull = _check_hull(node, cell, tolerance, here)
    leaves = _check_leaves(node, cell, hull, tolerance, here)
    body, bodies = _without_rim(hull, box, tolerance), None
    for shape in document.of_type("Shape"):
        if shape.lacks:
            continue
        shape_at = at.at(shape.place)
        _check_shape(shape, shape_at)
        points = shape.at("geometry", "coord")["point"]
        far = farthest(body, points)
        if (far > tolerance.cluster).any():  # seldom
            bodies = _leaf_bodies(leaves, box, tolerance) if bodies is None else bodies
            far = np.min([far, *(farthest(planes, points) for planes in bodies)], axis=0)
        if (most := far.max(initial=0.0)) > tolerance.cluster:
            shape_at.add("PTM-D683", f"geometry lies {most:.3g} m outside of the hull")
    if f"{cell.name}.wrl" != own:
        here.add("PTM-D699", f"cellName is {cell.name!r}")
    check_list("adjacentUrl", own, cell.adjacent, here)
    check_list("visibleUrl", own, cell.visible, here)
    if len(cell.ach) != len(cell.visible):
        here.add("PTM-D692", f"{len(cell.ach)} ach values for {len(cell.visible)} visible cells")
    check_shares(cell.ach, _ACH_SLACK, here)


def _check_hull(node: Node, cell: ReadCell, tolerance: Tolerance, at: Place) -> Planes:
    """The planes of the hull; none if it is invalid."""
    triangles = _loops(node.fields["hullIndex"], len(cell.hull))
    if triangles is None or len(triangles) < 4:
        at.add("PTM-D683", "hullIndex is not a list of triangles over hullPoint")
    else:
        try:
            return solid_planes(cell.hull, triangles.tolist(), tolerance)
        except SolidError as fault:
            at.add("PTM-D683", f"the hull {fault}")
    return np.zeros((0, 4))


def _check_leaves(
    node: Node, cell: ReadCell, hull: Planes, tolerance: Tolerance, at: Place
) -> tuple[Points, ...]:
    """The points of the leaves; empty if they are invalid or the cell has only one."""
    if not cell.leaves:
        return ()
    far = farthest(hull, node.fields["leafPoint"]).max(initial=0.0)
    if far > tolerance.cluster:
        at.add("PTM-D683", f"a leaf lies {far:.3g} m outside of the hull")
    sizes, start = [len(leaf) for leaf in cell.leaves], node.fields["leafStart"]
    divided = len(start) > 1 and np.array_equal(start, np.cumsum([0, *sizes[:-1]]))
    if divided and min(sizes) >= 4 and max(sizes) <= MOST_CORNERS:
        return cell.leaves
    at.add("PTM-D683", "leafStart does not divide leafPoint into leaves")
    return ()


def _leaf_bodies(
    leaves: Iterable[Points], box: NDArray[np.float64], tolerance: Tolerance
) -> list[Planes]:
    """The planes of each leaf that is not flat."""
    bodies = []
    for leaf in leaves:
        with suppress(DatabaseError, SolidError):
            points, triangles = convex_hull(leaf.astype(np.float32))
            planes = solid_planes(points.astype(np.float64), triangles.tolist(), tolerance)
            bodies.append(_without_rim(planes, box, tolerance))
    return bodies


def _without_rim(planes: Planes, box: NDArray[np.float64], tolerance: Tolerance) -> Planes:
    """The planes without those of the faces of the box."""
    faces = np.concatenate([-planes[:, 3:] - box[1], -planes[:, 3:] + box[0]], axis=1)
    outwards = np.concatenate([planes[:, :3], -planes[:, :3]], axis=1) >= tolerance.cosine
    return planes[~(outwards & (abs(faces) <= tolerance.plane)).any(axis=1)]


def _loops(index: NDArray[np.int64], points: int) -> NDArray[np.int64] | None:
    """(m, 3) triangles of an index field over ``points`` points; None if it is no such list."""
    if len(index) % 4:
        return None
    rows = index.reshape(-1, 4)
    corners = rows[:, :3]
    whole = (rows[:, 3] == -1).all() and (corners >= 0).all() and (corners < points).all()
    return corners if whole else None


def _check_shape(shape: Node, at: Place) -> None:
    geometry, points = shape.at("geometry"), shape.at("geometry", "coord")["point"]
    if list(geometry).index("coord") > list(geometry).index("coordIndex"):
        at.add("PTM-D661", "coordIndex stands before coord")
    triangles = _loops(geometry["coordIndex"], len(points))
    if triangles is None:
        at.add("PTM-D661", f"coordIndex is not a list of triangles over {len(points)} points")
    elif len(triangles) == 0 or (triangles == np.roll(triangles, 1, axis=1)).any():
        at.add("PTM-D661", "coordIndex has a triangle with two equal corners")
    count = len(geometry["coordIndex"]) // 4
    _check_texture(shape, count, at)
    _check_colours(shape, count, at)


def _check_texture(shape: Node, count: int, at: Place) -> None:
    texture, index = shape.at("appearance", "texture"), shape.at("geometry").get("texCoordIndex")
    coord = shape.at("geometry", "texCoord")
    if not texture and not coord and index is None:
        return
    if not texture.get("url"):
        at.add("PTM-D661", "texture coordinates without a texture")
    if not coord or index is None:
        at.add("PTM-D661", "a texture without texCoord or texCoordIndex")
        return
    points = len(coord["point"])
    triangles = _loops(index, points)
    if triangles is None:
        at.add("PTM-D661", f"texCoordIndex is not a list of triangles over {points} points")
    elif len(triangles) != count:
        at.add("PTM-D661", f"texCoordIndex has {len(triangles)} faces of {count}")


def _check_colours(shape: Node, count: int, at: Place) -> None:
    geometry, color = shape.at("geometry"), shape.at("geometry", "color")
    if color:
        index = geometry.get("colorIndex", np.zeros(0, np.int64))
        if geometry.get("colorPerVertex", True):
            corners = _loops(index, len(color["color"]))
            complete = corners is not None and len(corners) == count
        else:
            in_range = (index >= 0) & (index < len(color["color"]))
            complete = bool(in_range.all()) and len(index) == count
        if not complete:
            at.add("PTM-D661", f"colorIndex does not give a colour to each of {count} faces")
    values = [*shape.at("appearance", "material").values(), *color.values()]
    if any(((v < 0) | (v > 1)).any() for v in values):
        at.add("PTM-D661", "a colour or transparency is outside 0 to 1")
