"""`lru`: what is in the visible set is fetched whole in the order in which it is met, and what has
not been seen for longest goes first.

What one gets from files and a cache, without any hint but the visible sets.
"""

from __future__ import annotations

import numpy as np

from ptmtools.walkthrough.client import Kind
from ptmtools.walkthrough.network import Link
from ptmtools.walkthrough.policies.engine import CONNECTIONS
from ptmtools.walkthrough.policies.whole import WholeClient
from ptmtools.walkthrough.world import World


class LruClient(WholeClient):
    """See the module."""

    def __init__(self, world: World, link: Link, budget: int) -> None:
        super().__init__(world, link, budget)
        self._queue: list[int] = []
        self._seen = np.full(world.catalogue.texture_count, -1, np.int64)

    def look(self, frame: int) -> None:
        """See `Client.look`."""
        self.frame = frame
        stock, shapes = self.world.catalogue, self.world.catalogue.shapes
        frustum = self.world.frustum(frame)
        there = self.geometry.whole[shapes.cell] & (shapes.texture >= 0)
        met = shapes.texture[there & frustum.meets_boxes(shapes.low, shapes.high)]
        for t in dict.fromkeys(met.tolist()):
            if self._seen[t] < 0:
                self._queue.append(t)
            self._seen[t] = frame
        assert len(self._queue) <= stock.texture_count
        super().look(frame)

    def settle(self) -> None:
        """See `Client.settle`: the finest level that fits, the latest seen first."""
        stock, have = self.world.catalogue, self.have
        self.column[:] = 0
        left = self.budget
        for t in np.argsort(-self._seen, kind="stable").tolist():
            if self._seen[t] < 0:
                break
            fits = int((stock.memory[t, : have[t] + 1] <= left).sum()) - 1
            self.column[t] = max(fits, 0)
            left -= int(stock.memory[t, self.column[t]])

    def fetch(self) -> None:
        """See `Client.fetch`: one after the other, whole."""
        if not self.documents():
            return
        while self._queue and len(self.waiting) < CONNECTIONS:
            self.whole(Kind.TEXTURE, self._queue.pop(0))
