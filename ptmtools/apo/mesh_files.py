"""The simplified mesh as a GLB of one primitive, and as an OBJ; and the GLB back."""

from __future__ import annotations

import json

import numpy as np
from numpy.typing import NDArray

from ptmtools import schemas
from ptmtools.apo.making import Simple
from ptmtools.errors import InputError
from ptmtools.glb import BINARY, JSON, glb, glb_chunks

_FLOAT, _INT, _VERTICES, _INDICES = 5126, 5125, 34962, 34963


def split(mesh: Simple) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.uint32]]:
    """(n, 3) points and normals of its vertices, and (T, 3) triangles of them: a point at a crease
    is as many vertices as it has normals."""
    point = mesh.points.astype(np.float32)[mesh.triangles.ravel()]
    rows = np.concatenate([point, mesh.normals.reshape(-1, 3)], axis=1) + np.float32(0)
    _, first, number = np.unique(
        np.ascontiguousarray(rows).view([("", np.float32)] * 6).ravel(),
        return_index=True,
        return_inverse=True,
    )
    # In the order of their first use, as graphics processors like them.
    order = np.argsort(first, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    kept = rows[first[order]]
    triangle = rank[number.reshape(-1)].reshape(-1, 3).astype(np.uint32)
    return kept[:, :3], kept[:, 3:], triangle


def glb_of(mesh: Simple) -> bytes:
    """A GLB: positions, normals, indices."""
    point, normal, triangle = split(mesh)
    arrays = [point.astype("<f4"), normal.astype("<f4"), triangle.astype("<u4")]
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
            {"bufferView": 2, "componentType": _INT, "count": triangle.size, "type": "SCALAR"},
        ],
        "bufferViews": views,
        "buffers": [{"byteLength": at}],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    return glb([(JSON, text), (BINARY, b"".join(array.tobytes() for array in arrays))])


def obj_of(mesh: Simple) -> bytes:
    """The same as an OBJ."""
    point, normal, triangle = split(mesh)
    lines = ["# The simplified mesh of an octree texture; see apo.json."]
    lines += ["v " + " ".join(str(v) for v in row) for row in point]
    lines += ["vn " + " ".join(str(v) for v in row) for row in normal]
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
        arrays = []
        for k, (count, kind) in enumerate(
            [(3 * vertices, "<f4"), (3 * vertices, "<f4"), (corners, "<u4")]
        ):
            begin, length = int(views[k]["byteOffset"]), 4 * count
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
    return Simple(
        point.astype(np.float64), triangle.astype(np.int32), normal[triangle.astype(np.int64)]
    )
