"""Collects the triangles of a source, mesh by mesh, with all instances of each mesh; combines
colours of vertices and materials.
"""

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
    """The arrays of a source, one entry for each mesh."""

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
        """Adds the instances of a mesh.

        Parameters
        ----------
        frames: (k, 4, 4) from the mesh to the model.
        points, triangles: (p, 3) and (t, 3) over these.
        uv: (t, 3, 2). colors: (t, 3, 3), see `Source`.
        material: (t,), or one number for all.
        first_object: the object of the first instance; the others follow.
        """
        k, p, t = len(frames), len(points), len(triangles)
        with np.errstate(all="ignore"):
            placed = points @ frames[:, :3, :3].transpose(0, 2, 1) + frames[:, None, :3, 3]
            mirrored = np.linalg.det(frames[:, :3, :3]) < 0
        first = self.count + p * np.arange(k)
        copies = triangles + first[:, None, None]
        copies[mirrored] = copies[mirrored][..., ::-1]  # mirroring reverses the winding
        self.points.append(placed.reshape(-1, 3))
        self.triangles.append(copies.reshape(-1, 3))
        self.uv.append(_repeated(uv, k, mirrored))
        self.colors.append(None if colors is None else _repeated(colors, k, mirrored))
        self.object.append(np.repeat(first_object + np.arange(k), t))
        self.material.append(np.tile(np.broadcast_to(material, t), k))
        self.count += k * p

    def source(self, **others: Any) -> Source:
        """The source of all meshes; ``others`` are the remaining fields of a `Source`."""
        return Source(
            points=np.concatenate(self.points),
            triangles=np.concatenate(self.triangles),
            uv=np.concatenate(self.uv),
            triangle_object=np.concatenate(self.object),
            triangle_material=np.concatenate(self.material).astype(np.int64),
            objects=tuple(self.names),
            colors=joined_colors(self.colors, [len(rows) for rows in self.triangles]),
            **others,
        )


def _repeated(values: NDArray[Any], times: int, mirrored: NDArray[np.bool_]) -> NDArray[Any]:
    """(times · t, 3, m) values of corners, in reverse order for mirrored instances."""
    copies = np.broadcast_to(values, (times, *values.shape)).copy()
    copies[mirrored] = copies[mirrored][..., ::-1, :]
    return copies.reshape(-1, *values.shape[1:])


def joined_colors(
    parts: Sequence[NDArray[np.uint8] | None], counts: Sequence[int]
) -> NDArray[np.uint8] | None:
    """(T, 3, 3) the colours of parts with these counts of triangles, white for parts without
    colours; None if no part has any."""
    if all(part is None for part in parts):
        return None
    white = (np.full((count, 3, 3), 255, np.uint8) for count in counts)
    return np.concatenate(
        [w if part is None else part for w, part in zip(white, parts, strict=True)]
    )


_WHITE = (1.0, 1.0, 1.0)
#: Colours range to 255 if one is at least this; in the range to 1 rounding may exceed 1.
_BYTES = 2.0


def vertex_colors(
    materials: Sequence[SourceMaterial],
    triangles: Ints,
    triangle_material: Ints,
    colored: Ints,
    values: Floats,
) -> tuple[tuple[SourceMaterial, ...], NDArray[np.uint8]]:
    """The materials, white if a vertex of theirs has a colour, and (T, 3, 3) sRGB of corners.

    ``colored`` are the (n,) vertices with colours, and ``values`` the colours, (n, 3), from 0 to 1
    or to 255. Corners without a colour have that of their material; corners of materials without
    coloured vertices are white.
    """
    finite = np.nan_to_num(values, nan=0.0, posinf=0.0, neginf=0.0)
    scale = 1.0 if finite.max(initial=0.0) >= _BYTES else 255.0
    count = int(max(triangles.max(initial=-1), colored.max(initial=-1))) + 1
    has, color = np.zeros(count, dtype=bool), np.zeros((count, 3), dtype=np.uint8)
    has[colored] = True
    color[colored] = np.rint(np.clip(scale * finite, 0, 255)).astype(np.uint8)
    own = has[triangles]
    merged = np.zeros(len(materials), dtype=bool)
    merged[triangle_material[own.any(axis=1)]] = True
    tint = np.array([m.color or _WHITE for m in materials]) * merged[:, None] + ~merged[:, None]
    plain = np.rint(255 * tint).astype(np.uint8)[triangle_material]
    corners = np.where(own[..., None], color[triangles], plain[:, None])
    white = (replace(m, color=_WHITE) if t else m for m, t in zip(materials, merged, strict=True))
    return tuple(white), corners
