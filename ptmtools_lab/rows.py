"""Rows of the tables along a walk: sums of the errors of a frame by pair of cell and texture."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Ints, Singles


class ViewRows(NamedTuple):
    """ViewRows of `ptmtools_lab.tables.WalkViews`, and (R,) the frame of each, ascending."""

    frame: Ints
    cell: NDArray[np.int32]
    texture: NDArray[np.int32]
    error: Singles
    square: Singles
    need: Singles
    sight: Singles


class RowSums:
    """Collects the rows of frames.

    Parameters
    ----------
    keys: (k, 2) pairs of cell and texture, each any number of times.
    levels: number of levels that pixels may want. states: number of states with an error, besides
        those of nothing and of the mean colour.
    seen: (n,) which pixels belong to the item buffer of a client.

    Attributes
    ----------
    pair: (k,) the pair of each key.
    sums: tables for the kernels, by pair; ``pair`` is that of the keys.
    """

    def __init__(
        self, keys: Ints | NDArray[np.int32], levels: int, states: int, seen: Bools
    ) -> None:
        from ptmtools.rendering.kernels import Sums

        self._pairs, pair = np.unique(keys, axis=0, return_inverse=True)
        self.pair: Ints = pair.reshape(-1).astype(np.int64)
        wide = (states + 2, states + 2, levels, levels)
        self.sums = Sums(self.pair, *(np.zeros((len(self._pairs), n)) for n in wide))
        self._pixels = (len(seen), len(seen), len(seen), max(int(seen.sum()), 1))
        #: Pairs, and rows of each table: first of no frame, then of each.
        self._shown = [np.zeros(0, np.int64)]
        self._rows = [[np.zeros((0, n), np.float32)] for n in wide]

    def end_frame(self, shown: Bools) -> None:
        """Makes rows of the sums of the (P,) ``shown`` pairs, and clears them."""
        pairs = np.flatnonzero(shown)
        self._shown.append(pairs)
        for rows, table, pixels in zip(self._rows, self.sums[1:], self._pixels, strict=True):
            rows.append((table[pairs] / pixels).astype(np.float32))
            table[pairs] = 0.0

    def rows(self) -> ViewRows:
        """The rows of all frames."""
        count = [len(pairs) for pairs in self._shown[1:]]
        cell, texture = self._pairs[np.concatenate(self._shown)].astype(np.int32).T
        tables = map(np.concatenate, self._rows)
        return ViewRows(np.repeat(np.arange(len(count)), count), cell, texture, *tables)
