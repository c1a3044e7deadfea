"""Reads materials, samplers and images of a glTF document (glTF 2.0, sections 3.8 and 3.9).

The reader keeps the normal map, the emission, and base colour, metallic and roughness of the
metallic-roughness model. The factor of the base colour is linear light, but the tint of the emitted
files is sRGB, so the factor is converted and the conversion noted; for partial tints the product of
tint and texel differs from the linear product. The alpha of texels applies in the modes MASK and
BLEND only (section 3.9.6).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeAlias, TypeVar
from urllib.parse import unquote

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.scene.colors import to_srgb
from ptmtools.scene.gltf.compression import TranscodedBytes
from ptmtools.scene.gltf.document import GltfDocument, data_uri, place_of
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.options import FAULTS, fault_of
from ptmtools.scene.source import (
    DARK,
    FileRange,
    HeldBytes,
    NormalTexture,
    SourceMaterial,
    SourceTexture,
    SourceWrap,
)

#: Maps the JSON of a material to that of one of its textures.
TextureOf = Callable[[dict[str, Any]], dict[str, Any] | None]
T = TypeVar("T")
#: A texture, and as `_placement`.
_Placed: TypeAlias = "tuple[SourceTexture | None, str, Floats, bool]"

_UNLIT, _GLOSSY = "KHR_materials_unlit", "KHR_materials_pbrSpecularGlossiness"
#: Loss of opacity of a surface that transmits all light: what it reflects remains.
_TRANSMITTED = 0.9
_KTX2 = "image/ktx2"
_WRAPS: dict[int | None, SourceWrap] = {33071: "clamp", 33648: "mirror"}


@dataclass(frozen=True)
class MaterialUse:
    """The material of a primitive.

    Attributes
    ----------
    index: into `GltfMaterialReader.materials`.
    coords: the attribute with its texture coordinates.
    matrix: (2, 3) KHR_texture_transform, origin at the upper left as in glTF.
    see_through: whether an alpha of vertices counts, or it transmits light.
    light: (3,) its base colour, linear light, the factor of vertex colours.
    normal_coords, normal_matrix: those of its normal map, if they are not those above; or None.
    optional: whether it can be drawn without its texture.
    """

    index: int
    coords: str
    matrix: Floats
    see_through: bool
    light: Floats
    normal_coords: str | None = None
    normal_matrix: Floats | None = None
    optional: bool = False


class GltfMaterialReader:
    """Reads each material once, on first use.

    ``texture_of`` selects the texture of a material; the default is that of the base colour. With
    another, materials have neither normal maps nor emission, and so it is for normal maps without
    ``normals``. Damage of an emission, a normal map or another texture is a note.
    """

    def __init__(
        self,
        document: GltfDocument,
        notes: IngestNotes,
        texture_of: TextureOf | None = None,
        *,
        normals: bool = True,
    ) -> None:
        self._document = document
        self._notes = notes
        self._texture_of = texture_of
        self._normals = normals and texture_of is None
        self._uses: dict[tuple[int | None, bool], MaterialUse] = {}
        self._materials: list[SourceMaterial] = []

    @property
    def materials(self) -> tuple[SourceMaterial, ...]:
        return tuple(self._materials)

    def read(self, index: int | None, colored: bool) -> MaterialUse:
        """The material of a primitive; None is the default material of the format. The colours of
        ``colored`` vertices include the base colour, so that both are multiplied as linear light.
        """
        if (index, colored) not in self._uses:
            entry = {} if index is None else self._document.tree["materials"][index]
            self._uses[index, colored] = self._read(entry, index, colored)
        return self._uses[index, colored]

    def _read(self, entry: dict[str, Any], index: int | None, colored: bool) -> MaterialUse:
        place = place_of("material", entry, index)
        name = str(entry.get("name") or ("default" if index is None else place))
        extensions = entry.get("extensions", {})
        factor, use = _base_color(entry)
        r, g, b, a = (_share(value) for value in factor)
        if (r, g, b) != (1.0, 1.0, 1.0):
            self._notes.note("PTM-N215", "colour factor converted to sRGB", place)
        light = np.array([r, g, b], dtype=np.float64)
        red, green, blue = (1.0, 1.0, 1.0) if colored else to_srgb(light).tolist()
        alpha = _alpha(entry, a)
        # Of images, the texels tell.
        see_through = colored and not alpha["ignores_alpha"]
        transmission, transmits = extensions.get("KHR_materials_transmission", {}), 0.0
        if transmission.get("transmissionFactor", 0) > 0:
            self._notes.note("PTM-N215", "transmits light, never occludes", place)
            see_through = True
            blended = alpha["opacity"] < 1 or not (alpha["ignores_alpha"] or use is None)
            if not (blended or "transmissionTexture" in transmission):
                transmits = _share(transmission["transmissionFactor"])
                alpha["opacity"] = 1 - _TRANSMITTED * transmits

        placed: _Placed = None, "TEXCOORD_0", np.eye(2, 3), False
        if self._texture_of is not None:
            # The code of textures that are missing.
            what = "texture"
            placed = self._optional("PTM-N204", what, place, self._other, entry) or placed
        elif use is not None:
            placed = self._place(use, place)
        elif max(red, green, blue) <= DARK and "emissiveTexture" in entry:
            # The image of its emission may become its texture.
            what = "coordinates of emission"
            known = self._optional("PTM-N215", what, place, self._emission_placement, entry)
            placed = (None, *known) if known else placed
        texture, coords, matrix, moved = placed
        if moved:
            message = "KHR_texture_transform baked into its faces"
            self._notes.note("PTM-N215", message, place)
        normal, normal_coords, normal_matrix = self._normal_texture(entry, name, place, placed)
        parts: dict[str, Any] = {}
        if self._texture_of is None:
            for what, read in (("emission", self._glow), ("metallic, roughness", self._matter)):
                parts |= self._optional("PTM-N215", what, place, read, entry) or {}
        self._materials.append(
            SourceMaterial(
                name=name,
                color=(red, green, blue),
                see_through=see_through,
                two_sided=bool(entry.get("doubleSided", False)),
                texture=texture,
                normal=normal,
                unlit=_UNLIT in extensions,
                transmits=transmits,
                **alpha,
                **parts,
            )
        )
        return MaterialUse(
            len(self._materials) - 1,
            coords,
            matrix,
            see_through,
            light,
            normal_coords,
            normal_matrix,
            self._texture_of is not None,
        )

    def _optional(
        self,
        code: str,
        what: str,
        place: str,
        read: Callable[[dict[str, Any], str], T | None],
        entry: dict[str, Any],
    ) -> T | None:
        """``read(entry, place)``; None, and a note on ``what``, if it is damaged."""
        try:
            return read(entry, place)
        except FAULTS as fault:
            self._notes.note(code, f"{what} left out: {fault_of(fault)}", place)
            return None

    def _place(self, use: dict[str, Any], place: str) -> _Placed:
        """A texture that a material names."""
        texture = self._texture(use["index"], place, _share(use.get("strength", 1.0)))
        return texture, *_placement(use)

    def _emission_placement(self, entry: dict[str, Any], place: str) -> tuple[str, Floats, bool]:
        return _placement(entry["emissiveTexture"])

    def _other(self, entry: dict[str, Any], place: str) -> _Placed | None:
        """The texture in place of that of the base colour."""
        assert self._texture_of
        use = self._texture_of(entry)
        return None if use is None else self._place(use, place)

    def _normal_texture(
        self, entry: dict[str, Any], name: str, place: str, placed: _Placed
    ) -> tuple[NormalTexture | None, str | None, Floats | None]:
        """The normal map of a material with a texture ``placed``; and its coordinates and their
        matrix, None if they are those of the texture."""
        relief = None
        if self._normals and "normalTexture" in entry:
            what = "normal map"
            relief = self._optional("PTM-N215", what, place, self._normal, entry)
        if relief is None:
            return None, None, None
        image, scale, coords, matrix = relief
        if placed[0] is not None and coords == placed[1] and np.array_equal(matrix, placed[2]):
            return NormalTexture(image, scale), None, None
        return NormalTexture(image, scale, own=True), coords, matrix

    def _normal(
        self, entry: dict[str, Any], place: str
    ) -> tuple[SourceTexture, float, str, Floats] | None:
        """The image of a normal map, its scale, and as `_placement`."""
        use = entry["normalTexture"]
        scale = _finite(use.get("scale", 1.0))
        image, coords, matrix, _ = self._place(use, place)
        return None if image is None else (image, scale, coords, matrix)

    def _glow(self, entry: dict[str, Any], place: str) -> dict[str, Any]:
        """The emission of a material, as the fields of a `SourceMaterial`."""
        factor = [_share(value) for value in entry.get("emissiveFactor", [0.0, 0.0, 0.0])]
        extensions = entry.get("extensions", {})
        if not any(factor) or _UNLIT in extensions:
            return {}
        stronger = extensions.get("KHR_materials_emissive_strength", {})
        strength = finite(stronger.get("emissiveStrength", 1.0))
        use = entry.get("emissiveTexture")
        with self._notes.optional():
            image = None if use is None else self._texture(use["index"], place, 1.0)
        red, green, blue = (strength * part for part in factor)
        return {"glow": (red, green, blue), "glow_map": image}

    def _matter(self, entry: dict[str, Any], place: str) -> dict[str, Any]:
        """Metallic and roughness of a material, as the fields of a `SourceMaterial`."""
        extensions = entry.get("extensions", {})
        if _UNLIT in extensions:
            return {}
        if (glossy := extensions.get(_GLOSSY)) is not None:
            fields = {"roughness": 1 - _finite(glossy.get("glossinessFactor", 1.0))}
            use, maps = glossy.get("specularGlossinessTexture"), {"gloss_map": "m"}
        else:
            surface = entry.get("pbrMetallicRoughness", {})
            names = "metallic", "roughness"
            fields = {name: _finite(surface.get(f"{name}Factor", 1.0)) for name in names}
            use = surface.get("metallicRoughnessTexture")
            maps = {"metallic_map": "b", "roughness_map": "g"}
        if use is None:
            return fields
        with self._notes.optional():
            image = self._texture(use["index"], place, 1.0)
        if image is None:
            return {}
        return fields | {name: replace(image, channel=channel) for name, channel in maps.items()}

    def _texture(self, index: int, place: str, strength: float) -> SourceTexture | None:
        tree = self._document.tree
        texture = tree["textures"][index]
        sampler = tree["samplers"][texture["sampler"]] if "sampler" in texture else {}
        sources = [texture, *texture.get("extensions", {}).values()]
        # The image without an extension has the least loss.
        source = next((entry["source"] for entry in sources if "source" in entry), None)
        if source is None:
            what = place_of("texture", texture, index)
            self._notes.miss("PTM-N204", f"{what}: has no image", place)
            return None
        image = tree["images"][source]
        what = place_of("image", image, source)
        uri = image.get("uri")
        label = str(image.get("name") or f"image_{source}")
        if "bufferView" in image:
            buffer, start, length = self._document.view(image["bufferView"])
            read: Callable[[], bytes] = buffer.part(start, length)
        elif uri is not None and uri.startswith("data:"):
            read = HeldBytes(data_uri(self._document.path, uri, f"image {source}"))
        else:
            what = unquote(str(uri))
            file = self._notes.locate(what, what, place)
            if file is None:
                return None
            read, label = FileRange(file), file.name
        packed = image.get("mimeType") == _KTX2 or label.lower().endswith(".ktx2")
        return SourceTexture(
            read=TranscodedBytes(read) if packed else read,
            label=label,
            what=what,
            place=place,
            wrap_s=_WRAPS.get(sampler.get("wrapS"), "repeat"),
            wrap_t=_WRAPS.get(sampler.get("wrapT"), "repeat"),
            strength=strength,
        )


def _base_color(entry: dict[str, Any]) -> tuple[list[Any], dict[str, Any] | None]:
    """The factor of a material's base colour, and its texture."""
    color = entry.get("pbrMetallicRoughness", {})
    names = "baseColorFactor", "baseColorTexture"
    glossy = entry.get("extensions", {}).get(_GLOSSY)
    if glossy is not None:
        color, names = glossy, ("diffuseFactor", "diffuseTexture")
    return color.get(names[0], [1.0, 1.0, 1.0, 1.0]), color.get(names[1])


def _alpha(entry: dict[str, Any], factor: float) -> dict[str, Any]:
    """The effect of alpha by the mode of a material, as fields of a `SourceMaterial`."""
    mode = entry.get("alphaMode", "OPAQUE")
    cutoff = float(entry.get("alphaCutoff", 0.5)) if mode == "MASK" else 0.0
    opacity = {"BLEND": factor, "MASK": float(factor >= cutoff)}.get(mode, 1.0)
    tested = cutoff > 0 and opacity and factor > 0
    return {
        "opacity": opacity,
        "ignores_alpha": mode != "BLEND" and cutoff <= 0,
        # The cutoff of a texel, because the factor's alpha scales all texels.
        "cutoff": max(cutoff / factor, 0.0) if tested else None,
    }


def _share(value: Any) -> float:
    """A number, clipped to [0, 1]; ValueError for other values."""
    return min(finite(value), 1.0)


def finite(value: Any) -> float:
    """A finite number, 0 for a negative one; ValueError for other values."""
    return max(_finite(value), 0.0)


def _finite(value: Any) -> float:
    """A finite number; ValueError for other values."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError(f"{value!r} is not a number")
    return float(value)


def _placement(use: dict[str, Any]) -> tuple[str, Floats, bool]:
    """The attribute with the coordinates of a texture, their (2, 3) matrix, and whether the
    material defines that."""
    transform = use.get("extensions", {}).get("KHR_texture_transform", {})
    coords = transform.get("texCoord", use.get("texCoord", 0))
    return f"TEXCOORD_{coords}", _transform(transform), bool(transform)


def _transform(extension: dict[str, Any]) -> Floats:
    """(2, 3) matrix of KHR_texture_transform: scale, then rotation, then offset.

    The direction of rotation is that of its text, its test model and the viewers; the GLSL sample
    in the specification, read by columns, rotates the other way.
    """
    offset = np.array(extension.get("offset", [0.0, 0.0]), dtype=np.float64)
    scale = np.array(extension.get("scale", [1.0, 1.0]), dtype=np.float64)
    angle = extension.get("rotation", 0.0)
    c, s = np.cos(angle), np.sin(angle)
    return np.column_stack([np.array([[c, s], [-s, c]]) * scale, offset])
