"""Time and memory of reading a million triangles in each format, beside a plain GLB.

    python benchmarks/formats.py [--triangles 1000000] [--runs 3]

The script writes a wavy floor of triangles with texture coordinates as a GLB (plain, with meshopt,
with Draco), as OBJ and as USD. `ptmtools.scene.ingest` reads each in a separate process, runs
taking turns; memory is the peak of a process and of its child processes.
"""

from __future__ import annotations

import argparse
import json
import struct
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
READ = """
import resource, sys, time
from pathlib import Path
from ptmtools.scene import IngestOptions, ingest
start = time.perf_counter()
scene = ingest(Path(sys.argv[1]), IngestOptions(unit="m", up="y"))
seconds = time.perf_counter() - start
whose = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
most = max(resource.getrusage(who).ru_maxrss for who in whose)
print(seconds, most, len(scene.triangles))
"""


def floor(triangles: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points, texture coordinates and (n, 3) triangles of a wavy floor."""
    side = max(2, round((triangles / 2) ** 0.5)) + 1
    x, z = np.meshgrid(np.linspace(0, 50, side), np.linspace(0, 50, side), indexing="ij")
    y = 0.2 * np.sin(x) * np.cos(0.7 * z)
    points = np.stack([x, y, z], axis=2).reshape(-1, 3).astype(np.float32)
    corner = np.arange(side * side).reshape(side, side)
    a, b, c, d = (
        q.ravel() for q in (corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1])
    )
    faces = np.stack([a, b, c, a, c, d], axis=1).reshape(-1, 3).astype(np.uint32)
    return points, (points[:, [0, 2]] / 50).astype(np.float32), faces


def glb(views: list[tuple[bytes, dict[str, Any]]], tree: dict[str, Any]) -> bytes:
    """A GLB of buffer views, each with what it says besides."""
    blob, rows = b"", []
    for data, fields in views:
        rows.append({"buffer": 0, "byteOffset": len(blob), "byteLength": len(data)} | fields)
        blob += data + bytes(-len(data) % 4)
    tree = {"asset": {"version": "2.0"}, "bufferViews": rows} | tree
    tree["buffers"] = [{"byteLength": len(blob)}, *tree.get("buffers", [])]
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sIII4s", b"glTF", 2, 28 + len(text) + len(blob), len(text), b"JSON")
    return head + text + struct.pack("<I4s", len(blob), b"BIN\0") + blob


def document(points: np.ndarray, faces: np.ndarray) -> dict[str, Any]:
    """What all GLBs say of one mesh of positions, coordinates and indices, in this order."""
    count = len(points)
    return {
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2}]}
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": count, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5126, "count": count, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5125, "count": faces.size, "type": "SCALAR"},
        ],
    }


def plain(points: np.ndarray, coords: np.ndarray, faces: np.ndarray) -> bytes:
    views: list[tuple[bytes, dict[str, Any]]] = [
        (each.tobytes(), {}) for each in (points, coords, faces)
    ]
    return glb(views, document(points, faces))


def meshopt(points: np.ndarray, coords: np.ndarray, faces: np.ndarray) -> bytes:
    import meshopt as library

    name, whole = "EXT_meshopt_compression", 0
    views: list[tuple[bytes, dict[str, Any]]] = []
    for each in (points, coords, faces):
        if each is faces:
            data, mode, count, stride = (
                library.encode_index_buffer(each.ravel()),
                "TRIANGLES",
                each.size,
                4,
            )
        else:
            rows = np.ascontiguousarray(each).view(np.uint8).reshape(len(each), -1)
            data = library.encode_vertex_buffer_level(rows, 2, 0)
            mode, (count, stride) = "ATTRIBUTES", rows.shape
        fields = {"mode": mode, "count": count, "byteStride": stride, "byteLength": len(data)}
        views.append((data, fields))
        whole += count * stride
    at, packed = 0, []
    for data, fields in views:
        extension = {name: fields | {"buffer": 0, "byteOffset": at}}
        packed.append(
            (
                data,
                {
                    "buffer": 1,
                    "byteLength": fields["count"] * fields["byteStride"],
                    "extensions": extension,
                },
            )
        )
        at += len(data) + -len(data) % 4
    tree = document(points, faces) | {"extensionsRequired": [name], "extensionsUsed": [name]}
    tree["buffers"] = [{"byteLength": whole, "extensions": {name: {"fallback": True}}}]
    return glb(packed, tree)


def draco(points: np.ndarray, coords: np.ndarray, faces: np.ndarray) -> bytes:
    import DracoPy

    data = DracoPy.encode(points, faces, quantization_bits=14, tex_coord=coords.astype(np.float64))
    ids = {row["attribute_type"]: row["unique_id"] for row in DracoPy.decode(data).attributes}
    count = len(np.unique(faces))
    tree, name = document(points, faces), "KHR_draco_mesh_compression"
    for accessor in tree["accessors"]:
        del accessor["bufferView"]
    decoded = DracoPy.decode(data)
    for accessor in tree["accessors"][:2]:
        accessor["count"] = len(decoded.points)
    assert count <= len(decoded.points)
    fields = {"bufferView": 0, "attributes": {"POSITION": ids[0], "TEXCOORD_0": ids[3]}}
    tree["meshes"][0]["primitives"][0]["extensions"] = {name: fields}
    return glb([(data, {})], tree | {"extensionsRequired": [name], "extensionsUsed": [name]})


def obj(points: np.ndarray, coords: np.ndarray, faces: np.ndarray) -> bytes:
    rows = [f"v {x:.6g} {y:.6g} {z:.6g}" for x, y, z in points.tolist()]
    rows += [f"vt {u:.6g} {v:.6g}" for u, v in coords.tolist()]
    rows += [f"f {a}/{a} {b}/{b} {c}/{c}" for a, b, c in (faces + 1).tolist()]
    return "\n".join(rows).encode() + b"\n"


def usd(points: np.ndarray, coords: np.ndarray, faces: np.ndarray) -> bytes:
    from pxr import Sdf, Usd, UsdGeom, Vt

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.usdc")
        stage = Usd.Stage.CreateNew(str(path))
        mesh = UsdGeom.Mesh.Define(stage, "/floor")
        mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
        mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(faces), 3, np.int32)))
        mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(faces.ravel().astype(np.int32)))
        primvars = UsdGeom.PrimvarsAPI(mesh.GetPrim())
        kind = Sdf.ValueTypeNames.TexCoord2fArray
        primvars.CreatePrimvar("st", kind, "vertex").Set(Vt.Vec2fArray.FromNumpy(coords))
        stage.Save()
        del stage, mesh, primvars
        return path.read_bytes()


FORMS = {
    "GLB": (plain, ".glb"),
    "GLB, meshopt": (meshopt, ".glb"),
    "GLB, Draco": (draco, ".glb"),
    "OBJ": (obj, ".obj"),
    "USD": (usd, ".usdc"),
}


def main() -> None:
    """Prints a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--triangles", type=int, default=1_000_000)
    parser.add_argument("--runs", type=int, default=3)
    given = parser.parse_args()
    shape = floor(given.triangles)
    with tempfile.TemporaryDirectory() as folder:
        files = {}
        for number, (name, (make, suffix)) in enumerate(FORMS.items()):
            files[name] = Path(folder, f"{number}{suffix}")
            files[name].write_bytes(make(*shape))
        actual: dict[str, list[tuple[float, int]]] = {name: [] for name in FORMS}
        for _ in range(given.runs):
            for name, file in files.items():
                command = [sys.executable, "-c", READ, str(file)]
                run = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
                seconds, memory, triangles = run.stdout.split()
                assert int(triangles) >= 0.99 * len(shape[2]), (name, triangles)
                actual[name].append((float(seconds), int(memory)))
        print(f"{len(shape[2]):,} triangles, median of {given.runs} runs")
        print(f"{'':<14}{'file':>10}{'seconds':>9}{'beside':>8}{'memory':>9}")
        beside = float(np.median([seconds for seconds, _ in actual["GLB"]]))
        for name, rows in actual.items():
            seconds = float(np.median([s for s, _ in rows]))
            memory = float(np.median([m for _, m in rows])) / 1024
            size = files[name].stat().st_size / 1e6
            row = f"{name:<14}{size:>7.1f} MB{seconds:>9.2f}{seconds / beside:>7.2f}x"
            print(f"{row}{memory:>6.0f} MB")


if __name__ == "__main__":
    main()
