"""A model for ``@needle-tools/gltf-progressive``, with the level files that its extension names.

The GLB holds all geometry, compressed by meshoptimizer, and each image with at most 128 texels a
side; `NEEDLE_progressive` of each texture lists GLBs of one image each, the full image first, then
halves of its side down to 256 texels, as WebP of quality 90. Level files of meshes are left out: a
simplified building differs from the full picture by more than the marks that are measured, so the
full meshes would be downloaded anyway, and later.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from typing import Any

from benchmarks.web_rivals.images import in_form, size_of
from benchmarks.web_rivals.models import EXTENSIONS, whole_glb
from benchmarks.web_rivals.optimized import gltf_transform
from ptmtools.glb import BINARY, JSON, glb, glb_chunks
from ptmtools.scene.model import Scene

PROGRESSIVE = "NEEDLE_progressive"
WEBP = "image/webp"
#: Texels a side at most of the level files below the full image, and within the model.
SIDES, LEAST = (1024, 512, 256), 128


def progressive(scene: Scene) -> tuple[bytes, dict[str, bytes]]:
    """The model, and its level files by name."""
    files: dict[str, bytes] = {}
    rows = []
    full = in_form(scene.images, "webp-90")
    smaller = {side: in_form(scene.images, f"webp-{side}") for side in SIDES}
    for k, image in enumerate(full):
        longer = max(size_of(image))
        levels = [image, *(smaller[side][k] for side in SIDES if side < longer)]
        rows.append(list(_levels(k, levels, files)))
    least = in_form(scene.images, f"webp-{LEAST}")
    model = gltf_transform("meshopt", whole_glb(scene, least, WEBP))
    return _extended(model, rows), files


def _levels(number: int, images: Sequence[bytes], files: dict[str, bytes]) -> Iterator[Any]:
    for image in images:
        width, height = size_of(image)
        name = f"levels/{number:03d}-{max(width, height)}.glb"
        files[name] = _level_glb(number, image)
        yield {"path": name, "width": width, "height": height}


def _level_glb(number: int, image: bytes) -> bytes:
    """A GLB of a single texture, which its guid names."""
    document = {
        "asset": {"version": "2.0"},
        "extensionsUsed": [EXTENSIONS[WEBP], PROGRESSIVE],
        "textures": [
            {"extensions": {EXTENSIONS[WEBP]: {"source": 0}, PROGRESSIVE: {"guid": str(number)}}}
        ],
        "images": [{"bufferView": 0, "mimeType": WEBP}],
        "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": len(image)}],
        "buffers": [{"byteLength": len(image)}],
    }
    return glb([(JSON, json.dumps(document).encode()), (BINARY, image)])


def _extended(model: bytes, rows: Sequence[Sequence[Any]]) -> bytes:
    """The model with the extension on each texture; images are known by their names."""
    (_, _, text), (_, _, binary) = glb_chunks(model)
    document = json.loads(text)
    for texture in document.get("textures", ()):
        extensions = texture.setdefault("extensions", {})
        source = extensions.get(EXTENSIONS[WEBP], texture)["source"]
        number = int(document["images"][source]["name"])
        extensions[PROGRESSIVE] = {"guid": str(number), "lods": rows[number]}
    document["extensionsUsed"] = [*document.get("extensionsUsed", ()), PROGRESSIVE]
    return glb([(JSON, json.dumps(document, separators=(",", ":")).encode()), (BINARY, binary)])
