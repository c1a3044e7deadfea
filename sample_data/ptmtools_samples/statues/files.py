"""Serialises triangles as PLY, OBJ or GLB."""

from __future__ import annotations

import json

import numpy as np
from numpy.typing import NDArray

from ptmtools.glb import glb as pack_glb
from ptmtools_samples.files import HEAD

TITLE = f"{HEAD} statue"
Ints = NDArray[np.int64]
Singles = NDArray[np.float32]
Colors = NDArray[np.uint8] | None


def ply(points: Singles, triangles: Ints, colors: Colors, about: str) -> bytes:
    """Binary, little-endian PLY with vertex colours."""
    names = [("float", "x"), ("float", "y"), ("float", "z")]
    fields: list[tuple[str, str]] = [(name, "<f4") for _, name in names]
    if colors is not None:
        names += [("uchar", "red"), ("uchar", "green"), ("uchar", "blue")]
        fields += [(name, "u1") for name in ("red", "green", "blue")]
    head = ["ply", "format binary_little_endian 1.0", f"comment {TITLE}: {about}"]
    head += [f"element vertex {len(points)}", *(f"property {kind} {name}" for kind, name in names)]
    head += [f"element face {len(triangles)}", "property list uchar int vertex_indices"]
    rows = np.zeros(len(points), dtype=fields)
    for k, (name, _) in enumerate(fields):
        rows[name] = points[:, k] if k < 3 else colors[:, k - 3]  # type: ignore[index]
    faces = np.zeros(len(triangles), dtype=[("count", "u1"), ("corner", "<i4", 3)])
    faces["count"], faces["corner"] = 3, triangles
    return ("\n".join([*head, "end_header"]) + "\n").encode() + rows.tobytes() + faces.tobytes()


def obj(points: Singles, triangles: Ints, colors: Colors, about: str) -> bytes:
    """OBJ with colours after the coordinates, a common extension."""
    rows = [f"# {TITLE}: {about}", "# metres, Y up"]
    if colors is None:
        rows += [f"v {x:.7g} {y:.7g} {z:.7g}" for x, y, z in points.tolist()]
    else:
        shares = (colors / 255).tolist()
        rows += [
            f"v {x:.7g} {y:.7g} {z:.7g} {r:.4g} {g:.4g} {b:.4g}"
            for (x, y, z), (r, g, b) in zip(points.tolist(), shares, strict=True)
        ]
    rows += [f"f {a} {b} {c}" for a, b, c in (triangles + 1).tolist()]
    return ("\n".join(rows) + "\n").encode()


def glb(points: Singles, triangles: Ints, colors: Colors, about: str) -> bytes:
    """GLB of one primitive; colours are normalised bytes in linear space, as glTF requires."""
    parts = [points.astype("<f4").tobytes(), triangles.astype("<u4").tobytes()]
    attributes = {"POSITION": 0}
    low, high = (f(axis=0).tolist() for f in (points.min, points.max))
    accessors = [
        {"componentType": 5126, "count": len(points), "type": "VEC3", "min": low, "max": high},
        {"componentType": 5125, "count": triangles.size, "type": "SCALAR"},
    ]
    if colors is not None:
        share = colors / 255
        linear = np.rint(share * share * 255).astype(np.uint8)
        parts.append(np.pad(linear, ((0, 0), (0, 1)), constant_values=255).tobytes())
        attributes["COLOR_0"] = 2
        row = {"componentType": 5121, "normalized": True, "count": len(points), "type": "VEC4"}
        accessors.append(row)
    views, at = [], 0
    for part in parts:
        views.append({"buffer": 0, "byteOffset": at, "byteLength": len(part)})
        at += len(part)
    primitive = {"attributes": attributes, "indices": 1}
    tree = {
        "asset": {"version": "2.0", "generator": f"{TITLE}: {about}"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": about.split(",")[0]}],
        "meshes": [{"primitives": [primitive]}],
        "accessors": [row | {"bufferView": k} for k, row in enumerate(accessors)],
        "bufferViews": views,
        "buffers": [{"byteLength": at}],
    }
    text = json.dumps(tree, separators=(",", ":")).encode()
    return pack_glb([(b"JSON", text), (b"BIN\0", b"".join(parts))])


FORMATS = {"ply": ply, "obj": obj, "glb": glb}
