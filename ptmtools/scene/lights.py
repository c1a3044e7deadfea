"""What gives light in a model: lamps, surfaces that glow, lightmaps, and colours that contain it.

They are stored beside the arrays of the scene, because the light stage alone reads them: another
lamp changes neither the cells nor the stages after them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Singles
from ptmtools.store.archive import Stored

LampKind = Literal["point", "spot", "sun"]
KINDS: tuple[LampKind, ...] = get_args(LampKind)
MapWrap = Literal["repeat", "clamp", "mirror"]
#: Largest intensity of a lamp, radiance of a surface, and coordinate of a lamp.
MOST = 1e9
#: By their number in the arrays.
WRAPS: tuple[MapWrap, ...] = get_args(MapWrap)
#: Red, green and blue, linear (ITU-R BT.709).
Radiance: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True)
class Lamp:
    """A lamp without a surface (KHR_lights_punctual).

    Attributes
    ----------
    kind: a sun shines from everywhere in one direction.
    position: world metres, of no meaning for a sun.
    direction: unit vector, of no meaning for a point.
    intensity: linear luminance: candela, or lux of a sun. Lamps of a kind compare.
    cone: cosines of the angles to the direction up to which a spot has all of its light, and from
        which none.
    color: linear red, green and blue, of luminance 1.
    """

    kind: LampKind
    position: tuple[float, float, float]
    direction: tuple[float, float, float] = (0.0, -1.0, 0.0)
    intensity: float = 1.0
    cone: tuple[float, float] = (1.0, 0.0)
    color: Radiance = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class ModelMap:
    """A lightmap of the model (glTF's occlusionTexture).

    Attributes
    ----------
    data: the bytes of its image, whose red channel is linear light.
    wrap: beyond [0, 1], across and up, see `WRAPS`.
    strength: its share of the light, in [0, 1]; the rest is white.
    """

    data: bytes
    wrap: tuple[MapWrap, MapWrap] = ("repeat", "repeat")
    strength: float = 1.0


@dataclass(frozen=True, eq=False)
class Lights:
    """The lights of a scene of T triangles and M materials.

    Attributes
    ----------
    glow: (M, 3) float32 linear radiance that a material emits: red, green and blue.
    unlit: (M,) bool, whether its colours contain their light.
    transmits: (M,) float32, the share of light that passes, in its colour.
    lamps: those without a surface.
    map: (M,) int32 index into `maps`, -1 of materials without.
    uv: (T, 3, 2) float32 coordinates in the map, origin at the lower left; (0, 3, 2) without maps.
    maps: the lightmaps of the model.
    """

    glow: Singles
    unlit: Bools
    transmits: Singles
    lamps: tuple[Lamp, ...]
    map: NDArray[np.int32]
    uv: Singles
    maps: tuple[ModelMap, ...]

    @staticmethod
    def none(materials: int) -> Lights:
        """Those of a scene without any."""
        return Lights(
            np.zeros((materials, 3), np.float32),
            np.zeros(materials, np.bool_),
            np.zeros(materials, np.float32),
            (),
            np.full(materials, -1, np.int32),
            np.zeros((0, 3, 2), np.float32),
            (),
        )

    def __bool__(self) -> bool:
        materials = self.glow, self.unlit, self.transmits
        return bool(self.lamps or self.maps or any(values.any() for values in materials))

    def check(self, materials: int, triangles: int) -> None:
        """Raises ValueError if they are those of a scene with other numbers of these."""
        if len(self.glow) != materials:
            raise ValueError("the lights are those of other materials")
        if self.maps and len(self.uv) != triangles:
            raise ValueError("the lightmaps are those of other triangles")

    def to_arrays(self) -> dict[str, NDArray[np.generic]]:
        """The lights as plain arrays. Maps of the same image share its bytes."""
        images = list(dict.fromkeys(item.data for item in self.maps))
        start = np.cumsum([0, *map(len, images)])
        rows = [
            [*lamp.position, *lamp.direction, lamp.intensity, *lamp.cone, *lamp.color]
            for lamp in self.lamps
        ]
        return {
            "glow": self.glow,
            "unlit": self.unlit,
            "transmits": self.transmits,
            "lamp_kind": np.array([KINDS.index(lamp.kind) for lamp in self.lamps], np.uint8),
            "lamp": np.array(rows, np.float64).reshape(-1, 12),
            "map": self.map,
            "uv": self.uv,
            "map_image": np.array([images.index(item.data) for item in self.maps], np.int32),
            "map_wrap": np.array(
                [[WRAPS.index(way) for way in item.wrap] for item in self.maps], np.uint8
            ).reshape(-1, 2),
            "map_strength": np.array([item.strength for item in self.maps], np.float64),
            "image": np.frombuffer(b"".join(images), np.uint8),
            "image_start": start.astype(np.int64),
        }

    @staticmethod
    def from_arrays(arrays: Mapping[str, NDArray[np.generic]]) -> Lights:
        """Inverse of `to_arrays`. Raises KeyError or ValueError for other arrays."""
        stored = Stored(arrays)
        glow = stored.array("glow", np.float32, None, 3, finite=True)
        kind = stored.indices("lamp_kind", np.uint8, None, high=len(KINDS))
        rows = stored.array("lamp", np.float64, len(kind), 12, finite=True)
        strength = stored.array("map_strength", np.float64, None, finite=True)
        count = len(strength)
        wrap = stored.indices("map_wrap", np.uint8, count, 2, high=len(WRAPS))
        image = stored.array("image", np.uint8, None)
        start = stored.starts("image_start", None, len(image))
        place = stored.indices("map_image", np.int32, count, high=len(start) - 1)
        data = [image[a:b].tobytes() for a, b in pairwise(start.tolist())]
        return Lights(
            glow,
            stored.array("unlit", np.bool_, len(glow)),
            stored.array("transmits", np.float32, len(glow), finite=True),
            tuple(
                Lamp(
                    KINDS[k],
                    tuple(row[:3]),
                    tuple(row[3:6]),
                    row[6],
                    tuple(row[7:9]),
                    tuple(row[9:]),
                )
                for k, row in zip(kind.tolist(), rows.tolist(), strict=True)
            ),
            stored.indices("map", np.int32, len(glow), low=-1, high=count),
            stored.array("uv", np.float32, None, 3, 2, finite=True),
            tuple(
                ModelMap(data[i], (WRAPS[across], WRAPS[up]), share)
                for i, (across, up), share in zip(
                    place.tolist(), wrap.tolist(), strength.tolist(), strict=True
                )
            ),
        )
