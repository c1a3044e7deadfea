"""What a cell file must satisfy by itself: its hull, its shapes, its lists.

Convex bodies and polygons as a client reads them: what is wrong with one, and what is inside.

All in float64 with the distances of `Tolerance`; a body is its planes, (f, 4) unit normals
outwards and offsets, so that n·x + d is how far x lies in front."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from ptmtools.diagnostics import Place
from ptmtools.errors import DatabaseError
from ptmtools.output.hull import convex_hull
from ptmtools.output.validation.findings import check_list, check_shares
from ptmtools.output.vrml_reader import Document, Node
from ptmtools.tolerance import Tolerance

Points = NDArray[np.float64]
Planes = NDArray[np.float64]

#: Corners of a body beyond which it is none of ours: `vrml.hull` takes time by their square.
MOST_CORNERS = 1 << 14
#: Distances computed at a time.
_BATCH = 1 << 22


class SolidError(Exception):
    """What is wrong with a body or a polygon, as the rest of a sentence."""


def solid_planes(points: Points, loops: Sequence[Sequence[int]], tolerance: Tolerance) -> Planes:
    """The planes of a closed convex polyhedron.

    Parameters
    ----------
    points: (n, 3).
    loops: its faces, indices into ``points``, counter-clockwise seen from outside.

    Raises SolidError: it is none, within the tolerance's on-plane distance.
    """
    if len(points) > MOST_CORNERS:
        raise SolidError(f"has {len(points)} corners, more than any cell")
    size = np.array([len(loop) for loop in loops])
    start = np.cumsum(size) - size
    index = np.fromiter(chain.from_iterable(loops), np.int64)
    following = np.roll(index, -1)
    following[start + size - 1] = index[start]
    there = index * len(points) + following
    if len(np.unique(there)) < len(there) or len(
        np.setdiff1d(there, following * len(points) + index)
    ):
        raise SolidError("is not closed")
    planes, sound = _newell(points[index], points[following], start, tolerance)
    if not sound.any():
        raise SolidError("is flat")
    if not farthest(planes[sound], points).max() <= tolerance.plane:
        raise SolidError("is not convex")
    face = np.repeat(np.arange(len(loops)), size)
    behind = -(np.einsum("ij,ij->i", planes[face, :3], points[index]) + planes[face, 3])
    if not behind[sound[face]].max() <= tolerance.plane:
        raise SolidError("has a face that is not flat")
    return planes[sound]


def polygon_plane(polygon: Points, tolerance: Tolerance) -> Planes | None:
    """(4,) the plane of a convex polygon, its normal towards whom it is counter-clockwise for;
    None for a sliver, whose normal says nothing.

    Raises SolidError: it is not flat, or not convex.
    """
    following = np.roll(polygon, -1, axis=0)
    planes, sound = _newell(polygon, following, np.zeros(1, np.int64), tolerance)
    if not sound[0]:
        return None
    plane: Planes = planes[0]
    if not np.abs(polygon @ plane[:3] + plane[3]).max() <= tolerance.plane:
        raise SolidError("is not flat")
    edge = following - polygon
    length = np.linalg.norm(edge, axis=1)
    long = length > tolerance.plane
    # (edges, corners) how far each corner lies on the inner side of each edge.
    inner = np.cross(plane[:3], edge[long] / length[long, None])
    inside = inner @ polygon.T - np.einsum("ij,ij->i", inner, polygon[long])[:, None]
    if not inside.min(initial=0.0) >= -tolerance.plane:
        raise SolidError("is not convex")
    return plane


def polygon_area(polygon: Points) -> float:
    """m²."""
    arms = polygon - polygon[0]
    return float(np.linalg.norm(np.cross(arms[1:-1], arms[2:]).sum(axis=0)) / 2)


def farthest(planes: Planes, points: Points) -> Points:
    """(n,) how far each point lies in front of the plane that it is farthest in front of; -inf
    without planes."""
    far = np.full(len(points), -np.inf)
    step = max(_BATCH // max(len(planes), 1), 1)
    for i in range(0, len(points) if len(planes) else 0, step):
        part = points[i : i + step]
        far[i : i + step] = (part @ planes[:, :3].T + planes[:, 3]).max(axis=1)
    return far


def _newell(
    here: Points, following: Points, start: NDArray[np.int64], tolerance: Tolerance
) -> tuple[Planes, NDArray[np.bool_]]:
    """The planes of polygons whose edges begin ``here``, and which of them are sound: of a sliver
    thinner than the on-plane distance the normal says nothing."""
    size = np.diff([*start, len(here)])
    first = np.repeat(here[start], size, axis=0)
    normal = np.add.reduceat(np.cross(here - first, following - first), start, axis=0)
    longest = np.maximum.reduceat(np.linalg.norm(following - here, axis=1), start)
    twice_area = np.linalg.norm(normal, axis=1)
    sound = twice_area > 2 * tolerance.plane * longest
    normal /= np.where(sound, twice_area, 1.0)[:, None]
    middle = np.add.reduceat(here, start, axis=0) / size[:, None]
    return np.column_stack([normal, -np.einsum("ij,ij->i", normal, middle)]), sound


#: How far the ach values as written, single precision, may sum up beside 1.
ACH_SLACK = 1e-5


@dataclass(frozen=True)
class ReadCell:
    """A cell as its file has it.

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
    """The cell of a file, or None if it lacks fields or, with PTM-D663, if there is not one."""
    nodes = document.of_type("PTMCell")
    if len(nodes) != 1:
        at.add("PTM-D663", f"{len(nodes)} PTMCell nodes, not 1")
        return None
    if nodes[0].lacks:
        return None
    fields, shapes = nodes[0].fields, document.of_type("Shape")
    held = [fields["hullPoint"], *(s.at("geometry", "coord").get("point", ()) for s in shapes)]
    points = np.concatenate([some for some in held if len(some)] or [np.zeros((1, 3))])
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
    """Checks all that needs no other cell.

    ``box`` (2, 3) holds the hulls of all cells. Geometry beyond a face of that box is in order: a
    model that is open is subdivided within its walls, and what lies farther out belongs to the
    cells at the rim. There the hull of several leaves may lean inwards, and what lies before one of
    the leaves is in order too.
    """
    (node,) = document.of_type("PTMCell")
    own, here = at.file.rpartition("/")[2], at.at(f"line {node.line}")
    hull = _check_hull(node, cell, tolerance, here)
    leaves = _check_leaves(node, cell, hull, tolerance, here)
    body, bodies = _without_rim(hull, box, tolerance), None
    for shape in document.of_type("Shape"):
        if shape.lacks:
            continue
        there = at.at(shape.place)
        _check_shape(shape, there)
        points = shape.at("geometry", "coord")["point"]
        far = farthest(body, points)
        if (far > tolerance.cluster).any():  # seldom
            bodies = _leaf_bodies(leaves, box, tolerance) if bodies is None else bodies
            far = np.min([far, *(farthest(planes, points) for planes in bodies)], axis=0)
        if (most := far.max(initial=0.0)) > tolerance.cluster:
            there.add("PTM-D684", f"geometry lies {most:.3g} m outside of the hull")
    if f"{cell.name}.wrl" != own:
        here.add("PTM-D698", f"cellName is {cell.name!r}")
    check_list("adjacentUrl", own, cell.adjacent, here)
    check_list("visibleUrl", own, cell.visible, here)
    if len(cell.ach) != len(cell.visible):
        here.add("PTM-D691", f"{len(cell.ach)} ach values for {len(cell.visible)} visible cells")
    check_shares(cell.ach, ACH_SLACK, ("PTM-D692", "PTM-D693"), here)


def _check_hull(node: Node, cell: ReadCell, tolerance: Tolerance, at: Place) -> Planes:
    """The planes of the hull, none if it is not sound."""
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
    """The points of the leaves, if the cell has several that are sound."""
    if not cell.leaves:
        return ()
    far = farthest(hull, node.fields["leafPoint"]).max(initial=0.0)
    if far > tolerance.cluster:
        at.add("PTM-D684", f"a leaf lies {far:.3g} m outside of the hull")
    sizes, start = [len(leaf) for leaf in cell.leaves], node.fields["leafStart"]
    cut = len(start) > 1 and np.array_equal(start, np.cumsum([0, *sizes[:-1]]))
    if cut and min(sizes) >= 4 and max(sizes) <= MOST_CORNERS:
        return cell.leaves
    at.add("PTM-D685", "leafStart does not cut leafPoint into leaves")
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
    """Planes, but for those of the faces of the box."""
    faces = np.concatenate([-planes[:, 3:] - box[1], -planes[:, 3:] + box[0]], axis=1)
    outwards = np.concatenate([planes[:, :3], -planes[:, :3]], axis=1) >= tolerance.cosine
    return planes[~(outwards & (abs(faces) <= tolerance.plane)).any(axis=1)]


def _loops(index: NDArray[np.int64], points: int) -> NDArray[np.int64] | None:
    """(m, 3) triangles of an index field over so many points, or None if it is no such list."""
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
        at.add("PTM-D680", f"coordIndex is not a list of triangles over {len(points)} points")
    elif len(triangles) == 0 or (triangles == np.roll(triangles, 1, axis=1)).any():
        at.add("PTM-D680", "coordIndex has a triangle with two equal corners")
    count = len(geometry["coordIndex"]) // 4
    _check_texture(shape, count, at)
    _check_colours(shape, count, at)


def _check_texture(shape: Node, count: int, at: Place) -> None:
    texture, index = shape.at("appearance", "texture"), shape.at("geometry").get("texCoordIndex")
    coord = shape.at("geometry", "texCoord")
    if not texture and not coord and index is None:
        return
    if not texture.get("url"):
        at.add("PTM-D663", "texture coordinates without a texture")
    if not coord or index is None:
        at.add("PTM-D663", "a texture without texCoord or texCoordIndex")
        return
    points = len(coord["point"])
    triangles = _loops(index, points)
    if triangles is None:
        at.add("PTM-D681", f"texCoordIndex is not a list of triangles over {points} points")
    elif len(triangles) != count:
        at.add("PTM-D681", f"texCoordIndex has {len(triangles)} faces of {count}")


def _check_colours(shape: Node, count: int, at: Place) -> None:
    geometry, color = shape.at("geometry"), shape.at("geometry", "color")
    if color:
        index = geometry.get("colorIndex", np.zeros(0, np.int64))
        if geometry.get("colorPerVertex", True):
            corners = _loops(index, len(color["color"]))
            given = corners is not None and len(corners) == count
        else:
            in_range = (index >= 0) & (index < len(color["color"]))
            given = bool(in_range.all()) and len(index) == count
        if not given:
            at.add("PTM-D682", f"colorIndex does not give a colour to each of {count} faces")
    values = [*shape.at("appearance", "material").values(), *color.values()]
    if any(((v < 0) | (v > 1)).any() for v in values):
        at.add("PTM-D682", "a colour or transparency is outside 0 to 1")
