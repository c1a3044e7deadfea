"""Gathers the triangles of a source, mesh by mesh, each at all of its places.

Colours of vertices of formats whose materials have colours, too."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints
from ptmtools.scene.source import Source, SourceMaterial


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


_WHITE = (1.0, 1.0, 1.0)
#: With a number from here on colours go to 255: those to 1 may exceed it by rounding.
_BYTES = 2.0


def painted(
    materials: Sequence[SourceMaterial],
    triangles: Ints,
    triangle_material: Ints,
    colored: Ints,
    given: Floats,
) -> tuple[tuple[SourceMaterial, ...], NDArray[np.uint8]]:
    """The materials without their colours where vertices have some, and (T, 3, 3) sRGB of corners.

    ``colored`` are (n,) vertices with colours, and ``given`` these, (n, 3), from 0 to 1 or to 255.
    Corners without a colour of their own keep that of their material, and are white where no corner
    of a material has one.
    """
    finite = np.nan_to_num(given, nan=0.0, posinf=0.0, neginf=0.0)
    scale = 1.0 if finite.max(initial=0.0) >= _BYTES else 255.0
    count = int(max(triangles.max(initial=-1), colored.max(initial=-1))) + 1
    has, color = np.zeros(count, dtype=bool), np.zeros((count, 3), dtype=np.uint8)
    has[colored] = True
    color[colored] = np.rint(np.clip(scale * finite, 0, 255)).astype(np.uint8)
    known = has[triangles]
    touched = np.zeros(len(materials), dtype=bool)
    touched[triangle_material[known.any(axis=1)]] = True
    own = np.array([m.color or _WHITE for m in materials]) * touched[:, None] + ~touched[:, None]
    plain = np.rint(255 * own).astype(np.uint8)[triangle_material]
    found = np.where(known[..., None], color[triangles], plain[:, None])
    kept = (replace(m, color=_WHITE) if t else m for m, t in zip(materials, touched, strict=True))
    return tuple(kept), found
