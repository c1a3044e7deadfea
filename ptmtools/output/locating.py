"""Finds the cell of an eye: the one that has a leaf with the eye behind all its planes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ptmtools.arrays import Floats, Ints

#: Metres by which leaves are enlarged, so that leaves that touch overlap (docs/formats/hints.md).
SLACK = 1e-3


class Locator:
    """The leaves of all cells."""

    def __init__(self, records: Sequence[Mapping[str, Any]]) -> None:
        self._planes = [[_planes(leaf) for leaf in record["leaves"]] for record in records]
        points = [np.concatenate([leaf["points"] for leaf in r["leaves"]]) for r in records]
        self._low = np.array([p.min(axis=0) for p in points]) - SLACK
        self._high = np.array([p.max(axis=0) for p in points]) + SLACK

    def cells_along(self, eye: Floats) -> Ints:
        """(F,) the cell of each of (F, 3) eyes along a walk: the previous one if it still contains
        the eye; -1 for none."""
        cells = np.full(len(eye), -1, np.int64)
        cell = -1
        for f, point in enumerate(eye):
            if cell < 0 or not self._contains(cell, point):
                near = ((self._low <= point) & (point <= self._high)).all(axis=1)
                cell = next(
                    (c for c in np.flatnonzero(near).tolist() if self._contains(c, point)), -1
                )
            cells[f] = cell
        return cells

    def distance_outside(self, cell: int, point: Floats) -> Floats:
        """(n,) metres from (n, 3) points to a cell: the largest distance in front of a plane of a
        leaf, least over the leaves; 0 or less inside."""
        leaves = [(point @ leaf[:, :3].T + leaf[:, 3]).max(axis=1) for leaf in self._planes[cell]]
        return np.asarray(np.min(leaves, axis=0))

    def _contains(self, cell: int, point: Floats) -> bool:
        return bool(self.distance_outside(cell, point[None])[0] <= SLACK)


def _planes(leaf: Mapping[str, Any]) -> Floats:
    """(n, 4) outward unit normals and offsets of a leaf's faces."""
    point = np.array(leaf["points"], dtype=np.float64)
    rows = []
    for loop in leaf["faces"]:
        corner = point[loop]
        turned = np.cross(corner, np.roll(corner, -1, axis=0)).sum(axis=0)
        normal = turned / max(float(np.linalg.norm(turned)), np.finfo(np.float64).tiny)
        rows.append([*normal, -float((corner @ normal).mean())])
    return np.array(rows).reshape(-1, 4)
