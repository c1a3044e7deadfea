"""The engine of most policies: it fetches the ranges of greatest worth per byte.

A policy computes the current worth of each level of each texture, and of the geometry of each cell.
The engine chooses the levels for texture memory, to the last that fits, and requests the missing
ones by worth per byte, in ranges of a fraction of a second, so that few bytes are under way that
may become unwanted, or as previews, which are requested as a whole. A preview counts as the worth
that it adds to the best source that was requested, so a step may leap over levels, and the exact
ones follow when their worth per byte is the greatest. When nothing is missing the engine continues
with the most valuable levels beyond the budget, which stay in main memory.

Records and geometry compete with textures by the same measure: a cell without geometry is grey, and
its worth is the error of that. Both are requested as a whole, since browsers get no ranges of
responses that a server compresses. The first cell's geometry does not wait for its record: a
latency less of grey is worth 5 % of the error of 150 s at half a megabit a second, and nothing at
56 kbit/s.

`ItemBuffers` gives the item buffer of a client: one that it drew some frames ago, or, in a browser,
the last that could be read back by then. It shows the geometry that was loaded when it was drawn.

`Oracle` is a policy that knows the walk: the worth of a level is the error that it will remove,
discounted. It is greedy like the others: the same engine, with the true tables instead of an
estimate. A lower bound by linear programming is separate (benchmarks/RESULTS.md).
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints, Singles
from ptmtools.site.choice import next_fetch
from ptmtools.site.client import (
    BEHIND,
    CONNECTIONS,
    HELD_ON,
    HELD_SECONDS,
    LONGEST_WAIT,
    NEAREST,
    NOTHING,
    OVERHEAD,
    RANGE_BYTES,
    RANGE_SECONDS,
    RECORD_SHARE,
    STREAMS,
)
from ptmtools_lab.allocation import allocate, choose_sources, gather, holes
from ptmtools_lab.client import Client, FileKind
from ptmtools_lab.network import FluidLink, Request
from ptmtools_lab.world import World


class ItemBuffer(NamedTuple):
    """An item buffer.

    Attributes
    ----------
    view: number in `World.views`. frame: the frame in which it was drawn.
    loaded: (C,) cells with displayed geometry. missing: cells with displayed placeholders.
    """

    view: int
    frame: int
    loaded: Bools
    missing: Ints


class ItemBuffers:
    """The item buffers of a client."""

    def __init__(self, client: Client) -> None:
        self._client = client
        self._frame = 0
        #: At each frame of the client: loaded geometry; then times of its arrival, and the cells in
        #: use over time.
        self._loaded: list[Bools] = []
        self._since = np.full(client.world.catalogue.cell_count, math.inf)
        self._times: list[float] = []
        self._cells: list[int] = []

    def note(self) -> None:
        """Records arrivals and a change of the cell in use."""
        client, now = self._client, self._client.link.now
        self._since[client.geometry.whole & np.isinf(self._since)] = now
        if client.cell >= 0 and self._cells[-1:] != [client.cell]:
            self._times.append(now)
            self._cells.append(client.cell)

    def look(self) -> None:
        """Records the state at a frame of the client."""
        self._loaded.append(self._client.geometry.whole)
        self.note()

    def glance(self, frame: int) -> bool:
        """Passes a frame; returns whether it has another item buffer than the frame before."""
        drawn, before = self._client.world.track.drawn, self._frame
        self._frame = frame
        return drawn is not None and drawn[before] != drawn[frame]

    def available(self, age: int) -> ItemBuffer | None:
        """The item buffer of ``age`` frames ago, or a browser's last, or None."""
        client, world = self._client, self._client.world
        stock = world.catalogue
        if world.track.drawn is None:
            frame = max(0, client.frame - age)
            known, whole = stock.visible[client.cell], client.geometry.whole
            missing = known[~whole[known]]
            return ItemBuffer(int(world.track.view[frame]), frame, self._loaded[frame], missing)
        frame = int(world.track.drawn[self._frame])
        if frame < 0:
            return None
        loaded = self._since <= world.track.time[frame]
        entered = bisect_right(self._times, world.track.time[frame]) - 1
        known = stock.visible[self._cells[entered]] if entered >= 0 else np.zeros(0, np.int64)
        return ItemBuffer(int(world.track.view[self._frame]), frame, loaded, known[~loaded[known]])


#: Requests at a time by protocol.
CONCURRENCY = {"h1": CONNECTIONS, "h2": STREAMS}


@dataclass(frozen=True)
class Worth:
    """Worth of levels and geometry, as a policy computes it.

    Attributes
    ----------
    hold: (R, K) that each column of each source adds on the screen now to those before it.
    fetch: (R, K) that it adds now and soon.
    geometry: (C,) that the geometry of a cell adds.
    ahead: (R, K) of fetching beyond the budget; None: no such fetching.
    sight: (T, K) share of the view that wants each column; None: unknown.
    exact: see `allocate`.
    """

    hold: Floats
    fetch: Floats
    geometry: Floats
    ahead: Floats | None = None
    sight: Floats | None = None
    exact: bool = False


class Policy(Protocol):
    """A policy of the engine."""

    def __call__(self, client: EngineClient) -> Worth:
        """Computes the worth at the client's frame from the client's knowledge."""


class EngineClient(Client):
    """A client with a policy, which may need the statistics."""

    def __init__(
        self,
        world: World,
        link: FluidLink,
        budget: int,
        policy: Policy,
        *,
        statistics: bool = False,
    ) -> None:
        super().__init__(world, link, budget)
        self._policy, self._statistics = policy, statistics
        self._concurrency = CONCURRENCY[link.conditions.protocol]
        stock = world.catalogue
        self._target: Ints = np.zeros(stock.texture_count, np.int64)
        self._kept = np.zeros(stock.gains.shape)
        self._worth: Worth | None = None
        self._items, self._looked = ItemBuffers(self), -math.inf
        #: Budget including the second copy of a growing texture.
        self._all = budget
        # In a browser: bytes kept free, and the cell since whose entry.
        self._reserve, self._since = 0, -1
        self.frustum = world.frustum(0)

    # Input of policies.

    def sight(self, age: int) -> Floats:
        """(T, K) the share of the item buffer that wants each level, in columns, as drawn ``age``
        frames ago with the geometry of that time."""
        result = np.zeros(self.world.catalogue.ends.shape)
        item, views = self._items.available(age), self.world.views
        if item:
            rows = views.rows(item.view)
            gather(
                rows.start, rows.stop, views.cell, views.texture, views.sight, item.loaded, result
            )
        return result

    def placeholders(self, age: int) -> Floats:
        """(C,) the share of the item buffer, ``age`` frames old, that shows placeholders: the far
        faces of the boxes of visible cells without geometry."""
        stock, world = self.world.catalogue, self.world
        share = np.zeros(stock.cell_count)
        item = self._items.available(age)
        if item and len(item.missing):
            loaded = item.loaded if world.track.browser else self.geometry.whole
            rays, _ = world.camera.rays(world.track.direction[item.frame : item.frame + 1])
            holes(
                rays.reshape(-1, 3)[world.camera.sparse], world.views.owner[item.view],
                world.views.depth[item.view], world.track.eye[item.frame], stock.low, stock.high,
                loaded, item.missing, share,
            )  # fmt: skip
        return share

    def visible_set(self) -> Ints:
        """The visible set of the current cell, itself first."""
        return self.world.catalogue.visible[self.cell]

    def coverage(self) -> Floats:
        """Average coverage hints, aligned with `known`."""
        return self.world.catalogue.coverage[self.cell]

    # The engine.

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
        cell = int(self.world.track.cell[self.frame])
        if cell != self._since:
            self._reserve, self._since = 0, cell
        self.budget = self._all - self._reserve
        self._weigh()
        if self._worth is None:
            return
        hold, exact = self._worth.hold, self._worth.exact
        now = float(self.world.track.time[self.frame])
        fading = 0.5 ** ((now - self._looked) / HELD_SECONDS)
        self._looked = now
        # The greatest share of late, whatever the sign of what it counts for.
        kept = self._kept * fading
        self._kept = np.where(np.abs(hold) > np.abs(kept), hold, kept)
        stock = self.world.catalogue
        worth = hold + HELD_ON * self._kept + HELD_ON**2 * stock.gains
        step, source = np.zeros(stock.ends.shape), np.zeros(stock.ends.shape, np.int64)
        last = np.zeros(stock.texture_count, np.int64)
        choose_sources(worth, self.have, stock.previews, self.previews.whole, step, source, last)
        last = np.where(self._suffices(), self.exact, last)
        allocate(step, stock.memory, last, self.budget, self.column, exact)
        while self.world.track.browser and self._grow():
            self.budget = self._all - self._reserve
            allocate(step, stock.memory, last, self.budget, self.column, exact)
        self.source = source[np.arange(len(last)), self.column]

    def receive(self, request: Request) -> None:
        """See `Client.receive`."""
        super().receive(request)
        if request.tag.kind not in (FileKind.TEXTURE, FileKind.PREVIEW):  # type: ignore[attr-defined]
            if self.cell < 0 and self.records.whole[self.world.track.cell[self.frame]]:
                self.cell = int(self.world.track.cell[self.frame])
            self._items.note()
            self._weigh()

    def _suffices(self) -> Bools:
        """(T,) the textures in view whose exact columns are all that the view wants: no finer
        preview takes their place."""
        stock = self.world.catalogue
        if self._worth is None or self._worth.sight is None:
            return np.zeros(stock.texture_count, dtype=bool)
        sight, beyond = self._worth.sight, np.arange(stock.ends.shape[1]) > self.exact[:, None]
        result: Bools = (sight[:, 1] > 0) & ~(beyond & (sight > 0)).any(axis=1)
        return result

    def _grow(self) -> bool:
        """Reserves memory for the second copy of a texture while it grows: the largest texture
        without its finest level, at most half of the memory. Returns whether the reserve grew; it
        stays while the client is in the cell, lest a level go in and out."""
        column, memory = self.column, self.world.catalogue.memory
        need = int(memory[np.arange(len(column)), np.maximum(column - 1, 0)].max(initial=0))
        more = min(need, self._all // 2)
        grown = more > self._reserve
        self._reserve = max(more, self._reserve)
        return grown

    def _weigh(self) -> None:
        if self.cell >= 0 and (self.files[FileKind.STATISTICS].whole[0] or not self._statistics):
            stock = self.world.catalogue
            self._worth = self._policy(self)
            fetch, exact = self._worth.fetch[: stock.texture_count], self._worth.exact
            allocate(fetch, stock.memory, stock.levels, self.budget, self._target, exact)

    def fetch(self) -> None:
        """See `Client.fetch`."""
        while self._room() and self._fetch_one():
            pass

    def _room(self) -> bool:
        """Whether the link would run dry before a later request could be answered."""
        if len(self.waiting) >= self._concurrency:
            return False
        outstanding = sum(request.outstanding for request in self.waiting)
        ahead = self.estimate.latency + RANGE_SECONDS / 2
        return outstanding == 0 or 8 * outstanding < ahead * self.estimate.bandwidth

    def _fetch_one(self) -> bool:
        """Requests the range of the greatest worth; False if there is none."""
        if not self.files[FileKind.INDEX].asked[0]:
            self.open()
        if not self.index:
            return False
        if self._statistics and self.whole(FileKind.STATISTICS, 0, math.inf):
            return True
        current = int(self.world.track.cell[self.frame])
        if self.whole(FileKind.RECORD, current, math.inf):
            return True
        if self.cell < 0 and self.whole(FileKind.GEOMETRY, current, math.inf):
            return True
        if self._worth is None:
            return False
        stock, worth = self.world.catalogue, self._worth
        # With little memory a preview may show more columns than are wanted of the exact levels.
        last = np.maximum(self._target, np.where(self.column > self.exact, self.column, 0))
        best, source, column = self._next_fetch(worth.fetch, last)
        size = np.maximum(self.geometry.size, 1)
        density = np.where(self.geometry.asked == 0, worth.geometry / size, 0.0)
        cell = int(density.argmax())
        mesh, finer = self._next_mesh()
        records = [c for c in stock.adjacent[self.cell].tolist() if not self.records.asked[c]]
        if records:
            least = min(records, key=lambda c: int(self.records.size[c]))
            record = NOTHING * RECORD_SHARE / float(self.records.size[least])
            if record > max(best, float(density[cell]), finer):
                return self.whole(FileKind.RECORD, least, record)
        if finer > max(best, float(density[cell])):
            return self.whole(FileKind.MESH, mesh, finer)
        if density[cell] > best:
            return self.whole(FileKind.GEOMETRY, cell, float(density[cell]))
        if source < 0 and worth.ahead is not None:
            best, source, column = self._next_fetch(worth.ahead, stock.levels)
        if source < 0:
            return False
        if source >= stock.texture_count:
            return self.whole(FileKind.PREVIEW, source - stock.texture_count, best)
        return self._range(source, int(stock.ends[source, column]), best)

    def _next_mesh(self) -> tuple[int, float]:
        """The finer mesh of the greatest worth per byte, and that; -1 and 0 if there is none."""
        stock = self.world.catalogue
        meshes, asked = stock.meshes, self.meshes.asked > 0
        shown = self.geometry.whole & np.isin(np.arange(stock.cell_count), self.visible_set())
        free = ~asked & shown[meshes.cell]
        if not free.any():
            return -1, 0.0
        gains = NOTHING * meshes.gains(asked, self.frustum, NEAREST, BEHIND)
        density = np.where(free, gains / (meshes.bytes + self._overhead()), 0.0)
        best = int(density.argmax())
        return best, float(density[best])

    def _next_fetch(self, worth: Floats, last: Ints) -> tuple[float, int, int]:
        """See `next_fetch`; with one range a file at a time, no more while one is pending."""
        stock, asked = self.world.catalogue, self.textures.asked
        busy = (asked > self.textures.loaded) & self.world.one_range
        step: tuple[float, int, int] = next_fetch(
            worth, stock.ends, stock.stored, asked, busy, last, stock.previews,
            self.previews.asked > 0, self._overhead(),
        )  # fmt: skip
        return step

    def _overhead(self) -> int:
        """Overhead of a request, bytes: headers, and the bytes that its connection could bring
        while it waits. On a fast link a request thus covers more levels."""
        latency, bandwidth = self.estimate.latency, self.estimate.bandwidth
        waiting = latency * bandwidth / 8 / self._concurrency if latency else 0.0
        return OVERHEAD + int(min(waiting, LONGEST_WAIT))

    def _range(self, texture: int, end: int, priority: float) -> bool:
        limit = max(RANGE_BYTES, RANGE_SECONDS * self.estimate.bandwidth / 8)
        asked = int(self.textures.asked[texture])
        if end - asked > limit:
            end = asked + int(limit)
        self.ask(FileKind.TEXTURE, texture, end, priority)
        return True


#: Seconds after which errors count 1/e, in the near and the far future, and the weight of the
#: latter.
SOON, LATER = 3.0, 60.0
_LATER_SHARE, _SOON_HELD = 0.003, 1e-4


class Oracle:
    """A policy for one walk; with ``exchanging`` it exchanges steps, see
    `ptmtools_lab.allocation.exchange`."""

    def __init__(self, world: World, *, exchanging: bool = False) -> None:
        self._exchanging = exchanging
        self._now, self._cells = _drops(world)
        self._soon = [
            _discount(table, SOON * world.track.rate) for table in (self._now, self._cells)
        ]
        self._later = [_discount(t, LATER * world.track.rate) for t in (self._now, self._cells)]

    def __call__(self, client: EngineClient) -> Worth:
        """See `Policy`."""
        f = client.frame
        soon, later = (tables[0][f].astype(np.float64) for tables in (self._soon, self._later))
        cells = self._soon[1][f] + _LATER_SHARE * self._later[1][f]
        return Worth(
            hold=self._now[f] + _SOON_HELD * soon,
            fetch=soon + _LATER_SHARE * later,
            geometry=cells.astype(np.float64),
            ahead=later,
            exact=self._exchanging,
        )


def _drops(world: World) -> tuple[Singles, Singles]:
    """(F, R, K) the reduction of each frame's error by each column of each source, and (F, C) the
    error without each cell's geometry."""
    stock, views = world.catalogue, world.views
    count, textures, previews = views.frames, stock.texture_count, stock.previews
    columns = np.zeros((count, *stock.gains.shape), np.float32)
    cells = np.zeros((count, stock.cell_count), np.float32)
    frame = np.repeat(np.arange(count), np.diff(views.start))
    np.add.at(cells, (frame, views.cell), views.error[:, 0])
    texture_of = np.concatenate([np.arange(textures), previews.texture])
    first = np.concatenate([np.zeros(textures, np.int64), previews.state])
    last = np.concatenate([stock.levels, previews.column])
    for row, (t, before, until) in enumerate(zip(texture_of, first, last, strict=True)):
        shown = np.flatnonzero(views.texture == t)
        error = views.error[shown, before + 1 : before + until + 2]
        error[:, 0] = views.error[shown, 1]
        np.add.at(columns[:, row, 1 : until + 1], frame[shown], error[:, :-1] - error[:, 1:])
    return columns[world.track.view], cells[world.track.view]


def _discount(table: Singles, frames: float) -> Singles:
    """Discounted sums over future frames; each frame counts less than the one before."""
    result, kept = np.empty_like(table), np.exp(-1 / frames)
    total = np.zeros_like(table[0])
    for f in range(len(table) - 1, -1, -1):
        total = total * kept + table[f]
        result[f] = total
    return result
