"""Which leaves somebody can reach, and whether the model is closed.

The flood starts from the viewpoints, else from the largest leaf that has floor below it, is not
the inside of a solid and does not touch the root box, and runs through the portals. The model is
closed if it never meets the root box; what it does not reach is a solid, a sealed void or the
outside (design, "Reachable").
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain, compress

import numpy as np

from ptmtools.arrays import Bools, Floats
from ptmtools.cells.bsp import Tree
from ptmtools.cells.options import Walker
from ptmtools.cells.polyhedron import BOX_FACE
from ptmtools.cells.portals import Portal
from ptmtools.cells.structure import Structure
from ptmtools.cells.surroundings import Surroundings
from ptmtools.cells.vectors import cross, normals
from ptmtools.tolerance import ranked

#: A surface whose normal leans less than this from the vertical can be stood on (cosine of 45°).
FLOOR_COSINE = 0.7
#: The largest floor triangles, this many, stand for the whole floor.
FLOOR_SAMPLES = 400
#: Surfaces nearer to one another than head room, metres, or this share of the model's height, are
#: the two sides of a slab, or furniture.
HEAD_ROOM, SLAB_SHARE = 1.5, 1 / 3
#: A model is open above if less than this share of its floor has something over it.
ROOFED = 0.5


def flood(leaves: int, portals: list[Portal], start: tuple[int, ...]) -> Bools:
    """(L,) which of so many leaves are reached through the portals from the leaves ``start``."""
    ends = np.array([portal.leaves for portal in portals], dtype=np.int64).reshape(-1, 2)
    reached, count = np.zeros(leaves, dtype=bool), 0
    reached[list(start)] = True
    while count < (count := int(reached.sum())):
        reached[ends[reached[ends].any(axis=1)]] = True
    return reached


def at_box(tree: Tree) -> Bools:
    """(L,) which leaves touch the root box."""
    return np.array([BOX_FACE in body.tags for body in tree.leaves], dtype=bool)


def largest_leaf(
    tree: Tree, allowed: Bools, structure: Structure, walker: Walker
) -> tuple[int, ...]:
    """The largest of the (L,) allowed leaves that has floor below its middle, or if none has the
    largest, as a tuple of one; () if none is allowed. Leaves too thin for a walker, such as the
    hollow of a wall, are none unless all are. Where faces are turned out of solids, leaves whose
    walls and floor face into them come first, and the inside of the ground or of a thick wall is
    none of them."""
    corners = structure.corners
    roomy = np.array([body.width >= 2 * walker.radius for body in tree.leaves])
    leaves = np.flatnonzero(allowed & roomy if roomy.any() else allowed)
    order = leaves[ranked(np.array([tree.leaves[leaf].volume for leaf in leaves]))].tolist()
    middle = {leaf: tree.leaves[leaf].points.mean(axis=0) for leaf in order}
    hollow: Iterable[int] = ()
    if order and _outwards(corners):
        around = Surroundings(corners, structure.tolerance)
        floored = around.floored(np.array(list(middle.values())))
        hollow = (leaf for leaf in compress(order, floored) if not around.solid(middle[leaf][None]))
    for leaf in chain(hollow, order):
        if np.any(_plumb(middle[leaf], corners) < 0):
            return (leaf,)
    return tuple(order[:1])


def roofed_share(corners: Floats, floor_area: float) -> float:
    """Share of the floor, by area, that has something over it (1 without any floor).

    Floor is every level triangle of at least a tenth of ``floor_area`` m²; a ceiling is floor that
    nothing covers, so of the triangles over one another at a place only the lowest is floor.
    """
    normal = normals(corners)
    area = np.linalg.norm(normal, axis=1) / 2
    level = np.abs(normal[:, 1]) >= FLOOR_COSINE * 2 * area
    floor = np.flatnonzero(level & (area >= floor_area / 10))
    order = floor[ranked(area[floor])][:FLOOR_SAMPLES]
    height = float(np.ptp(corners[:, :, 1])) if len(corners) else 0.0
    apart = min(HEAD_ROOM, SLAB_SHARE * height)
    stood_on = corners[level]
    low, high = stood_on.min(axis=1), stood_on.max(axis=1)
    covered = total = 0.0
    for triangle in order:
        eye = corners[triangle].mean(axis=0)
        around = (low <= eye) & (eye <= high)
        heights = _plumb(eye, stood_on[around[:, 0] & around[:, 2]])
        if not np.any(heights < -apart):
            total += area[triangle]
            covered += area[triangle] * bool(np.any(heights > apart))
    return float(covered / total) if total else 1.0


def _outwards(corners: Floats) -> bool:
    """Whether (T, 3, 3) triangles face out of what they enclose, by volume: those of solids do,
    those of walls without thickness face into the rooms."""
    if not len(corners):
        return False
    a, b, c = (corners - corners.mean(axis=(0, 1))).transpose(1, 0, 2)
    return bool(np.einsum("ij,ij->", a, cross(b, c)) > 0)


def _plumb(eye: Floats, corners: Floats) -> Floats:
    """Heights above ``eye`` (metres) at which a plumb line meets triangles that can be stood on."""
    flat = corners[:, :, [0, 2]] - eye[[0, 2]]
    turn = flat[:, [1, 2, 0]]
    side = flat[:, :, 0] * turn[:, :, 1] - flat[:, :, 1] * turn[:, :, 0]
    hit = np.flatnonzero(np.all(side >= 0, axis=1) | np.all(side <= 0, axis=1))
    p = corners[hit]
    normal = normals(p)
    level = np.abs(normal[:, 1]) >= FLOOR_COSINE * np.linalg.norm(normal, axis=1)
    level &= normal[:, 1] != 0
    p, normal = p[level], normal[level]
    heights: Floats = np.einsum("ij,ij->i", normal, p[:, 0] - eye) / normal[:, 1]
    return heights
