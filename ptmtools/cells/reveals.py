"""Reveals: the jambs, lintels and sills that close a wall's thickness around an opening.

Two parallel walls near to one another are the faces of one wall. Between them the BSP leaves a
slab that holds both solid matter and the doorways through it; the polygons that part the two are
far smaller than any wall. They are found by what they do: they bridge the slab from face to face.
Without them, matter that is not capped (a wall ending under a floor slab) would join rooms to the
outside, and every door in a wall to every other.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells.polyhedron import Polyhedron
from ptmtools.cells.structure import (
    Frame,
    WallPlane,
    lying_in,
    parallel_and_near,
    planes_of,
    unite,
)
from ptmtools.tolerance import Tolerance


class Reveals:
    """The reveals in the thickness of walls, found once for every pair of wall faces."""

    def __init__(
        self, corners: NDArray[np.float64], wall_thickness: float, tolerance: Tolerance
    ) -> None:
        """``corners``: (T, 3, 3) structural triangles."""
        self._corners = corners
        self._planes, self._areas = planes_of(corners)
        self._limit = wall_thickness
        self._tolerance = tolerance
        self._known: dict[bytes, list[WallPlane]] = {}

    def within(self, body: Polyhedron, planes: list[NDArray[np.float64]]) -> list[WallPlane]:
        """The reveals of the slab that a body lies in; none if it lies in no wall.

        ``planes`` are those of the BSP nodes that the tags of the body's faces name.
        """
        slab = self._slab(body, planes)
        if slab is None:
            return []
        first, second = planes[slab[0]], planes[slab[1]]
        key = first.tobytes() + second.tobytes()
        if key not in self._known:
            self._known[key] = self._bridges(first, second)
        return self._known[key]

    def _slab(self, body: Polyhedron, planes: list[NDArray[np.float64]]) -> tuple[int, int] | None:
        """The nearest pair of parallel BSP planes that bound a body within the wall thickness."""
        nearest, pair = self._limit, None
        tags = sorted({tag for tag in body.tags if tag >= 0})
        for i, a in enumerate(tags):
            for b in tags[i + 1 :]:
                turn = float(planes[a][:3] @ planes[b][:3])
                if abs(turn) < self._tolerance.cosine:
                    continue
                gap = abs(float(planes[a][3]) - float(np.sign(turn)) * float(planes[b][3]))
                if gap <= nearest:
                    nearest, pair = gap, (a, b)
        return pair

    def _bridges(self, first: NDArray[np.float64], second: NDArray[np.float64]) -> list[WallPlane]:
        slack = self._tolerance.hairline
        turn = float(np.sign(first[:3] @ second[:3]))
        width = abs(float(first[3]) - turn * float(second[3]))
        inward = float(np.sign(float(first[3]) - turn * float(second[3]))) or 1.0
        depth = inward * (self._corners @ first[:3] + first[3])
        low, high = depth.min(axis=1), depth.max(axis=1)
        inside = np.flatnonzero((high > slack) & (low < width - slack) & (self._areas > 0))
        low, high = low[inside], high[inside]
        spans = (np.abs(low) <= slack) & (np.abs(high - width) <= slack)
        bridging = inside[spans]
        found: list[WallPlane] = []
        for seed in bridging[np.argsort(-self._areas[bridging], kind="stable")]:
            plane = self._planes[seed]
            if any(parallel_and_near(plane, w.frame.plane, self._tolerance) for w in found):
                continue
            frame = Frame.of(plane)
            flat = inside[lying_in(plane, self._corners[inside], self._tolerance)]
            walls = np.intersect1d(flat, bridging)
            found.append(
                WallPlane(
                    frame,
                    unite(frame.to_plane(self._corners[walls])),
                    unite(frame.to_plane(self._corners[flat])),
                )
            )
        return found
