"""The client `apo`: octree textures as their paper transmits them (Lacoste et al., §4.2), other
files as in `best`.

An octree is fetched level by level, from the root on, and shown at once as far as it has arrived.
The transmission pauses when the deepest nodes are no larger than a pixel where the object is
nearest; it goes on when the object comes nearer or is visible again.

Our reading, since the paper shows one object: among several in the frustum the one with the fewest
levels is next, the nearest first. Octrees share the link with geometry and textures: the two
alternate by requested bytes, unless one needs nothing. Octrees are the first in texture memory, in
the order of the levels, those in view before those seen earlier.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.rendering.rays import NEAR
from ptmtools_lab.network import FluidLink
from ptmtools_lab.policies.engine import EngineClient
from ptmtools_lab.policies.shares import BEST
from ptmtools_lab.world import World


class ApoClient(EngineClient):
    """The client of the module.

    Attributes
    ----------
    octrees: (O,) numbers of the textures that are octrees.
    distance: (O,) metres to the nearest shape of each in the frustum, infinite without one. wanted:
        (O,) levels that the screen needs; outside the frustum those it needed last.
    """

    def __init__(self, world: World, link: FluidLink, budget: int) -> None:
        stock = world.catalogue
        count = world.relief.octrees.number if world.relief else 0
        # The last texture stands for errors that no download reduces.
        self.octrees: Ints = np.arange(count) + stock.texture_count - 1 - count
        self.distance: Floats = np.full(count, np.inf)
        self.wanted: Ints = np.zeros(count, np.int64)
        self._seen, self._target_levels = np.full(count, -1, np.int64), np.zeros(count, np.int64)
        #: All texture memory, and the bytes by which octrees are ahead of other requests.
        self._total, self._ahead = budget, 0
        differences = stock.differences.copy()
        differences[self.octrees] = 0.0  # so that `best` ignores them
        super().__init__(
            replace(world, catalogue=replace(stock, differences=differences)), link, budget, BEST
        )

    def settle(self) -> None:
        """See `Client.settle`."""
        self._see()
        self._target_levels, _ = self._fill(self.wanted)
        levels, self._all = self._fill(np.minimum(self.wanted, self.have[self.octrees]))
        super().settle()
        self.column[self.octrees] = levels

    def _fetch_one(self) -> bool:
        octree = self._next()
        before = self._asked_bytes()
        if octree is None or self._ahead > 0:
            if super()._fetch_one():
                self._ahead -= self._asked_bytes() - before
                if octree is None:
                    self._ahead = max(self._ahead, 0)
                return True
            self._ahead = 0
        if octree is None:
            return False
        end = int(self.world.catalogue.ends[octree, self._levels_asked(octree) + 1])
        self._range(octree, end, math.inf)
        self._ahead += self._asked_bytes() - before
        return True

    def _see(self) -> None:
        """Updates which octrees are in the frustum, their distances, and the levels that the screen
        needs."""
        stock, shapes = self.world.catalogue, self.world.catalogue.shapes
        self.distance = np.full(len(self.octrees), np.inf)
        if not len(self.octrees):
            return
        met = self.shapes_ahead(int(self.octrees[0]))
        number = shapes.texture[met] - self.octrees[0]
        distance = np.maximum(self.frustum.distance(shapes.low[met], shapes.high[met]), NEAR)
        np.minimum.at(self.distance, number, distance)
        nodes = np.zeros(len(self.octrees))
        np.maximum.at(nodes, number, shapes.side[met, 0] / (distance * self.world.camera.pixel))
        # Nodes of the last level are no larger than a pixel.
        levels = np.ceil(np.log2(np.maximum(nodes, 1.0))).astype(np.int64) + 1
        seen = np.isfinite(self.distance)
        self.wanted = np.where(seen, np.minimum(levels, stock.levels[self.octrees]), self.wanted)
        self._seen[seen] = self.frame

    def _fill(self, limit: Ints) -> tuple[Ints, int]:
        """(O,) levels that fit, at most ``limit``, the coarsest of all first; and the bytes that
        remain."""
        memory = self.world.catalogue.memory[self.octrees]
        levels, remaining = np.zeros_like(limit), self._total
        order = np.lexsort((self.distance, -self._seen)).tolist()
        for k in range(int(limit.max(initial=0))):
            for o in order:
                more = int(memory[o, k + 1] - memory[o, k])
                if k < limit[o] and levels[o] == k and more <= remaining:
                    levels[o] = k + 1
                    remaining -= more
        return levels, remaining

    def _next(self) -> int | None:
        """The octree in the frustum to refine next."""
        candidates = [
            (self._levels_asked(octree), float(self.distance[o]), octree)
            for o, octree in enumerate(self.octrees.tolist())
            if np.isfinite(self.distance[o])
        ]
        first = int(self.octrees[0]) if len(self.octrees) else 0
        coarse = [
            (levels, distance, octree)
            for levels, distance, octree in candidates
            if levels < self._target_levels[octree - first]
        ]
        return min(coarse)[2] if coarse else None

    def _levels_asked(self, octree: int) -> int:
        asked = self.textures.asked[octree]
        return int((self.world.catalogue.ends[octree] <= asked).sum()) - 1

    def _asked_bytes(self) -> int:
        return sum(int(files.asked.sum()) for files in self.files.values())
