"""Gathers the lights of a model: lamps, the emission of its materials, and its lightmaps.

A dark surface without an image of its own shows that of its emission; of any other, the emission
is reduced to its mean.

An occlusion texture of glTF is a lightmap if its surfaces lie in it once. One that repeats belongs
to its material, like a normal map. What cannot be read is left out with a note, and is no miss,
because most builds do not need it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ptmtools.arrays import Floats, Ints, plane_areas
from ptmtools.scene.colors import to_linear, to_srgb
from ptmtools.scene.faces import KeptFaces
from ptmtools.scene.images import OptionalImages, integers
from ptmtools.scene.lights import MOST, Lamp, Lights, ModelMap, Radiance
from ptmtools.scene.model import Space
from ptmtools.scene.orientation.space import rotate, to_world
from ptmtools.scene.source import DARK, ModelSource, SecondReading, SourceMaterial
from ptmtools.texture.model import Limits

#: Coordinates may be this far outside of an image that lies on its surfaces once.
_OUTSIDE = 1e-3
#: Coordinates beyond this are at the border of an image that clamps.
_FAR = 1e6
#: Texels that are counted at a time.
_STRIP_TEXELS = 1 << 20


def show_emission(source: ModelSource, kept: KeptFaces, images: OptionalImages) -> ModelSource:
    """The model, in which dark materials without an image have that of their emission as texture:
    they are unlit, and only the mean of the image lights others."""
    materials, number = list(source.materials), source.triangle_material[kept.source]
    for place in np.unique(number).tolist():
        material = materials[place]
        dark = material.color is not None and max(material.color) <= DARK
        if not (dark and material.glow_map and any(material.glow)) or material.texture is not None:
            continue
        uv = source.uv[kept.source[number == place]].reshape(-1, 2)
        shown = np.isfinite(uv).all() and np.ptp(uv, axis=0).any()
        if shown and material.opacity == 1 and images.read(material.glow_map, _mean) is not None:
            red, green, blue = to_srgb(np.array(material.glow)).tolist()
            materials[place] = replace(
                material,
                color=(red, green, blue),
                texture=material.glow_map,
                ignores_alpha=True,
                unlit=True,
            )
    return replace(source, materials=tuple(materials))


def lights_of(
    source: ModelSource, used: Ints, space: Space, images: OptionalImages, shares: Floats
) -> Lights:
    """The lights of a model without its lightmaps. ``used``: (M,) the materials of the scene by
    their numbers in the source, some twice; ``shares``: (M,) of the area of all surfaces."""
    materials = [source.materials[number] for number in used.tolist()]
    distinct, first, group = np.unique(used, return_index=True, return_inverse=True)
    whole = np.bincount(group, shares, len(distinct)).tolist()
    glow = [_glow(materials[k], images, whole[n]) for n, k in enumerate(first.tolist())]
    return Lights(
        np.array(glow, np.float32).reshape(-1, 3)[group],
        np.array([material.unlit for material in materials], np.bool_),
        np.array([material.transmits for material in materials], np.float32),
        tuple(_place(lamp, space) for lamp in source.lamps),
        np.full(len(used), -1, np.int32),
        np.zeros((0, 3, 2), np.float32),
        (),
    )


def _glow(material: SourceMaterial, images: OptionalImages, share: float) -> Radiance:
    """The linear radiance that a material emits, on average; ``share``: of all surfaces."""
    red, green, blue = (min(max(0.0, part), MOST) for part in material.glow)
    glow = red, green, blue
    if glow != material.glow:
        before, after = (" ".join(f"{v:g}" for v in part) for part in (material.glow, glow))
        text = f"{material.name}: emission of {before} changed to {after}"
        images.notes.note("PTM-N215", text)
    if not any(glow) or material.glow_map is None:
        return glow
    image = material.glow_map
    mean = images.read(image, _mean)
    known = material.texture is not None and material.texture.read == image.read
    if mean is not None and not known:
        text = f"{material.name}: image of emission reduced to its mean, on {share:.2g} of all area"
        images.notes.note("PTM-N215", text, image.place)
    return glow if mean is None else (red * mean[0], green * mean[1], blue * mean[2])


def _lightmap(data: bytes, limit: int) -> bytes:
    """The bytes of a lightmap that can be decoded. Raises as `load_image`."""
    from ptmtools.texture.images.files import load_image

    load_image(data, Limits(limit)).array()
    return data


def _mean(data: bytes, limit: int) -> Radiance:
    """The mean colour of an image, linear light. Raises as `integers`."""
    texels = integers(data, limit).array()
    largest = int(np.iinfo(texels.dtype).max)
    light = to_linear(np.arange(largest + 1) / largest)
    channels = [0, 1, 2] if texels.shape[2] > 2 else [0, 0, 0]
    counts = np.zeros((3, largest + 1))
    step = max(1, _STRIP_TEXELS // texels.shape[1])
    for y in range(0, len(texels), step):
        for k, channel in enumerate(channels):
            row = texels[y : y + step, :, channel].ravel()
            counts[k] += np.bincount(row, minlength=largest + 1)
    red, green, blue = (counts @ light / counts.sum(axis=1)).tolist()
    return red, green, blue


def _place(lamp: Lamp, space: Space) -> Lamp:
    x, y, z = to_world(np.array([lamp.position]), space)[0].tolist()
    dx, dy, dz = rotate(np.array([lamp.direction]), space.up)[0].tolist()
    return replace(lamp, position=(x, y, z), direction=(dx, dy, dz))


def add_maps(
    plain: Lights, read: SecondReading, kept: KeptFaces, used: Ints, images: OptionalImages
) -> Lights:
    """The lights of the kept faces with the lightmaps of the model, as a second reading has them;
    ``used`` as in `lights_of`."""
    notes = images.notes
    for note in read.missing:
        notes.note(note.code, note.message, note.place)
    notes.folder.sought.update(dict.fromkeys(read.sought))
    uv = read.source.uv[kept.source]
    material = read.source.triangle_material[kept.source]
    index = np.full(len(used), -1, np.int32)
    maps: dict[ModelMap, int] = {}
    kept_bytes: dict[bytes, bytes] = {}
    for number, original in enumerate(used.tolist()):
        texture, place = read.source.materials[original].texture, uv[material == original]
        if texture is None:
            continue
        if not (np.isfinite(place).all() and plane_areas(place).any()):
            text = f"{texture.what}: lightmap of surfaces without coordinates in it left out"
            notes.note("PTM-N215", text, texture.place)
            continue
        outside = (place < -_OUTSIDE) | (place > 1 + _OUTSIDE)
        ways = texture.wrap_s, texture.wrap_t
        if (outside.any(axis=(0, 1)) & [way != "clamp" for way in ways]).any():
            continue
        if (data := images.read(texture, _lightmap)) is not None:
            data = kept_bytes.setdefault(data, data)
            index[number] = maps.setdefault(ModelMap(data, ways, texture.strength), len(maps))
    if not maps:
        return plain
    near = np.clip(np.nan_to_num(uv, nan=0.0), -_FAR, _FAR).astype(np.float32)
    return replace(plain, map=index, uv=near, maps=tuple(maps))
