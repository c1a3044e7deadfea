"""A material of the scene as glTF's, with the texture, sampler and image that it needs.

=================================  =======================================================
glTF                               from
=================================  =======================================================
baseColorFactor                    colour and opacity; glTF multiplies linear light, the scene
                                   what is encoded as sRGB, so the colour is converted
baseColorTexture                   the fallback image, by URI; nothing where there is none
metallicFactor 0, roughness 1      nothing known: matt
doubleSided                        the shape's sidedness
alphaMode BLEND                    opacity below 1, or a used texel with alpha below 255
alphaMode MASK, alphaCutoff        such texels of a material that tests them against a cutoff
extras.ptm, extras.texture         the image's `.ptm`, and its place in the hints' textures
extras.wrapS, extras.wrapT         the sampler's, for clients with textures of their own
=================================  =======================================================

(Tried: the texture as emissiveTexture
over black, which shows it texel for texel as VRML does, without KHR_materials_unlit. Clients then
find no base colour texture to put their own in, and alpha still needs one.)
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any
from urllib.parse import quote

import numpy as np

from ptmtools.database.model import TextureRecord
from ptmtools.database.names import UP
from ptmtools.scene.colors import to_linear
from ptmtools.scene.model import Material, Wrap

#: A sampler's number for each way to go on beyond [0, 1]; the first is the default.
WRAPS: dict[Wrap, int] = {"repeat": 10497, "clamp": 33071}
WHITE = [1.0, 1.0, 1.0, 1.0]


@lru_cache(maxsize=4096)
def linear(color: float) -> float:
    """A component encoded as sRGB (IEC 61966-2-1) as linear light, single precision."""
    return float(str(np.float32(to_linear(np.array(color)))))


class MaterialWriter:
    """Gathers the materials of one GLB."""

    def __init__(
        self,
        materials: tuple[Material, ...],
        textures: Mapping[int, tuple[int, TextureRecord]],
        fallback: bool,
    ) -> None:
        """``textures``: for every image its place in the hints' list, and its record."""
        self._scene = materials
        self._records = textures
        self._fallback = fallback
        self._known: dict[tuple[int, bool], int] = {}
        self._materials: list[dict[str, Any]] = []
        self._textures: dict[tuple[int, int], int] = {}
        self._images: dict[str, int] = {}
        self._samplers: dict[tuple[Wrap, Wrap], int] = {}

    def take(self, material: int, two_sided: bool) -> int:
        """The index of a scene's material, seen from one side or from both."""
        place = self._known.setdefault((material, two_sided), len(self._materials))
        if place == len(self._materials):
            self._materials.append(self._material(self._scene[material], two_sided))
        return place

    def members(self) -> dict[str, Any]:
        """What the document has of "materials", "textures", "images" and "samplers"."""
        textures: list[dict[str, Any]] = []
        for image, sampler in self._textures:
            textures.append({"source": image} | ({} if sampler < 0 else {"sampler": sampler}))
        lists = {
            "materials": self._materials,
            "textures": textures,
            "images": [{"uri": uri} for uri in self._images],
            "samplers": [_wrap(*wraps) for wraps in self._samplers],
        }
        return {name: rows for name, rows in lists.items() if rows}

    def _material(self, material: Material, two_sided: bool) -> dict[str, Any]:
        alpha = min(max(material.opacity, 0.0), 1.0)
        factor = [*map(linear, material.color), float(str(np.float32(alpha)))]
        surface: dict[str, Any] = {} if factor == WHITE else {"baseColorFactor": factor}
        extras: dict[str, Any] = {}
        blends, cutoff = alpha < 1, None
        if material.image >= 0:
            place, record = self._records[material.image]
            if material.transparent and record.components in (2, 4):
                blends, cutoff = True, material.cutoff
            extras = {"ptm": UP + quote(record.file), "texture": place}
            extras |= _wrap(material.wrap_s, material.wrap_t)
            if self._fallback and record.fallback is not None:
                index = self._texture(UP + quote(record.fallback), material)
                surface["baseColorTexture"] = {"index": index}
        found: dict[str, Any] = {"name": material.name}
        found["pbrMetallicRoughness"] = surface | {"metallicFactor": 0}
        if cutoff is not None:
            found |= {"alphaMode": "MASK", "alphaCutoff": cutoff}
        elif blends:
            found["alphaMode"] = "BLEND"
        if two_sided:
            found["doubleSided"] = True
        return found | ({"extras": extras} if extras else {})

    def _texture(self, uri: str, material: Material) -> int:
        wraps = (material.wrap_s, material.wrap_t)
        sampler = -1
        if wraps != ("repeat", "repeat"):
            sampler = self._samplers.setdefault(wraps, len(self._samplers))
        image = self._images.setdefault(uri, len(self._images))
        return self._textures.setdefault((image, sampler), len(self._textures))


def _wrap(s: Wrap, t: Wrap) -> dict[str, int]:
    named = {"wrapS": s, "wrapT": t}
    return {name: WRAPS[wrap] for name, wrap in named.items() if wrap != "repeat"}
