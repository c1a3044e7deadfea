"""Where the sample points of a cell lie: spread over its volume.

The paper takes "samples per cell whose COPs are uniformly distributed inside the cell" (§5).
Position matters far more than resolution (docs/design/coverage.md), so there is a choice of how:

``sobol``
    A scrambled Sobol' sequence in the cell's bounding box, of which the points in the cell are
    kept. Any number of points is evenly spread, and more can be added: the error falls as K^-0.8.
    Where hardly any of the box is cell, as with a thin slanting one, the sequence fills the
    tetrahedra of its leaves instead, with a fourth dimension for the choice among them.
``kd``
    The volume is halved again and again along its longest axis into as many parts of equal volume
    as there are points, and of each part the point nearest to its centroid is taken: best below
    some sixteen points.
``uniform``
    Independent random points, as in the paper: K^-0.5.

All come with a shift of their views' pixels by less than half a pixel, spread as evenly: with the
same few pixel centres at every point no number of points would be enough.

A cell is a union of disjoint convex leaves. Points are where eyes can be: in those of its leaves in
which somebody can stand, and there in the eye region (`ptmtools.cells.eyes`). They depend on
nothing but its shape and the seed: not on other cells, the unit, the number of workers or the
version of a library.
"""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.cells.eyes import EyeRegion
from ptmtools.cells.model import Cells
from ptmtools.cells.vectors import volumes
from ptmtools.coverage.sobol import sobol, uniform

#: Points of the cloud that is divided into parts, for each part: enough that parts of equal count
#: are parts of equal volume within a few percent.
CLOUD = 256
#: Points that a part of the cell offers, evenly picked from its share of the cloud.
TRIES = 32
#: A cell that fills less than this share of its bounding box is filled by tetrahedra.
FILLED = 1 / 32
#: The (n, 4, 3) tetrahedra of a cell, and their (n,) volumes.
Room = tuple[Floats, Floats]


def filling(tetra: Floats, volume: Floats, unit: Floats) -> Floats:
    """(m, 3) points, uniform in the union of (n, 4, 3) tetrahedra with (n,) volumes if the (m, 4 or
    more) coordinates in (0, 1) are: the first three tell where in a tetrahedron, the fourth in
    which."""
    share = np.cumsum(volume)
    which = np.minimum(np.searchsorted(share / share[-1], unit[:, 3], "right"), len(tetra) - 1)
    # The gaps between three sorted numbers and the ends of [0, 1] are uniform barycentric
    # coordinates.
    cut = np.sort(unit[:, :3], axis=1)
    weight = np.diff(cut, axis=1, prepend=0.0, append=1.0)
    base = tetra[which, 0]
    offset = np.einsum("ij,ijk->ik", weight[:, 1:], tetra[which, 1:] - base[:, None])
    return np.asarray(base + offset, dtype=np.float64)


class Volume:
    """A cell as something to put points into.

    Attributes
    ----------
    tetrahedra, volume: (n, 4, 3) metres and (n,) m³, disjoint, none flat, together the cell.
    boxed: whether enough of its bounding box is cell.
    """

    def __init__(self, cells: Cells, cell: int, eyes: EyeRegion, room: Room) -> None:
        self._cells, self._cell, self._eyes = cells, cell, eyes
        self.tetrahedra, self.volume = room
        self.empty = len(self.tetrahedra) == 0
        if not self.empty:
            points = self.tetrahedra.reshape(-1, 3)
            low, high = eyes.clipped(points.min(axis=0), points.max(axis=0))
            self._low, self._size = low, np.maximum(high - low, 0.0)
            size = float(np.prod(np.ptp(points, axis=0)))
            self.boxed = float(self.volume.sum()) / size >= FILLED

    @staticmethod
    def of_cells(cells: Cells) -> list[Volume]:
        """All cells; those in which nobody can stand are empty."""
        tetrahedra, leaf = cells.tetrahedra()
        volume = volumes(tetrahedra)
        cell = np.where(cells.leaf_standing, cells.leaf_cell, -1)[leaf]
        order = np.argsort(cell, kind="stable")
        order = order[volume[order] > 0]
        rows = np.split(order, np.searchsorted(cell[order], np.arange(cells.cell_count)))[1:]
        eyes = cells.eyes
        return [
            Volume(cells, c, eyes, (tetrahedra[rows[c]], volume[rows[c]]))
            for c in range(cells.cell_count)
        ]

    @property
    def everywhere(self) -> bool:
        """Whether eyes may be anywhere in it."""
        return self.empty or self._eyes.everywhere

    def anywhere(self) -> Volume:
        """The same leaves, with eyes anywhere in them."""
        everywhere = EyeRegion(np.zeros((0, 3, 3)), self._cells.walker)
        return Volume(self._cells, self._cell, everywhere, (self.tetrahedra, self.volume))

    def random(self, first: int, count: int, seed: int) -> Floats:
        """(at most count, 5) independent points ``first`` …: positions in metres, and two more
        coordinates in (0, 1)."""
        return self._filled(uniform(first, count, seed))

    def sobol(self, first: int, count: int, seed: int) -> Floats:
        """(at most count, 5) points ``first`` … of a scrambled sequence, those in the cell: their
        positions in metres, and two more coordinates in (0, 1)."""
        unit = sobol(first, count, seed)
        if self.empty or not self.boxed:
            return self._filled(unit)
        points = self._low + unit[:, :3] * self._size
        leaf = self._cells.locate_leaf(points)
        inside = (leaf >= 0) & (self._cells.leaf_cell[leaf] == self._cell)
        inside &= self._cells.leaf_standing[leaf]
        inside[inside] = self._eyes.contains(points[inside])
        return np.hstack([points[inside], unit[inside, 4:]])

    def parts(self, count: int, seed: int) -> list[Floats]:
        """For each of ``count`` equal parts of the cell (TRIES, 3) points, from its centroid
        outwards."""
        points = self._filled(sobol(0, CLOUD * count, seed))[:, :3]
        groups = strata(points, count) if len(points) >= count else []
        return [points[group[:: -(-len(group) // TRIES)]] for group in groups]

    def _filled(self, unit: Floats) -> Floats:
        if self.empty:
            return np.zeros((0, 5))
        points = filling(self.tetrahedra, self.volume, unit)
        inside = self._eyes.contains(points)
        return np.hstack([points[inside], unit[inside, 4:]])


def strata(points: Floats, parts: int) -> list[Ints]:
    """Indices of the (n, 3) points in ``parts`` groups of equal size, compact in space.

    Each group is halved across its longest axis; an odd number of parts is divided as evenly as
    it goes. Within a group the points are in order of their distance from its centroid.
    """
    pending = [(np.arange(len(points), dtype=np.int64), parts)]
    done: list[Ints] = []
    while pending:
        group, share = pending.pop()
        here = points[group]
        if share == 1:
            away = np.sum((here - here.mean(axis=0)) ** 2, axis=1)
            done.append(group[np.argsort(away, kind="stable")])
            continue
        axis = int(np.argmax(np.ptp(here, axis=0)))
        order = group[np.argsort(here[:, axis], kind="stable")]
        low = share // 2
        middle = len(order) * low // share
        pending.append((order[middle:], share - low))
        pending.append((order[:middle], low))
    return done
