"""The engine that all policies but the paper's share: it fetches what is worth most for its bytes.

A policy says what each level of each texture, and the geometry of each cell, is worth now. The
engine chooses what should be in texture memory, to the last level that fits, and asks for what of
that is missing, the greatest worth per byte first, in ranges of a fraction of a second, so that
little is under way that may not be wanted any more. When nothing is missing it goes on with what is
worth most beyond the budget, which stays in main memory.

Records and geometry compete with textures by the same measure: a cell whose geometry is missing is
grey, and worth the error of that. Both are asked for whole: browsers get no ranges of what a server
compresses on its way. The first cell's geometry does not wait for its record: a latency less of
grey is worth 5 % of the error of 150 s at half a megabit a second, and nothing at 56 kbit/s.

The item buffer that a client has at hand: one that it drew some frames ago, or, in a browser,
the last that could be read back by then. It shows the geometry that was there as it was drawn.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.lab.allocation import allocate, gather, holes, next_fetch
from ptmtools.lab.client import Client, Kind
from ptmtools.lab.network import Link, Request
from ptmtools.lab.world import World


class Item(NamedTuple):
    """An item buffer.

    Attributes
    ----------
    view: of `World.views`. frame: in which it was drawn.
    there: (C,) whose geometry it shows. missing: cells of which it shows placeholders.
    """

    view: int
    frame: int
    loaded: Bools
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
        loaded = self._since <= world.time[frame]
        entered = bisect_right(self._times, world.time[frame]) - 1
        known = stock.visible[self._cells[entered]] if entered >= 0 else np.zeros(0, np.int64)
        return Item(int(world.view[self._frame]), frame, loaded, known[~loaded[known]])


#: A range takes so many seconds of the link, and at least so many bytes.
RANGE_SECONDS, RANGE_BYTES = 0.2, 8000
#: Requests at a time.
CONNECTIONS = 6
#: Bytes of the headers of a request, and the most that waiting counts, of links without a limit.
OVERHEAD, LONGEST_WAIT = 300, 1 << 20
#: What a pixel is wrong by where there is nothing: the mean of what was measured, 0 to 255.
NOTHING = 64.0
#: The record of a neighbouring cell is worth as much as so large a share of the screen.
RECORD_SHARE = 0.005
#: A level that is not wanted any more is held on to, at so small a share of its worth, which
#: halves in so many seconds.
HELD_ON, HELD_SECONDS = 1e-3, 7.0


@dataclass(frozen=True)
class Worth:
    """What a policy says.

    Attributes
    ----------
    hold: (T, K) what each column adds on the screen now, beside those before it.
    fetch: (T, K) what it adds now and soon.
    geometry: (C,) what the geometry of a cell adds.
    ahead: (T, K) what may be fetched beyond the budget; None: nothing.
    exact: see `allocate`.
    """

    hold: Floats
    fetch: Floats
    geometry: Floats
    ahead: Floats | None = None
    exact: bool = False


class Policy(Protocol):
    """What a policy of the engine is."""

    def __call__(self, client: EngineClient) -> Worth:
        """What things are worth at the client's frame, by what the client may know."""


class EngineClient(Client):
    """A client that goes by a policy, which may need the statistics."""

    def __init__(
        self, world: World, link: Link, budget: int, policy: Policy, *, statistics: bool = False
    ) -> None:
        super().__init__(world, link, budget)
        self._policy, self._statistics = policy, statistics
        stock = world.catalogue
        self._target: Ints = np.zeros(stock.texture_count, np.int64)
        self._kept = np.zeros(stock.ends.shape)
        self._worth: Worth | None = None
        self._items, self._looked = Items(self), -math.inf
        #: With what is there twice while it grows.
        self._all = budget
        # Of a browser: what is kept free, and the cell in which it began.
        self._reserve, self._since = 0, -1
        self.frustum = world.frustum(0)

    # What policies look at.

    def sight(self, age: int) -> Floats:
        """(T, K) the share of the item buffer that wants each level, in columns, as it was drawn
        so many frames ago: with the geometry that was there."""
        result = np.zeros(self.world.catalogue.ends.shape)
        item, views = self._items.at_hand(age), self.world.views
        if item:
            rows = views.rows(item.view)
            gather(
                rows.start, rows.stop, views.cell, views.texture, views.sight, item.loaded, result
            )
        return result

    def placeholders(self, age: int) -> Floats:
        """(C,) the share of the item buffer, so many frames old, that shows placeholders: of cells
        that may be seen and whose geometry is not there, the far faces of their boxes."""
        stock, world = self.world.catalogue, self.world
        share = np.zeros(stock.cell_count)
        item = self._items.at_hand(age)
        if item and len(item.missing):
            loaded = item.loaded if world.browser else self.geometry.whole
            rays, _ = world.camera.rays(world.direction[item.frame : item.frame + 1])
            holes(
                rays.reshape(-1, 3)[world.camera.sparse], world.views.owner[item.view],
                world.views.depth[item.view], world.eye[item.frame], stock.low, stock.high, loaded,
                item.missing, share,
            )  # fmt: skip
        return share

    def known(self) -> Ints:
        """The cells that the one the client is in may see, itself first."""
        return self.world.catalogue.visible[self.cell]

    def coverage(self) -> Floats:
        """Average coverage hints, aligned with `known`."""
        return self.world.catalogue.coverage[self.cell]

    def loaded_shapes(self) -> Ints:
        """The shapes with a texture of the cells whose geometry is there."""
        stock = self.world.catalogue
        loaded = self.geometry.whole[stock.shapes.cell] & (stock.shapes.texture >= 0)
        return np.flatnonzero(loaded)

    # What the engine does.

    def look(self, frame: int) -> None:
        """See `Client.look`."""
        self.frustum = self.world.frustum(frame)
        self._items.look()
        super().look(frame)

    def glance(self, frame: int) -> None:
        """See `Client.glance`."""
        if self._items.glance(frame):
            self._weigh()

    def settle(self) -> None:
        """See `Client.settle`."""
        here = int(self.world.cell[self.frame])
        if here != self._since:
            self._reserve, self._since = 0, here
        self.budget = self._all - self._reserve
        self._weigh()
        if self._worth is None:
            return
        hold, exact = self._worth.hold, self._worth.exact
        now = float(self.world.time[self.frame])
        fading = 0.5 ** ((now - self._looked) / HELD_SECONDS)
        self._looked = now
        self._kept = np.maximum(self._kept * fading, hold)
        stock = self.world.catalogue
        worth = hold + HELD_ON * self._kept + HELD_ON**2 * stock.differences
        allocate(worth, stock.memory, self.have, self.budget, self.column, exact)
        while self.world.browser and self._grow():
            self.budget = self._all - self._reserve
            allocate(worth, stock.memory, self.have, self.budget, self.column, exact)

    def arrived(self, request: Request) -> None:
        """See `Client.arrived`."""
        super().arrived(request)
        if request.tag.kind != Kind.TEXTURE:  # type: ignore[attr-defined]
            if self.cell < 0 and self.records.whole[self.world.cell[self.frame]]:
                self.cell = int(self.world.cell[self.frame])
            self._items.note()
            self._weigh()

    def _grow(self) -> bool:
        """Whether more must be kept free for what is there twice while it grows: the greatest
        texture less its finest level, at most half. From now on it is, for as long as the client
        is in the cell, lest a level go in and out."""
        column, memory = self.column, self.world.catalogue.memory
        need = int(memory[np.arange(len(column)), np.maximum(column - 1, 0)].max(initial=0))
        more = min(need, self._all // 2)
        grown = more > self._reserve
        self._reserve = max(more, self._reserve)
        return grown

    def _weigh(self) -> None:
        if self.cell >= 0 and (self.files[Kind.STATISTICS].whole[0] or not self._statistics):
            stock = self.world.catalogue
            self._worth = self._policy(self)
            fetch, exact = self._worth.fetch, self._worth.exact
            allocate(fetch, stock.memory, stock.levels, self.budget, self._target, exact)

    def fetch(self) -> None:
        """See `Client.fetch`."""
        while self._room() and self._fetch_one():
            pass

    def _room(self) -> bool:
        """Whether the link would run dry before a request made later could be answered."""
        if len(self.waiting) >= CONNECTIONS:
            return False
        left = sum(request.left for request in self.waiting)
        ahead = self.estimate.latency + RANGE_SECONDS / 2
        return left == 0 or 8 * left < ahead * self.estimate.bandwidth

    def _fetch_one(self) -> bool:
        """Asks for the range that is worth most; False if there is none."""
        if not self.index:
            return self._whole(Kind.INDEX, 0, math.inf)
        if self._statistics and self._whole(Kind.STATISTICS, 0, math.inf):
            return True
        here = int(self.world.cell[self.frame])
        if self._whole(Kind.RECORD, here, math.inf):
            return True
        if self.cell < 0 and self._whole(Kind.GEOMETRY, here, math.inf):
            return True
        if self._worth is None:
            return False
        stock, worth = self.world.catalogue, self._worth
        asked, overhead = self._asked(), self._overhead()
        best, texture, column = next_fetch(worth.fetch, stock.ends, asked, self._target, overhead)
        size = np.maximum(self.geometry.size, 1)
        density = np.where(self.geometry.asked == 0, worth.geometry / size, 0.0)
        cell = int(density.argmax())
        records = [c for c in stock.adjacent[self.cell].tolist() if not self.records.asked[c]]
        if records:
            least = min(records, key=lambda c: int(self.records.size[c]))
            record = NOTHING * RECORD_SHARE / float(self.records.size[least])
            if record > max(best, float(density[cell])):
                return self._whole(Kind.RECORD, least, record)
        if density[cell] > best:
            return self._whole(Kind.GEOMETRY, cell, float(density[cell]))
        if texture < 0 and worth.ahead is not None:
            best, texture, column = next_fetch(
                worth.ahead, stock.ends, asked, stock.levels, overhead
            )
        if texture < 0:
            return False
        return self._range(texture, int(stock.ends[texture, column]), best)

    def _asked(self) -> Ints:
        """(T,) bytes of each texture from its beginning that are not to be asked for: with one
        range a file at a time, all of what is on the way."""
        asked = self.textures.asked
        if not self.world.one_range:
            return asked
        under_way = asked > self.textures.loaded
        return np.where(under_way, self.textures.size, asked)

    def _overhead(self) -> int:
        """Bytes that a request costs besides its own: headers, and what its connection could have
        brought while it waits. So of a fast link more levels are asked for at once."""
        latency, bandwidth = self.estimate.latency, self.estimate.bandwidth
        waiting = latency * bandwidth / 8 / CONNECTIONS if latency else 0.0
        return OVERHEAD + int(min(waiting, LONGEST_WAIT))

    def _whole(self, kind: Kind, number: int, priority: float) -> bool:
        files = self.files[kind]
        if files.asked[number]:
            return False
        self.ask(kind, number, int(files.size[number]), priority)
        return True

    def _range(self, texture: int, end: int, priority: float) -> bool:
        most = max(RANGE_BYTES, RANGE_SECONDS * self.estimate.bandwidth / 8)
        asked = int(self.textures.asked[texture])
        if end - asked > most:
            end = asked + int(most)
        self.ask(Kind.TEXTURE, texture, end, priority)
        return True
