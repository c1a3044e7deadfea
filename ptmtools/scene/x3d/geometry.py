"""Cuts the geometry nodes of VRML97 and X3D into triangles, with coordinates and colours.

Normals and crease angles have no effect on later stages. Round shapes are polygons of `_SIDES`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints, units
from ptmtools.scene.colors import color_bytes
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.placement import rotation
from ptmtools.scene.polygon import cut, fan_of, strip_of
from ptmtools.scene.x3d.nodes import X3dNode

_SIDES, _BANDS = 24, 12
#: Most points of an extrusion, which its spine and its cross section multiply.
_MOST_POINTS = 1_000_000


@dataclass(frozen=True)
class Faces:
    """The triangles of a geometry.

    Attributes
    ----------
    points: (P, 3). triangles: (T, 3) into these, counter-clockwise seen from the front.
    uv: (T, 3, 2) texture coordinates, origin at the lower left.
    colors: (T, 3, 3), None without a Color node.
    solid: whether only the front is drawn.
    """

    points: Floats
    triangles: Ints
    uv: Floats
    colors: NDArray[np.uint8] | None
    solid: bool


@dataclass
class _Polygons:
    """Polygons by their corners: (C,) points of the corners, and (P + 1,) where each begins."""

    points: Floats
    vertex: Ints
    start: Ints
    uv: Floats | None = None
    colors: Floats | None = None


def read_geometry(node: X3dNode, notes: IngestNotes) -> Faces | None:
    """The triangles of a geometry; None, and a note, if it has none. Raises ValueError."""
    read = _READERS.get(node.type)
    if read is None:
        notes.note("PTM-N215", f"{node.type}: not drawn")
        return None
    polygons = read(node)
    vertex, points = polygons.vertex, polygons.points
    if vertex.size and not 0 <= vertex.min() <= vertex.max() < len(points):
        raise ValueError(f"{node.type}: an index exceeds the points")
    result = cut(points[vertex], polygons.start, notes, node.name or node.type)
    corner = result.corner if node.flag("ccw", True) else result.corner[:, ::-1]
    if not len(corner):
        return None
    uv = _box_coordinates(points[vertex]) if polygons.uv is None else polygons.uv
    used, triangles = np.unique(vertex[corner], return_inverse=True)
    return Faces(
        points[used],
        triangles.reshape(-1, 3),
        uv[corner],
        None if polygons.colors is None else color_bytes(polygons.colors[corner]),
        node.flag("solid", True),
    )


def _box_coordinates(points: Floats) -> Floats:
    """(n, 2) the coordinates of a mesh without any: along the longest side of its bounds, and along
    the second longest, both by the length of the longest."""
    if not len(points):
        return np.zeros((0, 2))
    with np.errstate(all="ignore"):
        low = points.min(axis=0)
        size = points.max(axis=0) - low
        axes = np.argsort(-size, kind="stable")[:2]
        return np.asarray((points[:, axes] - low[axes]) / (size[axes[0]] or 1.0))


def _coordinates(node: X3dNode) -> Floats:
    """(n, 3) the points of a geometry."""
    coord = node.node("coord")
    return np.zeros((0, 3)) if coord is None else coord.numbers("point", 3)


def _values(node: X3dNode, field: str) -> Floats | None:
    """(n, width) the texture coordinates or the colours of a geometry; None without them."""
    part = node.node(field)
    if part is not None and part.type == "MultiTextureCoordinate":
        part = part.node("texCoord")
    if part is None or part.type == "TextureCoordinateGenerator":
        return None
    if field == "texCoord":
        return part.numbers("point", 2)
    return part.numbers("color", 4 if part.type == "ColorRGBA" else 3)[:, :3]


def _pick(values: Floats | None, index: Ints, what: str) -> Floats | None:
    if values is not None and index.size and not 0 <= index.min() <= index.max() < len(values):
        raise ValueError(f"an index exceeds the {what}")
    return None if values is None else values[index]


def _indexed_faces(node: X3dNode) -> _Polygons:
    """IndexedFaceSet: each list of indices has -1 after each face."""
    index = node.integers("coordIndex")
    if len(index) and index[-1] >= 0:
        index = np.append(index, -1)
    size = np.diff(np.flatnonzero(np.append(-1, index) < 0)) - 1
    rows = np.flatnonzero(index >= 0)
    face = np.repeat(np.arange(len(size)), size)

    def at_corners(field: str, per_corner: bool = True) -> Floats | None:
        given = node.integers(f"{field}Index")
        place = rows if per_corner else face
        if len(given) and len(place) and place.max() >= len(given):
            raise ValueError(f"{len(given)} indices of {field}")
        usual = index[rows] if per_corner else face
        return _pick(_values(node, field), given[place] if len(given) else usual, field)

    start = np.concatenate([[0], np.cumsum(size[size > 0])])
    colors = at_corners("color", node.flag("colorPerVertex", True))
    return _Polygons(_coordinates(node), index[rows], start, at_corners("texCoord"), colors)


def _of_vertices(node: X3dNode, vertex: Ints, corners: int) -> _Polygons:
    """Faces with a number of corners each, whose values belong to the points."""
    vertex = vertex[: len(vertex) // corners * corners]
    uv, colors = (_pick(_values(node, field), vertex, field) for field in ("texCoord", "color"))
    start = np.arange(0, len(vertex) + 1, corners)
    return _Polygons(_coordinates(node), vertex, start, uv, colors)


def _lists(corners: int) -> Callable[[X3dNode], _Polygons]:
    """TriangleSet, QuadSet, and those with an index."""

    def read(node: X3dNode) -> _Polygons:
        indexed = node.type.startswith("Indexed")
        every = node.integers("index") if indexed else np.arange(len(_coordinates(node)))
        return _of_vertices(node, every, corners)

    return read


def _runs(local: Callable[[int], Ints], count: str) -> Callable[[X3dNode], _Polygons]:
    """Strips and fans, whose lengths are in a field ``count``, or that have -1 after each."""

    def read(node: X3dNode) -> _Polygons:
        if node.type.startswith("Indexed"):
            index = node.integers("index")
            parts = np.split(index, np.flatnonzero(index < 0))
            parts = [part[part >= 0] for part in parts]
        else:
            ends = np.cumsum(np.maximum(node.integers(count), 0))
            every = np.arange(len(_coordinates(node)))
            if len(ends) and ends[-1] > len(every):
                raise ValueError(f"{node.type}: {count} exceeds the points")
            parts = np.split(every, ends)[:-1]
        runs = [part[local(len(part))].ravel() for part in parts]
        return _of_vertices(node, np.concatenate([np.zeros(0, np.int64), *runs]), 3)

    return read


def _elevation(node: X3dNode) -> _Polygons:
    """ElevationGrid: heights above a grid."""
    height = node.numbers("height").ravel()
    nx, nz = (int(node.number(f"{axis}Dimension", 0)) for axis in "xz")
    if nx < 2 or nz < 2 or nx * nz != len(height):
        raise ValueError(f"ElevationGrid of {nx} x {nz} with {len(height)} heights")
    z, x = np.divmod(np.arange(nx * nz), nx)
    steps = [node.number(f"{axis}Spacing", 1.0) for axis in "xz"]
    points = np.stack([x * steps[0], height, z * steps[1]], axis=1)
    first: Ints = (np.arange(nz - 1)[:, None] * nx + np.arange(nx - 1)).ravel()
    vertex: Ints = (first[:, None] + np.array([0, nx, nx + 1, 1])).ravel()
    uv = _pick(_values(node, "texCoord"), vertex, "texCoord")
    if uv is None:
        uv = np.stack([x / (nx - 1), z / (nz - 1)], axis=1)[vertex]
    per_vertex = node.flag("colorPerVertex", True)
    owner = vertex if per_vertex else np.repeat(np.arange(len(first)), 4)
    start = np.arange(0, len(vertex) + 1, 4)
    return _Polygons(points, vertex, start, uv, _pick(_values(node, "color"), owner, "color"))


def _extrusion(node: X3dNode) -> _Polygons:
    """Extrusion: a cross section along a spine, with caps."""
    section = _or(node.numbers("crossSection", 2), [[1, 1], [1, -1], [-1, -1], [-1, 1], [1, 1]])
    spine = _or(node.numbers("spine", 3), [[0, 0, 0], [0, 1, 0]])
    scale = _or(node.numbers("scale", 2), [[1, 1]])
    turn = _or(node.numbers("orientation", 4), [[0, 0, 1, 0]])
    n, m = len(spine), len(section)
    if n < 2 or m < 2 or n * m > _MOST_POINTS or not {len(scale), len(turn)} <= {1, n}:
        raise ValueError(f"Extrusion of {m} points along {n}")
    rows = section * np.broadcast_to(scale, (n, 2))[:, None]
    flat = np.stack([rows[..., 0], np.zeros((n, m)), rows[..., 1]], axis=2)
    turns = np.stack([rotation(row[:3], row[3])[:3, :3] for row in turn])
    points = spine[:, None] + flat @ turns.transpose(0, 2, 1) @ _spine_axes(spine)
    first = (np.arange(n - 1)[:, None] * m + np.arange(m - 1)).ravel()
    sides: Ints = (first[:, None] + np.array([0, 1, m + 1, m])).ravel()
    ring = np.arange(m - 1 if (section[0] == section[-1]).all() else m)
    caps = [ring[::-1]] if node.flag("beginCap", True) else []
    caps += [(n - 1) * m + ring] if node.flag("endCap", True) else []
    vertex = np.concatenate([sides, *caps])
    size = [4] * len(first) + [len(cap) for cap in caps]
    along, across = np.divmod(np.arange(n * m), m)
    uv = np.stack([across / (m - 1), along / (n - 1)], axis=1)[vertex]
    whole = (section - section.min(axis=0)) / (np.ptp(section, axis=0).max() or 1.0)
    uv[len(sides) :] = whole[vertex[len(sides) :] % m]
    return _Polygons(points.reshape(-1, 3), vertex, np.cumsum([0, *size]), uv)


def _or(values: Floats, default: Sequence[Sequence[float]]) -> Floats:
    return values if len(values) else np.array(default, np.float64)


def _spine_axes(spine: Floats) -> Floats:
    """(n, 3, 3) the x, y and z axes of the cross section at the points of a spine."""
    before, after = np.roll(spine, 1, axis=0), np.roll(spine, -1, axis=0)
    if (spine[0] == spine[-1]).all():
        before[0], after[-1] = spine[-2], spine[1]
    else:
        before[0], after[-1] = spine[0], spine[-1]
    y = units(after - before)
    z = units(np.cross(after - spine, before - spine))
    bent = (z != 0).any(axis=1)
    if bent.any():  # straight parts have the axis of the bend before them, or else of the first
        last = np.maximum.accumulate(np.where(bent, np.arange(len(spine)), -1))
        z = z[np.where(last < 0, bent.argmax(), last)]
        z[1:] *= np.cumprod(np.where((z[1:] * z[:-1]).sum(axis=1) < 0, -1.0, 1.0))[:, None]
    else:
        axis = np.cross([0.0, 1, 0], y[0]) if abs(y[0, 1]) < 1 else np.array([1.0, 0, 0])
        z[:] = rotation(axis, float(np.arccos(np.clip(y[0, 1], -1, 1))))[:3, 2]
    x = units(np.cross(y, z))
    return np.stack([x, y, np.cross(x, y)], axis=1)


#: The faces of a box of two units, seen from outside, from the lower left.
_BOX = np.array(
    [
        [[-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]],
        [[1, -1, -1], [-1, -1, -1], [-1, 1, -1], [1, 1, -1]],
        [[1, -1, 1], [1, -1, -1], [1, 1, -1], [1, 1, 1]],
        [[-1, -1, -1], [-1, -1, 1], [-1, 1, 1], [-1, 1, -1]],
        [[-1, 1, 1], [1, 1, 1], [1, 1, -1], [-1, 1, -1]],
        [[-1, -1, -1], [1, -1, -1], [1, -1, 1], [-1, -1, 1]],
    ],
    np.float64,
)
_WHOLE = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])


def _box(node: X3dNode) -> _Polygons:
    points = (_BOX * node.vector("size", (2.0, 2.0, 2.0)) / 2).reshape(-1, 3)
    return _Polygons(points, np.arange(24), np.arange(0, 25, 4), np.tile(_WHOLE, (6, 1)))


def _round(bands: Sequence[tuple[Sequence[float], Sequence[float], Sequence[float]]]) -> _Polygons:
    """Bands around the Y axis: each has the radii, heights and t of its two rings, the upper or
    inner first; without t, its texture is cut from the image as a disc. Rings begin behind the axis
    and go counter-clockwise seen from above."""
    share = np.linspace(0, 1, _SIDES + 1)
    x, z = -np.sin(2 * np.pi * share), -np.cos(2 * np.pi * share)
    points, uv, size = [np.zeros((0, 3))], [np.zeros((0, 2))], [0]
    for radii, heights, t in bands:
        rings = [
            np.stack([r * x, 0 * x + y, r * z], 1) for r, y in zip(radii, heights, strict=True)
        ]
        if t:
            coords = [np.stack([share, 0 * share + v], 1) for v in t]
        else:
            side = np.array([0.5, -0.5 if radii[1] > radii[0] else 0.5]) / (max(radii) or 1.0)
            coords = [0.5 + ring[:, [0, 2]] * side for ring in rings]
        # A ring without a radius is one point, so each quad is a triangle.
        kept = [k for k in range(4) if not (radii[k in (1, 2)] == 0 and k in (2, 3))]
        for values, rows in ((rings, points), (coords, uv)):
            top, low = values
            quads = np.stack([top[:-1], low[:-1], low[1:], top[1:]], axis=1)[:, kept]
            rows.append(quads.reshape(-1, quads.shape[2]))
        size += [len(kept)] * _SIDES
    every = np.concatenate(points)
    return _Polygons(every, np.arange(len(every)), np.cumsum(size), np.concatenate(uv))


def _tube(node: X3dNode, top: float, radius: float) -> _Polygons:
    """A cylinder or a cone: the radii of its rings, and its parts by their flags."""
    half = node.number("height", 2.0) / 2
    bands: list[tuple[Sequence[float], Sequence[float], Sequence[float]]] = []
    if node.flag("side", True):
        bands.append(((top, radius), (half, -half), (1, 0)))
    if top and node.flag("top", True):
        bands.append(((0, radius), (half, half), ()))
    if node.flag("bottom", True):
        bands.append(((radius, 0), (-half, -half), ()))
    return _round(bands)


def _cylinder(node: X3dNode) -> _Polygons:
    radius = node.number("radius", 1.0)
    return _tube(node, radius, radius)


def _cone(node: X3dNode) -> _Polygons:
    return _tube(node, 0.0, node.number("bottomRadius", 1.0))


def _sphere(node: X3dNode) -> _Polygons:
    angle = np.linspace(0, np.pi, _BANDS + 1)
    radius, t = node.number("radius", 1.0), 1 - angle / np.pi
    across, up = radius * np.sin(angle), radius * np.cos(angle)
    across[[0, -1]] = 0
    return _round(
        [
            (across[k : k + 2].tolist(), up[k : k + 2].tolist(), t[k : k + 2].tolist())
            for k in range(_BANDS)
        ]
    )


_READERS: dict[str, Callable[[X3dNode], _Polygons]] = {
    "IndexedFaceSet": _indexed_faces,
    "TriangleSet": _lists(3),
    "IndexedTriangleSet": _lists(3),
    "QuadSet": _lists(4),
    "IndexedQuadSet": _lists(4),
    "TriangleFanSet": _runs(fan_of, "fanCount"),
    "IndexedTriangleFanSet": _runs(fan_of, ""),
    "TriangleStripSet": _runs(strip_of, "stripCount"),
    "IndexedTriangleStripSet": _runs(strip_of, ""),
    "ElevationGrid": _elevation,
    "Extrusion": _extrusion,
    "Box": _box,
    "Cone": _cone,
    "Cylinder": _cylinder,
    "Sphere": _sphere,
}
