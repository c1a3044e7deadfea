"""A scene as one GLB, as exporters write it: a primitive for each material, images within.

All of it is unlit, so that textured surfaces look as in the walk page. Without images, the
materials' ``extras.image`` say which image each wants, for a page that fetches those by itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ptmtools.output.gltf import WRAPS, linear, pack
from ptmtools.output.gltf_shapes import PlainBuffer, flip_v
from ptmtools.scene.model import Material, Scene

UNLIT = "KHR_materials_unlit"
#: What a texture of such images is named in; PNG and JPEG need none.
EXTENSIONS = {"image/webp": "EXT_texture_webp", "image/ktx2": "KHR_texture_basisu"}
_LINEAR, _MIPMAPS = 9729, 9987


def whole_glb(scene: Scene, images: Sequence[bytes] = (), media: str = "") -> bytes:
    """The GLB of all triangles of a scene, with its images in order, of one media type, or
    without."""
    buffer = PlainBuffer()
    shown = np.stack([scene.triangle_material, scene.two_sided], axis=1)
    kinds, kind = np.unique(shown, axis=0, return_inverse=True)
    primitives = [
        _primitive(scene, np.flatnonzero(kind.ravel() == k), k, buffer) for k in range(len(kinds))
    ]
    extension = EXTENSIONS.get(media)
    materials = [
        _material(scene.materials[material], k, bool(two_sided), bool(images))
        for k, (material, two_sided) in enumerate(kinds.tolist())
    ]
    named = [UNLIT] + ([extension] if extension else [])
    document: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "extensionsUsed": named,
        "extensionsRequired": named[1:] or None,
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": primitives}],
        "materials": materials,
    }
    members, binary = buffer.members(), buffer.bytes()
    if images:
        # A texture for each material, since wraps differ; equal images are shared.
        rows = [scene.materials[material] for material, _ in kinds.tolist()]
        document["textures"] = [_texture(row, k, extension) for k, row in enumerate(rows)]
        document["samplers"] = [_sampler(row) for row in rows]
        document["images"] = []
        parts = [binary]
        at = len(binary)
        for number, image in enumerate(images):
            view = {"buffer": 0, "byteOffset": at, "byteLength": len(image)}
            row = {"name": str(number), "bufferView": len(members["bufferViews"])}
            document["images"].append({**row, "mimeType": media})
            members["bufferViews"].append(view)
            parts.append(image + bytes(-len(image) % 4))
            at += len(parts[-1])
        binary = b"".join(parts)
        members["buffers"] = [{"byteLength": at}]
    kept = {name: value for name, value in (document | members).items() if value is not None}
    return pack(kept, binary)


def _primitive(scene: Scene, rows: Any, material: int, buffer: PlainBuffer) -> dict[str, Any]:
    points = scene.corners[rows].reshape(-1, 3).astype(np.float32)
    uv = flip_v(scene.uv[rows].reshape(-1, 2))
    vertices, triangle = np.unique(
        np.concatenate([points, uv], axis=1), axis=0, return_inverse=True
    )
    return {
        "attributes": {
            "POSITION": buffer.positions(vertices[:, :3]),
            "TEXCOORD_0": buffer.vectors(vertices[:, 3:]),
        },
        "indices": buffer.indices(triangle.reshape(-1, 3), len(vertices)),
        "material": material,
    }


def _material(material: Material, place: int, two_sided: bool, embedded: bool) -> dict[str, Any]:
    factor = [*map(linear, material.color), material.opacity]
    surface: dict[str, Any] = {"baseColorFactor": factor}
    actual = {"pbrMetallicRoughness": surface, "extensions": {UNLIT: {}}}
    if material.image >= 0 and embedded:
        surface["baseColorTexture"] = {"index": place}
    elif material.image >= 0:
        actual["extras"] = {"image": material.image, **_sampler(material)}
    if material.transparent:
        actual["alphaMode"] = "BLEND"
    if two_sided:
        actual["doubleSided"] = True
    return actual


def _texture(material: Material, sampler: int, extension: str | None) -> dict[str, Any]:
    source = {"source": max(material.image, 0)}
    return {"sampler": sampler, **({"extensions": {extension: source}} if extension else source)}


def _sampler(material: Material) -> dict[str, int]:
    wraps = {"wrapS": WRAPS[material.wrap_s], "wrapT": WRAPS[material.wrap_t]}
    return {**wraps, "magFilter": _LINEAR, "minFilter": _MIPMAPS}
