"""The order of leaves by the model file, and the geometry that each has."""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Floats, Ints, areas
from ptmtools.cells.model import Cells

#: Shares of a triangle that differ by less are equal, in digits.
GAIN_DIGITS = 6


def leaf_of_cell(cells: Cells) -> Ints:
    """(C,) the leaves that are cells, of cells that are single leaves."""
    return np.flatnonzero(cells.leaf_cell >= 0)


def rank_in_file(cells: Cells) -> Ints:
    """(L,) the place of each leaf in an order that no transformation of the model changes: leaves
    are compared by the share that they hold of the model's first triangle of which one of them
    holds more, and go by number where they hold the same of all.

    Leaves themselves are numbered as planes split them, and which side of a plane is its front
    depends on how the model is turned.
    """
    leaf, piece, area = sides(cells)
    source = cells.triangle_source
    count = int(source.max(initial=-1)) + 1
    pair, row = np.unique(leaf * count + source[piece], return_inverse=True)
    held = np.bincount(row, area[piece])
    whole = np.bincount(source, area)[pair % max(count, 1)]
    share = np.round(np.divide(held, whole, out=np.zeros(len(held)), where=whole > 0), GAIN_DIGITS)
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


def sides(cells: Cells) -> tuple[Ints, Ints, Floats]:
    """(n,) leaves and (n,) their pieces of geometry, of cells that are single leaves; pieces in a
    boundary count on both sides. And (M,) the areas of the pieces, m²."""
    front, back = np.append(leaf_of_cell(cells), -1)[cells.triangle_cell].T
    behind = (back >= 0) & (back != front)
    leaf = np.concatenate([front[front >= 0], back[behind]])
    piece = np.concatenate([np.flatnonzero(front >= 0), np.flatnonzero(behind)])
    return leaf, piece, areas(cells.vertex[cells.triangle])
