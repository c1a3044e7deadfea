"""The planes of door leaves, which split what walls and reveals have left.

A leaf of 1 × 2.1 m is as large as a wall, but as one it would cut the thickness of the wall it
hangs in: the jambs beside it bridge the wall from face to face, and neither of the two slabs that
it makes of it. And one of 0.8 × 2 m would be none. So door leaves come after the reveals, whatever
their size. Like caps (`rejoin`) they are taken back where both sides are reached.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.cells.polyhedron import Polyhedron
from ptmtools.cells.structure import Frame, Structure, WallPlane
from ptmtools.tolerance import ranked

#: A plane of a leaf holds at least this share of what is largest of it in one plane.
_SHARE = 0.5
#: It lies square across the leaf to this cosine.
_SQUARE = 0.99


@dataclass(frozen=True)
class DoorPlanes:
    """The planes of d leaves and the boxes, metres, around what of each lies in them."""

    planes: tuple[WallPlane, ...]
    low: Floats  # (p, 3) and
    high: Floats  # (p, 3) least and greatest corner

    @staticmethod
    def of(structure: Structure, leaf: Ints, across: Floats) -> DoorPlanes:
        """Of the leaves, ``leaf``: (T,), -1 for none, of the triangles of a structure, that lie
        across (d, 3) directions."""
        own = np.flatnonzero(leaf >= 0)
        turn = np.einsum("ij,ij->i", structure.planes[own, :3], across[leaf[own]])
        own = own[np.abs(turn) >= _SQUARE]
        order = own[np.argsort(leaf[own], kind="stable")]
        bounds = np.searchsorted(leaf[order], np.arange(len(across) + 1))
        found: list[tuple[WallPlane, Ints]] = []
        for first, last in itertools.pairwise(bounds):
            found += _planes(structure, order[first:last])
        boxes = [structure.corners[flat].reshape(-1, 3) for _, flat in found]
        low = np.array([points.min(axis=0) for points in boxes]).reshape(-1, 3)
        high = np.array([points.max(axis=0) for points in boxes]).reshape(-1, 3)
        return DoorPlanes(tuple(plane for plane, _ in found), low, high)

    def within(self, body: Polyhedron) -> list[WallPlane]:
        """Those of leaves whose boxes meet that of a body."""
        low, high = body.points.min(axis=0), body.points.max(axis=0)
        meets = ((self.low <= high) & (self.high >= low)).all(axis=1)
        return [self.planes[i] for i in np.flatnonzero(meets)]


def _planes(structure: Structure, triangles: Ints) -> list[tuple[WallPlane, Ints]]:
    """The planes of one leaf, and which of its ``triangles`` lie in each."""
    layers: list[tuple[float, Floats, Ints]] = []
    left = triangles
    while len(left):
        plane = structure.planes[left[ranked(structure.areas[left])[0]]]
        flat = structure.lie_in(plane, left)
        layers.append((float(structure.areas[left[flat]].sum()), plane, left[flat]))
        left = left[~flat] if flat.any() else left[1:]
    least = _SHARE * max((area for area, *_ in layers), default=0.0)
    near = structure.tolerance.plane
    found = []
    for area, plane, own in layers:
        if area >= least:
            frame = Frame.of(plane)
            every = structure.nearby.between(plane, -near, near)
            blocking = structure.united(frame, every[structure.lie_in(plane, every)])
            found.append((WallPlane(frame, structure.united(frame, own), blocking), own))
    return found
