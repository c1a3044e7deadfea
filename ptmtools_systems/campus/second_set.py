"""Lightmaps and reflection masks of a model, which a scene does not have (docs/formats/campus.md,
"Sources by format").

A mask has the texture coordinates of the colours, or is left out. For OBJ, the scene's own reader
names the masks. A glTF is read a second time (`ModelFormat.second`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats
from ptmtools.errors import InputError, LimitError, PtmError
from ptmtools.light.looks import LightImage, red_texels
from ptmtools.scene.formats import format_of
from ptmtools.scene.model import Scene
from ptmtools.scene.options import IngestOptions
from ptmtools.scene.reference import ModelFolder
from ptmtools.scene.source import FileRange, SecondReading, SourceTexture
from ptmtools_systems.campus.textures import Mask

#: Reasons for leaving out a file that a model names.
_NOT_THERE = {"missing": "not found", "outside": "lies outside the model's folder"}


@dataclass(frozen=True)
class ModelLight:
    """The lightmaps of a model.

    Attributes
    ----------
    uv: (T, 3, 2) of the scene's faces, origin at the lower left.
    image: (T,) index into `images`, -1 for faces without.
    images: one for each material that has one.
    """

    uv: Floats
    image: NDArray[np.int32]
    images: tuple[LightImage, ...]


def model_light(model: Path, options: IngestOptions) -> ModelLight:
    """The lightmaps of a model, for the faces of its scene.

    Raises InputError: PTM-I701 it has none, its format has none, or one that it names is missing;
    and as reading and decoding.
    """
    second = format_of(model).second
    read = second.load()(model, options, "lightmap") if second else None
    if read is None:
        raise InputError(
            "PTM-I701",
            "has no lightmaps",
            file=model,
            remedy="use --lightmaps bake, or a glTF with occlusionTexture",
        )
    used = np.unique(read.source.triangle_material[read.faces]).tolist()
    index = np.full(len(read.source.materials), -1, np.int32)
    images: list[LightImage] = []
    decoded: dict[Callable[[], bytes], NDArray[np.uint8]] = {}
    for number in used:
        if not read.asked[number]:
            continue
        material = read.source.materials[number]
        if (texture := material.texture) is None:
            raise _missing(model, material.name, number, read)
        if texture.read not in decoded:
            decoded[texture.read] = _red(texture, material.name, options)
        index[number] = len(images)
        wrap = texture.wrap_s, texture.wrap_t
        images.append(LightImage(decoded[texture.read], wrap, texture.strength))
    uv = read.source.uv[read.faces]
    finite = np.asarray(np.isfinite(uv).all(axis=(1, 2)))
    return ModelLight(
        np.where(finite[:, None, None], uv, 0.0),
        index[read.source.triangle_material[read.faces]],
        tuple(images),
    )


def _missing(model: Path, material: str, number: int, read: SecondReading) -> InputError:
    """The error for a missing lightmap that a material names."""
    # Each material without the texture that it names left a note, in the same order.
    textures = zip(read.asked, read.source.materials, strict=True)
    lost = [k for k, (asked, m) in enumerate(textures) if asked and m.texture is None]
    fault = read.missing[min(lost.index(number), len(read.missing) - 1)].message
    return InputError(
        "PTM-I701",
        f"the lightmap of material {material}, {fault}",
        file=model,
        remedy="put it where the model says (or use --allow-outside, where it lies elsewhere), or "
        "use --lightmaps bake",
    )


def _red(texture: SourceTexture, material: str, options: IngestOptions) -> NDArray[np.uint8]:
    """(h, w) red samples of a lightmap. Raises as decoding, and InputError PTM-I122."""
    try:
        return red_texels(texture.read(), options.limit << 20, texture.label)
    except InputError as fault:
        place, remedy = f"lightmap of material {material}", "mend it, or use --lightmaps bake"
        raise InputError(
            fault.code, fault.message, file=texture.label, place=place, remedy=remedy
        ) from None
    except OSError as fault:
        what = fault.strerror or str(fault)
        raise InputError("PTM-I122", what, file=fault.filename or texture.label) from None


def model_masks(
    model: Path, scene: Scene, options: IngestOptions
) -> tuple[dict[int, Mask], tuple[str, ...]]:
    """The masks of a model that was read as ``scene``, by the number of its material, and notes on
    invalid ones."""
    second = format_of(model).second
    if second is None:
        candidates = _named_masks(model, scene, options)
    elif read := second.load()(model, options, "reflection"):
        candidates = _second_masks(read, scene)
    else:
        candidates = iter(())
    masks, notes = {}, []
    for number, label, mask in candidates:
        if fault := mask if isinstance(mask, str) else _fault(mask, options):
            name = scene.materials[number].name
            notes.append(f"the mask of material {name} is left out: {label}{fault}")
        elif not isinstance(mask, str):
            masks[number] = mask
    return masks, tuple(notes)


#: The number of a material, the beginning of a note on its mask, and the mask or its fault.
_Candidates = Iterator[tuple[int, str, Mask | str]]


def _second_masks(read: SecondReading, scene: Scene) -> _Candidates:
    """The masks of a second reading."""
    source, faces = read.source, read.faces
    material = source.triangle_material[faces]
    numbers, first = np.unique(scene.triangle_material, return_index=True)
    for number, index in zip(numbers.tolist(), material[first].tolist(), strict=True):
        texture = source.materials[index].texture
        if texture is None or scene.materials[number].image < 0:
            continue
        faces_of = scene.triangle_material == number
        mirrored = "mirror" in (texture.wrap_s, texture.wrap_t)
        if mirrored or not np.array_equal(source.uv[faces][faces_of], scene.uv[faces_of]):
            yield number, "", "other texture coordinates"
        else:
            yield number, "", Mask(texture.read, texture.label, band=1, inverted=True)


def _named_masks(model: Path, scene: Scene, options: IngestOptions) -> _Candidates:
    """The masks that the scene's own reader names."""
    folder = ModelFolder(model.absolute().parent, options.allow_outside)
    for number, (material, shine) in enumerate(zip(scene.materials, scene.shines, strict=True)):
        if material.image < 0 or shine is None:
            continue
        file = None if shine.fault else folder.find(shine.file, shine.base)
        if file is None:
            yield number, "", shine.fault
        elif file.path is None:
            yield number, f"map_Ks {shine.file}: ", _NOT_THERE[file.outcome]
        else:
            yield number, f"map_Ks {shine.file}: ", Mask(FileRange(file.path), file.path.name)


def _fault(mask: Mask, options: IngestOptions) -> str:
    """The fault of a mask that is no image, or "". Raises LimitError."""
    try:
        red_texels(mask.load(), options.limit << 20, mask.label)
    except LimitError:
        raise
    except PtmError as fault:
        return fault.message
    except OSError as fault:
        return fault.strerror or str(fault)
    return ""
