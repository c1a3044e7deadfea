"""Compares the cells of a model with those of its copy whose meshes Draco has quantised.

    python benchmarks/rounded.py [MODEL] [--bits 14 12 11]

The triangles of each opaque material are a mesh of a GLB, quantised on its own grid. Prints cells,
leaves and portals of the plain GLB, of the compressed one, and of the compressed one without its
grid as tolerance.
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import DracoPy
import numpy as np
from formats import glb

from ptmtools.cells import subdivide
from ptmtools.scene import Scene, ingest
from ptmtools.scene.orientation.main_axes import tolerance_of

NAME = "KHR_draco_mesh_compression"


def made(scene: Scene, bits: int) -> bytes:
    """A GLB of the same opaque triangles, without textures, seen from both sides; plain for 0."""
    views: list[tuple[bytes, dict[str, Any]]] = []
    primitives: list[dict[str, Any]] = []
    accessors: list[dict[str, Any]] = []
    for material in np.unique(scene.triangle_material[scene.opaque]):
        points = scene.corners[scene.triangle_material == material].reshape(-1, 3)
        position: dict[str, Any] = {"componentType": 5126, "count": len(points), "type": "VEC3"}
        one: dict[str, Any] = {"attributes": {"POSITION": len(accessors)}, "material": 0}
        if bits:
            faces = np.arange(len(points), dtype=np.uint32).reshape(-1, 3)
            data = DracoPy.encode(points, faces, quantization_bits=bits)
            decoded = DracoPy.decode(data)
            position["count"] = len(decoded.points)
            index = {"componentType": 5125, "count": faces.size, "type": "SCALAR"}
            one["indices"] = len(accessors) + 1
            attributes = {"POSITION": decoded.attributes[0]["unique_id"]}
            one["extensions"] = {NAME: {"bufferView": len(views), "attributes": attributes}}
            accessors += [position, index]
        else:
            data = points.astype(np.float32).tobytes()
            accessors.append(position | {"bufferView": len(views)})
        views.append((data, {}))
        primitives.append(one)
    tree = {
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": primitives}],
        "materials": [{"doubleSided": True}],
        "accessors": accessors,
        "extensionsRequired": [NAME] if bits else [],
    }
    return glb(views, tree)


def row(name: str, scene: Scene) -> None:
    """Prints what becomes of a scene."""
    cells = subdivide(scene)
    step, plane = 1000 * scene.tolerance.step, 1000 * scene.tolerance.plane
    counts = f"{cells.cell_count:>6}{cells.leaf_count:>8}{cells.portal_count:>9}"
    print(f"{name:<24}{step:>8.2f} mm{plane:>8.2f} mm{counts}", flush=True)


def main() -> None:
    """Prints a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("model", nargs="?", type=Path, default=Path("build/museum/museum.obj"))
    parser.add_argument("--bits", nargs="*", type=int, default=[14, 12, 11])
    given = parser.parse_args()
    model = ingest(given.model)
    print(f"{'':<24}{'step':>11}{'plane':>11}{'cells':>6}{'leaves':>8}{'portals':>9}")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "a.glb")
        for bits in (0, *given.bits):
            file.write_bytes(made(model, bits))
            scene = ingest(file)
            row(f"{bits} bits" if bits else "plain", scene)
            if bits:
                usual = tolerance_of(scene.points, scene.triangles)
                row(f"{bits} bits, step ignored", replace(scene, tolerance=usual))


if __name__ == "__main__":
    main()
