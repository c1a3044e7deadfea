"""Finer meshes of objects with levels of detail, and what clients gain by them.

The pictures of the simulator have all objects as modelled: a coarser mesh costs a client bytes
here, and no error.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.rendering.rays import Frustum
from ptmtools.site.client import GROSS, SEEN


@dataclass(frozen=True)
class Meshes:
    """The files of finer meshes, in the order of the index.

    Attributes
    ----------
    mesh, cell: (M,) the object's row in the index, ascending, and its cell.
    bytes: (M,) on the link.
    low, high: (M, 3) corners of the object's box, metres.
    error, coarsest: (M,) metres, of the mesh, and of that in the GLB of the cell.
    """

    mesh: Ints
    cell: Ints
    bytes: Ints
    low: Floats
    high: Floats
    error: Floats
    coarsest: Floats

    @property
    def finest(self) -> Bools:
        """(M,) which files have the object as modelled."""
        last: Bools = np.append(self.mesh[1:] != self.mesh[:-1], len(self.mesh) > 0)
        return last[: len(self.mesh)]

    def gains(self, there: Bools, frustum: Frustum, nearest: float, behind: float) -> Floats:
        """(M,) the share of the view, with the severity of its error, that each file improves
        beside those that are ``there`` (docs/formats/client.md); ``nearest``: the least distance,
        metres; ``behind``: weight of an object out of sight."""
        if not len(self.mesh):
            return np.zeros(0)
        present = np.full(int(self.mesh[-1]) + 1, np.inf)
        present[self.mesh] = self.coarsest
        np.minimum.at(present, self.mesh[there], self.error[there])
        far = np.maximum(frustum.distance(self.low, self.high), nearest)
        size = np.linalg.norm(self.high - self.low, axis=1) / 2
        ahead = frustum.meets_boxes(self.low, self.high)
        share = np.minimum(1.0, (size / far) ** 2) * np.where(ahead, 1.0, behind)
        now, then = present[self.mesh] / far, self.error / far
        gain = now / (now + GROSS) - then / (then + GROSS)
        gains: Floats = np.where(now > SEEN, share * np.maximum(gain, 0.0), 0.0)
        return gains


def meshes_of(rows: Sequence[Mapping[str, Any]], sizes: Sequence[Sequence[int]]) -> Meshes:
    """The files of an index; ``sizes``: bytes of each on the link."""
    files = [
        (mesh, row["cell"], size, *row["box"], error, row["errors"][0])
        for mesh, (row, own) in enumerate(zip(rows, sizes, strict=True))
        for size, error in zip(own, row["errors"][1:], strict=True)
    ]
    table = np.array(files, dtype=np.float64).reshape(-1, 11)
    mesh, cell, size = table[:, :3].astype(np.int64).T
    return Meshes(mesh, cell, size, table[:, 3:6], table[:, 6:9], table[:, 9], table[:, 10])
