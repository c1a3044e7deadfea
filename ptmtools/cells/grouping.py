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
from ptmtools.cells.seen import from_places
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
    leaf = leaf_of_cell(cells)
    group = _groups(cells, options.gain)[leaf] if options.cells == "room" else leaf
    name = np.append(numbered(group), np.int32(-1))
    leaf_cell = np.full(cells.leaf_count, -1, dtype=np.int32)
    leaf_cell[leaf] = name[:-1]
    cells = replace(cells, leaf_cell=leaf_cell, triangle_cell=name[cells.triangle_cell])
    if cells.cell_count == 1:
        cells = replace(cells, notes=(*cells.notes, ONE_HALL))
    return cells


def leaf_of_cell(cells: Cells) -> Ints:
    """(C,) the leaves that are cells, of cells that are single leaves."""
    return np.flatnonzero(cells.leaf_cell >= 0)


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
    holds = share > 0
    return _in_order(pair[holds] // count, pair[holds] % count, share[holds], cells.leaf_count)


def _in_order(leaf: Ints, source: Ints, share: Floats, leaves: int) -> Ints:
    """(leaves,) the places of leaves in order, given the share that each, ascending, holds of each
    source, ascending: the more of an earlier one, the earlier. A leaf that holds nothing more
    comes last, not first."""
    start = np.searchsorted(leaf, np.arange(leaves + 1))
    source, share = np.append(source, np.iinfo(np.int64).max), np.append(share, 0.0)
    before = np.zeros(leaves, dtype=np.int64)  # how many leaves come before each
    tied, k = np.arange(leaves), 0
    while len(tied):
        at = np.where(start[tied] + k < start[tied + 1], start[tied] + k, len(leaf))
        order = np.lexsort((-share[at], source[at], before[tied]))
        tied, at = tied[order], at[order]
        group = np.diff(before[tied], prepend=-1) > 0
        run = group | (np.diff(source[at], prepend=-1) != 0) | (np.diff(share[at], prepend=-1) != 0)
        row = np.arange(len(tied))
        first_of_run = np.maximum.accumulate(np.where(run, row, 0))
        before[tied] += first_of_run - np.maximum.accumulate(np.where(group, row, 0))
        alone = run & np.append(run[1:], True)
        tied, k = tied[~alone & (at < len(leaf))], k + 1
    rank = np.empty(leaves, dtype=np.int64)
    rank[np.lexsort((np.arange(leaves), before))] = np.arange(leaves)
    return rank


def _groups(cells: Cells, gain: float) -> NDArray[np.integer]:
    rank = rank_in_file(cells)
    room = room_of_leaf(cells, rank)
    if gain >= 1 or len(np.unique(room)) == len(room):
        return room
    inner = cells.portal_leaf[room[cells.portal_leaf[:, 0]] == room[cells.portal_leaf[:, 1]]]
    inner = inner[(cells.leaf_cell[inner] >= 0).all(axis=1)]
    order = np.argsort(rank)
    sees = from_places(sampled_sight(cells), cells.leaf_standing)[np.ix_(order, order)]
    leaf, piece, area = _sides(cells)
    surface = np.bincount(leaf, area[piece], cells.leaf_count).astype(np.float64)
    viewers = cells.leaf_volumes() * cells.leaf_standing
    return join_by_gain(sees, viewers[order], surface[order], rank[inner], gain)[rank]


def _sides(cells: Cells) -> tuple[Ints, Ints, Floats]:
    """(n,) leaves and (n,) pieces of geometry that belong to them, of cells that are single leaves;
    what lies in a boundary counts on both sides. And (M,) the areas of the pieces, m²."""
    front, back = np.append(leaf_of_cell(cells), -1)[cells.triangle_cell].T
    behind = (back >= 0) & (back != front)
    leaf = np.concatenate([front[front >= 0], back[behind]])
    piece = np.concatenate([np.flatnonzero(front >= 0), np.flatnonzero(behind)])
    return leaf, piece, areas(cells.vertex[cells.triangle])
