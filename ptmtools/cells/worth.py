"""Whether dividing leaves further saves visitors anything.

At some sizes of the tree, every leaf is judged by its **district**: all leaves under the lowest
node with `DISTRICT` of them. What dividing the district has saved is measured as for rooms
(`gain`): viewers are the walkable floor in a leaf, cost is the surface in it, and lines through the
openings so far show which leaves see one another. The leaf is divided further if the district has
saved, of the whole cost, at least the threshold times its share of all leaves, which are the work
of dividing it. Elsewhere sight goes around the walls or over them, as in a street.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints, normals, summed
from ptmtools.cells.bsp import Tree
from ptmtools.cells.gain import cost
from ptmtools.cells.model import descend
from ptmtools.cells.places import Places, spread
from ptmtools.cells.portals import Portal, find_portals
from ptmtools.cells.sight import from_places, sampled_sight
from ptmtools.portal_flow.flow import Portals
from ptmtools.tolerance import Tolerance

#: The least number of leaves whose gain is measured.
DISTRICT = 16
#: Points that represent the viewers, and the surfaces.
_POINTS = 100_000


@dataclass(frozen=True)
class Worth:
    """Measures what a division gains."""

    viewers: tuple[Floats, Floats]  # (n, 3) the middles of bodies, and (n,) their m² of floor
    surfaces: tuple[Floats, Floats]  # (n, 3) points beside the structure, and (n,) their m²
    gain: float  # `SubdivideOptions.gain`
    tolerance: Tolerance

    @staticmethod
    def of(
        places: Places, middle: float, structure: Floats, gain: float, tolerance: Tolerance
    ) -> Worth:
        """``middle``: height of the middle of a body; ``structure``: (n, 3, 3) triangles."""
        points, area = _thinned(*spread(places.triangles(tolerance)))
        beside, size = _beside(structure, 2 * tolerance.plane)
        return Worth((points + [0.0, middle, 0.0], area), (beside, size), gain, tolerance)

    def __call__(self, tree: Tree) -> Bools:
        """(L,) which leaves of a tree, and parts of it that wait for their division, to divide."""
        every = np.stack([_held(tree, *self.viewers), _held(tree, *self.surfaces)], axis=1)
        portals = _portals(tree, find_portals(tree, self.tolerance), self.tolerance)
        sees = from_places(sampled_sight(portals), every[:, 0] > 0)
        apart = every[:, 0] * (sees @ every[:, 1]) + every[:, 1] * (sees @ every[:, 0])
        district = districts(tree)
        divide = np.ones(len(tree.leaves), dtype=np.bool_)
        for node in np.unique(district):
            members = within(tree, node)
            seen = np.asarray(sees[members].any(axis=0))
            saved = cost(seen, every[members].sum(axis=0), every) - apart[members].sum()
            least = self.gain * np.count_nonzero(members) / len(members) * apart.sum()
            divide[district == node] = saved >= least
        return divide


def districts(tree: Tree) -> Ints:
    """(L,) for each leaf the lowest node above it with at least `DISTRICT` leaves, or the root."""
    count = np.zeros(len(tree.children), dtype=np.int64)
    for node in range(len(tree.children) - 1, -1, -1):  # children follow their parents
        count[node] = sum(count[child] if child >= 0 else 1 for child in tree.children[node])
    lowest = np.zeros(len(tree.children), dtype=np.int64)
    result = np.zeros(len(tree.leaves), dtype=np.int64)
    for node, children in enumerate(tree.children.tolist()):
        name = node if count[node] >= DISTRICT else lowest[node]
        for child in children:
            if child >= 0:
                lowest[child] = name
            else:
                result[-2 - child] = name
    return result


def within(tree: Tree, node: int) -> Bools:
    """(L,) which leaves are under a node."""
    result = np.zeros(len(tree.leaves), dtype=np.bool_)
    below = [node]
    while below:
        front, back = tree.children[below.pop()].tolist()
        for child in (front, back):
            if child >= 0:
                below.append(child)
            else:
                result[-2 - child] = True
    return result


def _portals(tree: Tree, portals: list[Portal], tolerance: Tolerance) -> Portals:
    sight = [portal for portal in portals if not portal.passage]
    return Portals(
        leaf_count=len(tree.leaves),
        leaf=np.array([portal.leaves for portal in sight], dtype=np.int32).reshape(-1, 2),
        normal=tree.planes[[portal.node for portal in sight], :3].reshape(-1, 3),
        point=np.concatenate([np.zeros((0, 3)), *(portal.polygon for portal in sight)]),
        start=np.cumsum([0, *(len(portal.polygon) for portal in sight)]),
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
