"""Keeps the materials, images and values of corners that faces of a scene use.

Colours of corners include the colour of their material, so that a face has one tint only; what the
emitted files cannot express is baked in (`baking`); textures are near the origin of their images.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.progress import Progress
from ptmtools.scene.baking import LARGEST, bake, emitted_wraps, near_origin
from ptmtools.scene.faces import KeptFaces
from ptmtools.scene.images import ImageStore, OptionalImages, mean_values
from ptmtools.scene.model import Material
from ptmtools.scene.normal_maps import NormalMaps
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.source import ModelSource, SourceMaterial, SourceTexture
from ptmtools.scene.texels import near_holes, uses_holes

#: Default colours: of faces without an image, and of images.
PLAIN, WHITE = (0.8, 0.8, 0.8), (1.0, 1.0, 1.0)
#: The place of a channel in `mean_values`.
_CHANNELS = {"r": 0, "g": 1, "b": 2, "m": 3}


@dataclass(frozen=True)
class SceneMaterials:
    """The materials of kept faces; the fields but the first are those of `Scene`.

    Attributes
    ----------
    used: (M,) int64 the number of each material in the source: increasing, then once more those of
        which a part of the faces uses opaque texels only.
    """

    used: Ints
    materials: tuple[Material, ...]
    triangle_material: Ints
    uv: Floats
    colors: NDArray[np.uint8] | None
    normal_uv: Floats | None


def gather_materials(
    source: ModelSource,
    kept: KeptFaces,
    store: ImageStore,
    notes: IngestNotes,
    progress: Progress,
    *,
    workers: int,
) -> SceneMaterials:
    """The materials of kept faces; ``workers`` threads decode their images into the ``store``.

    Raises LimitError PTM-L104.
    """
    written = _coordinates(source, kept, notes)
    used, triangle_material = np.unique(source.triangle_material[kept.source], return_inverse=True)
    by_material = np.argsort(triangle_material, kind="stable")
    faces = np.split(by_material, np.cumsum(np.bincount(triangle_material))[:-1])
    originals = [source.materials[index] for index in used.tolist()]
    baked, uv = bake(originals, faces, written, store, notes, progress, workers=workers)
    colors = None if source.colors is None else source.colors[kept.source]
    if colors is not None and (colors == 255).all():
        colors = None
    images = OptionalImages(store, notes)
    maps = (m for o in originals for m in (o.metallic_map, o.roughness_map, o.gloss_map) if m)
    images.read_all(maps, mean_values, workers)
    materials, parts = [], {}
    for done, (material, rows) in enumerate(zip(baked, faces, strict=True)):
        progress(done, len(faces), "materials")
        if colors is not None and (colors[rows] != 255).any():
            tint = np.array(material.color or WHITE)
            colors[rows] = np.rint(colors[rows] * tint).astype(np.uint8)
            material = replace(material, color=WHITE)
        metallic, roughness = _matter(material, images)
        emitted, opaque = _material(material, uv[rows], store, notes)
        materials.append(replace(emitted, metallic=metallic, roughness=roughness))
        if len(opaque):
            parts[done] = rows[opaque]
    normal_maps = NormalMaps(store, notes)
    for number, rows in enumerate(faces):
        if (normal := originals[number].normal) is not None:
            moved = uv is not written and not np.array_equal(uv[rows], written[rows])
            image = normal_maps.add(normal, baked[number].texture, moved=moved)
            materials[number] = replace(materials[number], normal=image)
    for number, rows in parts.items():
        triangle_material[rows] = len(materials)
        materials.append(replace(materials[number], transparent=False, cutoff=None))
    used = np.append(used, used[list(parts)])
    normal_uv = _normal_coordinates(source, kept, materials, triangle_material, written)
    progress(len(faces), len(faces), "materials")
    return SceneMaterials(used, tuple(materials), triangle_material, uv, colors, normal_uv)


def _coordinates(source: ModelSource, kept: KeptFaces, notes: IngestNotes) -> Floats:
    """(T, 3, 2) of kept faces, all finite, and near the origin for repeating textures."""
    uv = source.uv[kept.source]
    unusable: Bools = np.logical_not(np.isfinite(uv).all(axis=(1, 2)))
    uv[unusable] = 0.0
    textures = [material.texture for material in source.materials]
    repeats = np.array(
        [(t is None or t.wrap_s != "clamp", t is None or t.wrap_t != "clamp") for t in textures]
    )
    material, owner = source.triangle_material[kept.source], source.triangle_object[kept.source]
    uv = near_origin(uv, material * np.int64(len(source.objects)) + owner, repeats[material])
    unusable |= (np.abs(uv) > LARGEST).any(axis=(1, 2))
    if unusable.any():
        message = f"texture coordinates not finite or beyond {LARGEST:,.0f} replaced by 0"
        notes.note("PTM-N211", message, "", int(unusable.sum()))
        uv[unusable] = 0.0
    return uv


def _normal_coordinates(
    source: ModelSource,
    kept: KeptFaces,
    materials: Sequence[Material],
    material: Ints,
    uv: Floats,
) -> Floats | None:
    """(T, 3, 2) of kept faces, finite and near the origin, in the normal maps that have their own
    coordinates: those of the source, or else ``uv``; ``material`` (T,) of each face. None without.
    """
    separate = np.array([m.normal is not None and m.normal.own for m in materials], bool)[material]
    if not separate.any():
        return None
    result = np.zeros_like(uv)
    result[separate] = uv[separate]
    if source.normal_uv is not None:
        given = source.normal_uv[kept.source]
        has = [m.normal is not None and m.normal.own for m in source.materials]
        given_rows = separate & np.array(has, np.bool_)[source.triangle_material[kept.source]]
        result[given_rows] = given[given_rows]
    fits = np.isfinite(result).all(axis=(1, 2)) & (np.abs(result) <= LARGEST).all(axis=(1, 2))
    result[~fits] = 0.0
    wraps = [(m.normal.wrap_s, m.normal.wrap_t) if m.normal else ("clamp",) * 2 for m in materials]
    repeats = np.array([[wrap == "repeat" for wrap in pair] for pair in wraps], np.bool_)
    owner = source.triangle_object[kept.source]
    return near_origin(result, material * np.int64(len(source.objects)) + owner, repeats[material])


def _matter(material: SourceMaterial, images: OptionalImages) -> tuple[float, float]:
    """Metallic and roughness of a material, on average; 0 and 1 where an image cannot be read."""

    def share(name: str, value: float) -> float:
        clipped = min(max(0.0, value), 1.0)
        if clipped != value:
            text = f"{material.name}: {name} of {value:g} changed to {clipped:g}"
            images.notes.note("PTM-N215", text)
        return clipped

    def mean(image: SourceTexture) -> float | None:
        means = images.read(image, mean_values)
        return None if means is None else means[_CHANNELS.get(image.channel, 0)]

    metallic = share("metallic", material.metallic)
    roughness = share("roughness", material.roughness)
    if material.metallic_map is not None:
        metallic *= mean(material.metallic_map) or 0.0
    if material.roughness_map is not None:
        known = mean(material.roughness_map)
        roughness = 1.0 if known is None else roughness * known
    if material.gloss_map is not None:
        roughness = 1.0 - (1.0 - roughness) * (mean(material.gloss_map) or 0.0)
    return round(metallic, 3), round(roughness, 3)


def _material(
    material: SourceMaterial, uv: Floats, store: ImageStore, notes: IngestNotes
) -> tuple[Material, Ints]:
    """The emitted form of a material whose kept faces have these (n, 3, 2) coordinates; of those,
    if only others use transparent texels, the numbers of the opaque ones."""
    texture, image, opaque = material.texture, -1, np.zeros(0, np.int64)
    wraps = emitted_wraps(texture)
    transparent = material.see_through or material.opacity < 1
    if texture is not None and (added := store.add(texture)) is not None:
        image, holes = added
        if holes is not None and not (transparent or material.ignores_alpha):
            through = near_holes(holes, uv, *wraps)
            transparent = uses_holes(holes, uv[through], *wraps)
            opaque = np.flatnonzero(~through) if transparent else opaque
    if material.opacity == 0:
        notes.note("PTM-N211", f"material {material.name}: invisible (opacity 0)")
    emitted = Material(
        name=material.name,
        color=material.color or (PLAIN if image < 0 else WHITE),
        opacity=material.opacity,
        image=image,
        wrap_s=wraps[0],
        wrap_t=wraps[1],
        transparent=transparent,
        cutoff=material.cutoff if image >= 0 else None,
    )
    return emitted, opaque
