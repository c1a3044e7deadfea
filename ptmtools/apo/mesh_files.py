"""The simplified mesh as a GLB of one primitive, and as an OBJ; and the GLB back."""

from __future__ import annotations

import json

import numpy as np

from ptmtools import schemas
from ptmtools.apo.making import Simple
from ptmtools.errors import InputError
from ptmtools.glb import BINARY, JSON, glb, glb_chunks

_FLOAT, _SHORT, _INT, _VERTICES, _INDICES = 5126, 5123, 5125, 34962, 34963
#: An index of 16 bits that restarts a primitive.
_RESTART = 65535


def glb_of(mesh: Simple) -> bytes:
    """A GLB: positions, normals, indices."""
    point, triangle = mesh.points.astype(np.float32), mesh.triangles
    narrow = len(point) < _RESTART
    arrays = [
        point.astype("<f4"),
        mesh.normals.astype("<f4"),
        triangle.astype("<u2" if narrow else "<u4"),
    ]
    views, at = [], 0
    for array, target in zip(arrays, (_VERTICES, _VERTICES, _INDICES), strict=True):
        views.append({"buffer": 0, "byteOffset": at, "byteLength": array.nbytes, "target": target})
        at += array.nbytes
    bounds = {"min": point.min(axis=0).tolist(), "max": point.max(axis=0).tolist()}
    vector = {"componentType": _FLOAT, "count": len(point), "type": "VEC3"}
    document = {
        "asset": {"version": "2.0", "generator": "ptmtools"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2}]}],
        "accessors": [
            {"bufferView": 0, **vector, **bounds},
            {"bufferView": 1, **vector},
            {
                "bufferView": 2,
                "componentType": _SHORT if narrow else _INT,
                "count": triangle.size,
                "type": "SCALAR",
            },
        ],
        "bufferViews": views,
        "buffers": [{"byteLength": at}],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    return glb([(JSON, text), (BINARY, b"".join(array.tobytes() for array in arrays))])


def obj_of(mesh: Simple) -> bytes:
    """The same as an OBJ."""
    point, triangle = mesh.points.astype(np.float32), mesh.triangles
    lines = ["# The simplified mesh of an octree texture; see apo.json."]
    lines += ["v " + " ".join(str(v) for v in row) for row in point]
    lines += ["vn " + " ".join(str(v) for v in row) for row in mesh.normals]
    corners = (triangle.astype(np.int64) + 1).tolist()
    lines += ["f " + " ".join(f"{v}//{v}" for v in row) for row in corners]
    return ("\n".join(lines) + "\n").encode()


def mesh_of(data: bytes) -> Simple:
    """The mesh of a GLB that `glb_of` wrote.

    Raises InputError PTM-I846: it is not such a GLB.
    """
    try:
        chunks = {kind: body for kind, _, body in glb_chunks(data)}
        document = schemas.parse(chunks[JSON])
        views, accessors = document["bufferViews"], document["accessors"]
        vertices, corners = (int(accessors[k]["count"]) for k in (0, 2))
        indices = {_SHORT: "<u2", _INT: "<u4"}[accessors[2]["componentType"]]
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
            "PTM-I846",
            f"is no GLB of a simplified mesh ({fault.args[-1] if fault.args else 'damaged'})",
            remedy="write it again with `ptm apo`",
        ) from None
    return Simple(point.astype(np.float64), triangle.astype(np.int32), normal)
