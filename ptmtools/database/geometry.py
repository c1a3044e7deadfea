"""The geometry of a cell as indexed shapes: one per object, material and sidedness.

Positions and texture coordinates are rounded to float32 once for the whole scene and welded by
equality there, so that a vertex shared by two pieces is one vertex in the file, and a corner
shared by two cells has the same text in both. Pieces of which two corners become one in that
rounding have no area left; they are dropped and counted.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells.model import Cells
from ptmtools.database.numerals import single
from ptmtools.scene.model import Scene


@dataclass(frozen=True)
class Shape:
    """Triangles of one object with one material, all of them solid or all two-sided.

    Attributes
    ----------
    object, material: indices into the scene's.
    two_sided: whether both sides are seen.
    point, uv: (n,), (k,) rows of `Geometry.point` and `Geometry.uv`.
    triangle, uv_triangle: (m, 3) indices into `point` and `uv`.
    """

    object: int
    material: int
    two_sided: bool
    point: NDArray[np.int64]
    uv: NDArray[np.int64]
    triangle: NDArray[np.int64]
    uv_triangle: NDArray[np.int64]


class Geometry:
    """All shapes of all cells.

    Attributes
    ----------
    point, uv: (n, 3), (k, 2) float32, the distinct positions and texture coordinates.
    collapsed: pieces dropped by the rounding, over all cells.
    """

    def __init__(self, scene: Scene, cells: Cells) -> None:
        piece, cell = cells.emitted(scene.two_sided)
        self.point, point_of = _welded(single(cells.vertex, "vertices"))
        self.uv, uv_of = _welded(single(cells.vertex_uv, "texture coordinates"))
        corner = point_of[cells.triangle[piece]].reshape(-1, 3)
        flat = (corner == np.roll(corner, 1, axis=1)).any(axis=1)
        self.collapsed = int(flat.sum())
        piece, cell, corner = piece[~flat], cell[~flat], corner[~flat]
        source = cells.triangle_source[piece]
        key = np.stack(
            [
                cell,
                scene.triangle_object[source],
                scene.triangle_material[source],
                scene.two_sided[source],
            ]
        )
        order = np.lexsort((piece, *key[::-1]))
        self._key = key[:, order]
        self._corner = corner[order]
        self._uv_corner = uv_of[cells.triangle[piece[order]]].reshape(-1, 3)
        change = (self._key[:, 1:] != self._key[:, :-1]).any(axis=0)
        self._start = np.concatenate([[0], np.flatnonzero(change) + 1, [len(order)]])
        self._first = np.searchsorted(
            self._key[0, self._start[:-1]] if len(order) else np.zeros(0, np.int64),
            np.arange(cells.cell_count + 1),
        )

    def shapes(self, cell: int) -> Iterator[Shape]:
        """The shapes of a cell, by object, material and sidedness."""
        for s in range(int(self._first[cell]), int(self._first[cell + 1])):
            rows = slice(int(self._start[s]), int(self._start[s + 1]))
            _, thing, material, two_sided = self._key[:, rows.start].tolist()
            point, triangle = np.unique(self._corner[rows], return_inverse=True)
            uv, uv_triangle = np.unique(self._uv_corner[rows], return_inverse=True)
            yield Shape(
                thing,
                material,
                bool(two_sided),
                point,
                uv,
                triangle.reshape(-1, 3),
                uv_triangle.reshape(-1, 3),
            )


def _welded(rows: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    distinct, place = np.unique(rows, axis=0, return_inverse=True)
    return distinct, place.ravel().astype(np.int64)
