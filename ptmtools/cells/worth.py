"""Whether dividing a model further saves visitors anything.

At some sizes of the tree, the **cost** of the leaves so far is estimated: the share of all surfaces
that visitors see, by lines through the openings so far. Division ends, everywhere, if it has not
lowered the cost by the threshold since the last look: sight goes around the walls or over them, as
in a street, and the next ones would take as long again.

Buildings with rooms are divided to the end: on a large plot most floor is outside, and doors come
last. (Tried: to stop by districts of the tree. A few leaves that are not divided join the rooms,
and the hollows of the walls, of a museum of a thousand rooms.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Floats, normals, summed
from ptmtools.cells.bsp import Tree
from ptmtools.cells.model import descend
from ptmtools.cells.places import Places, spread
from ptmtools.cells.planar import counting
from ptmtools.cells.portals import find_portals
from ptmtools.cells.sight import sampled_sight
from ptmtools.portal_flow.flow import Portals
from ptmtools.tolerance import Tolerance

#: Points that represent the viewers, and the surfaces.
_POINTS = 100_000


@dataclass(frozen=True)
class Viewing:
    """Viewers, and the surfaces that they may see."""

    viewers: tuple[Floats, Floats]  # (n, 3) the middles of bodies, and (n,) their m² of floor
    surfaces: tuple[Floats, Floats]  # (n, 3) points beside the structure, and (n,) their m²
    tolerance: Tolerance

    @staticmethod
    def of(places: Places, middle: float, structure: Floats, tolerance: Tolerance) -> Viewing:
        """``middle``: height of the middle of a body; ``structure``: (n, 3, 3) triangles."""
        points, area = _thinned(*spread(places.triangles(tolerance)))
        beside = _beside(structure, 2 * tolerance.plane)
        return Viewing((points + [0.0, middle, 0.0], area), beside, tolerance)

    def cost(self, tree: Tree) -> float:
        """The mean share of all surfaces that a viewer sees from any point of a leaf, in a tree
        that may not be complete. Surfaces that no viewer sees do not count."""
        viewers, surface = (_held(tree, *points) for points in (self.viewers, self.surfaces))
        with counting():  # what is undecided here decides nothing
            sees = sampled_sight(_openings(tree, self.tolerance))
        held, seen = 0.0, np.zeros(len(surface), dtype=np.bool_)
        for leaf in np.flatnonzero(viewers):
            held += viewers[leaf] * surface[sees[leaf]].sum()
            seen |= sees[leaf]
        most = viewers.sum() * surface[seen].sum()
        return float(held / most) if most > 0 else 1.0


def _openings(tree: Tree, tolerance: Tolerance) -> Portals:
    portals = [portal for portal in find_portals(tree, tolerance) if not portal.passage]
    return Portals(
        leaf_count=len(tree.leaves),
        leaf=np.array([portal.leaves for portal in portals], dtype=np.int32).reshape(-1, 2),
        normal=tree.planes[[portal.node for portal in portals], :3].reshape(-1, 3),
        point=np.concatenate([np.zeros((0, 3)), *(portal.polygon for portal in portals)]),
        start=np.cumsum([0, *(len(portal.polygon) for portal in portals)]),
        tolerance=tolerance,
    )


def _held(tree: Tree, points: Floats, weight: Floats) -> Floats:
    """(L,) the weight of the points in each leaf."""
    leaf = -2 - descend(tree.planes, tree.children, points)
    return summed(leaf, weight, len(tree.leaves))


def _beside(corners: Floats, distance: float) -> tuple[Floats, Floats]:
    """Points spread over triangles, half of them at a distance to either side, and their m²."""
    facing = normals(corners)
    length = np.linalg.norm(facing, axis=1)
    sound = length > 0
    step = distance * facing[sound] / length[sound, None]
    sides = [_thinned(*spread(corners[sound] + turn * step[:, None])) for turn in (1.0, -1.0)]
    points, area = zip(*sides, strict=True)
    return np.concatenate(points), np.concatenate(area) / 2


def _thinned(points: Floats, weight: Floats) -> tuple[Floats, Floats]:
    """Some of the points, which represent them all."""
    step = -(-len(points) // _POINTS) or 1
    return points[::step], weight[::step] * step
