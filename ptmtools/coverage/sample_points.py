"""The sample points of a cell: the usable positions from which its six views are drawn.

Points inside a solid or too near to a surface are rejected and counted (`solids`); the next of the
sequence, or of the same part of the cell, takes their place.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ptmtools.arrays import Bools, Floats
from ptmtools.coverage.placement import FILLED, TRIES, CellVolume, sobol
from ptmtools.coverage.solids import SampleObstacles

#: Points of a sequence that are tried together, at least.
BATCH = 64


@dataclass(frozen=True)
class SamplePoints:
    """K sample points."""

    position: Floats  # (K, 3) metres, world coordinates
    near: Floats  # (K,) metres within which each has no surface
    shift: Floats  # (K, 2) in (-1, 1): halves of a pixel, how far right and up its views are drawn

    def __len__(self) -> int:
        return len(self.position)

    def part(self, rows: slice) -> SamplePoints:
        """A subset of the points."""
        return SamplePoints(self.position[rows], self.near[rows], self.shift[rows])

    @staticmethod
    def join(parts: list[SamplePoints]) -> SamplePoints:
        """Concatenates the points of several."""
        columns = zip(*(vars(part).values() for part in parts), strict=True)
        return SamplePoints(*(np.concatenate(column) for column in columns))


@dataclass
class PointFinder:
    """Finds usable points in one cell, ``clearance`` metres from all surfaces.

    ``rejected`` counts the points that were rejected so far; the best of them is kept in case no
    point is usable.
    """

    volume: CellVolume
    obstacles: SampleObstacles
    clearance: float
    rejected: int = 0
    _best: tuple[bool, float, Floats] | None = field(default=None, init=False)

    def usable(self, points: Floats) -> Bools:
        """(n,) which of the (n, 3) points are usable; counts none of them."""
        free = self.obstacles.clearance(points, self.clearance)
        outside = ~self.obstacles.in_solid(points)
        good = (free >= self.clearance) & outside
        if not good.any():
            for i in np.lexsort((free, outside))[-1:]:
                candidate = (bool(outside[i]), float(free[i]), points[i])
                if self._best is None or candidate[:2] > self._best[:2]:
                    self._best = candidate
        return np.asarray(good)

    def of_parts(self, count: int, seed: int) -> SamplePoints:
        """One point of each of ``count`` equal parts of the cell; a part without a usable one,
        such as one filled by a statue, gives none."""
        chosen = []
        shift = sobol(0, count, seed)[:, 4:]
        parts = [] if self.volume.empty else self.volume.parts(count, seed)
        for number, part in enumerate(parts):
            first = self.usable(part[:1])
            good = np.flatnonzero(first if first[0] else self.usable(part))
            self.rejected += int(good[0]) if len(good) else len(part)
            chosen += [np.append(part[i], shift[number]) for i in good[:1]]
        rows = np.array(chosen).reshape(-1, 5)
        return self.samples_at(rows[:, :3], rows[:, 3:])

    def samples_at(self, points: Floats, unit: Floats) -> SamplePoints:
        """Sample points at usable positions, shifted by two coordinates in (0, 1) each."""
        return SamplePoints(points, np.full(len(points), self.clearance), 2 * unit - 1)

    def least_bad(self) -> SamplePoints:
        """The fallback if no point is usable: a point outside solids, if possible, and farthest
        from all surfaces. None in a cell without volume."""
        if self._best is None:
            return self.samples_at(np.zeros((0, 3)), np.zeros((0, 2)))
        _, free, point = self._best
        # On the surface itself no clearance is right, but the near plane needs one.
        near = free or self.clearance * np.finfo(np.float32).eps
        return SamplePoints(point[None], np.array([near]), np.zeros((1, 2)))


class PointSequence:
    """The usable points of one random or scrambled sequence in a cell, in their order."""

    def __init__(self, finder: PointFinder, kind: str, seed: int) -> None:
        """``kind`` is "sobol" or "uniform"."""
        self._finder = finder
        self._draw = finder.volume.sobol if kind == "sobol" else finder.volume.random
        self._seed = seed
        self._next = 0
        self._waiting = np.zeros((0, 5))
        self._good = np.zeros(0, dtype=np.bool_)
        self._rejected = self._asked = 0

    def take(self, count: int) -> SamplePoints:
        """The next ``count`` usable points; fewer if more than `TRIES` in the cell are rejected
        for each, or the box holds hardly any of the cell, contrary to its volume."""
        finder = self._finder
        self._asked += count
        while not finder.volume.empty and int(self._good.sum()) < count:
            limit = TRIES * self._asked
            if self._rejected > limit or self._next > limit / FILLED:
                break
            # Every cell asks for the same stretches, which are computed once.
            size = max(BATCH, self._next // 4 or 1 << (count - 1).bit_length())
            drawn = self._draw(self._next, size, self._seed)
            good = finder.usable(drawn[:, :3])
            self._next += size
            self._rejected += int((~good).sum())
            self._waiting = np.concatenate([self._waiting, drawn])
            self._good = np.concatenate([self._good, good])
        last = np.flatnonzero(self._good)[:count]
        end = int(last[-1]) + 1 if len(last) == count and count else len(self._good)
        taken = self._waiting[last]
        finder.rejected += end - len(last)
        self._waiting, self._good = self._waiting[end:], self._good[end:]
        return finder.samples_at(taken[:, :3], taken[:, 3:])
