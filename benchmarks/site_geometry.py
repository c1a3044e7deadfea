"""What a form of its own would save of the geometry of cells, against GLB compressed by gzip.

    python benchmarks/site_geometry.py DB…

*Lean GLB* leaves out what the page does not read: names, and the URIs of images. *Planes* has the
same JSON without accessors and bounds, and the numbers each as its difference to the vertex before
(of floats their bit patterns, as integers), byte by byte in planes of their own. All is compressed
by `gzip -9`; of *planes* the first lines of a decoder are not counted. Seconds: of the first cell,
at 512 kbit/s.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.database.gltf.reader import read_glb
from ptmtools.database.served import compressed
from ptmtools.texture.samples import to_ordered

BITS = 512_000


def main() -> None:
    """Prints a table."""
    print("| model | form | all cells | first cell | saves | s |\n|---|---|---|---|---|---|")
    for db in map(Path, sys.argv[1:]):
        index = json.loads((db / "www" / "hints.json").read_bytes())
        first = index["viewpoints"][0]["cell"]
        cells = [
            (db / "www" / index["geometry"]["gltf"].replace("{name}", cell["name"])).read_bytes()
            for cell in index["cells"]
        ]
        forms = {
            "GLB": cells,
            "lean GLB": [lean(cell) for cell in cells],
            "planes": [planes(cell) for cell in cells],
        }
        plain = [len(compressed(cell)) for cell in cells]
        for form, files in forms.items():
            sizes = [len(compressed(file)) for file in files]
            saved = plain[first] - sizes[first]
            print(
                f"| {db.stem} | {form} | {sum(sizes):,} | {sizes[first]:,} "
                f"| {1 - sum(sizes) / sum(plain):.0%} | {8 * saved / BITS:.2f} |"
            )


def lean(glb: bytes) -> bytes:
    """A GLB without names, images and what refers to them; the page reads the rest."""
    size = int.from_bytes(glb[12:16], "little")
    tree: dict[str, Any] = json.loads(glb[20 : 20 + size])
    for name in ("asset", "images", "textures", "samplers", "nodes", "meshes", "materials"):
        for row in tree.get(name, []) if isinstance(tree.get(name), list) else []:
            row.pop("name", None)
    for name in ("images", "textures", "samplers"):
        tree.pop(name, None)
    for look in tree.get("materials", []):
        look.get("pbrMetallicRoughness", {}).pop("baseColorTexture", None)
        look.get("extras", {}).pop("ptm", None)
    text = json.dumps(tree, separators=(",", ":")).encode()
    return text + glb[20 + size :]


def planes(glb: bytes) -> bytes:
    """The shapes of a cell: JSON of their looks and sizes, and the planes of all their numbers."""
    shapes = read_glb(glb).primitives
    looks = [
        [len(p.point), len(p.triangle), p.material.texture, p.material.factor, p.material.blends]
        + [p.material.two_sided, p.material.wrap, p.uv is not None]
        for p in shapes
    ]
    table = json.dumps(looks, separators=(",", ":"), default=list).encode()
    return table + b"".join(columns(shapes))


def columns(shapes: Any) -> Iterator[bytes]:
    """The planes, alike beside alike."""
    points = [p.point for p in shapes]
    uvs = [p.uv for p in shapes if p.uv is not None]
    for rows, width in ((points, 3), (uvs, 2)):
        for k in range(width):
            steps = [differences(to_ordered(row[:, k].astype(np.float32))) for row in rows]
            yield split(np.concatenate([np.zeros(0, np.uint32), *steps]))
    steps = [differences(p.triangle.ravel().astype(np.uint32)) for p in shapes]
    yield split(np.concatenate([np.zeros(0, np.uint32), *steps]))


def differences(numbers: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Each less the one before; signs folded into the lowest bit, so that small stays small."""
    step = np.diff(numbers, prepend=np.uint32(0)).view(np.int32)
    return ((step << 1) ^ (step >> 31)).view(np.uint32)


def split(numbers: NDArray[np.uint32]) -> bytes:
    """The highest bytes of all numbers, then the next ones, and so on."""
    return numbers.astype(">u4").view(np.uint8).reshape(-1, 4).T.tobytes()


if __name__ == "__main__":
    main()
