"""Bytes of geometry on the wire, and speed of its codec.

    python benchmarks/geometry.py [MODEL…]

The first table gives bytes of the geometry of each model, with `gzip -9` of each file, which is how
a site sends it, and for each triangle. *Cells* are those of a database: plain (`--plain-gltf`),
compressed, and as `ptm publish` serves them; they have more triangles than the model, since cells
cut them. *Model* is the model in one GLB, written by trimesh, then compressed by gltfpack and by
glTF-Transform (meshopt and Draco, at their defaults); images are left out of all. The last columns
give the step of the positions, mm, and bytes for each triangle of the model: what all cells
together cost instead of it.

The second table gives MB/s of decoded data: encoding in Python, and decoding of all views of the
cells by the page's module and by meshoptimizer's decoder, in node; the best of three runs.
"""

from __future__ import annotations

import argparse
import io
import json
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from emission import best
from npm import GLTF_TRANSFORM, Package
from PIL import Image
from scenes import MODELS, MUSEUM, ROOT, model_file

from ptmtools.cells import subdivide
from ptmtools.meshopt.encoding import encode_attributes, encode_triangles
from ptmtools.output.content import Content
from ptmtools.output.emission import compress
from ptmtools.output.gltf import gltf_files, unpack
from ptmtools.output.gltf_compressed import MESHOPT
from ptmtools.output.grid import COARSEST
from ptmtools.output.model import TextureRecord, WriterOptions
from ptmtools.scene import Scene, ingest
from ptmtools.site.conversion import lean_glb

GLTFPACK = Package("gltfpack", "1.3.0", "gltfpack")
MESHOPTIMIZER = Package("meshoptimizer", "1.3.0", "meshoptimizer")


@dataclass(frozen=True)
class Geometry:
    """Files of one form and their triangles."""

    name: str
    triangles: int
    files: Sequence[bytes]

    @property
    def wire(self) -> int:
        """Bytes with gzip."""
        return sum(len(compress(data)) for data in self.files)

    def row(self, model_triangles: int, step: str = "") -> None:
        print(
            f"| {self.name} | {self.triangles:,} | {sum(map(len, self.files)) / 1e3:,.0f} "
            f"| {self.wire / 1e3:,.1f} | {self.wire / self.triangles:.2f} "
            f"| {self.wire / model_triangles:.2f} | {step} |",
            flush=True,
        )


def records(scene: Scene) -> tuple[TextureRecord, ...]:
    """As if every image had been encoded."""
    rows = []
    for i, image in enumerate(scene.images):
        width, height = Image.open(io.BytesIO(image.load())).size
        ptm, png = (f"textures/{image.name}.{suffix}" for suffix in ("ptm", "png"))
        rows.append(TextureRecord(i, ptm, png, width, height, 3, (), "0" * 64))
    return tuple(rows)


def model_glb(model: Path) -> tuple[bytes, int]:
    """The model in one GLB, without images, and its triangles."""
    loaded = trimesh.load_scene(model)
    for shape in loaded.geometry.values():
        material = getattr(shape.visual, "material", None)
        if getattr(material, "image", None) is not None:
            material.image = Image.new("RGB", (1, 1))
        if getattr(material, "baseColorTexture", None) is not None:
            material.baseColorTexture = Image.new("RGB", (1, 1))
    triangles = sum(len(g.faces) for g in loaded.geometry.values())
    return loaded.export(file_type="glb"), triangles


def rivals(glb: bytes, folder: Path) -> list[tuple[str, bytes]]:
    """The GLB as other tools compress it."""
    source, out = folder / "in.glb", folder / "out.glb"
    source.write_bytes(glb)
    pack = ["node", GLTFPACK.folder / "cli.js", "-i", source, "-o", out]
    transform = ["node", GLTF_TRANSFORM.folder / "bin/cli.js"]
    commands: dict[str, list[Any]] = {
        "gltfpack -c": [*pack, "-c"],
        "gltfpack -cc": [*pack, "-cc"],
        "gltf-transform meshopt": [*transform, "meshopt", source, out],
        "gltf-transform draco": [*transform, "draco", source, out],
    }
    results = []
    for name, command in commands.items():
        if (GLTFPACK if command[1] == pack[1] else GLTF_TRANSFORM).remedy():
            continue
        subprocess.run(list(map(str, command)), check=True, capture_output=True)
        results.append((f"model, {name}", out.read_bytes()))
    return results


def sizes(model: Path, folder: Path) -> list[bytes]:
    """Prints the first table of a model; returns its compressed cells."""
    scene = ingest(model)
    unused: Any = None
    content = Content(scene, subdivide(scene), unused, unused, records(scene))
    plain = replace(content, options=WriterOptions(plain_gltf=True))
    files = [data for _, data in gltf_files(content)]
    source, triangles = model_glb(model)
    print(
        f"\n| {model.stem} | triangles | kB | kB, gzip | a triangle | of the model's | step, mm |"
    )
    print("|---|--:|--:|--:|--:|--:|--:|")
    count = len(content.geometry.triangle)
    Geometry("cells, plain", count, [d for _, d in gltf_files(plain)]).row(triangles)
    step = f"{1e3 * 2.0**content.position_exponent:.2f}"
    Geometry("cells", count, files).row(triangles, step)
    Geometry("cells, published", count, [lean_glb(d) for d in files]).row(triangles, step)
    coarse = replace(content, options=WriterOptions(gltf_step=2.0**COARSEST))
    lean = [lean_glb(data) for _, data in gltf_files(coarse)]
    Geometry("the same, `--gltf-step 0.001`", count, lean).row(triangles, "0.98")
    for name, data in [("model", source), *rivals(source, folder)]:
        Geometry(name, triangles, [data]).row(triangles)
    return files


def views_of(files: Sequence[bytes]) -> list[tuple[dict[str, Any], bytes]]:
    """The compressed views of GLBs: their extensions and their bytes."""
    views = []
    for data in files:
        tree, binary = unpack(data)
        for view in tree.get("bufferViews", ()):
            row = view["extensions"][MESHOPT]
            begin = row.get("byteOffset", 0)
            views.append((row, binary[begin : begin + row["byteLength"]]))
    return views


def speeds(name: str, files: Sequence[bytes], folder: Path) -> None:
    """Prints a row of the second table."""
    from ptmtools.meshopt.decoding import decode

    views = views_of(files)
    decoded = [(row, decode(data, row | {"filter": "NONE"})) for row, data in views]

    def encode() -> None:
        for row, data in decoded:
            if row["mode"] == "TRIANGLES":
                kind = np.uint16 if row["byteStride"] == 2 else np.uint32
                encode_triangles(np.frombuffer(data, kind).reshape(-1, 3))
            else:
                encode_attributes(np.frombuffer(data, np.uint8).reshape(row["count"], -1), 0)

    total = sum(len(data) for _, data in decoded)
    encode()
    encoding = total / best(encode) / 1e6
    (folder / "views.json").write_text(json.dumps([row for row, _ in views]))
    (folder / "views.bin").write_bytes(b"".join(data for _, data in views))
    script = ROOT / "benchmarks/geometry_decode.mjs"
    command = ["node", script, folder, MESHOPTIMIZER.folder]
    done = subprocess.run(list(map(str, command)), check=True, capture_output=True, text=True)
    ours, theirs = json.loads(done.stdout)
    print(f"| {name} | {total / 1e3:,.0f} | {encoding:.0f} | {ours:.0f} | {theirs:.0f} |")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    usual = [MODELS[name] for name in (MUSEUM, "hospital", "gallery", "office")]
    parser.add_argument("models", nargs="*", type=model_file, default=usual, help="names or files")
    models = [model for model in parser.parse_args().models if model.is_file()]
    for package in (GLTFPACK, GLTF_TRANSFORM, MESHOPTIMIZER):
        if remedy := package.remedy():
            print(f"without {package.name}; {remedy}")
    with tempfile.TemporaryDirectory(prefix="geometry-") as folder:
        cells = {model.stem: sizes(model, Path(folder)) for model in models}
        if MESHOPTIMIZER.remedy():
            return
        print("\n| cells of | kB decoded | encoded, MB/s | decoded, MB/s | meshoptimizer |")
        print("|---|--:|--:|--:|--:|")
        for name, files in cells.items():
            speeds(name, files, Path(folder))


if __name__ == "__main__":
    main()
