"""Simulates one run: a client with a policy walks through a world over a link.

Time proceeds from frame to frame. The client receives arrivals at once and may then make more
requests; texture memory changes only with a frame.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.link import Conditions
from ptmtools.site.client import LOOK_SECONDS
from ptmtools_lab.allocation import picture
from ptmtools_lab.client import DOCUMENTS, Client, FileKind
from ptmtools_lab.network import FluidLink, Request
from ptmtools_lab.policies import PolicyEntry
from ptmtools_lab.world import World


@dataclass(frozen=True)
class WalkRun:
    """Result of a run; F frames.

    Attributes
    ----------
    policy, conditions, budget: policy, link, and bytes of texture memory.
    time: (F,) s. still: (F,).
    error: (F,) e, the mean over the pixels of the root mean square over R, G and B, 0 to 255.
    square: (F,) the mean of its square.
    missing: (F,) share of the wanted levels on the screen that are missing.
    quality: (F,) the paper's: levels downloaded over levels existing, of the textures of the
        visible set.
    memory: (F,) bytes of texture memory in use. fetched: (F,) bytes of bodies received so far.
    column, state: (F, T) resident column of each texture, and its state
        (`ptmtools_lab.lossy`). loaded: (F, C) whether the geometry is loaded.
    body, overhead: bytes received of bodies and headers.
    documents: bytes of other bodies than textures and geometry.
    useful: bytes of textures and geometry that were displayed.
    uploads: bytes uploaded to texture memory. switches: changes of a texture's finest level.
    requests: number of requests. stalls: frames without the geometry of the current cell.
    overruns: frames above the budget.
    """

    policy: str
    conditions: Conditions
    budget: int
    time: Floats
    still: Bools
    error: Floats
    square: Floats
    missing: Floats
    quality: Floats
    memory: Ints
    fetched: Floats
    column: Ints
    state: Ints
    loaded: Bools
    body: float
    overhead: float
    documents: int
    useful: float
    uploads: int
    switches: int
    requests: int
    stalls: int
    overruns: int


#: The former name.
Run = WalkRun


def simulate(world: World, policy: PolicyEntry, conditions: Conditions, budget: int) -> WalkRun:
    """Simulates a walk, with textures in the policy's form. The same arguments give the same run,
    bit for bit.

    Raises InputError PTM-I701 if the world was not prepared for that form.
    """
    world = policy.in_world(world)
    link = FluidLink(conditions)
    client = policy.client(world, link, budget)
    frames, stock, views = world.frames, world.catalogue, world.views
    error, square, missing, quality, fetched = (np.zeros(frames) for _ in range(5))
    memory = np.zeros(frames, np.int64)
    column, state = (np.zeros((frames, stock.texture_count), np.int64) for _ in range(2))
    loaded = np.zeros((frames, stock.cell_count), dtype=bool)
    shown = np.zeros(stock.gains.shape, dtype=bool)
    before_first = np.concatenate([np.zeros(stock.texture_count, np.int64), stock.previews.state])
    drawn = np.zeros(stock.cell_count, dtype=bool)
    texture = np.arange(stock.texture_count)
    clock = _Clock(client, link)
    for f in range(frames):
        if f:
            clock.run_ticks(*world.track.time[f - 1 : f + 1].tolist())
        clock.frame(f)
        column[f], loaded[f] = client.column, client.geometry.whole
        state[f] = np.where(client.column > 0, before_first[client.source] + client.column, 0)
        memory[f] = stock.memory[texture, client.column].sum()
        rows = views.rows(int(world.track.view[f]))
        error[f], square[f], missing[f] = picture(
            rows.start, rows.stop, views.cell, views.texture, views.error, views.square, views.need,
            loaded[f], client.column, client.source, state[f], world.colored, shown, drawn,
        )  # fmt: skip
        quality[f] = _quality(client)
        arriving = sum(request.body_bytes for request in client.waiting)
        fetched[f] = link.bytes - clock.page_bytes + arriving
        client.fetch()
    return WalkRun(
        policy=policy.name,
        conditions=conditions,
        budget=budget,
        time=world.track.time,
        still=world.track.still,
        error=error,
        square=square,
        missing=missing,
        quality=quality,
        memory=memory,
        fetched=fetched,
        column=column,
        state=state,
        loaded=loaded,
        body=float(fetched[-1]),
        overhead=link.overhead_bytes,
        documents=sum(int(client.files[kind].loaded.sum()) for kind in DOCUMENTS),
        useful=_useful_bytes(client, shown, drawn),
        uploads=_upload_bytes(stock.memory[texture, column], column, state - column),
        switches=int(np.count_nonzero(np.diff(state, axis=0, prepend=0))),
        requests=link.requests - clock.page,
        stalls=int((~loaded[np.arange(frames), world.track.cell]).sum()),
        overruns=int((memory > policy.limits(world, budget)).sum()),
    )


def _useful_bytes(client: Client, shown: Bools, drawn: Bools) -> float:
    """Bytes of files, or of their parts, that a frame showed; ``shown`` as `picture` fills it."""
    stock = client.world.catalogue
    exact, previews = np.split(shown[:, 1:], [stock.texture_count])
    textures = int((np.diff(stock.ends, axis=1) * exact).sum())
    textures += int(stock.previews.bytes[previews.any(axis=1)].sum())
    meshes = client.meshes.whole & drawn[stock.meshes.cell]
    geometry = float(stock.geometry_bytes[drawn].sum())
    return textures + geometry + float(stock.meshes.bytes[meshes].sum())


def _upload_bytes(resident: Ints, column: Ints, offset: Ints) -> int:
    """Bytes sent to graphics memory, from the (F, T) resident bytes of textures, their columns, and
    the distances of their states from these: what grew, or all where the source changed."""
    grown = np.maximum(np.diff(resident, axis=0, prepend=0), 0)
    replaced = (np.diff(offset, axis=0, prepend=offset[:1]) != 0) & (column > 0)
    return int(np.where(replaced, resident, grown).sum())


class _Clock:
    """Time for a client. In a browser the client does not update in every frame, and some files are
    pushed without its request.

    Attributes
    ----------
    page, page_bytes: number of requested files of the page itself, and the bytes of those that have
        arrived.
    """

    def __init__(self, client: Client, link: FluidLink) -> None:
        self._client, self._link = client, link
        self._browser = client.world.track.browser
        self._pushed = deque(self._browser.files if self._browser else ())
        self._begun, self._news, self._looked = False, False, -math.inf
        self._late: deque[tuple[float, Request]] = deque()
        self.page = self.page_bytes = 0

    def run_ticks(self, start: float, end: float) -> None:
        """Advances time to each of the client's instants between two frames."""
        for tick in range(1, self._client.ticks):
            part = tick / self._client.ticks
            self.advance_to((1 - part) * start + part * end)
            self._client.tick()

    def advance_to(self, moment: float) -> None:
        """Advances time; the client handles arrivals."""
        while True:
            due = self._late[0][0] if self._late else math.inf
            finished = self._arrival(min(due, moment))
            if finished:
                free = self._link.now
                if self._browser:
                    free = self._browser.taken.wait_end(free)
                if free <= self._link.now and not self._late:
                    self._handle(finished)
                else:
                    self._late.append((free, finished))
            elif due < moment:
                self._handle(self._late.popleft()[1])
            else:
                return

    def frame(self, frame: int) -> None:
        """Advances time to a frame, and updates the client: in a browser several times a second,
        and after arrivals."""
        now = float(self._client.world.track.time[frame])
        self.advance_to(now)
        self._begun = True
        self._client.glance(frame)
        if self._browser is None or self._news or now - self._looked >= LOOK_SECONDS:
            self._looked, self._news = now, False
            self._client.look(frame)

    def _handle(self, finished: Request) -> None:
        self._client.receive(finished)
        self._news = True
        if self._begun:
            self._client.fetch()

    def _arrival(self, moment: float) -> Request | None:
        """The next file of the client to arrive by then."""
        while self._pushed and self._pushed[0].asked <= moment:
            finished = self._flow(max(self._pushed[0].asked, self._link.now))
            if finished:
                return finished
            pushed = self._pushed.popleft()
            if pushed.kind == "page":
                self.page += 1
                self._link.request(pushed.size, math.inf)
            else:
                self._client.give(FileKind[pushed.kind.upper()], pushed.number, pushed.size)
        return self._flow(moment)

    def _flow(self, moment: float) -> Request | None:
        while True:
            finished = self._link.advance(moment)
            self._client.estimate.observe(finished)
            if finished is None or finished.tag is not None:
                return finished
            self.page_bytes += finished.size


def _quality(client: Client) -> float:
    """Levels downloaded over levels existing, of the textures that the visible set uses."""
    if client.cell < 0:
        return 0.0
    textures = client.world.catalogue.in_sight[client.cell]
    existing = client.world.catalogue.levels[textures].sum()
    return float(client.have[textures].sum() / existing) if existing else 1.0
