"""Cell-to-cell potentially visible sets, as CSR."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.store.archive import Stored

#: Counts for each portal.
COUNTED = ("work", "ties", "decided", "opened")


@dataclass(frozen=True)
class Pvs:
    """The potentially visible set of each cell. Symmetric; a row is the cell itself, then the
    others, ascending.

    Attributes
    ----------
    start: (C + 1,) int64 CSR over cells.
    cell: (n,) int32 the potentially visible cells; ``cell[start[i]] == i``.
    work: (K,) int64 operations of the search from each portal; empty without a search.
    cut: (K,) bool portals whose search was given up for a looser, still conservative set.
    ties: (K,) int64 near ties of the search from each portal: sequences of portals rejected by less
        than 16 roundings of the arithmetic.
    decided: (K,) int64 near ties that mattered and were decided in double-double arithmetic.
    opened: (K,) int64 decided near ties that let a line pass; see `PortalFlow`.
    leak: (n, 4) int32 cells that see suspiciously much: the cell, how many cells it sees, the
        smallest portal that shows it half of them, and how many that one shows.
    volume: (C,) float64 m³ of each cell, for shares of the building; empty if not known.
    standing: (C,) float64 m³ of each cell with standing room; empty if not known.
    conservative: False for sets sampled by random lines.
    spared: by how much searches that were left out could reduce what visitors hold, as a share;
        0 if they were done.
    """

    start: Ints
    cell: NDArray[np.int32]
    work: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    cut: Bools = field(default_factory=lambda: np.zeros(0, np.bool_))
    ties: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    decided: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    opened: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    leak: NDArray[np.int32] = field(default_factory=lambda: np.zeros((0, 4), np.int32))
    volume: Floats = field(default_factory=lambda: np.zeros(0))
    standing: Floats = field(default_factory=lambda: np.zeros(0))
    conservative: bool = True
    spared: float = 0.0

    @property
    def fallbacks(self) -> int:
        """Portals whose search was cut short."""
        return int(self.cut.sum())

    @property
    def cell_count(self) -> int:
        return len(self.start) - 1

    def row(self, i: int) -> NDArray[np.int32]:
        """The cells that cell ``i`` may see, itself first."""
        return self.cell[self.start[i] : self.start[i + 1]]

    @property
    def average_share(self) -> float:
        """Mean share of all cells that a cell may see, itself included, in [0, 1]."""
        n = self.cell_count
        return float(len(self.cell) / (n * n)) if n else 0.0

    def at_hand(self, size: NDArray[np.number]) -> Floats:
        """(C,) the sum of ``size`` (C,) over the cells that each may see."""
        if not self.cell_count:
            return np.zeros(0)
        return np.add.reduceat(size[self.cell].astype(np.float64), self.start[:-1])

    @property
    def volume_at_hand(self) -> tuple[float, float]:
        """Share of the building's volume that has to be resident, in [0, 1]: the average over
        places, and the maximum. If no volume is known, the share of cells."""
        volume = self.volume if self.volume.any() else np.ones(self.cell_count)
        share = self.at_hand(volume) / max(volume.sum(), np.finfo(float).tiny)
        return over_places(share, self.viewers)

    @property
    def viewers(self) -> Floats:
        """(C,) m³ of each cell with standing room; the whole volume if not known."""
        return self.standing if len(self.standing) else self.volume

    def to_matrix(self) -> Bools:
        """(C, C) dense matrix."""
        n = self.cell_count
        matrix = np.zeros((n, n), dtype=np.bool_)
        matrix[np.repeat(np.arange(n), np.diff(self.start)), self.cell] = True
        return matrix

    @staticmethod
    def from_matrix(matrix: Bools, **attributes: Any) -> Pvs:
        """From a (C, C) symmetric matrix, the diagonal taken as set; further attributes."""
        n = len(matrix)
        rest = matrix & ~np.eye(n, dtype=np.bool_)
        rows = [np.concatenate([[i], np.flatnonzero(rest[i])]) for i in range(n)]
        start = np.concatenate([[0], np.cumsum([len(r) for r in rows])]).astype(np.int64)
        cell = np.concatenate(rows).astype(np.int32) if rows else np.zeros(0, np.int32)
        return Pvs(start, cell, **attributes)

    def to_arrays(self) -> dict[str, NDArray[np.generic]]:
        """The sets as plain arrays."""
        single = {name: np.array([getattr(self, name)]) for name in ("conservative", "spared")}
        return vars(self) | single

    @staticmethod
    def from_arrays(arrays: Mapping[str, NDArray[np.generic]]) -> Pvs:
        """Inverse of `to_arrays`.

        Raises KeyError or ValueError for invalid arrays.
        """
        stored = Stored(arrays)
        entries = stored.array("cell", np.int32, None)
        start = stored.starts("start", None, len(entries))
        cells = len(start) - 1
        stored.indices("cell", np.int32, len(entries), high=cells)
        if (np.diff(start) < 1).any() or (entries[start[:-1]] != np.arange(cells)).any():
            raise ValueError("a row of cell does not begin with its own")
        leak = stored.array("leak", np.int32, None, 4)
        if len(leak) and not 0 <= int(leak[:, 0].min()) <= int(leak[:, 0].max()) < cells:
            raise ValueError("leak has an index out of range")
        volumes = {name: stored.array(name, np.float64, None) for name in ("volume", "standing")}
        for name, volume in volumes.items():
            if len(volume) not in (0, cells) or not ((volume >= 0) & (volume < np.inf)).all():
                raise ValueError(f"{name} is not that of the cells")
        return Pvs(
            start,
            entries,
            **{name: stored.array(name, np.int64, None) for name in COUNTED},
            cut=stored.array("cut", np.bool_, None),
            leak=leak,
            **volumes,
            conservative=bool(stored.array("conservative", np.bool_, 1)[0]),
            spared=float(stored.array("spared", np.float64, 1, finite=True)[0]),
        )


def over_places(values: Floats, volume: Floats) -> tuple[float, float]:
    """The mean of (C,) values of cells over all places, so that a cell counts by the (C,)
    ``volume`` of its standing room, and the maximum; (0, 0) without cells."""
    if not len(values):
        return 0.0, 0.0
    weight = volume if volume.any() else np.ones(len(values))
    return float(np.average(values, weights=weight)), float(values[weight > 0].max())
