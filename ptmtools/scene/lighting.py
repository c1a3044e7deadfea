"""Gathers the lights of a model: lamps, the emission of its materials, and its lightmaps.

An occlusion texture of glTF is a lightmap if its surfaces lie in it once. One that repeats belongs
to its material, like a normal map. What cannot be read is a miss, and then has no effect.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ptmtools.arrays import Ints
from ptmtools.errors import InputError
from ptmtools.scene.colors import luminance, to_linear
from ptmtools.scene.faces import KeptFaces
from ptmtools.scene.images import ImageStore, integers
from ptmtools.scene.lights import Lamp, Lights, ModelMap
from ptmtools.scene.model import Space
from ptmtools.scene.notes import Findings
from ptmtools.scene.options import GLTF, IngestOptions
from ptmtools.scene.source import Source, SourceMaterial
from ptmtools.scene.space import rotated, to_world

#: Coordinates may be this far outside of an image that lies on its surfaces once.
_OUTSIDE = 1e-3
#: Coordinates beyond this are at the border of an image that clamps.
_FAR = 1e6


def lights_of(
    source: Source,
    kept: KeptFaces,
    used: Ints,
    space: Space,
    store: ImageStore,
    findings: Findings,
    options: IngestOptions,
) -> Lights:
    """The lights of the kept faces of a model. ``used``: (M,) the materials of the scene by their
    numbers in the source. Raises LimitError PTM-L104."""
    glow = [_glow(source.materials[number], store) for number in used.tolist()]
    plain = Lights(
        np.array(glow, np.float32),
        tuple(_placed(lamp, space) for lamp in source.lamps),
        np.full(len(used), -1, np.int32),
        np.zeros((0, 3, 2), np.float32),
        (),
    )
    if findings.model.suffix.lower() not in GLTF:
        return plain
    return _with_maps(plain, kept, used, store, findings, options)


def _glow(material: SourceMaterial, store: ImageStore) -> float:
    """The linear luminance that a material emits, on average."""
    if not material.glow or material.glow_map is None:
        return material.glow
    if store.record(material.glow_map) is None:
        return material.glow
    store.mark_as_input(material.glow_map)
    try:
        texels = integers(material.glow_map.read(), store.limit)[0]
    except InputError:  # an image of floats
        return material.glow
    colors = texels[..., :3] if texels.shape[2] > 2 else texels[..., :1].repeat(3, axis=2)
    light = luminance(to_linear(colors / np.iinfo(texels.dtype).max))
    return material.glow * float(light.mean())


def _placed(lamp: Lamp, space: Space) -> Lamp:
    x, y, z = to_world(np.array([lamp.position]), space)[0].tolist()
    dx, dy, dz = rotated(np.array([lamp.direction]), space.up)[0].tolist()
    return replace(lamp, position=(x, y, z), direction=(dx, dy, dz))


def _with_maps(
    plain: Lights,
    kept: KeptFaces,
    used: Ints,
    store: ImageStore,
    findings: Findings,
    options: IngestOptions,
) -> Lights:
    """The lights of a glTF with its lightmaps."""
    from ptmtools.scene.gltf.second import read_again

    read = read_again(findings.model, options, lambda entry: entry.get("occlusionTexture"))
    if read is None:
        return plain
    for note in read.missing:
        findings.miss(note.code, note.message, note.place)
    findings.folder.sought.update(dict.fromkeys(read.sought))
    uv = read.source.uv[kept.source]
    material = read.source.triangle_material[kept.source]
    index = np.full(len(used), -1, np.int32)
    maps: list[ModelMap] = []
    for number, own in enumerate(used.tolist()):
        texture, place = read.source.materials[own].texture, uv[material == own]
        if texture is None or not np.isfinite(place).all():
            continue
        outside = (place < -_OUTSIDE) | (place > 1 + _OUTSIDE)
        ways = texture.wrap_s, texture.wrap_t
        if (outside.any(axis=(0, 1)) & [way != "clamp" for way in ways]).any():
            continue
        if store.record(texture) is None:
            continue
        store.mark_as_input(texture)
        index[number] = len(maps)
        maps.append(ModelMap(texture.read(), ways, texture.strength))
    if not maps:
        return plain
    near = np.clip(np.nan_to_num(uv, nan=0.0), -_FAR, _FAR).astype(np.float32)
    return replace(plain, map=index, uv=near, maps=tuple(maps))
