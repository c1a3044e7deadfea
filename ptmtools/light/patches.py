"""Patches of the surfaces of a building, between which light is transported.

A face is divided into n² triangles alike by lines parallel to its edges, and each side of it has
patches of its own. Row i, from the edge between the first and the third corner on, has
2 (n - i) - 1 triangles; those before it are i (2 n - i). A point with barycentric coordinates
(1 - u - v, u, v) lies in row ⌊n u⌋ and column ⌊n v⌋, above the diagonal of that rhomb or below it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, areas
from ptmtools.jit import inlined_kernel, kernel

#: Largest number of parts of an edge; the patches of a face of a kilometre are larger.
_MOST = 256
#: Patches of less than this share of the usual area matter little by themselves; that is at most
#: the second number, m², however large the ground is.
_SMALL, _USUAL = 0.1, 0.2


def are_small(area: Floats) -> Bools:
    """(n,) which areas of patches are small beside their mean, weighted by themselves."""
    usual = (area**2).sum() / max(float(area.sum()), 1e-300)
    return np.asarray(area < _SMALL * min(usual, _USUAL))


@dataclass(frozen=True)
class LightPatches:
    """The patches of F faces.

    Attributes
    ----------
    corner: (F, 3, 3) metres.
    split: (F,) int32 parts of each edge.
    first: (F, 2) int64 the first patch of the front and of the back; -1 of a side without light.
    count: number of patches.
    """

    corner: Floats
    split: NDArray[np.int32]
    first: Ints
    count: int

    @staticmethod
    def of_faces(corner: Floats, lit: Bools, size: float) -> LightPatches:
        """Patches of about ``size`` metres on the (F, 2) ``lit`` sides of (F, 3, 3) faces."""
        edge = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2).max(axis=1)
        # Slivers have patches longer than wide.
        length = np.sqrt(edge * np.sqrt(2 * areas(corner)))
        split = np.clip(np.ceil(length / size), 1, _MOST).astype(np.int32)
        number = np.where(lit, (split.astype(np.int64) ** 2)[:, None], 0)
        start = np.concatenate([[0], np.cumsum(number.ravel())])
        first = np.where(lit, start[:-1].reshape(-1, 2), -1)
        return LightPatches(corner, split, first, int(start[-1]))

    def faces(self) -> tuple[Ints, Ints, Ints]:
        """(count,) of each patch: face, side (0 front, 1 back), and number on that side."""
        parts = np.where(self.first >= 0, (self.split.astype(np.int64) ** 2)[:, None], 0).ravel()
        side = np.repeat(np.arange(len(parts)), parts)
        return side // 2, side % 2, np.arange(self.count) - self.first.ravel()[side]

    def areas(self) -> Floats:
        """(F,) m² of a patch of each face."""
        return areas(self.corner) / self.split.astype(np.float64) ** 2

    def points(self, face: Ints, number: Ints, across: Floats, along: Floats) -> Floats:
        """(n, 3) points of patches, given by face and number on its side; (n,) ``across`` and
        ``along`` in [0, 1) spread them over a patch."""
        return points_of(self.corner, self.split, face, number, across, along)


@inlined_kernel
def patch_number(split: int, u: float, v: float) -> int:
    """The number of the patch at barycentric coordinates ``u`` and ``v``."""
    row = min(int(u * split), split - 1)
    column = min(int(v * split), split - 1 - row)
    above = (u * split - row) + (v * split - column) > 1 and column < split - 1 - row
    return row * (2 * split - row) + 2 * column + (1 if above else 0)


@kernel
def points_of(
    corner: Floats,
    split: NDArray[np.int32],
    face: Ints,
    number: Ints,
    across: Floats,
    along: Floats,
) -> Floats:
    """See `LightPatches.points`."""
    result = np.empty((len(face), 3))
    for k in range(len(face)):
        parts, rest, row = split[face[k]], number[k], 0
        while rest >= 2 * (parts - row) - 1:
            rest -= 2 * (parts - row) - 1
            row += 1
        column, above = rest // 2, rest % 2
        s = np.sqrt(across[k])
        u, v = s * (1 - along[k]), s * along[k]
        if above:
            u, v = 1 - u, 1 - v
        u, v = (row + u) / parts, (column + v) / parts
        for axis in range(3):
            result[k, axis] = (
                (1 - u - v) * corner[face[k], 0, axis]
                + u * corner[face[k], 1, axis]
                + v * corner[face[k], 2, axis]
            )
    return result
