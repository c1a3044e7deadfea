"""The files of a database as clients of the hints fetch them: index, records, geometry, textures.

Only the served folder is read, so that all of a client's data counts as traffic, and a
published database can be simulated like a local one. `Locator` finds the cell of an eye: the one
that has a leaf with the eye behind all its planes.

Pieces in a boundary between two cells are in both. A pixel belongs to the copy of the cell on the
viewer's side (`sides`). That copy is loaded as soon as the viewer's cell is; the other may be
behind a wall.
"""

from __future__ import annotations

import os
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from ptmtools import schemas
from ptmtools.arrays import Bools, Floats, Ints, normals
from ptmtools.errors import DatabaseError, Rebuild
from ptmtools.files import open_regular
from ptmtools.output.bumps import Bumps, bumps_of, corners_of
from ptmtools.output.gltf import WRAPS
from ptmtools.output.gltf_reader import ReadGlb, ReadPrimitive, read_glb
from ptmtools.output.mesh_levels import row_fault
from ptmtools.output.model import FileError, sizes_of
from ptmtools.output.names import HINTS, texture_name
from ptmtools.scene.colors import to_srgb
from ptmtools.store.layout import SERVED

#: Metres by which leaves are enlarged, so that leaves that touch overlap (docs/formats/hints.md).
SLACK = 1e-3


class Locator:
    """The leaves of all cells."""

    def __init__(self, records: Sequence[Mapping[str, Any]]) -> None:
        self._planes = [[_planes(leaf) for leaf in record["leaves"]] for record in records]
        points = [np.concatenate([leaf["points"] for leaf in r["leaves"]]) for r in records]
        self._low = np.array([p.min(axis=0) for p in points]) - SLACK
        self._high = np.array([p.max(axis=0) for p in points]) + SLACK

    def along(self, eye: Floats) -> Ints:
        """(F,) the cell of each of (F, 3) eyes along a walk: the previous one if it still contains
        the eye; -1 for none."""
        cells = np.full(len(eye), -1, np.int64)
        cell = -1
        for f, point in enumerate(eye):
            if cell < 0 or not self._contains(cell, point):
                near = ((self._low <= point) & (point <= self._high)).all(axis=1)
                cell = next(
                    (c for c in np.flatnonzero(near).tolist() if self._contains(c, point)), -1
                )
            cells[f] = cell
        return cells

    def outside(self, cell: int, point: Floats) -> Floats:
        """(n,) metres from (n, 3) points to a cell: the largest distance in front of a plane of a
        leaf, least over the leaves; 0 or less inside."""
        leaves = [(point @ leaf[:, :3].T + leaf[:, 3]).max(axis=1) for leaf in self._planes[cell]]
        return np.asarray(np.min(leaves, axis=0))

    def _contains(self, cell: int, point: Floats) -> bool:
        return bool(self.outside(cell, point[None])[0] <= SLACK)


def _planes(leaf: Mapping[str, Any]) -> Floats:
    """(n, 4) outward unit normals and offsets of a leaf's faces."""
    point = np.array(leaf["points"], dtype=np.float64)
    rows = []
    for loop in leaf["faces"]:
        corner = point[loop]
        turned = np.cross(corner, np.roll(corner, -1, axis=0)).sum(axis=0)
        normal = turned / max(float(np.linalg.norm(turned)), np.finfo(np.float64).tiny)
        rows.append([*normal, -float((corner @ normal).mean())])
    return np.array(rows).reshape(-1, 4)


def sides(corner: Floats, cell: NDArray[np.int32], two_sided: Bools, locator: Locator) -> Ints:
    """(n, 2) the triangle visible in place of each triangle from the side of its normal, and from
    the other side: itself, or its copy in the cell on that side.

    Parameters
    ----------
    corner, cell, two_sided: (n, 3, 3) metres, (n,), (n,) of the triangles.
    locator: of the cells.
    """
    visible = np.repeat(np.arange(len(corner))[:, None], 2, axis=1)
    one, other = _pairs(corner, np.flatnonzero(two_sided))
    apart = cell[one] != cell[other]
    one = np.concatenate([one[apart], np.unique(one[apart])])
    other = np.concatenate([other[apart], np.unique(other[apart])])
    normal = normals(corner[one])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    step = SLACK * np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
    for side, away in enumerate((step, -step)):
        point = corner[one].mean(axis=1) + away
        outside = np.empty(len(one))
        for c in np.unique(cell[other]).tolist():
            rows = np.flatnonzero(cell[other] == c)
            outside[rows] = locator.outside(c, point[rows])
        # The copy in the cell that the point is deepest in comes last and wins.
        order = np.lexsort((-outside, one))
        order = order[outside[order] < SLACK / 2]
        visible[one[order], side] = other[order]
    return visible


def _pairs(corner: Floats, among: Ints) -> tuple[Ints, Ints]:
    """All pairs of triangles with the same three corners, each both ways, itself left out."""
    x, y, z = np.moveaxis(corner[among], 2, 0)
    turned = np.take_along_axis(corner[among], np.lexsort((z, y, x))[..., None], axis=1)
    _, group = np.unique(turned.reshape(-1, 9), axis=0, return_inverse=True)
    order = np.argsort(group.reshape(-1), kind="stable")
    group = group.reshape(-1)[order]
    ones, others = [among[:0]], [among[:0]]
    step = 1
    while step < len(group) and (same := group[step:] == group[:-step]).any():
        first, second = among[order[:-step][same]], among[order[step:][same]]
        ones += [first, second]
        others += [second, first]
        step += 1
    return np.concatenate(ones), np.concatenate(others)


#: The form of the geometry that clients of the hints fetch.
FORM = "gltf"
#: Bytes that a gzip file has more than a zlib stream.
_GZIP_MORE = 12
BUILD = Rebuild("build it again with {}")

Document = Mapping[str, Any]


@dataclass(frozen=True)
class MappedRelief:
    """The normal maps of triangles.

    Attributes
    ----------
    number: (n,) int32, the normal map of its object in the hints, -1 without.
    uv: (n, 3, 2) float64 coordinates in it, origin at the upper left; 0 without one.
    frame: (n, 7) float32, see `ptmtools.neighbours.apo.normal_map`; 0 without one.
    """

    number: NDArray[np.int32]
    uv: Floats
    frame: NDArray[np.float32]


@dataclass(frozen=True)
class Surfaces:
    """All triangles that are drawn, in the order of their cells.

    Attributes
    ----------
    corner: (n, 3, 3) float64 world metres. uv: (n, 3, 2) float64, origin at the upper left.
    cell, shape, texture: (n,) int32; the shape counts over all cells, the texture is -1 without.
    color: (n, 3) factor of the texel, encoded as sRGB, 0 to 1; of corners of several colours
        their mean.
    two_sided, glass: (n,) seen from both sides; without texture and not opaque.
    clamped: (n, 2) whether u and v stop at the edge of the texture instead of repeating it.
    seen: (n, 2) of each the one that is seen in its place from where its normal points to, and from
        behind it, see `sides`.
    octree: (n,) int32, the octree texture of its object in the hints, -1 without.
    lightmap, spot: (n,) int32, the lightmap in the hints' textures, -1 without; (n, 3, 2) float64
        coordinates in it, origin at the upper left. None if there are no lightmaps.
    relief: the normal maps of objects, if there are any. bumps: those of materials.
    opacity: (n,) of the factor, 0 to 1; None of surfaces that are all opaque.
    """

    corner: Floats
    uv: Floats
    cell: NDArray[np.int32]
    shape: NDArray[np.int32]
    texture: NDArray[np.int32]
    color: Floats
    two_sided: Bools
    glass: Bools
    clamped: Bools
    seen: Ints
    octree: NDArray[np.int32]
    lightmap: NDArray[np.int32] | None = None
    spot: Floats | None = None
    relief: MappedRelief | None = None
    bumps: Bumps | None = None
    opacity: Floats | None = None

    @property
    def light(self) -> Surfaces | None:
        """The same surfaces with their lightmaps, linear light, as textures; None if there are no
        lightmaps."""
        if self.lightmap is None or self.spot is None:
            return None
        count = len(self.corner)
        return replace(
            self,
            uv=self.spot,
            texture=self.lightmap,
            color=np.ones((count, 3)),
            clamped=np.ones((count, 2), np.bool_),
        )

    @property
    def bumped(self) -> Surfaces | None:
        """The same surfaces with the normal maps of their materials as textures; None if there are
        no such maps."""
        bumps = self.bumps
        if bumps is None:
            return None
        white = np.ones((len(self.corner), 3))
        return replace(self, uv=bumps.uv, texture=bumps.number, color=white, clamped=bumps.clamped)

    def boxes(self) -> tuple[Floats, Floats]:
        """(s, 3) corners of the boxes of the shapes, metres; infinite of one without triangles."""
        count = int(self.shape.max(initial=-1)) + 1
        low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
        np.minimum.at(low, self.shape, self.corner.min(axis=1))
        np.maximum.at(high, self.shape, self.corner.max(axis=1))
        return low, high


@dataclass(frozen=True)
class Served:
    """A served folder.

    Attributes
    ----------
    folder: its path.
    index: `hints.json`. records: of each cell. statistics: of all of them.
    index_bytes, statistics_bytes: on the link, and record_bytes, geometry_bytes: (C,);
        mesh_bytes: of each file of each of the index's meshes. All sizes are compressed by gzip, as
        servers send the files (docs/design/walkthrough.md).
    surfaces: the geometry of all cells, as modelled.
    locator: of the cells.
    """

    folder: Path
    index: Document
    records: tuple[Document, ...]
    statistics: Document
    index_bytes: int
    statistics_bytes: int
    record_bytes: NDArray[np.int64]
    geometry_bytes: NDArray[np.int64]
    mesh_bytes: tuple[tuple[int, ...], ...]
    surfaces: Surfaces
    locator: Locator

    @property
    def cell_count(self) -> int:
        """The number of cells."""
        return len(self.records)

    def file(self, url: str) -> Path:
        """A file that the index names. Raises DatabaseError PTM-D006 for one outside the folder."""
        return _inside(self.folder, url)

    def read(self, url: str) -> bytes:
        """The bytes of a file that the index names. Raises DatabaseError PTM-D005, D006."""
        return _bytes(self.file(url))

    def texture_file(self, texture: int) -> Path:
        """The `.ptm` of a texture."""
        return self.file(self.index["textures"][texture]["file"])

    def texture_set(self, form: str, texture: int) -> Path:
        """The folder of a texture in another form, one of the index's."""
        name = texture_name(self.index["textures"][texture]["file"])
        return self.file(self.index["textureSets"][form].replace("{name}", name))


def read_index(folder: Path) -> Document:
    """The `hints.json` of a served folder.

    Raises DatabaseError: PTM-D005 it cannot be read; PTM-D006 it is damaged.
    """
    return _document(folder / HINTS, schemas.HINTS)[0]


def read_served(database: str | os.PathLike[str]) -> Served:
    """The served folder of a database; ``database`` may also be the served folder itself.

    Raises
    ------
    DatabaseError: PTM-D001 there is no `hints.json`; PTM-D005 a file is missing; PTM-D006 one is
        damaged; PTM-D606 there is no geometry in glTF.
    """
    folder = Path(database)
    if not (folder / HINTS).exists():
        folder /= SERVED
    if not (folder / HINTS).exists():
        raise DatabaseError(
            "PTM-D001", f"there is no {HINTS}", file=database, remedy="build a database first"
        )
    index, index_bytes = _document(folder / HINTS, schemas.HINTS)
    if FORM not in index["geometry"]:
        raise DatabaseError(
            "PTM-D606",
            "has no geometry in glTF, which clients of the hints need",
            file=database,
            remedy="write it with `ptm emit DB --format vrml,gltf`",
        )
    names = [cell["name"] for cell in index["cells"]]
    pairs = [_document(_of(folder, index["record"], name), schemas.CELL) for name in names]
    records = tuple(document for document, _ in pairs)
    for cell, (name, record) in enumerate(zip(names, records, strict=True)):
        file = _of(folder, index["record"], name)
        _check_record(file, record, cell, len(names), index["textures"])
    statistics, statistics_bytes = _document(
        _inside(folder, index["statistics"]), schemas.STATISTICS
    )
    geometry, sizes = [], []
    for cell, name in enumerate(names):
        file = _of(folder, index["geometry"][FORM], name)
        data = _bytes(file)
        lists = len(index["textures"]), len(index.get("octrees", ()))
        geometry.append(_glb(file, data, cell, *lists))
        sizes.append(on_link(data))
    mesh_bytes = []
    for number, row in enumerate(index.get("meshes", ())):
        member, message = row_fault(row, len(names))
        if member:
            place = f"meshes[{number}].{member}"
            raise DatabaseError("PTM-D006", message, file=folder / HINTS, place=place, remedy=BUILD)
        files = [_inside(folder, url) for url in row["files"]]
        bodies = [_bytes(file) for file in files]
        mesh_bytes.append(tuple(map(on_link, bodies)))
        whole = _glb(files[-1], bodies[-1], row["cell"], *lists)
        geometry[row["cell"]] = _refined(geometry[row["cell"]], number, whole)
    locator = Locator(records)
    return Served(
        folder,
        index,
        records,
        statistics,
        index_bytes,
        statistics_bytes,
        np.array([size for _, size in pairs], dtype=np.int64),
        np.array(sizes, dtype=np.int64),
        tuple(mesh_bytes),
        _surfaces(geometry, locator),
        locator,
    )


def _of(folder: Path, template: str, name: str) -> Path:
    return _inside(folder, template.replace("{name}", name))


def _inside(folder: Path, url: str) -> Path:
    path = Path(os.path.normpath(folder / unquote(url)))
    if not path.is_relative_to(folder):
        raise DatabaseError(
            "PTM-D006", f"names {url!r}, outside the served folder", file=folder, remedy=BUILD
        )
    return path


def _bytes(file: Path) -> bytes:
    try:
        with open_regular(file) as stream:
            return stream.read()
    except OSError as fault:
        raise DatabaseError(
            "PTM-D005", f"cannot be read ({fault.strerror or fault})", file=file, remedy=BUILD
        ) from None


def _document(file: Path, schema: str) -> tuple[Document, int]:
    """A document, and its bytes on the link."""
    data = _bytes(file)
    try:
        document: Document = schemas.read(data, schema)
    except schemas.ShapeError as fault:
        raise DatabaseError(
            "PTM-D006", fault.message, file=file, place=fault.place or None, remedy=BUILD
        ) from None
    return document, on_link(data)


def on_link(data: bytes) -> int:
    """Bytes of a file as a server sends it with gzip, which is of no use for textures."""
    return min(len(data), len(zlib.compress(data, 6)) + _GZIP_MORE)


def _check_record(
    file: Path, record: Document, cell: int, cells: int, textures: Sequence[Document]
) -> None:
    others = [*record["visible"], *record["adjacent"], *(p["neighbour"] for p in record["portals"])]
    shares = record.get("textureShares", record["textures"])
    need = record.get("need", ())
    used = [t for row in record["textures"] for t in row]
    used += [t for row in record.get("textureShares", ()) for t, _ in row if t is not None]
    used += [row[0] for row in need]
    rows = {len(record["visible"]), len(record["ach"]), len(record["textures"]), len(shares)}
    fault = ""
    if len(rows) > 1 or max(others, default=0) >= cells or max(used, default=-1) >= len(textures):
        fault = "an index is out of range"
    elif any(first + len(levels) > len(sizes_of(textures[t])) for t, first, *levels in need):
        fault = "needs levels that do not exist"
    elif record["cell"] != cell or record["visible"][:1] != [cell]:
        fault = "belongs to another cell"
    if fault:
        raise DatabaseError("PTM-D006", fault, file=file, remedy=BUILD)


def _glb(file: Path, data: bytes, cell: int, textures: int, octrees: int) -> ReadGlb:
    try:
        read = read_glb(data)
    except FileError as fault:
        raise DatabaseError(
            "PTM-D006", fault.message, file=file, place=fault.place, remedy=BUILD
        ) from None
    named = ((p.material.texture, p.material.light, p.material.normal) for p in read.primitives)
    used = [number for each in named for number in each if number is not None]
    octree = [p.octree for p in read.primitives if p.octree is not None]
    out_of_range = max(used, default=-1) >= textures or max(octree, default=-1) >= octrees
    if read.cell != cell or out_of_range:
        raise DatabaseError("PTM-D006", "belongs to another cell", file=file, remedy=BUILD)
    return read


def _refined(cell: ReadGlb, mesh: int, whole: ReadGlb) -> ReadGlb:
    """A cell with an object as modelled in place of its coarsest mesh."""
    others = (each for each in cell.primitives if each.material.mesh != mesh)
    return replace(cell, primitives=(*others, *whole.primitives))


def _surfaces(geometry: list[ReadGlb], locator: Locator) -> Surfaces:
    shapes = [(glb.cell, p) for glb in geometry for p in glb.primitives]
    count = [len(p.triangle) for _, p in shapes]

    def spread(values: list[Any], kind: type[np.generic], *shape: int) -> NDArray[Any]:
        rows = np.array(values, dtype=kind).reshape(len(shapes), *shape)
        return np.repeat(rows, count, axis=0)

    def joined(rows: list[NDArray[Any]], width: int) -> Floats:
        return np.concatenate([np.zeros((0, 3, width)), *rows])

    materials = [p.material for _, p in shapes]
    texture = [
        -1 if p.uv is None or p.material.texture is None else p.material.texture for _, p in shapes
    ]
    lightmap = [-1 if m.light is None else m.light for m in materials]
    spot = joined([corners_of(p.light, p.triangle) for _, p in shapes], 2)
    clamp = WRAPS["clamp"]
    corner = joined([p.point.astype(np.float64)[p.triangle] for _, p in shapes], 3)
    cell = spread([cell for cell, _ in shapes], np.int32)
    two_sided = spread([m.two_sided for m in materials], np.bool_)
    mean = joined([_colors(p) for _, p in shapes], 3).mean(axis=1)
    return Surfaces(
        corner=corner,
        uv=joined([corners_of(p.uv, p.triangle) for _, p in shapes], 2),
        cell=cell,
        shape=np.repeat(np.arange(len(shapes), dtype=np.int32), count),
        texture=spread(texture, np.int32),
        color=to_srgb(spread([m.factor[:3] for m in materials], np.float64, 3)) * mean,
        two_sided=two_sided,
        glass=spread(
            [m.blends and t < 0 for m, t in zip(materials, texture, strict=True)], np.bool_
        ),
        clamped=spread([[w == clamp for w in m.wrap] for m in materials], np.bool_, 2),
        seen=sides(corner, cell, two_sided, locator),
        octree=spread([-1 if p.octree is None else p.octree for _, p in shapes], np.int32),
        lightmap=spread(lightmap, np.int32) if max(lightmap, default=-1) >= 0 else None,
        spot=spot if max(lightmap, default=-1) >= 0 else None,
        relief=_relief([p for _, p in shapes]),
        bumps=bumps_of([p for _, p in shapes], count),
        opacity=spread([m.factor[3] for m in materials], np.float64),
    )


def _relief(shapes: list[ReadPrimitive]) -> MappedRelief | None:
    if all(p.frame is None for p in shapes):
        return None
    count = sum(len(p.triangle) for p in shapes)
    number, uv = np.full(count, -1, np.int32), np.zeros((count, 3, 2))
    frame = np.zeros((count, 7), np.float32)
    end = 0
    for p in shapes:
        own = slice(end, end := end + len(p.triangle))
        if p.frame is not None and p.light is not None:
            number[own], uv[own] = p.material.normal or 0, p.light[p.triangle]
            frame[own] = p.frame[p.triangle[:, 0]]  # the corners have the same
    return MappedRelief(number, uv, frame)


def _colors(primitive: ReadPrimitive) -> Floats:
    """(m, 3, 3) of the corners of triangles, as sRGB encodes them."""
    if primitive.color is None:
        return np.ones((len(primitive.triangle), 3, 3))
    return to_srgb(primitive.color)[primitive.triangle]
