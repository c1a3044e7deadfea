"""The light of a model as its file describes it, read apart from the light stage of `ptmtools`.

Geometry, textures and base colours are those of `ptmtools.scene`; metallic, roughness, emission
and lamps of a GLB come from its JSON, in colour. A model without lamps has a cloudy sky of `SKY`
nits outside and ceilings that glow (`CEILING`), as the light stage has by default; one with a sun
has a sky of a fifth of its lux. The ground lies below the horizon, unshadowed.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from ptmtools_samples.lit_hall import corner_normals

from ptmtools.arrays import Bools, Floats
from ptmtools.glb import glb_chunks
from ptmtools.light.building import BLUE, CEILING, CLOUDY, GROUND, SKY, WARM
from ptmtools.light.occlusion import Occluders
from ptmtools.scene import Scene, ingest
from ptmtools.scene.colors import to_linear
from ptmtools.scene.model import Material

#: What ceilings send that glow, nits.
CEILINGS = CEILING * SKY * WARM
#: A ceiling faces down, this far above what is below it, metres, or this share of the highest.
_OVER, _OF_HIGHEST = 2.2, 0.6
#: Largest reflectance: with more, light hardly fades.
_MOST = 0.98
#: Texels of an image's longer side.
_SIDE = 512


@dataclass(frozen=True)
class PathLamp:
    """A lamp as the file has it: linear colour × candela, or × lux of a sun; world coordinates."""

    kind: str
    color: Floats
    place: Floats
    way: Floats
    cone: tuple[float, float]


def path_lamps(tree: dict[str, Any], scene: Scene) -> list[PathLamp]:
    """The lamps of a GLB in nodes without parents."""
    name = "KHR_lights_punctual"
    entries = tree.get("extensions", {}).get(name, {}).get("lights", [])
    lamps = []
    for node in tree.get("nodes", []):
        index = node.get("extensions", {}).get(name, {}).get("light")
        if index is None:
            continue
        entry = entries[index]
        x, y, z, w = node.get("rotation", (0, 0, 0, 1))
        way = -np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
        place = np.array(node.get("translation", (0, 0, 0)), float) - scene.space.origin
        color = np.array(entry.get("color", (1, 1, 1)), float) * entry.get("intensity", 1.0)
        if not color.any():
            continue
        spot = entry.get("spot", {})
        cone = spot.get("innerConeAngle", 0.0), spot.get("outerConeAngle", math.pi / 4)
        lamps.append(PathLamp(entry["type"], color, place * scene.space.metres, way, cone))
    return lamps


class LitModel:
    """A model with its light.

    Attributes
    ----------
    scene: as `ptmtools` reads it.
    normal: (T, 3, 3) unit normals of corners, smooth where the surface is.
    lamps: those without a surface.
    sky: (3,) radiance from above.
    """

    def __init__(self, file: Path) -> None:
        data = file.read_bytes()
        self.digest = sha256(data).hexdigest()
        self.scene = ingest(file)
        tree = dict(json.loads(glb_chunks(data)[0][2])) if file.suffix == ".glb" else {}
        self._looks = {entry.get("name"): entry for entry in tree.get("materials", [])}
        self.lamps = path_lamps(tree, self.scene)
        self.normal = corner_normals(self.scene.corners)
        suns = [lamp for lamp in self.lamps if lamp.kind == "directional"]
        self.sky = suns[0].color.mean() / 5 * BLUE if suns else SKY * CLOUDY
        self._images: dict[int, NDArray[np.float32]] = {}

    @cached_property
    def ceilings(self) -> Bools:
        """(T,) level faces that look down on a room and glow, of a model without lamps."""
        scene = self.scene
        if self.lamps:
            return np.zeros(len(scene.triangles), np.bool_)
        result = self.normal[:, 0, 1] < -0.9
        around, middle = Occluders.from_scene(scene), scene.corners[result].mean(axis=1)
        middle[:, 1] -= around.lift
        height = middle[:, 1] - around.upright(middle, np.ptp(scene.points[:, 1]) + 1, -1.0)
        result[result] = height >= min(_OVER, _OF_HIGHEST * height.max(initial=0.0))
        return result

    @property
    def daylight(self) -> tuple[Floats, Floats]:
        """(3,) radiance of the sky, and of the ground, which reflects it and the sun."""
        suns = (lamp for lamp in self.lamps if lamp.kind == "directional")
        sun = sum((lamp.color * max(-lamp.way[1], 0) for lamp in suns), start=np.zeros(3))
        return self.sky, GROUND * (self.sky + sun / math.pi)

    def polish(self, material: Material) -> tuple[float, float]:
        """Metallic and roughness."""
        look = self._looks.get(material.name, {}).get("pbrMetallicRoughness")
        if look is None:
            return 0.0, 1.0
        return look.get("metallicFactor", 1.0), look.get("roughnessFactor", 1.0)

    def emission(self, material: Material) -> Floats:
        """(3,) nits of each colour."""
        entry = self._looks.get(material.name, {})
        strong = entry.get("extensions", {}).get("KHR_materials_emissive_strength", {})
        factor = np.array(entry.get("emissiveFactor", (0, 0, 0)), float)
        return np.asarray(factor * strong.get("emissiveStrength", 1.0))

    def color(self, material: Material) -> NDArray[np.float32]:
        """(h, w, 3) reflectance, rows from the top; (1, 1, 3) without an image. An image has at
        most `_SIDE` texels a side."""
        tint = np.minimum(to_linear(np.array(material.color)), _MOST).astype(np.float32)
        if material.image < 0:
            return tint[None, None]
        if material.image not in self._images:
            data = self.scene.images[material.image].load()
            with Image.open(BytesIO(data)) as image:
                small = image.convert("RGB")
                small.thumbnail((_SIDE, _SIDE), Image.Resampling.BOX)
                texels = np.minimum(to_linear(np.asarray(small) / 255), _MOST)
                self._images[material.image] = texels.astype(np.float32)
        return np.asarray(self._images[material.image] * tint)
