"""Rooms that the flood did not reach: behind a door that is closed, in another building, upstairs.

Leaves that hang together through portals, but with none that is reached, are a group. One that
holds a place is where somebody could be, and is not to be lost; one that holds none is a solid, the
hollow of a wall or a shaft. What touches the root box of a closed model is the outside.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.bsp import Tree
from ptmtools.cells.merging import connected
from ptmtools.cells.model import sunk
from ptmtools.cells.options import Walker
from ptmtools.cells.places import Floors, find_places, spread
from ptmtools.cells.portals import Portal
from ptmtools.cells.structure import Structure
from ptmtools.cells.vectors import summed
from ptmtools.tolerance import ranked

#: A group of leaves with less place than this, m², is none that anybody would miss.
LEAST_PLACE = 0.05


@dataclass(frozen=True)
class CutOff:
    """A group of leaves that the flood did not reach, and in which somebody could be."""

    leaves: Ints  # of the tree, ascending
    place: float  # m² where somebody can stand
    eye: tuple[float, float, float]  # a viewpoint in it, metres


@dataclass(frozen=True)
class Standing:
    """Whoever stands in some leaves, spread over all places there."""

    points: Floats  # (n, 3) the middles of their bodies, metres
    place: Floats  # (n,) m² that each stands for
    leaf: Ints  # (n,) where they are

    @staticmethod
    def of(
        tree: Tree, leaves: Bools, floors: Floors, structure: Structure, walker: Walker
    ) -> Standing:
        """Whoever stands in these (L,) leaves."""
        middle = np.array([0.0, (walker.step + walker.height) / 2, 0.0])
        points, _, row = spread(floors.corners)
        asked = np.zeros(len(floors.region), dtype=bool)
        asked[row[_among(leaves, tree, points + middle)]] = True
        points, place, _ = spread(find_places(floors.only(asked), structure, walker))
        points = points + middle
        inside = _among(leaves, tree, points)
        return Standing(points[inside], place[inside], _leaf(tree, points[inside]))


def cut_off(
    tree: Tree,
    portals: list[Portal],
    reached: Bools,
    outside: Bools,
    floors: Floors,
    structure: Structure,
    walker: Walker,
) -> list[CutOff]:
    """The groups that hold a place, the largest first; ``reached`` and ``outside``: (L,) leaves,
    groups with one of the latter are the outside."""
    group = _groups(len(tree.leaves), portals)
    barred = reached | outside
    waiting = ~barred & ~np.isin(group, group[barred])
    if not waiting.any():
        return []
    standing = Standing.of(tree, waiting, floors, structure, walker)
    of = group[standing.leaf]
    area = summed(of, standing.place, len(group))
    found = []
    for name in ranked(area)[: np.count_nonzero(area >= LEAST_PLACE)]:
        here = standing.points[of == name]
        away = ((here - here.mean(axis=0)) ** 2).sum(axis=1)
        x, y, z = here[np.argmin(away)].tolist()
        found.append(CutOff(np.flatnonzero(group == name), float(area[name]), (x, y, z)))
    return found


def _groups(leaves: int, portals: list[Portal]) -> Ints:
    """(leaves,) the least leaf that each hangs together with through portals."""
    ends = np.array([portal.leaves for portal in portals], dtype=np.int64).reshape(-1, 2)
    return connected(leaves, np.concatenate(ends.T), np.concatenate(ends[:, ::-1].T))


def _leaf(tree: Tree, points: Floats) -> Ints:
    """(n,) the leaf of the tree that each of (n, 3) points is in."""
    return np.asarray(-2 - sunk(tree.planes, tree.children, points))


def _among(leaves: Bools, tree: Tree, points: Floats) -> Bools:
    """(n,) which of (n, 3) points lie in one of these (L,) leaves."""
    corners = np.concatenate([body.points for body in tree.leaves])
    inside = np.all((points >= corners.min(axis=0)) & (points <= corners.max(axis=0)), axis=1)
    found: Bools = inside & leaves[_leaf(tree, points)]
    return found
