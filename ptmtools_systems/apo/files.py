"""Writes and reads an octree texture and its mesh as a folder (docs/formats/apo.md; paper 2, §3.2
and §4).

Each level of a stream ends with a full flush of deflate, so that every prefix of whole levels
inflates, and every level alone. A folder may be untrusted: the index is checked against its schema
and for contradictions, and sizes against the limit of addresses before memory is allocated.
"""

from __future__ import annotations

import json
import math
import os
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools import schemas
from ptmtools.arrays import Floats, Ints
from ptmtools.errors import InputError, LimitError, naming
from ptmtools.files import open_below
from ptmtools.glb import BINARY, INT, JSON, SHORT, BufferWriter, glb_chunks, one_mesh
from ptmtools.whole_folder import FolderForm
from ptmtools_systems.apo.making import ApoTexture, Simple
from ptmtools_systems.apo.model import ADDRESS_BITS, Octree
from ptmtools_systems.schemas import APO


def glb_of(mesh: Simple) -> bytes:
    """A GLB with positions, normals and indices."""
    buffer = BufferWriter()
    attributes = {
        "POSITION": buffer.positions(mesh.points),
        "NORMAL": buffer.vectors(mesh.normals),
    }
    indices = buffer.indices(mesh.triangles, len(mesh.points))
    return one_mesh([{"attributes": attributes, "indices": indices}], buffer)


def obj_of(mesh: Simple) -> bytes:
    """The mesh as an OBJ."""
    point, triangle = mesh.points.astype(np.float32), mesh.triangles
    lines = ["# The simplified mesh of an octree texture; see apo.json."]
    lines += ["v " + " ".join(str(v) for v in row) for row in point]
    lines += ["vn " + " ".join(str(v) for v in row) for row in mesh.normals]
    corners = (triangle.astype(np.int64) + 1).tolist()
    lines += ["f " + " ".join(f"{v}//{v}" for v in row) for row in corners]
    return ("\n".join(lines) + "\n").encode()


def mesh_of(data: bytes) -> Simple:
    """The mesh of a GLB that `glb_of` wrote.

    Raises InputError PTM-I821: it is not such a GLB.
    """
    try:
        chunks = {kind: body for kind, _, body in glb_chunks(data)}
        document = schemas.parse(chunks[JSON])
        views, accessors = document["bufferViews"], document["accessors"]
        vertices, corners = (int(accessors[k]["count"]) for k in (0, 2))
        indices = {SHORT: "<u2", INT: "<u4"}[accessors[2]["componentType"]]
        wanted = (3 * vertices, "<f4"), (3 * vertices, "<f4"), (corners, indices)
        arrays = []
        for k, (count, kind) in enumerate(wanted):
            begin, length = int(views[k]["byteOffset"]), count * np.dtype(kind).itemsize
            if count <= 0 or begin < 0 or begin + length > len(chunks[BINARY]):
                raise ValueError("an accessor leads out of its bytes")
            arrays.append(np.frombuffer(chunks[BINARY], kind, count, begin).reshape(-1, 3))
        point, normal, triangle = arrays
        if triangle.max() >= vertices or not all(np.isfinite(a).all() for a in (point, normal)):
            raise ValueError("an index is out of range, or a number not finite")
    except (ValueError, LookupError, TypeError, OverflowError) as fault:
        raise InputError(
            "PTM-I821",
            f"is no GLB of a simplified mesh ({fault.args[-1] if fault.args else 'damaged'})",
            remedy="write it again with `ptm apo`",
        ) from None
    return Simple(point.astype(np.float64), triangle.astype(np.int32), normal)


FORMAT, SCHEMA = "ptmtools apo", 1
INDEX, NORMALS, COLORS, MESH, OBJ = "apo.json", "apo.bin", "color.bin", "mesh.glb", "mesh.obj"
FORM = FolderForm(INDEX, FORMAT, "ptm apo", lambda p: p in (INDEX, NORMALS, COLORS, MESH, OBJ))


def encode_stream(texels: NDArray[np.uint8], octree: Octree) -> tuple[bytes, dict[str, list[int]]]:
    """The stream of (n, 4) texels of an octree, with the end of each level and checksums."""
    deflate = zlib.compressobj(zlib.Z_BEST_COMPRESSION)
    parts: list[bytes] = []
    ends, checks, at = [], [], 0
    for k in range(octree.levels):
        level = texels[octree.start[k] : octree.start[k + 1]].tobytes()
        last = k == octree.levels - 1
        flushed = zlib.Z_FINISH if last else zlib.Z_FULL_FLUSH
        part = deflate.compress(level) + deflate.flush(flushed)
        parts.append(part)
        at += len(part)
        ends.append(at)
        checks.append(zlib.crc32(level))
    return b"".join(parts), {"ends": ends, "crc32": checks}


def files_of(texture: ApoTexture) -> Iterator[tuple[str, bytes]]:
    """Name and contents of each file, the index last."""
    octree, streams = texture.octree, {}
    wanted = {"normals": (NORMALS, octree.texels), "colors": (COLORS, octree.colors)}
    for channel, (name, texels) in wanted.items():
        if texels is not None:
            data, levels = encode_stream(texels, octree)
            streams[channel] = {"file": name, **levels}
            yield name, data
    mesh = glb_of(texture.mesh)
    yield MESH, mesh
    yield OBJ, obj_of(texture.mesh)
    document = json.dumps(_document(texture, streams, mesh), indent=1, allow_nan=False)
    yield INDEX, f"{document}\n".encode()


def _document(texture: ApoTexture, streams: dict[str, Any], mesh: bytes) -> dict[str, Any]:
    octree = texture.octree
    return {
        "format": FORMAT,
        "schema": SCHEMA,
        "space": {
            "origin": list(texture.space.origin),
            "unit": texture.space.metres,
            "up": texture.space.up,
        },
        "cube": {"low": octree.low.tolist(), "side": octree.side},
        "levels": np.diff(octree.start).tolist(),
        **streams,
        "mesh": {
            "file": MESH,
            "faces": len(texture.mesh.triangles),
            "bytes": len(mesh),
            "crc32": zlib.crc32(mesh),
        },
        "source": {
            "triangles": texture.source,
            "deviation": texture.deviation if math.isfinite(texture.deviation) else None,
            "missed": texture.missed,
        },
        "options": asdict(texture.options),
    }


_AGAIN = "write it again with `ptm apo`"
#: An index of 21 levels has 3 kB; more fields may be added.
_INDEX_MOST = 1 << 20
#: Largest growth by deflate: a factor, and further bytes.
_GROWTH, _BESIDES = 1.01, 64
#: Bytes of a GLB of 4 million vertices.
_MESH_MOST = 1 << 28


@dataclass(frozen=True)
class Index:
    """The content of `apo.json`.

    Attributes
    ----------
    start: (L + 1,) first texel of each level.
    low, side: corner and side of the cube.
    normals, colors: the streams: file, the end of each level and its checksum; colours may be None.
    mesh: faces, bytes and checksum of the mesh's file.
    document: the whole document.
    """

    start: Ints
    low: Floats
    side: float
    normals: Mapping[str, Any]
    colors: Mapping[str, Any] | None
    mesh: Mapping[str, Any]
    document: Mapping[str, Any]

    @property
    def levels(self) -> int:
        """Number of levels."""
        return len(self.start) - 1


def read_index(folder: str | os.PathLike[str]) -> Index:
    """Reads the index of an octree texture.

    Raises
    ------
    InputError: PTM-I120 the folder holds no octree texture; PTM-I821 the index violates its schema,
        has another schema number, or contradicts itself; PTM-I122 it cannot be read.
    LimitError: PTM-L400 more texels than addresses; PTM-L204 too large for an index.
    """
    file = Path(folder) / INDEX
    if not os.path.lexists(file):
        exists = Path(folder).is_dir()
        raise InputError(
            "PTM-I120",
            f"holds no octree texture: there is no {INDEX} in it" if exists else "is no folder",
            file=folder,
            remedy="specify a folder that `ptm apo` wrote",
        )
    data = _bytes_of(folder, INDEX, _INDEX_MOST)
    with naming(file):
        return _index(data)


def _index(data: bytes) -> Index:
    try:
        document = schemas.parse(data)
        declared = document if isinstance(document, dict) else {}
        if (declared.get("format"), declared.get("schema")) != (FORMAT, SCHEMA):
            raise schemas.ShapeError(
                f"is {declared.get('format')!r}, schema {declared.get('schema')!r}, not "
                f"{FORMAT!r}, schema {SCHEMA}"
            )
        schemas.check(document, APO)
    except schemas.ShapeError as fault:
        raise InputError(
            "PTM-I821", fault.message, place=fault.place or None, remedy=_AGAIN
        ) from None
    start: Ints = np.concatenate([[0], np.cumsum(document["levels"], dtype=np.float64)])
    if start[-1] > 1 << ADDRESS_BITS:
        raise LimitError(
            "PTM-L400",
            f"has {start[-1]:.4g} texels, more than the {1 << ADDRESS_BITS:,} that addresses can "
            "tell apart",
            remedy=_AGAIN,
        )
    result = Index(
        start.astype(np.int64),
        np.array(document["cube"]["low"], dtype=np.float64),
        float(document["cube"]["side"]),
        document["normals"],
        document.get("colors"),
        document["mesh"],
        document,
    )
    _check(result)
    return result


def _check(index: Index) -> None:
    problem = ""
    streams = [(index.normals, NORMALS), *([(index.colors, COLORS)] if index.colors else [])]
    for stream, name in streams:
        if stream["file"] != name:
            problem = f"a stream is called {stream['file'][:40]!r} instead of {name!r}"
        elif {len(stream["ends"]), len(stream["crc32"])} != {index.levels}:
            problem = f"{name} has another number of levels than the octree"
        elif ((size := np.diff(stream["ends"], prepend=0)) <= 0).any():
            problem = f"the levels of {name} do not follow each other"
        elif (size > 4 * np.diff(index.start) * _GROWTH + _BESIDES).any():
            problem = f"a level of {name} takes more than its texels"
    if index.mesh["file"] != MESH:
        problem = f"the mesh is called {str(index.mesh['file'])[:40]!r} instead of {MESH!r}"
    if problem:
        raise InputError("PTM-I821", problem, remedy=_AGAIN)


def read_octree(folder: str | os.PathLike[str], levels: int | None = None) -> Octree:
    """The first ``levels`` of an octree texture, or all of it.

    Raises
    ------
    InputError, LimitError: those of `read_index`; PTM-I111 the octree has fewer levels; PTM-I821 a
        stream is damaged.
    """
    index = read_index(folder)
    wanted = index.levels if levels is None else levels
    if not 1 <= wanted <= index.levels:
        raise InputError(
            "PTM-I111",
            f"there is no octree of {wanted} levels",
            file=folder,
            remedy=f"use 1 to {index.levels}",
        )
    texels = _texels(folder, index, index.normals, wanted)
    colors = _texels(folder, index, index.colors, wanted) if index.colors else None
    return Octree(texels, index.start[: wanted + 1], index.low, index.side, colors)


def _texels(
    folder: str | os.PathLike[str], index: Index, stream: Mapping[str, Any], levels: int
) -> NDArray[np.uint8]:
    data = _bytes_of(folder, stream["file"], stream["ends"][levels - 1], whole=False)
    with naming(Path(folder) / stream["file"]):
        return inflate_texels(data, index.start[: levels + 1], stream)


def inflate_texels(data: bytes, start: Ints, stream: Mapping[str, Any]) -> NDArray[np.uint8]:
    """(n, 4) texels of the first levels, from the beginning of a stream with "ends" and "crc32".

    Raises InputError PTM-I821: it is damaged, or too short.
    """
    inflate, parts, at = zlib.decompressobj(), [], 0
    for k, end in enumerate(stream["ends"][: len(start) - 1]):
        size = 4 * int(start[k + 1] - start[k])
        try:
            part = inflate.decompress(data[at:end], size + 1)
        except zlib.error:
            part = b""
        if end > len(data) or len(part) != size or zlib.crc32(part) != stream["crc32"][k]:
            problem = "ends before it is whole" if end > len(data) else "is damaged"
            raise InputError("PTM-I821", problem, place=f"level {k}", remedy=_AGAIN)
        parts.append(part)
        at = end
    return np.frombuffer(b"".join(parts), np.uint8).reshape(-1, 4)


def read_mesh(folder: str | os.PathLike[str]) -> Simple:
    """The simplified mesh of an octree texture.

    Raises InputError: PTM-I122 it cannot be read; PTM-I821 it is damaged. LimitError PTM-L204.
    """
    with naming(Path(folder) / MESH):
        return mesh_of(mesh_bytes(folder))


def mesh_bytes(folder: str | os.PathLike[str]) -> bytes:
    """Reads the file of the mesh. Raises InputError PTM-I122, LimitError PTM-L204."""
    return _bytes_of(folder, MESH, _MESH_MOST)


def _bytes_of(
    folder: str | os.PathLike[str], name: str, limit: int, *, whole: bool = True
) -> bytes:
    """Reads a file, or with ``whole`` False its first ``limit`` bytes."""
    file = Path(folder) / name
    try:
        with open_below(folder, name) as stream:
            data = stream.read(limit + whole)
    except OSError as fault:
        raise InputError(
            "PTM-I122", f"cannot be read ({fault.strerror or fault})", file=file, remedy=_AGAIN
        ) from None
    if len(data) > limit:
        raise LimitError("PTM-L204", f"has more than {limit:,} bytes", file=file, remedy=_AGAIN)
    return data


def page_files(index: Mapping[str, Any]) -> Iterator[str]:
    """The files of a folder with this index that its page fetches."""
    for name in ("mesh", "normals", "colors"):
        if name in index:
            yield index[name]["file"]
