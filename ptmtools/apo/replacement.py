"""What becomes of a scene when objects of it are replaced by meshes of fewer triangles.

Each new triangle stands for one of the object's own, whose material and sides it has, and in whose
place it comes: so what is decided by the order of the triangles stays as it was. The tolerances
stay too. They are those of the model's coordinates, and a simplified mesh does not leave the box of
its object.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats
from ptmtools.scene.model import Scene
from ptmtools.store.checked import Stored


@dataclass(frozen=True)
class Replacement:
    """New triangles for some objects of a scene.

    Attributes
    ----------
    objects: (K,) int32, those that are replaced, ascending.
    points: (P, 3) float64, metres. triangles: (F, 3) int32 indices into them.
    source: (F,) int32, the triangle of the scene that each stands for, never descending: those that
        fill a hole stand for one beside it, which may stand for itself, too.
    uv: (F, 3, 2) float64. colors: (F, 3, 3) uint8 if the scene has colours, else None.
    """

    objects: NDArray[np.int32]
    points: Floats
    triangles: NDArray[np.int32]
    source: NDArray[np.int32]
    uv: Floats
    colors: NDArray[np.uint8] | None = None

    def of(self, scene: Scene) -> Scene:
        """The scene with these triangles; points that no triangle uses are dropped.

        Raises ValueError if they are not of this scene.
        """
        self._check(scene)
        kept = np.flatnonzero(~np.isin(scene.triangle_object, self.objects))
        source = np.concatenate([kept, self.source.astype(np.int64)])
        order = np.argsort(source, kind="stable")
        source = source[order]
        used, corners = np.unique(scene.triangles[kept], return_inverse=True)
        corners = corners.reshape(-1, 3)
        triangles = np.concatenate([corners, self.triangles + len(used)])[order]
        colors = None
        if scene.colors is not None and self.colors is not None:
            colors = np.concatenate([scene.colors[kept], self.colors])[order]
        return replace(
            scene,
            points=np.concatenate([scene.points[used], self.points]),
            triangles=triangles.astype(np.int32),
            uv=np.concatenate([scene.uv[kept], self.uv])[order],
            triangle_object=scene.triangle_object[source],
            triangle_material=scene.triangle_material[source],
            two_sided=scene.two_sided[source],
            colors=colors,
        )

    def _check(self, scene: Scene) -> None:
        if self.objects.max(initial=-1) >= len(scene.objects):
            raise ValueError("an object is replaced that the scene lacks")
        if self.source.max(initial=-1) >= len(scene.triangles):
            raise ValueError("a triangle stands for one that the scene lacks")
        if not np.isin(scene.triangle_object[self.source], self.objects).all():
            raise ValueError("a triangle stands for one of another object")
        if (self.colors is None) != (scene.colors is None):
            raise ValueError("either the scene has colours, or what replaces its objects")

    def to_arrays(self) -> dict[str, NDArray[np.generic]]:
        """What `from_arrays` makes it of again."""
        colors = {} if self.colors is None else {"colors": self.colors}
        return {n: v for n, v in vars(self).items() if n != "colors"} | colors

    @staticmethod
    def from_arrays(arrays: Mapping[str, NDArray[Any]]) -> Replacement:
        """Raises KeyError or ValueError for what is none."""
        stored = Stored(arrays)
        points = stored.array("points", np.float64, None, 3, finite=True)
        triangles = stored.indices("triangles", np.int32, None, 3, high=len(points))
        n, most = len(triangles), np.iinfo(np.int32).max
        found = Replacement(
            stored.indices("objects", np.int32, None, high=most),
            points,
            triangles,
            stored.indices("source", np.int32, n, high=most),
            stored.array("uv", np.float64, n, 3, 2, finite=True),
            stored.array("colors", np.uint8, n, 3, 3) if "colors" in arrays else None,
        )
        if (np.diff(found.source) < 0).any() or (np.diff(found.objects) <= 0).any():
            raise ValueError("triangles or objects are not in order")
        return found


def joined(parts: list[Replacement]) -> Replacement:
    """Replacements of different objects of one scene as one."""
    first = np.cumsum([0, *(len(part.points) for part in parts)])
    source = np.concatenate([part.source for part in parts])
    order = np.argsort(source, kind="stable")
    triangles = [part.triangles + begin for part, begin in zip(parts, first, strict=False)]
    colors = [part.colors for part in parts if part.colors is not None]
    return Replacement(
        np.sort(np.concatenate([part.objects for part in parts])),
        np.concatenate([part.points for part in parts]),
        np.concatenate(triangles)[order].astype(np.int32),
        source[order],
        np.concatenate([part.uv for part in parts])[order],
        np.concatenate(colors)[order] if colors else None,
    )
