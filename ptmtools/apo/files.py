"""An octree texture and its mesh as a folder (docs/formats/apo.md; paper 2, §3.2 and §4).

Each level of a stream ends with a full flush of deflate: from there on nothing refers to what was
before, so that every prefix of whole levels inflates, and every level alone. The flushes of all
levels together cost some 5 bytes each.
"""

from __future__ import annotations

import json
import math
import zlib
from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.apo.making import Made
from ptmtools.apo.mesh_files import glb_of, obj_of
from ptmtools.apo.model import Octree
from ptmtools.whole_folder import FolderForm

FORMAT, SCHEMA = "ptmtools apo", 1
INDEX, NORMALS, COLORS, MESH, OBJ = "apo.json", "apo.bin", "color.bin", "mesh.glb", "mesh.obj"
FORM = FolderForm(INDEX, FORMAT, "ptm apo", lambda p: p in (INDEX, NORMALS, COLORS, MESH, OBJ))


def streamed(texels: NDArray[np.uint8], octree: Octree) -> tuple[bytes, dict[str, list[int]]]:
    """The stream of (n, 4) texels of an octree, where each level ends in it, and checksums."""
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


def files_of(made: Made) -> Iterator[tuple[str, bytes]]:
    """Name and contents of each file, the index last."""
    octree, streams = made.octree, {}
    wanted = {"normals": (NORMALS, octree.texels), "colors": (COLORS, octree.colors)}
    for what, (name, texels) in wanted.items():
        if texels is not None:
            data, levels = streamed(texels, octree)
            streams[what] = {"file": name, **levels}
            yield name, data
    mesh = glb_of(made.mesh)
    yield MESH, mesh
    yield OBJ, obj_of(made.mesh)
    document = json.dumps(_document(made, streams, mesh), indent=1, allow_nan=False)
    yield INDEX, f"{document}\n".encode()


def _document(made: Made, streams: dict[str, Any], mesh: bytes) -> dict[str, Any]:
    octree = made.octree
    return {
        "format": FORMAT,
        "schema": SCHEMA,
        "space": {
            "origin": list(made.space.origin),
            "unit": made.space.metres,
            "up": made.space.up,
        },
        "cube": {"low": octree.low.tolist(), "side": octree.side},
        "levels": np.diff(octree.start).tolist(),
        **streams,
        "mesh": {
            "file": MESH,
            "faces": len(made.mesh.triangles),
            "bytes": len(mesh),
            "crc32": zlib.crc32(mesh),
        },
        "source": {
            "triangles": made.source,
            "deviation": made.deviation if math.isfinite(made.deviation) else None,
            "missed": made.missed,
        },
        "options": asdict(made.options),
    }
