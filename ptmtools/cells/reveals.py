"""Reveals: the jambs, lintels and sills that close a wall's thickness around an opening.

Two parallel walls near to one another are the faces of one wall. Between them the BSP leaves a
slab that holds both solids and the doorways through it; the polygons that part the two are
far smaller than any wall. They are found by what they do: they bridge the slab from face to face.
Without them, solids that are not capped (a wall ending under a floor slab) would join rooms to the
outside, and every door in a wall to every other.
"""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.polyhedron import BOX_FACE, Polyhedron
from ptmtools.cells.structure import Frame, Structure, WallPlane, parallel_gap
from ptmtools.tolerance import TIE_SHARE, ranked


class Reveals:
    """The reveals in the thickness of walls, found once for every pair of wall faces."""

    def __init__(self, structure: Structure, wall_thickness: float) -> None:
        self._structure = structure
        self._limit = wall_thickness
        self._tolerance = structure.tolerance
        self._known: dict[bytes, list[WallPlane]] = {}

    def __getstate__(self) -> dict[str, object]:
        return {**vars(self), "_known": {}}  # which another thread may be adding to

    def within(self, body: Polyhedron, walls: list[WallPlane]) -> list[WallPlane]:
        """The reveals of the slab that a body lies in; none if it lies in no wall.

        ``walls`` are those of the BSP nodes that the tags of the body's faces name.
        """
        slab = self._slab(_bounds(body, walls))
        if slab is None:
            return []
        key = slab[0].tobytes() + slab[1].tobytes()
        if key not in self._known:
            self._known[key] = self._bridges(*slab)
        return self._known[key]

    def _slab(self, bounds: list[Floats]) -> tuple[Floats, Floats] | None:
        """The nearest pair of parallel planes within the wall thickness."""
        nearest, pair = (1 + TIE_SHARE) * self._limit, None
        for i, a in enumerate(bounds):
            for b in bounds[i + 1 :]:
                gap = parallel_gap(a, b, self._tolerance)
                if gap <= nearest:
                    nearest, pair = gap - self._tolerance.rounding, (a, b)
        return pair

    def _bridges(self, first: Floats, second: Floats) -> list[WallPlane]:
        slack = self._tolerance.hairline
        turn = float(np.sign(first[:3] @ second[:3]))
        width = abs(float(first[3]) - turn * float(second[3]))
        inward = float(np.sign(float(first[3]) - turn * float(second[3]))) or 1.0
        structure, areas = self._structure, self._structure.areas
        near = structure.nearby.between(first, *sorted((inward * slack, inward * (width - slack))))
        depth = inward * (structure.corners[near] @ first[:3] + first[3])
        low, high = depth.min(axis=1), depth.max(axis=1)
        within = (high > slack) & (low < width - slack) & (areas[near] > 0)
        inside, low, high = near[within], low[within], high[within]
        spans = self._span(inside, low, high, width)
        bridging = inside[spans]
        found: list[WallPlane] = []
        for seed in bridging[ranked(areas[bridging])]:
            plane = structure.planes[seed]
            apart = (parallel_gap(plane, w.frame.plane, self._tolerance) for w in found)
            if min(apart, default=self._limit) < self._tolerance.thin:
                continue
            frame, lies = Frame.of(plane), structure.lie_in(plane, inside)
            walls, blocking = inside[lies & spans], inside[lies]
            found.append(
                WallPlane(frame, structure.united(frame, walls), structure.united(frame, blocking))
            )
        return found

    def _span(self, triangles: Ints, low: Floats, high: Floats, width: float) -> Bools:
        """(n,) which triangles, ``low`` and ``high`` deep in a slab, are of a flat region that
        reaches from one of its faces to the other; of the region, what lies between them."""
        slack = self._tolerance.hairline
        between = np.flatnonzero((low >= -slack) & (high <= width + slack))
        names, region = np.unique(self._structure.region[triangles[between]], return_inverse=True)
        least, most = np.full(len(names), np.inf), np.full(len(names), -np.inf)
        np.minimum.at(least, region, low[between])
        np.maximum.at(most, region, high[between])
        spans = np.zeros(len(triangles), dtype=bool)
        spans[between] = ((least <= slack) & (most >= width - slack))[region]
        return spans


def _bounds(body: Polyhedron, walls: list[WallPlane]) -> list[Floats]:
    """The planes of a body's faces: those of the BSP, and those of the root box, in which the
    outer faces of a building lie when the box is clipped to it."""
    bounds = [
        walls[tag].frame.plane for tag in sorted({tag for tag in body.tags if tag != BOX_FACE})
    ]
    return bounds + [p for p, tag in zip(body.planes, body.tags, strict=True) if tag == BOX_FACE]
