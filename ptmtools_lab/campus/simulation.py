"""Simulates runs: a client with a preset walks through a campus over a link.

As in `ptmtools_lab.simulation`, time proceeds from frame to frame. The client receives arrivals at
once, and graphics memory changes only with a frame.

The client of a campus is also a policy that is compared with those of a database of the same model
on the same walks, links, pictures and measures. It then loads no lightmaps, since the other clients
have no light. Its budget is graphics memory for meshes and textures; that of the others is for
textures alone. Measures of texture levels or cells do not apply, and are NaN.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import nan

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.link import Conditions, Trace
from ptmtools_lab.campus.client import CampusClient
from ptmtools_lab.campus.options import QUALITIES, CampusWalkOptions
from ptmtools_lab.campus.stock import Stock
from ptmtools_lab.campus.world import COARSE, FINE, NOTHING, CampusWorld
from ptmtools_lab.measures import STANDS, Measures, measure, seconds_to
from ptmtools_lab.network import FluidLink
from ptmtools_lab.simulation import WalkRun
from ptmtools_lab.world import World
from ptmtools_systems.campus.model import SIZES, Quality

#: Shortest interval without requests that counts as a pause, s.
PAUSE = 1.0


@dataclass(frozen=True)
class Meeting:
    """An object becomes one of the nearest for the first time.

    Attributes
    ----------
    label: of the object. time: s.
    textures: number of its textures in the preset's size. reused: number of those already loaded.
    """

    label: str
    time: float
    textures: int
    reused: int


@dataclass(frozen=True)
class CampusRun:
    """Result of a run; F frames.

    Attributes
    ----------
    quality, conditions, budget: preset, link, and bytes of graphics memory, or None.
    time: (F,) s.
    error: (F,) e, the mean over the pixels of the root mean square over R, G and B, 0 to 255; NaN
        in frames without tables.
    memory: (F,) bytes of graphics memory in use. fetched: (F,) bytes of bodies received so far.
    triangles: (F,) of the meshes that are shown, of objects in view.
    lacking: (F,) number of objects wanted in high detail and not shown in it; all of them before
        the client has the index.
    begun: s until all coarsest meshes and least textures had arrived, or None.
    floor: bytes of graphics memory of these.
    delays: s from becoming one of the nearest objects to being shown in full, of each time this
        happened. never: how often the object was far again, or the walk over, before.
    meetings: of each object that became one of the nearest, in their order.
    idle: (p, 2) intervals, s, without a pending request.
    body, overhead: bytes received of bodies and headers. requests: number of requests. sorts:
        number of sorts of the objects.
    """

    quality: Quality
    conditions: Conditions
    budget: int | None
    time: Floats
    error: Floats
    memory: Ints
    fetched: Floats
    triangles: Ints
    lacking: Ints
    begun: float | None
    floor: int
    delays: tuple[float, ...]
    never: int
    meetings: tuple[Meeting, ...]
    idle: Floats
    body: float
    overhead: float
    requests: int
    sorts: int

    @property
    def e(self) -> float:
        """Mean of the errors; NaN without tables."""
        known = self.error[np.isfinite(self.error)]
        return float(known.mean()) if len(known) else float("nan")

    @property
    def late(self) -> float:
        """Share of the time in which at least one of the nearest objects is not shown in full."""
        return float((self.lacking > 0).mean())

    @property
    def delay(self) -> float:
        """Mean of the delays, s; NaN without any."""
        return float(np.mean(self.delays)) if self.delays else float("nan")

    @property
    def reused(self) -> float:
        """Share of the preset's textures that were loaded when an object that uses them first
        became one of the nearest; 0 without textures."""
        textures = sum(meeting.textures for meeting in self.meetings)
        return sum(meeting.reused for meeting in self.meetings) / max(textures, 1)

    @property
    def idle_share(self) -> float:
        """Share of the walk without a pending request; 0 for a walk of one frame."""
        whole = float(self.time[-1])
        return float(np.diff(self.idle, axis=1).sum()) / whole if whole else 0.0

    @property
    def pauses(self) -> int:
        """Number of idle intervals of at least `PAUSE`."""
        return int((np.diff(self.idle, axis=1) >= PAUSE).sum())


def simulate_campus(
    world: CampusWorld,
    quality: Quality,
    options: CampusWalkOptions = CampusWalkOptions(),  # noqa: B008 - a frozen value
    trace: Trace | None = None,
    conditions: Conditions | None = None,
) -> CampusRun:
    """Simulates a walk. The same arguments give the same run, bit for bit. ``conditions`` replace
    the link of the options and the trace."""
    link = FluidLink(conditions or options.link(trace))
    client = CampusClient(world.stock, link, quality, options)
    frames, columns = world.frames, _Columns(world.stock)
    wanted = min(max(options.nearest, 1), world.stock.objects)
    error = np.full(frames, np.nan)
    fetched = np.zeros(frames)
    memory, lacking, triangles = (np.zeros(frames, np.int64) for _ in range(3))
    waits, begun = _Waits(client), None
    for f in range(frames):
        now = float(world.time[f])
        while finished := link.advance(now):
            client.receive(finished)
            client.fetch()
            if begun is None and client.begun:
                begun = link.now
        client.look(world.eye[f])
        client.fetch()
        waits.look(now)
        memory[f] = client.memory
        fetched[f] = link.bytes + sum(r.body_bytes for r in client.waiting)
        lacking[f] = waits.lacking if client.order.size else wanted
        view, (mesh, column) = int(world.view[f]), columns.state(client)
        triangles[f] = columns.faces[world.seen[f], mesh[world.seen[f]]].sum()
        if world.tables is not None and view >= 0:
            error[f] = world.tables.wrong(view, mesh, column)
    idle = [[*span, float(world.time[-1])][:2] for span in client.idle]
    low = np.unique([f for files in client.low for f in files]).astype(np.int64)
    return CampusRun(
        quality=quality,
        conditions=link.conditions,
        budget=options.budget,
        time=world.time,
        error=error,
        memory=memory,
        fetched=fetched,
        triangles=triangles,
        lacking=lacking,
        begun=begun,
        floor=int(world.stock.memory[low].sum()),
        delays=tuple(waits.delays),
        never=waits.never + len(waits.since),
        meetings=tuple(waits.meetings),
        idle=np.array(idle, dtype=np.float64).reshape(-1, 2),
        body=float(fetched[-1]),
        overhead=link.overhead_bytes,
        requests=link.requests,
        sorts=client.sorts,
    )


class _Columns:
    """Display state of objects and textures, by the files in graphics memory.

    Attributes
    ----------
    faces: (m, 3) triangles of each object in each state.
    """

    def __init__(self, stock: Stock) -> None:
        lods = [stock.meshes(number) for number in range(stock.objects)]
        self._coarse, self._fine = (
            np.array([item[i] for item in lods], dtype=np.int64) for i in (0, -1)
        )
        meshes = [item.meshes for item in stock.campus.objects]
        self.faces = np.array([[0, m[0].faces, m[-1].faces] for m in meshes], dtype=np.int64)
        bases = range(len(stock.bases))
        self._file = np.array(
            [[stock.diffuse(base, size) for size in SIZES] for base in bases], dtype=np.int64
        ).reshape(-1, len(SIZES))

    def state(self, client: CampusClient) -> tuple[Ints, Ints]:
        """(m,) of the objects, and (T,) of the textures, as `Tables.wrong` takes them."""
        shown = client.shown
        mesh = np.where(shown[self._coarse], COARSE, NOTHING)
        mesh[shown[self._fine]] = FINE
        column = (shown[self._file] * np.arange(1, len(SIZES) + 1)).max(axis=1, initial=0)
        return mesh, column.astype(np.int64)


@dataclass
class _Waits:
    """Waiting times of objects for their high detail, after they become near.

    Attributes
    ----------
    since: when each waiting object became one of the nearest, s.
    lacking: number of the nearest objects not shown in full.
    meetings: see `CampusRun`.
    """

    client: CampusClient
    since: dict[int, float] = field(default_factory=dict)
    delays: list[float] = field(default_factory=list)
    never: int = 0
    lacking: int = 0
    meetings: list[Meeting] = field(default_factory=list)
    _near: frozenset[int] = frozenset()
    _met: set[int] = field(default_factory=set)

    def look(self, now: float) -> None:
        """Updates the waiting times for a frame."""
        near = frozenset(self.client.near)
        for number in near - self._near:
            self.since[number] = now
        for number in self.client.near:
            self._meet(number, now)
        for number in self._near - near:
            self.never += self.since.pop(number, None) is not None
        self._near = near
        full = {number: self.client.full(number) for number in self.client.near}
        for number, shown in full.items():
            if shown and number in self.since:
                self.delays.append(now - self.since.pop(number))
        self.lacking = sum(not shown for shown in full.values())

    def _meet(self, number: int, now: float) -> None:
        if number not in self._met:
            self._met.add(number)
            client = self.client
            files = list(client.stock.textures(number, client.quality.diffuse))
            label, reused = (
                client.stock.campus.objects[number].label,
                int(client.loaded[files].sum()),
            )
            self.meetings.append(Meeting(label, now, len(files), reused))


@dataclass(frozen=True)
class CampusPolicy:
    """A campus client with a preset; ``name`` and ``about`` are for `--policy`."""

    name: str
    about: str
    quality: Quality


#: Campus policies by name.
CAMPUS_POLICIES = {
    f"campus-{name}": CampusPolicy(
        f"campus-{name}",
        f"client of --campus; width and height of textures and lightmaps in texels: {choice.about}",
        choice.quality,
    )
    for name, choice in QUALITIES.items()
}


def measure_campus_walk(
    place: CampusWorld, world: World, policy: CampusPolicy, link: Conditions, budget: int | None
) -> tuple[WalkRun, Measures]:
    """A run through a campus, and its measures; ``world`` is the same walk through the database."""
    tables = place.tables
    if tables is None:
        raise ValueError("the errors of the campus are not tabulated")
    run = _run(place, world.track.still, policy, link, budget)
    stands = place.standing(STANDS)
    standing = _run(stands, np.ones(stands.frames, np.bool_), policy, link, budget)
    nothing = np.zeros(place.stock.objects, np.int64), np.zeros(len(place.stock.bases), np.int64)
    nothing_loaded = tables.wrong(int(place.view[0]), *nothing)
    measures = replace(
        measure(run, world, standing),
        waste=nan,
        stalls=nan,
        uploads=nan,
        switches=nan,
        final=seconds_to(standing, nothing_loaded),
    )
    return run, measures


def _run(
    place: CampusWorld, still: Bools, policy: CampusPolicy, link: Conditions, budget: int | None
) -> WalkRun:
    memory = "inf" if budget is None else str(max(budget, 1))
    options = CampusWalkOptions(memory=memory, lightmaps=False)
    run = simulate_campus(place, policy.quality, options, conditions=link)
    frames = place.frames
    unknown = np.full(frames, nan)
    return WalkRun(
        policy=policy.name,
        conditions=link,
        budget=int(run.memory.max()) if budget is None else budget,
        time=run.time,
        still=still,
        error=run.error,
        square=unknown,
        missing=unknown,
        quality=unknown,
        memory=run.memory,
        fetched=run.fetched,
        column=np.zeros((frames, 0), np.int64),
        state=np.zeros((frames, 0), np.int64),
        loaded=np.zeros((frames, 0), np.bool_),
        body=run.body,
        overhead=run.overhead,
        documents=0,
        useful=nan,
        uploads=0,
        switches=0,
        requests=run.requests,
        stalls=0,
        overruns=0 if budget is None else int((run.memory > budget).sum()),
    )
