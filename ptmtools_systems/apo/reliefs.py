"""The normal maps of the replaced objects of a scene: one task for each object."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.output.object_maps import ObjectMaps
from ptmtools.scene.model import Scene
from ptmtools_systems.apo.making import smooth
from ptmtools_systems.apo.model import ApoOptions
from ptmtools_systems.apo.normal_map import NormalMap, normal_map
from ptmtools_systems.apo.replacing import mesh_of


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


def object_maps(shown: Scene, objects: NDArray[np.int32], maps: list[NormalMap]) -> ObjectMaps:
    """The places of ``objects``, ascending, in their maps."""
    own = [np.flatnonzero(shown.triangle_object == number) for number in objects.tolist()]
    order = np.argsort(np.concatenate(own), kind="stable")
    return ObjectMaps(
        objects,
        np.array([len(each.texels) for each in maps], np.int32),
        np.concatenate([each.uv for each in maps])[order],
        np.concatenate([each.frame for each in maps])[order],
    )
