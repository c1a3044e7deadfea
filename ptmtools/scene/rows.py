"""Gathers the triangles of a source, mesh by mesh, each at all of its places."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints
from ptmtools.scene.source import Source


@dataclass
class Rows:
    """What has been gathered, an entry for each mesh."""

    points: list[Floats] = field(default_factory=list)
    triangles: list[Ints] = field(default_factory=list)
    uv: list[Floats] = field(default_factory=list)
    colors: list[NDArray[np.uint8] | None] = field(default_factory=list)
    object: list[Ints] = field(default_factory=list)
    material: list[Ints] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    count: int = 0

    def add(
        self,
        frames: Floats,
        points: Floats,
        triangles: Ints,
        uv: Floats,
        material: Ints | int,
        colors: NDArray[np.uint8] | None,
        first_object: int,
    ) -> None:
        """A mesh at each of its places.

        Parameters
        ----------
        frames: (k, 4, 4) from the mesh to the model.
        points, triangles: (p, 3) and (t, 3) over these.
        uv: (t, 3, 2). colors: (t, 3, 3), see `Source`.
        material: (t,), or the one of all.
        first_object: the object at the first place; the others follow.
        """
        k, p, t = len(frames), len(points), len(triangles)
        with np.errstate(all="ignore"):
            placed = points @ frames[:, :3, :3].transpose(0, 2, 1) + frames[:, None, :3, 3]
            mirrored = np.linalg.det(frames[:, :3, :3]) < 0
        first = self.count + p * np.arange(k)
        each = triangles + first[:, None, None]
        each[mirrored] = each[mirrored][..., ::-1]  # a mirror turns faces over
        self.points.append(placed.reshape(-1, 3))
        self.triangles.append(each.reshape(-1, 3))
        self.uv.append(_repeated(uv, k, mirrored))
        self.colors.append(None if colors is None else _repeated(colors, k, mirrored))
        self.object.append(np.repeat(first_object + np.arange(k), t))
        self.material.append(np.tile(np.broadcast_to(material, t), k))
        self.count += k * p

    def all_colors(self) -> NDArray[np.uint8] | None:
        """(T, 3, 3); None if no mesh has any."""
        return joined_colors(self.colors, [len(rows) for rows in self.triangles])

    def source(self, **others: Any) -> Source:
        """All of them; ``others`` are the other fields of a `Source`."""
        return Source(
            points=np.concatenate(self.points),
            triangles=np.concatenate(self.triangles),
            uv=np.concatenate(self.uv),
            triangle_object=np.concatenate(self.object),
            triangle_material=np.concatenate(self.material).astype(np.int64),
            objects=tuple(self.names),
            colors=self.all_colors(),
            **others,
        )


def _repeated(values: NDArray[Any], times: int, mirrored: NDArray[np.bool_]) -> NDArray[Any]:
    """(times · t, 3, m) values of corners, in the other order where they are mirrored."""
    each = np.broadcast_to(values, (times, *values.shape)).copy()
    each[mirrored] = each[mirrored][..., ::-1, :]
    return each.reshape(-1, *values.shape[1:])


def joined_colors(
    parts: Sequence[NDArray[np.uint8] | None], counts: Sequence[int]
) -> NDArray[np.uint8] | None:
    """(T, 3, 3) the colours of parts of so many triangles, white where a part has none; None if
    none has any."""
    if all(part is None for part in parts):
        return None
    white = (np.full((count, 3, 3), 255, np.uint8) for count in counts)
    return np.concatenate(
        [w if part is None else part for w, part in zip(white, parts, strict=True)]
    )
