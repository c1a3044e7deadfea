"""The base of all clients: requests of files, storage of arrivals, and an estimate of the link.

A client has the index once it has arrived, then the record of its cell and the geometry of the
visible cells; it requests ranges of a `.ptm` from its beginning on, and whole previews and meshes.
Downloaded bytes stay in main memory; texture memory is limited.

`Estimate` is the client's estimate of its link, from recent downloads (§6.2: "network bandwidth and
latency analysis performed for some recent downloadings"). Bandwidth is bytes over the time during
which any were arriving, both with a half-life of such time. A pause without requests therefore
neither lowers nor ages the estimate, and parallel requests do not count against each other.
Arrivals between two observations are taken as evenly spread and fade from their arrival, so the
estimate does not depend on the rate of observation. Latency is the mean of the last few requests
whose response did not wait for other responses: on `h2` the others say nothing about the network.
(A client can tell: another response ended when this one began.)
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections import deque
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from ptmtools.arrays import Bools, Ints
from ptmtools.site.client import (
    ENOUGH_BYTES,
    ENOUGH_SECONDS,
    HALF_LIFE,
    LATENCIES,
    PRIOR_BANDWIDTH,
    PRIOR_LATENCY,
)
from ptmtools_lab.network import FluidLink, Request
from ptmtools_lab.world import World


class Estimate:
    """Estimate of bandwidth and latency by a client of ``link``.

    Parameters
    ----------
    link: only its bytes and arrival times are observed.
    bandwidth, latency: the prior, bit/s and s, used until enough has arrived.
    """

    def __init__(self, link: FluidLink, bandwidth: float, latency: float) -> None:
        self._link, self._prior = link, bandwidth
        self._seen = (link.carried, link.busy)
        self._bytes = self._seconds = 0.0
        self._latencies: deque[float] = deque([latency], LATENCIES)
        self._guessed = True

    def observe(self, finished: Request | None = None) -> None:
        """Updates the estimate; call it after each `FluidLink.advance` with its result."""
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
        """s until a request of ``size`` bytes would be finished, alone on the link."""
        return self.latency + 8 * size / self.bandwidth if self.bandwidth else math.inf


class FileKind(IntEnum):
    """FileKind of a requested file."""

    INDEX = 0
    RECORD = 1
    GEOMETRY = 2
    TEXTURE = 3
    STATISTICS = 4
    PREVIEW = 5
    MESH = 6


#: Kinds that are neither textures nor geometry.
DOCUMENTS = (FileKind.INDEX, FileKind.RECORD, FileKind.STATISTICS)


@dataclass(frozen=True, slots=True)
class Range:
    """Bytes ``begin`` to ``end`` of file ``number`` of a kind."""

    kind: FileKind
    number: int
    begin: int
    end: int


class ClientFiles:
    """The files of one kind, with the bytes requested and loaded of each.

    Attributes
    ----------
    size: (n,) bytes. asked, loaded: (n,) bytes from the beginning that were requested, and that
        have arrived without a gap.
    """

    def __init__(self, kind: FileKind, size: Ints) -> None:
        self.kind, self.size = kind, size
        self.asked, self.loaded = np.zeros(len(size), np.int64), np.zeros(len(size), np.int64)
        #: By number, the ends of the ranges that were requested and not yet counted, in order, and
        #: whether each has arrived.
        self._waiting: dict[int, dict[int, bool]] = {}

    @property
    def whole(self) -> Bools:
        """(n,) which are completely loaded."""
        result: Bools = self.loaded >= self.size
        return result

    def ask(self, number: int, end: int) -> Range:
        """Marks a file as requested up to ``end``; returns the range to request."""
        result = Range(self.kind, number, int(self.asked[number]), end)
        self.asked[number] = end
        self._waiting.setdefault(number, {})[end] = False
        return result

    def receive(self, part: Range) -> None:
        """Marks a range as arrived; ranges before it may be missing."""
        waiting = self._waiting[part.number]
        waiting[part.end] = True
        for end in [*waiting]:
            if not waiting[end]:
                break
            del waiting[end]
            self.loaded[part.number] = end


class Client(ABC):
    """A client on a walk.

    Attributes
    ----------
    world, link, budget: the walk, the link, and the limit of texture memory, bytes.
    frame: current frame.
    index: whether it has the index.
    records, geometry, textures, previews, meshes: see `RequestedFiles`.
    column: (T,) resident column of each texture. source: (T,) its source, a row of tables by source
        (`ptmtools_lab.catalogue`).
    estimate: estimate of the link.
    ticks: number of calls of `tick` between two frames, plus one.
    """

    ticks = 1

    def __init__(self, world: World, link: FluidLink, budget: int) -> None:
        self.world, self.link, self.budget = world, link, budget
        stock = world.catalogue
        self.frame = 0
        self.files = {
            FileKind.INDEX: ClientFiles(FileKind.INDEX, np.array([stock.index_bytes])),
            FileKind.RECORD: ClientFiles(FileKind.RECORD, stock.record_bytes.copy()),
            FileKind.GEOMETRY: ClientFiles(FileKind.GEOMETRY, stock.geometry_bytes.copy()),
            FileKind.TEXTURE: ClientFiles(FileKind.TEXTURE, stock.ends[:, -1]),
            FileKind.STATISTICS: ClientFiles(
                FileKind.STATISTICS, np.array([stock.statistics_bytes])
            ),
            FileKind.PREVIEW: ClientFiles(FileKind.PREVIEW, stock.previews.bytes.copy()),
            FileKind.MESH: ClientFiles(FileKind.MESH, stock.meshes.bytes.copy()),
        }
        self.records, self.geometry = self.files[FileKind.RECORD], self.files[FileKind.GEOMETRY]
        self.textures, self.previews = self.files[FileKind.TEXTURE], self.files[FileKind.PREVIEW]
        self.meshes = self.files[FileKind.MESH]
        self.column = np.zeros(stock.texture_count, np.int64)
        self.source = np.arange(stock.texture_count)
        self.estimate = Estimate(link, PRIOR_BANDWIDTH, PRIOR_LATENCY)
        self.waiting: list[Request] = []
        #: The cell whose record is in use: the current one, once its record has arrived.
        self.cell = -1

    @property
    def index(self) -> bool:
        """Whether the index has arrived."""
        return bool(self.files[FileKind.INDEX].whole[0])

    @property
    def have(self) -> Ints:
        """(T,) columns whose ranges are completely downloaded."""
        stock = self.world.catalogue
        complete = (stock.ends <= self.textures.loaded[:, None]).sum(axis=1) - 1
        columns: Ints = np.minimum(complete, stock.stored)
        return columns

    @property
    def exact(self) -> Ints:
        """(T,) columns with an exact source."""
        previews, columns = self.world.catalogue.previews, self.have
        whole = previews.exact & self.previews.whole
        np.maximum.at(columns, previews.texture[whole], previews.column[whole])
        return columns

    def look(self, frame: int) -> None:
        """Moves the viewpoint to a frame."""
        self.frame = frame
        cell = int(self.world.track.cell[frame])
        if self.records.whole[cell]:
            self.cell = cell
        self.settle()

    def glance(self, frame: int) -> None:  # noqa: B027 - only browsers have item buffers of other frames
        """Passes a frame; with an item buffer the client may get another one."""

    def give(self, kind: FileKind, number: int, size: int) -> None:
        """Starts a transfer that the client did not request; of a preview, if it knows some."""
        if number < len(self.files[kind].size) and not self.files[kind].asked[number]:
            self.files[kind].size[number] = size
            self.ask(kind, number, size, math.inf)

    def ask(self, kind: FileKind, number: int, end: int, priority: float) -> None:
        """Requests a file up to a byte."""
        part, now = self.files[kind].ask(number, end), self.link.now
        browser = self.world.track.browser
        late = browser.sent.wait_end(now) - now if browser else 0.0
        self.waiting.append(self.link.request(part.end - part.begin, priority, part, late))

    def open(self) -> None:
        """Requests the index and the opening, if there is one, at once."""
        self.whole(FileKind.INDEX, 0, math.inf)
        parts = [
            self.files[FileKind[kind.upper()]].ask(n, end) for kind, n, end in self.world.opening
        ]
        if parts:
            (size, part), *rest = [(part.end, part) for part in parts]
            self.waiting.append(self.link.request(size, math.inf, part, rest=tuple(rest)))

    def whole(self, kind: FileKind, number: int, priority: float) -> bool:
        """Requests a file as a whole; returns False if it was requested before."""
        files = self.files[kind]
        if files.asked[number]:
            return False
        self.ask(kind, number, int(files.size[number]), priority)
        return True

    def finest_meshes(self, cells: Ints) -> list[int]:
        """The files that have objects in some cells as modelled."""
        meshes = self.world.catalogue.meshes
        files: list[int] = np.flatnonzero(meshes.finest & np.isin(meshes.cell, cells)).tolist()
        return files

    def loaded_shapes(self, first: int = 0) -> Ints:
        """The shapes of cells with loaded geometry whose texture is ``first`` or a later one."""
        shapes = self.world.catalogue.shapes
        return np.flatnonzero(self.geometry.whole[shapes.cell] & (shapes.texture >= first))

    def shapes_ahead(self, first: int = 0) -> Ints:
        """Those of `loaded_shapes` whose boxes meet the frustum."""
        shapes, loaded = self.world.catalogue.shapes, self.loaded_shapes(first)
        frustum = self.world.frustum(self.frame)
        return loaded[frustum.meets_boxes(shapes.low[loaded], shapes.high[loaded])]

    def receive(self, request: Request) -> None:
        """Handles a finished request."""
        assert isinstance(request.tag, Range)
        self.waiting.remove(request)
        if request.following:
            self.waiting.append(request.following)
        self.files[request.tag.kind].receive(request.tag)

    def tick(self) -> None:  # noqa: B027 - most clients do nothing
        """Handles a step of time between frames."""

    @abstractmethod
    def settle(self) -> None:
        """Decides what is in texture memory in this frame: sets `column`."""

    @abstractmethod
    def fetch(self) -> None:
        """Makes the next requests, if any; called in every frame and after every arrival."""
