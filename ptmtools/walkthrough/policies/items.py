"""The item buffer that a client has at hand: one that it drew some frames ago, or, in a browser,
the last that could be read back by then. It shows the geometry that was there as it was drawn."""

from __future__ import annotations

import math
from bisect import bisect_right
from typing import NamedTuple

import numpy as np

from ptmtools.arrays import Bools, Ints
from ptmtools.walkthrough.client import Client


class Item(NamedTuple):
    """An item buffer.

    Attributes
    ----------
    view: of `World.views`. frame: in which it was drawn.
    there: (C,) whose geometry it shows. missing: cells of which it shows placeholders.
    """

    view: int
    frame: int
    there: Bools
    missing: Ints


class Items:
    """Those of a client."""

    def __init__(self, client: Client) -> None:
        self._client = client
        self._frame = 0
        #: At each look, what was there; since when geometry is, and the cells that were gone by.
        self._there: list[Bools] = []
        self._since = np.full(client.world.catalogue.cell_count, math.inf)
        self._times: list[float] = []
        self._cells: list[int] = []

    def note(self) -> None:
        """Something may have arrived, or the client gone by another cell."""
        client, now = self._client, self._client.link.now
        self._since[client.geometry.whole & np.isinf(self._since)] = now
        if client.cell >= 0 and self._cells[-1:] != [client.cell]:
            self._times.append(now)
            self._cells.append(client.cell)

    def look(self) -> None:
        """The client looks."""
        self._there.append(self._client.geometry.whole)
        self.note()

    def glance(self, frame: int) -> bool:
        """The client is at a frame; whether that has another item buffer than the one before."""
        drawn, before = self._client.world.drawn, self._frame
        self._frame = frame
        return drawn is not None and drawn[before] != drawn[frame]

    def at_hand(self, age: int) -> Item | None:
        """The item buffer that is so many frames old, or a browser's last, or None."""
        client, world = self._client, self._client.world
        stock = world.catalogue
        if world.drawn is None:
            frame = max(0, client.frame - age)
            known, whole = stock.visible[client.cell], client.geometry.whole
            missing = known[~whole[known]]
            return Item(int(world.view[frame]), frame, self._there[frame], missing)
        frame = int(world.drawn[self._frame])
        if frame < 0:
            return None
        there = self._since <= world.time[frame]
        entered = bisect_right(self._times, world.time[frame]) - 1
        known = stock.visible[self._cells[entered]] if entered >= 0 else np.zeros(0, np.int64)
        return Item(int(world.view[self._frame]), frame, there, known[~there[known]])
