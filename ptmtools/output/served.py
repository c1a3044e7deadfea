"""The files of a database as clients of the hints fetch them: index, records, geometry, textures.

Only the served folder is read, so that all of a client's data counts as traffic, and a
published database can be simulated like a local one.
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

from ptmtools import schemas
from ptmtools.arrays import Ints
from ptmtools.errors import DatabaseError, Rebuild
from ptmtools.files import open_regular
from ptmtools.output.gltf_reader import ReadGlb, read_glb
from ptmtools.output.locating import Locator
from ptmtools.output.mesh_levels import row_fault
from ptmtools.output.model import FileError, probe_fault, sizes_of
from ptmtools.output.names import HINTS, texture_name
from ptmtools.output.representation import representations
from ptmtools.output.surfaces import Surfaces, surfaces_of
from ptmtools.store.layout import SERVED

#: The form of the geometry that clients of the hints fetch.
FORM = "gltf"
#: Bytes that a gzip file has more than a zlib stream.
_GZIP_MORE = 12
BUILD = Rebuild("build it again with {}")

Document = Mapping[str, Any]


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
    record_bytes: Ints
    geometry_bytes: Ints
    mesh_bytes: tuple[tuple[int, ...], ...]
    surfaces: Surfaces
    locator: Locator

    @property
    def cell_count(self) -> int:
        """The number of cells."""
        return len(self.records)

    def file(self, url: str) -> Path:
        """A file that the index names. Raises DatabaseError PTM-D006 for one outside the folder."""
        return _path_within(self.folder, url)

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
    folder, (index, index_bytes) = _find_index(database)
    names = [cell["name"] for cell in index["cells"]]
    for number, row in enumerate(index["textures"]):
        member, message = probe_fault(row, len(names))
        if member:
            place = f"textures[{number}].{member}"
            raise DatabaseError("PTM-D006", message, file=folder / HINTS, place=place, remedy=BUILD)
    pairs = [
        _document(_template_path(folder, index["record"], name), schemas.CELL) for name in names
    ]
    records = tuple(document for document, _ in pairs)
    for cell, (name, record) in enumerate(zip(names, records, strict=True)):
        file = _template_path(folder, index["record"], name)
        _check_record(file, record, cell, len(names), index["textures"])
    statistics, statistics_bytes = _document(
        _path_within(folder, index["statistics"]), schemas.STATISTICS
    )
    geometry, sizes = [], []
    for cell, name in enumerate(names):
        file = _template_path(folder, index["geometry"][FORM], name)
        data = _bytes(file)
        geometry.append(_glb(file, data, cell, index))
        sizes.append(on_link(data))
    mesh_bytes = []
    for number, row in enumerate(index.get("meshes", ())):
        member, message = row_fault(row, len(names))
        if member:
            place = f"meshes[{number}].{member}"
            raise DatabaseError("PTM-D006", message, file=folder / HINTS, place=place, remedy=BUILD)
        files = [_path_within(folder, url) for url in row["files"]]
        bodies = [_bytes(file) for file in files]
        mesh_bytes.append(tuple(map(on_link, bodies)))
        whole = _glb(files[-1], bodies[-1], row["cell"], index)
        geometry[row["cell"]] = _refine(geometry[row["cell"]], number, whole)
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
        surfaces_of(geometry, locator),
        locator,
    )


def _find_index(database: str | os.PathLike[str]) -> tuple[Path, tuple[Document, int]]:
    """The served folder, and its index as `_document` returns it; raises as `read_served`."""
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
    return folder, (index, index_bytes)


def place_names(database: str | os.PathLike[str]) -> tuple[str, ...]:
    """The names of the viewpoints of a database, each once; none without hints. Raises
    DatabaseError: PTM-D006 the hints are damaged."""
    file = Path(database) / SERVED / HINTS
    if not file.exists():
        return ()
    index, _ = _document(file, schemas.HINTS)
    names = dict.fromkeys(str(row["description"]) for row in index["viewpoints"])
    return tuple(filter(None, names))


def _template_path(folder: Path, template: str, name: str) -> Path:
    return _path_within(folder, template.replace("{name}", name))


def _path_within(folder: Path, url: str) -> Path:
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


def _glb(file: Path, data: bytes, cell: int, index: Mapping[str, Any]) -> ReadGlb:
    try:
        read = read_glb(data)
    except FileError as fault:
        raise DatabaseError(
            "PTM-D006", fault.message, file=file, place=fault.place, remedy=BUILD
        ) from None
    materials = [primitive.material for primitive in read.primitives]
    named = ((m.texture, m.light, m.normal, m.probe) for m in materials)
    used = [number for numbers in named for number in numbers if number is not None]
    out_of_range = max(used, default=-1) >= len(index["textures"])
    for kind in representations():
        rows = [p.extras[kind.member] for p in read.primitives if kind.member in p.extras]
        out_of_range |= max(rows, default=-1) >= len(index.get(kind.name, ()))
    if read.cell != cell or out_of_range:
        raise DatabaseError("PTM-D006", "belongs to another cell", file=file, remedy=BUILD)
    for material in materials:
        if material.probe is not None and "probe" not in index["textures"][material.probe]:
            message = f"texture {material.probe} of the hints is not a probe"
            raise DatabaseError("PTM-D006", message, file=file, place="materials", remedy=BUILD)
    return read


def _refine(cell: ReadGlb, mesh: int, whole: ReadGlb) -> ReadGlb:
    """A cell with an object as modelled in place of its coarsest mesh."""
    others = (primitive for primitive in cell.primitives if primitive.material.mesh != mesh)
    return replace(cell, primitives=(*others, *whole.primitives))
