"""The normal maps of the replaced objects of a scene: one task for each object."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ptmtools.scene.model import Scene
from ptmtools.store.archive import Stored
from ptmtools_systems.apo.making import smooth
from ptmtools_systems.apo.model import ApoOptions
from ptmtools_systems.apo.normal_map import NormalMap, normal_map
from ptmtools_systems.apo.replacing import mesh_of


@dataclass(frozen=True)
class Reliefs:
    """The places of objects in their normal maps, as stored.

    Attributes
    ----------
    objects: (K,) int32 ascending. side: (K,) int32 width and height of the map of each, texels.
    uv: (T, 3, 2) float32 coordinates of the corners of all triangles of these objects, in the order
        of the scene with the simplified meshes; see `NormalMap`.
    frame: (T, 7) float32, likewise.
    """

    objects: NDArray[np.int32]
    side: NDArray[np.int32]
    uv: NDArray[np.float32]
    frame: NDArray[np.float32]

    def to_arrays(self) -> dict[str, NDArray[np.generic]]:
        """The reliefs as plain arrays."""
        return dict(vars(self))

    @staticmethod
    def from_arrays(arrays: Mapping[str, NDArray[np.generic]]) -> Reliefs:
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
        return Reliefs(objects, side, uv, frame)

    def painted(self, scene: Scene) -> Scene:
        """The scene with simplified meshes, of which each has its normal map for an image, numbered
        as in `objects`, and other surfaces have none."""
        own = np.isin(scene.triangle_object, self.objects)
        uv = np.zeros((len(own), 3, 2))
        uv[own] = self.uv
        count = len(scene.materials)
        first = np.zeros(len(own), np.int64)
        first[own] = count * (1 + np.searchsorted(self.objects, scene.triangle_object[own]))
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


@dataclass(frozen=True)
class Replacing:
    """The scene as modelled, and with simplified meshes, and the options of the maps."""

    source: Scene
    shown: Scene
    options: ApoOptions

    def normal_map(self, number: int) -> NormalMap:
        """The normal map of a replaced object; raises as `normal_map`."""
        own = np.flatnonzero(self.shown.triangle_object == number)
        used, corners = np.unique(self.shown.triangles[own], return_inverse=True)
        mesh = smooth(self.shown.points[used], corners.reshape(-1, 3).astype(np.int32))
        modelled = np.flatnonzero(self.source.triangle_object == number)
        return normal_map(mesh, *mesh_of(self.source, modelled), self.options)


def reliefs_of(shown: Scene, objects: NDArray[np.int32], maps: list[NormalMap]) -> Reliefs:
    """The places of ``objects``, ascending, in their maps."""
    own = [np.flatnonzero(shown.triangle_object == number) for number in objects.tolist()]
    order = np.argsort(np.concatenate(own), kind="stable")
    return Reliefs(
        objects,
        np.array([len(each.texels) for each in maps], np.int32),
        np.concatenate([each.uv for each in maps])[order],
        np.concatenate([each.frame for each in maps])[order],
    )
