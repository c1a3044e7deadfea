"""Normal maps of objects: maps with coordinates of their own, in the frames of the faces.

Materials have normal maps, too (`ptmtools.scene.normal_maps`); these belong to an object, whatever
its materials are.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Singles
from ptmtools.scene.model import Scene
from ptmtools.store.archive import Stored


@dataclass(frozen=True)
class ObjectMaps:
    """The places of objects in their normal maps, as stored.

    Attributes
    ----------
    objects: (K,) int32 ascending. side: (K,) int32 width and height of the map of each, texels.
    uv: (T, 3, 2) float32 coordinates of the corners of all triangles of these objects, in the order
        of the scene as changed; in [0, 1], origin at the lower left.
    frame: (T, 7) float32 of each face: normal, tangent, and the sign of the bitangent, which is
        their cross product.
    """

    objects: NDArray[np.int32]
    side: NDArray[np.int32]
    uv: Singles
    frame: Singles

    def to_arrays(self) -> dict[str, NDArray[np.generic]]:
        """The maps as plain arrays."""
        return dict(vars(self))

    @staticmethod
    def from_arrays(arrays: Mapping[str, NDArray[np.generic]]) -> ObjectMaps:
        """Inverse of `to_arrays`. Raises KeyError or ValueError for other arrays."""
        stored = Stored(arrays)
        objects = stored.indices("objects", np.int32, None, high=np.iinfo(np.int32).max)
        uv = stored.array("uv", np.float32, None, 3, 2, finite=True)
        side = stored.array("side", np.int32, len(objects))
        if (np.diff(objects) <= 0).any() or (side <= 0).any():
            raise ValueError("objects are not in order, or have maps without texels")
        if uv.size and not (uv.min() >= 0 and uv.max() <= 1):
            raise ValueError("a coordinate lies outside of its normal map")
        frame = stored.array("frame", np.float32, len(uv), 7, finite=True)
        return ObjectMaps(objects, side, uv, frame)

    def scene_with_maps(self, scene: Scene) -> Scene:
        """The scene as changed; of it, each of these objects has its normal map for an image,
        numbered as in `objects`, and other surfaces have none."""
        mapped = np.isin(scene.triangle_object, self.objects)
        uv = np.zeros((len(mapped), 3, 2))
        uv[mapped] = self.uv
        count = len(scene.materials)
        first = np.zeros(len(mapped), np.int64)
        first[mapped] = count * (1 + np.searchsorted(self.objects, scene.triangle_object[mapped]))
        return replace(
            scene,
            uv=uv,
            triangle_material=(first + scene.triangle_material).astype(np.int32),
            materials=tuple(
                replace(material, image=image)
                for image in range(-1, len(self.objects))
                for material in scene.materials
            ),
        )


def frame_axes(frame: Singles) -> Floats:
    """(n, 3, 3) tangent, bitangent and normal, as columns, of (n, 7) frames."""
    normal, tangent = frame[:, :3].astype(np.float64), frame[:, 3:6].astype(np.float64)
    bitangent = np.cross(normal, tangent) * frame[:, 6:]
    return np.stack([tangent, bitangent, normal], axis=2)
