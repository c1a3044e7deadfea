"""The simplified mesh as a GLB of one primitive, and as an OBJ; and the GLB back."""

from __future__ import annotations

import numpy as np

from ptmtools import schemas
from ptmtools.apo.making import Simple
from ptmtools.errors import InputError
from ptmtools.glb import BINARY, JSON, glb_chunks
from ptmtools.glb_writing import INT, SHORT, BufferWriter, one_mesh


def glb_of(mesh: Simple) -> bytes:
    """A GLB: positions, normals, indices."""
    buffer = BufferWriter()
    attributes = {
        "POSITION": buffer.positions(mesh.points),
        "NORMAL": buffer.vectors(mesh.normals),
    }
    indices = buffer.indices(mesh.triangles, len(mesh.points))
    return one_mesh([{"attributes": attributes, "indices": indices}], buffer)


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
            "PTM-I846",
            f"is no GLB of a simplified mesh ({fault.args[-1] if fault.args else 'damaged'})",
            remedy="write it again with `ptm apo`",
        ) from None
    return Simple(point.astype(np.float64), triangle.astype(np.int32), normal)
