"""What every client does: it asks for files, keeps what arrives, and knows what it may use.

A client sees the index once it is there, then the record of the cell that it is in and the geometry
of what that cell sees; of a texture it asks for ranges of the `.ptm` from its beginning on. What
has been downloaded stays in main memory; texture memory is what is short.

What a client believes of its link, from what it has downloaded lately (§6.2: "network bandwidth
and latency analysis performed for some recent downloadings").

Bandwidth is bytes over the time during which any were arriving, both forgotten with a half-life of
such time: so a pause, in which nothing was asked for, neither lowers the estimate nor ages it, and
parallel requests are not counted against each other. What arrives between two looks is taken to
arrive evenly, and fades from where it arrives, so that the estimate does not depend on how often
one looks. Latency is the mean of the last few, of requests whose response did not have to wait for
those of others: on `h2` the others tell nothing of the network. (A client sees it: another response
ended as this one began.)
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections import deque
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from ptmtools.arrays import Bools, Ints
from ptmtools.lab.network import Link, Request
from ptmtools.lab.world import World

#: After so many s of arriving bytes they count half.
HALF_LIFE = 1.0
#: With fewer bytes and less time than these, B and s, the prior is believed.
ENOUGH_BYTES, ENOUGH_SECONDS = 16_384, 0.25
#: So many latencies are remembered.
LATENCIES = 8


class Estimate:
    """Bandwidth and latency as a client of ``link`` believes them.

    Parameters
    ----------
    link: whose bytes and whose time of arrivals are observed; nothing else of it is looked at.
    bandwidth, latency: the prior, bit/s and s: what is believed until enough is known.
    """

    def __init__(self, link: Link, bandwidth: float, latency: float) -> None:
        self._link, self._prior = link, bandwidth
        self._seen = (link.carried, link.busy)
        self._bytes = self._seconds = 0.0
        self._latencies: deque[float] = deque([latency], LATENCIES)
        self._guessed = True

    def observe(self, finished: Request | None = None) -> None:
        """To be called after each `Link.advance`, with what that returned."""
        carried, busy = self._link.carried, self._link.busy
        seconds = busy - self._seen[1]
        age = math.log(2) * seconds / HALF_LIFE
        fading, kept = math.exp(-age), -math.expm1(-age) / age if age else 1.0
        self._bytes = self._bytes * fading + kept * (carried - self._seen[0])
        self._seconds = self._seconds * fading + kept * seconds
        self._seen = (carried, busy)
        if finished and finished.sent is not None and finished.first_byte == finished.starts:
            if self._guessed:
                self._latencies.clear()
                self._guessed = False
            self._latencies.append(finished.starts - finished.sent)

    @property
    def bandwidth(self) -> float:
        """Bit/s; infinite if bytes took no time."""
        if self._bytes < ENOUGH_BYTES and self._seconds < ENOUGH_SECONDS:
            return self._prior
        return 8 * self._bytes / self._seconds if self._seconds else math.inf

    @property
    def latency(self) -> float:
        """s to the first byte."""
        return sum(self._latencies) / len(self._latencies)

    def duration(self, size: float) -> float:
        """s until a request of ``size`` bytes would be finished, if it had the link for itself."""
        return self.latency + 8 * size / self.bandwidth if self.bandwidth else math.inf


#: What a client believes of a link before it knows any better: bit/s and s.
PRIOR = (1e6, 0.1)


class Kind(IntEnum):
    """What is asked for."""

    INDEX = 0
    RECORD = 1
    GEOMETRY = 2
    TEXTURE = 3
    STATISTICS = 4


#: What is neither textures nor geometry.
DOCUMENTS = (Kind.INDEX, Kind.RECORD, Kind.STATISTICS)


@dataclass(frozen=True, slots=True)
class Range:
    """Bytes ``begin`` to ``end`` of the file number ``number`` of a kind."""

    kind: Kind
    number: int
    begin: int
    end: int


class Files:
    """The files of one kind: how much of each was asked for, and how much is there.

    Attributes
    ----------
    size: (n,) bytes. asked, there: (n,) bytes from the beginning that were asked for, that are
        there without a gap.
    """

    def __init__(self, kind: Kind, size: Ints) -> None:
        self.kind, self.size = kind, size
        self.asked, self.loaded = np.zeros(len(size), np.int64), np.zeros(len(size), np.int64)
        self._waiting: dict[int, deque[list[int]]] = {}

    @property
    def whole(self) -> Bools:
        """(n,) which are there from beginning to end."""
        result: Bools = self.loaded >= self.size
        return result

    def ask(self, number: int, end: int) -> Range:
        """The range that leads to ``end``; it counts as asked for."""
        result = Range(self.kind, number, int(self.asked[number]), end)
        self.asked[number] = end
        self._waiting.setdefault(number, deque()).append([end, 0])
        return result

    def arrived(self, part: Range) -> None:
        """A range is there; others before it may not be."""
        waiting = self._waiting[part.number]
        for entry in waiting:
            if entry[0] == part.end:
                entry[1] = 1
        self._pass(part.number)

    def given_up(self, part: Range, received: int) -> bool:
        """The last range of a file is given up, of which so much has arrived; False if it was not
        the last, and nothing is changed."""
        waiting = self._waiting[part.number]
        if waiting[-1][0] != part.end:
            return False
        self.asked[part.number] = part.begin + received
        waiting.pop()
        if received:
            waiting.append([part.begin + received, 1])
            self._pass(part.number)
        return True

    def _pass(self, number: int) -> None:
        """Counts what is there without a gap."""
        waiting = self._waiting[number]
        while waiting and waiting[0][1]:
            self.loaded[number] = waiting.popleft()[0]


class Client(ABC):
    """A client on a walk.

    Attributes
    ----------
    world, link, budget: where it is, what it asks, bytes of texture memory that it may use.
    frame: at which it is.
    index: whether it has the index. records, geometry, textures: see `Files`.
    column: (T,) what of each texture is in texture memory.
    estimate: of the link.
    ticks: how often `tick` is called from one frame to the next, the frames not counted.
    """

    ticks = 1

    def __init__(self, world: World, link: Link, budget: int) -> None:
        self.world, self.link, self.budget = world, link, budget
        stock = world.catalogue
        self.frame = 0
        self.files = {
            Kind.INDEX: Files(Kind.INDEX, np.array([stock.index_bytes])),
            Kind.RECORD: Files(Kind.RECORD, stock.record_bytes.copy()),
            Kind.GEOMETRY: Files(Kind.GEOMETRY, stock.geometry_bytes.copy()),
            Kind.TEXTURE: Files(Kind.TEXTURE, stock.ends[:, -1]),
            Kind.STATISTICS: Files(Kind.STATISTICS, np.array([stock.statistics_bytes])),
        }
        self.records, self.geometry = self.files[Kind.RECORD], self.files[Kind.GEOMETRY]
        self.textures = self.files[Kind.TEXTURE]
        self.column = np.zeros(stock.texture_count, np.int64)
        self.estimate = Estimate(link, *PRIOR)
        self.waiting: list[Request] = []
        #: The cell whose record the client goes by: that it is in, once its record is there.
        self.cell = -1

    @property
    def index(self) -> bool:
        """Whether the index is there."""
        return bool(self.files[Kind.INDEX].whole[0])

    @property
    def have(self) -> Ints:
        """(T,) columns that are downloaded whole."""
        stock = self.world.catalogue
        held = (stock.ends <= self.textures.loaded[:, None]).sum(axis=1) - 1
        columns: Ints = np.minimum(held, stock.levels)
        return columns

    def look(self, frame: int) -> None:
        """The walker is at a frame."""
        self.frame = frame
        here = int(self.world.cell[frame])
        if self.records.whole[here]:
            self.cell = here
        self.settle()

    def glance(self, frame: int) -> None:  # noqa: B027 - only browsers have item buffers of other frames
        """There is a frame; who has an item buffer may see another one than before."""

    def give(self, kind: Kind, number: int, size: int) -> None:
        """A file is on the way before the client asks for it."""
        if not self.files[kind].asked[number]:
            self.files[kind].size[number] = size
            self.ask(kind, number, size, math.inf)

    def ask(self, kind: Kind, number: int, end: int, priority: float) -> None:
        """Asks for a file up to a byte."""
        part, now = self.files[kind].ask(number, end), self.link.now
        browser = self.world.browser
        late = {"late": browser.sent.until(now) - now} if browser else {}
        self.waiting.append(self.link.request(part.end - part.begin, priority, part, **late))

    def arrived(self, request: Request) -> None:
        """A request is finished."""
        assert isinstance(request.tag, Range)
        self.waiting.remove(request)
        self.files[request.tag.kind].arrived(request.tag)

    def tick(self) -> None:  # noqa: B027 - most have nothing to do then
        """Some time has passed, and no frame yet."""

    @abstractmethod
    def settle(self) -> None:
        """Decides what is in texture memory in this frame: sets `column`."""

    @abstractmethod
    def fetch(self) -> None:
        """Asks for what is wanted next, or for nothing; called in every frame, and whenever
        something has arrived."""
