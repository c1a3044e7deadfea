"""What a model has beside what a scene knows: lightmaps, and reflection masks.

===========  ===============================================  =====================================
format       lightmap                                         mask
===========  ===============================================  =====================================
glTF         red of occlusionTexture, whichever set of        1 − roughness: green of
             coordinates it has                               metallicRoughnessTexture, inverted
OBJ          none                                             map_Ks, its luminance
others       none                                             none
===========  ===============================================  =====================================

A mask has the texture coordinates of the colours, or is left out. The model is read a second time,
with the other texture in place of the colours': its faces are then cleaned as they were before, and
are the scene's, one by one.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints, Singles
from ptmtools.campus.textures import Mask, decoded_lightmap
from ptmtools.errors import InputError, PtmError
from ptmtools.files import open_regular
from ptmtools.scene.faces import keep_faces
from ptmtools.scene.model import Scene
from ptmtools.scene.options import IngestOptions
from ptmtools.scene.source import FileRange, Findings, Source, decode

_GLTF = (".glb", ".gltf")
_LIBRARIES = re.compile(rb"^[ \t]*mtllib[ \t]+(.+?)[ \t\r]*$", re.MULTILINE)


@dataclass(frozen=True)
class ModelLight:
    """The lightmaps of a model.

    Attributes
    ----------
    uv: (T, 3, 2) of the scene's faces, origin at the lower left.
    image: (T,) index into `images`, -1 for faces without.
    images: (h, w) linear light, rows from the top.
    """

    uv: Floats
    image: NDArray[np.int32]
    images: tuple[Singles, ...]


def model_light(model: Path, scene: Scene, options: IngestOptions) -> ModelLight:
    """The lightmaps of a model that was read as ``scene``.

    Raises InputError: PTM-I831 it has none, or its format cannot; what reading and decoding raise.
    """
    read = None
    if model.suffix.lower() in _GLTF:
        read = _again(model, scene, options, lambda entry: entry.get("occlusionTexture"))
    if read is None or all(m.texture is None for m in read[0].materials):
        raise InputError(
            "PTM-I831",
            "has no lightmaps",
            file=model,
            remedy="give --lightmaps bake, or a glTF with occlusionTexture",
        )
    source, faces = read
    index = np.full(len(source.materials), -1, np.int32)
    images: list[Singles] = []
    for number, material in enumerate(source.materials):
        if (texture := material.texture) is not None:
            red = decoded_lightmap(texture.read(), options.limit << 20, texture.label)
            index[number] = len(images)
            images.append(np.asarray(red.getchannel("R"), np.float32) / np.float32(255))
    return ModelLight(source.uv[faces], index[source.triangle_material[faces]], tuple(images))


def model_masks(
    model: Path, scene: Scene, options: IngestOptions
) -> tuple[dict[int, Mask], tuple[str, ...]]:
    """The masks of a model that was read as ``scene``, by the number of its material, and notes on
    those that cannot be had."""
    suffix = model.suffix.lower()
    if suffix in _GLTF:
        return _gltf_masks(model, scene, options)
    return _obj_masks(model, scene, options) if suffix == ".obj" else ({}, ())


def _again(
    model: Path, scene: Scene, options: IngestOptions, texture_of: Any
) -> tuple[Source, Ints] | None:
    """A glTF with other textures, and which of its faces the scene has; None if no material has
    such a texture."""
    from ptmtools.scene.gltf.document import document_json
    from ptmtools.scene.gltf.reader import read_gltf

    if not any(map(texture_of, document_json(model).get("materials", []))):
        return None
    findings = Findings(model, options.allow_outside)
    source = read_gltf(model, findings, options.max_triangles, texture_of)
    return source, keep_faces(source.points, source.triangles).source


def _gltf_masks(
    model: Path, scene: Scene, options: IngestOptions
) -> tuple[dict[int, Mask], tuple[str, ...]]:
    def glossy(entry: Mapping[str, Any]) -> Any:
        return entry.get("pbrMetallicRoughness", {}).get("metallicRoughnessTexture")

    if (read := _again(model, scene, options, glossy)) is None:
        return {}, ()
    source, faces = read
    material = source.triangle_material[faces]
    found, notes = {}, []
    for number, index in enumerate(np.unique(material).tolist()):
        texture = source.materials[index].texture
        if texture is None or scene.materials[number].image < 0:
            continue
        its = material == index
        if "mirror" in (texture.wrap_s, texture.wrap_t) or not np.array_equal(
            source.uv[faces][its], scene.uv[its]
        ):
            notes.append(_left_out(scene.materials[number].name, "other texture coordinates"))
            continue
        mask = Mask(texture.read, texture.label, band=1, inverted=True)
        if fault := _fault(mask, options):
            notes.append(_left_out(scene.materials[number].name, fault))
        else:
            found[number] = mask
    return found, tuple(notes)


def _obj_masks(
    model: Path, scene: Scene, options: IngestOptions
) -> tuple[dict[int, Mask], tuple[str, ...]]:
    from ptmtools.scene.mtl import MtlMaterial, read_mtl
    from ptmtools.scene.obj_materials import library_names

    findings = Findings(model, options.allow_outside)
    with open_regular(model) as stream:
        said = [decode(text) for text in _LIBRARIES.findall(stream.read())]
    defined: dict[str, MtlMaterial] = {}
    for name in dict.fromkeys(name for text in said for name in library_names(text)):
        if (file := findings.locate(name, name, "")) is not None:
            for key, material in read_mtl(file, findings).items():
                defined.setdefault(key, material)
    found, notes = {}, []
    for number, its in enumerate(scene.materials):
        known = defined.get(its.name)
        if its.image < 0 or known is None or known.map_kd is None or known.map_ks is None:
            continue
        colors, shine = known.map_kd, known.map_ks
        file = findings.locate(shine.file, shine.file, "", base=known.library.parent)
        if file is None:
            notes.append(_left_out(its.name, f"map_Ks {shine.file} is not found"))
        elif (colors.scale, colors.offset) != (shine.scale, shine.offset):
            notes.append(_left_out(its.name, "other texture coordinates"))
        else:
            mask = Mask(FileRange(file), file.name)
            if fault := _fault(mask, options):
                notes.append(_left_out(its.name, fault))
            else:
                found[number] = mask
    return found, tuple(notes)


def _fault(mask: Mask, options: IngestOptions) -> str:
    """Why a mask is no image, or "". Raises LimitError."""
    from ptmtools.errors import LimitError

    try:
        decoded_lightmap(mask.load(), options.limit << 20, mask.label)
    except LimitError:
        raise
    except PtmError as fault:
        return fault.message
    except OSError as fault:
        return fault.strerror or str(fault)
    return ""


def _left_out(material: str, why: str) -> str:
    return f"the mask of material {material} is left out: {why}"
