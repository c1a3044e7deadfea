"""Placement of the sample points of a cell, spread over its volume (paper §5).

``docs/design/coverage.md`` describes the placements ``sobol``, ``kd`` and ``uniform``. The error
falls as K^-0.8 with the first, as K^-0.5 with the last; ``kd`` is best below sixteen points.
All come with a shift of their views' pixels by less than half a pixel, spread as evenly.

Direction numbers of the Sobol' sequence are those of Joe and Kuo (2008), "Constructing Sobol
sequences with better two-dimensional projections"; scrambling is Owen's nested uniform one (1995):
every digit is turned over or not by a hash of the digits before it, so each point alone is uniform
and aligned blocks of the sequence stay nets. Only integers are used, so the points depend on the
shape of the cell and the seed alone, not on a machine, a library, the unit or other cells.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bits, Floats, Ints, volumes
from ptmtools.cells.model import Cells, EyeRegion

#: Binary digits of a coordinate.
DIGITS = 32
#: Dimensions: three for the position, a fourth for the choice among parts, two for the shift
#: within a pixel.
DIMENSIONS = 6
#: Primitive polynomials (degree, coefficients between the ends) and first direction numbers of
#: the dimensions after the first.
_POLYNOMIALS = (
    (1, 0, (1,)),
    (2, 1, (1, 3)),
    (3, 1, (1, 3, 1)),
    (3, 2, (1, 1, 1)),
    (4, 1, (1, 1, 3, 3)),
)


def _directions() -> NDArray[np.uint32]:
    """(DIMENSIONS, DIGITS) direction numbers, scaled by 2^32."""
    directions = [[1 << (DIGITS - 1 - k) for k in range(DIGITS)]]
    for degree, middle, first in _POLYNOMIALS:
        m = [v << (DIGITS - 1 - k) for k, v in enumerate(first)]
        for k in range(degree, DIGITS):
            v = m[k - degree] ^ (m[k - degree] >> degree)
            for i in range(1, degree):
                if middle >> (degree - 1 - i) & 1:
                    v ^= m[k - i]
            m.append(v)
        directions.append(m)
    return np.array(directions, dtype=np.uint32)


_DIRECTIONS = _directions()


@lru_cache(maxsize=256)
def sobol(first: int, count: int, seed: int) -> Floats:
    """(count, DIMENSIONS) points ``first`` … of the sequence scrambled by ``seed``, in (0, 1); not
    to be written to, since every cell asks for the same ones.

    Stretches of one seed belong to one sequence; two seeds are independent.
    """
    index = np.arange(first, first + count, dtype=np.uint64)
    point = np.zeros((count, DIMENSIONS), dtype=np.uint32)
    for k in range(max(1, int(first + count).bit_length())):
        bit = (index >> np.uint64(k) & np.uint64(1)).astype(bool)
        point[bit] ^= _DIRECTIONS[:, k]
    points = (_scramble(point, seed) + 0.5) * 2.0**-DIGITS
    points.setflags(write=False)
    return np.asarray(points)


def uniform(first: int, count: int, seed: int) -> Floats:
    """(count, DIMENSIONS) independent random points ``first`` … in (0, 1), by hashing numbers."""
    number = np.arange(DIMENSIONS * first, DIMENSIONS * (first + count), dtype=np.uint64)
    drawn = _hash(number.reshape(count, DIMENSIONS), _seed_hash(seed, 1))
    return np.asarray(((drawn >> np.uint64(11)).astype(np.float64) + 0.5) * 2.0**-53)


def _scramble(point: NDArray[np.uint32], seed: int) -> NDArray[np.uint32]:
    dimension = _hash(np.arange(DIMENSIONS, dtype=np.uint64), _seed_hash(seed, 0))
    turned = np.zeros_like(point)
    before = np.zeros(point.shape, dtype=np.uint64)
    for digit in range(DIGITS):
        # The digits before this one, a leading 1 to tell their number, and the dimension.
        place = before | np.uint64(1) << np.uint64(digit)
        flip = (_hash(place, dimension) >> np.uint64(63)).astype(np.uint32)
        turned |= flip << np.uint32(DIGITS - 1 - digit)
        bit = point >> np.uint32(DIGITS - 1 - digit) & np.uint32(1)
        before = before << np.uint64(1) | bit
    return point ^ turned


def _seed_hash(seed: int, stream: int) -> Bits:
    return _hash(np.array([seed], dtype=np.uint64), np.array([stream], dtype=np.uint64))


def _hash(value: Bits, key: Bits) -> Bits:
    """The finaliser of SplitMix64 (Steele, Lea and Flood 2014), twice, the key between."""

    def mix(x: Bits) -> Bits:
        x = x + np.uint64(0x9E3779B97F4A7C15)
        x = (x ^ x >> np.uint64(30)) * np.uint64(0xBF58476D1CE4E5B9)
        x = (x ^ x >> np.uint64(27)) * np.uint64(0x94D049BB133111EB)
        return x ^ x >> np.uint64(31)

    return mix(mix(value) ^ key)


#: Points of the cloud that is divided into parts, for each part: enough that parts of equal count
#: are parts of equal volume within a few percent.
CLOUD = 256
#: Candidate points of a part of the cell, evenly picked from its share of the cloud.
TRIES = 32
#: A cell that fills less than this share of its bounding box is filled by tetrahedra.
FILLED = 1 / 32
#: The (n, 4, 3) tetrahedra of a cell, and their (n,) volumes.
Room = tuple[Floats, Floats]


def filling(tetra: Floats, volume: Floats, unit: Floats) -> Floats:
    """(m, 3) points in the union of (n, 4, 3) tetrahedra with (n,) volumes, uniform if the (m, 4 or
    more) coordinates in (0, 1) are: the first three place a point in a tetrahedron, the fourth
    chooses the tetrahedron."""
    share = np.cumsum(volume)
    which = np.minimum(np.searchsorted(share / share[-1], unit[:, 3], "right"), len(tetra) - 1)
    # The gaps between three sorted numbers and the ends of [0, 1] are uniform barycentric
    # coordinates.
    cut = np.sort(unit[:, :3], axis=1)
    weight = np.diff(cut, axis=1, prepend=0.0, append=1.0)
    base = tetra[which, 0]
    offset = np.einsum("ij,ijk->ik", weight[:, 1:], tetra[which, 1:] - base[:, None])
    return np.asarray(base + offset, dtype=np.float64)


class CellVolume:
    """The volume of a cell to place points in.

    Attributes
    ----------
    tetrahedra, volume: (n, 4, 3) metres and (n,) m³, disjoint, none flat, together the cell.
    boxed: whether the cell fills enough of its bounding box.
    """

    def __init__(self, cells: Cells, cell: int, eyes: EyeRegion, room: Room) -> None:
        self._cells, self._cell, self._eyes = cells, cell, eyes
        self.tetrahedra, self.volume = room
        self.empty = len(self.tetrahedra) == 0
        if not self.empty:
            points = self.tetrahedra.reshape(-1, 3)
            low, high = eyes.clip(points.min(axis=0), points.max(axis=0))
            self._low, self._size = low, np.maximum(high - low, 0.0)
            size = float(np.prod(np.ptp(points, axis=0)))
            self.boxed = float(self.volume.sum()) / size >= FILLED

    @staticmethod
    def of_cells(cells: Cells) -> list[CellVolume]:
        """All cells; those without standing room are empty."""
        tetrahedra, leaf = cells.tetrahedra()
        volume = volumes(tetrahedra)
        cell = np.where(cells.leaf_standing, cells.leaf_cell, -1)[leaf]
        order = np.argsort(cell, kind="stable")
        order = order[volume[order] > 0]
        rows = np.split(order, np.searchsorted(cell[order], np.arange(cells.cell_count)))[1:]
        eyes = cells.eyes
        return [
            CellVolume(cells, c, eyes, (tetrahedra[rows[c]], volume[rows[c]]))
            for c in range(cells.cell_count)
        ]

    @property
    def everywhere(self) -> bool:
        """Whether eyes may be anywhere in the cell."""
        return self.empty or self._eyes.everywhere

    def anywhere(self) -> CellVolume:
        """The same leaves, with eyes anywhere in them."""
        everywhere = EyeRegion(np.zeros((0, 3, 3)), self._cells.walker)
        return CellVolume(self._cells, self._cell, everywhere, (self.tetrahedra, self.volume))

    def random(self, first: int, count: int, seed: int) -> Floats:
        """(at most count, 5) independent points ``first`` …: positions in metres, and two more
        coordinates in (0, 1)."""
        return self._fill(uniform(first, count, seed))

    def sobol(self, first: int, count: int, seed: int) -> Floats:
        """(at most count, 5) points ``first`` … of a scrambled sequence, those in the cell: their
        positions in metres, and two more coordinates in (0, 1)."""
        unit = sobol(first, count, seed)
        if self.empty or not self.boxed:
            return self._fill(unit)
        points = self._low + unit[:, :3] * self._size
        leaf = self._cells.locate_leaf(points)
        inside = (leaf >= 0) & (self._cells.leaf_cell[leaf] == self._cell)
        inside &= self._cells.leaf_standing[leaf]
        inside[inside] = self._eyes.contains(points[inside])
        return np.hstack([points[inside], unit[inside, 4:]])

    def parts(self, count: int, seed: int) -> list[Floats]:
        """For each of ``count`` equal parts of the cell (TRIES, 3) points, from its centroid
        outwards."""
        points = self._fill(sobol(0, CLOUD * count, seed))[:, :3]
        groups = strata(points, count) if len(points) >= count else []
        return [points[group[:: -(-len(group) // TRIES)]] for group in groups]

    def _fill(self, unit: Floats) -> Floats:
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
        members = points[group]
        if share == 1:
            away = np.sum((members - members.mean(axis=0)) ** 2, axis=1)
            done.append(group[np.argsort(away, kind="stable")])
            continue
        axis = int(np.argmax(np.ptp(members, axis=0)))
        order = group[np.argsort(members[:, axis], kind="stable")]
        low = share // 2
        middle = len(order) * low // share
        pending.append((order[middle:], share - low))
        pending.append((order[:middle], low))
    return done
