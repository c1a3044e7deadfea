"""Leaves become cells: each for itself, or grouped into rooms where parting gains too little.

A room of several leaves is one cell, unless keeping some of them apart saves its viewers more than
`SubdivideOptions.gain` of what they fetch: a corridor along many doors is worth parting, a hall is
not. Cells never reach through a door (`rooms`), even if both sides see the same: what is behind a
door covers little of the view, and the coverage hints can say so only of another cell.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints
from ptmtools.cells.gain import join_by_gain
from ptmtools.cells.model import Cells
from ptmtools.cells.options import SubdivideOptions
from ptmtools.cells.rooms import room_of_leaf
from ptmtools.cells.sight import sampled_sight
from ptmtools.cells.vectors import areas
from ptmtools.notes import Warned

#: Shares of a triangle that differ by less are equal, in digits.
DIGITS = 6
#: What is said of a model of one cell.
ONE_HALL = Warned("visibility culling gains nothing here: 1 hall")


def grouped(cells: Cells, options: SubdivideOptions) -> Cells:
    """The cells that the options ask for, of cells that are single leaves.

    Cells are numbered in the order of their first leaves; geometry in a boundary between two
    leaves of one cell lies inside that cell.
    """
    if options.cells == "room":
        group, owner = numbered(_groups(cells, options.gain)), cells.triangle_cell
        owner = np.where(owner >= 0, group[owner], -1).astype(np.int32)
        cells = replace(cells, leaf_cell=group, triangle_cell=owner)
    if cells.cell_count == 1:
        cells = replace(cells, notes=(*cells.notes, ONE_HALL))
    return cells


def numbered(group: NDArray[np.integer]) -> NDArray[np.int32]:
    """(L,) groups renamed to 0, 1, … in the order in which they first occur."""
    _, first, row = np.unique(group, return_index=True, return_inverse=True)
    place = np.empty(len(first), dtype=np.int32)
    place[np.argsort(first)] = np.arange(len(first))
    return np.asarray(place[row.reshape(-1)])


def rank_in_file(cells: Cells) -> Ints:
    """(L,) the place of each leaf in an order that no transformation of the model changes: leaves
    are compared by the share that they hold of the model's first triangle of which one of them
    holds more, and go by number where they hold the same of all.

    Leaves themselves are numbered as planes split them, and which side of a plane is its front
    depends on how the model is turned.
    """
    leaf, piece, area = _sides(cells)
    source = cells.triangle_source
    count = int(source.max(initial=-1)) + 1
    pair, row = np.unique(leaf * count + source[piece], return_inverse=True)
    held = np.bincount(row, area[piece])
    whole = np.bincount(source, area)[pair % max(count, 1)]
    share = np.round(np.divide(held, whole, out=np.zeros(len(held)), where=whole > 0), DIGITS)
    held_by: list[list[tuple[int, float]]] = [[] for _ in range(cells.leaf_count)]
    for at, part in zip(pair.tolist(), share.tolist(), strict=True):
        if part > 0:
            held_by[at // count].append((at % count, -part))
    rank = np.empty(cells.leaf_count, dtype=np.int64)
    # A leaf that holds nothing more comes last, not first.
    key = [[*held, (count, 0.0)] for held in held_by]
    rank[sorted(range(cells.leaf_count), key=key.__getitem__)] = np.arange(cells.leaf_count)
    return rank


def _groups(cells: Cells, gain: float) -> NDArray[np.integer]:
    rank = rank_in_file(cells)
    room = room_of_leaf(cells, rank)
    if gain >= 1 or len(np.unique(room)) == len(room):
        return room
    inner = cells.portal_leaf[room[cells.portal_leaf[:, 0]] == room[cells.portal_leaf[:, 1]]]
    order = np.argsort(rank)
    sees = sampled_sight(cells)[np.ix_(order, order)]
    leaf, piece, area = _sides(cells)
    surface = np.bincount(leaf, area[piece], cells.leaf_count).astype(np.float64)
    weights = cells.leaf_volumes()[order], surface[order]
    return join_by_gain(sees, *weights, rank[inner], gain)[rank]


def _sides(cells: Cells) -> tuple[Ints, Ints, Floats]:
    """(n,) leaves and (n,) pieces of geometry that belong to them, of cells that are single leaves;
    what lies in a boundary counts on both sides. And (M,) the areas of the pieces, m²."""
    front, back = cells.triangle_cell.T
    behind = (back >= 0) & (back != front)
    leaf = np.concatenate([front[front >= 0], back[behind]]).astype(np.int64)
    piece = np.concatenate([np.flatnonzero(front >= 0), np.flatnonzero(behind)])
    return leaf, piece, areas(cells.vertex[cells.triangle])
