"""The client `paper`: that of Marvie & Bouatouch, §6.1 and §6.2, as written.

In every rendered frame (30 a second here; pictures are evaluated five times a second):

1. The cells of the visible set are culled by their hulls, and the coverage hints of the rest
   normalised. From the greatest hint down, a cell gets its part of the remaining memory, by its
   hint over those of the cells not yet served, and shares it equally among its shapes in the
   frustum. Unused memory is left for the next cell.
2. A texture that keeps N bytes so far is offered a: T is its next level, or its present one if
   there is no other. If S(T) > N + a it keeps a, else it keeps the rest of S(T). S is the whole
   pyramid up to a level: the level alone would break the budget.
3. Each texture adds or removes one level, or requests one if its expected download, the latency and
   its bytes by the bandwidth of recent downloads, ends within δt.
4. While the viewpoint has been static for t_static, M_static and δt_static replace the budget and
   δt (`PaperOptions`).

A client that enters a cell drops textures that its visible set does not use. The next cell, behind
the first portal that the motion of the last half second reaches within two seconds, is fetched
ahead. Requests are made at once, for the cell, then its visible set, then the next cell, then
levels, which are requested as a whole and never cancelled.

Our reading: a level is added only if it fits, and when the budget shrinks, levels are dropped until
it is kept. By the letter levels are dropped one a frame while others are added at once, and a
client that turns around, or walks on, would exceed its budget.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.jit import kernel, plain_kernel
from ptmtools.options import option, require
from ptmtools.quantities import MemorySize, parse_memory
from ptmtools.site.client import AHEAD, BEFORE, PATIENCE, PATIENCE_STILL, STILL_SECONDS
from ptmtools_lab.client import Client, FileKind, Range
from ptmtools_lab.network import FluidLink
from ptmtools_lab.world import World


@plain_kernel
def share_out(
    cells: Ints,
    weight: Floats,
    first_shape: Ints,
    texture: Ints,
    shown: Bools,
    memory: Ints,
    levels: Ints,
    column: Ints,
    budget: float,
    share: Floats,
) -> None:
    """Adds to ``share`` (T,) the bytes that each texture keeps.

    Parameters
    ----------
    cells, weight: (n,) cells in the frustum by descending hint, and their hints.
    first_shape, texture, shown: (C + 1,), (S,), (S,) shapes of cells, their textures, and whether
        they are textured and in the frustum.
    memory, levels, column: (T, K), (T,), (T,): column 0 is nothing.
    """
    remaining, total = budget, weight.sum()
    for i in range(len(cells)):
        begin, end = first_shape[cells[i]], first_shape[cells[i] + 1]
        part = remaining * weight[i] / total if total > 0.0 else 0.0
        total -= weight[i]
        waiting = 0
        for s in range(begin, end):
            waiting += shown[s]
        rest = part
        for s in range(begin, end):
            if not shown[s]:
                continue
            offer = rest / waiting
            waiting -= 1
            t = texture[s]
            wanted = float(memory[t, min(column[t] + 1, levels[t])])
            if wanted > share[t] + offer:
                share[t] += offer
                rest -= offer
            else:
                rest -= max(0.0, wanted - share[t])
                share[t] = max(share[t], wanted)
        remaining -= part - rest


@kernel
def refresh(
    share: Floats,
    memory: Ints,
    levels: Ints,
    have: Ints,
    pending: Bools,
    budget: int,
    column: Ints,
) -> Ints:
    """Removes and adds a level of each texture, by its kept and downloaded bytes; returns the
    textures whose next level is to be requested. ``column`` (T,) changes.

    Further levels are removed while all together exceed the budget, as when it has shrunk.
    """
    asks = np.zeros(len(share), np.int64)
    count, used, removed = 0, budget + 1, True
    before = column.copy()
    while removed and used > budget:
        used, removed = 0, False
        for t in range(len(share)):
            if column[t] > 0 and memory[t, column[t]] > share[t]:
                column[t] -= 1
                removed = True
            used += memory[t, column[t]]
    for t in range(len(share)):
        current = column[t]
        if current < before[t] or current >= levels[t] or memory[t, current + 1] > share[t]:
            continue
        if current + 1 <= have[t]:
            more = memory[t, current + 1] - memory[t, current]
            if used + more <= budget:
                used += more
                column[t] = current + 1
        elif not pending[t]:
            asks[count] = t
            count += 1
    return asks[:count]


#: Rendered frames per second.
FRAMES = 30
#: Priorities of requests: levels, the next cell, the visible set, the cell.
LEVEL, NEXT, VISIBLE, CURRENT = 1.0, 2.0, 3.0, 4.0


@dataclass(frozen=True)
class PaperOptions:
    """The parameters of §6.2 that the user sets.

    Raises InputError: PTM-I111 an unreadable amount of memory or another value out of range.
    """

    heading: ClassVar[str] = "Policy paper"

    delta_t: float = option(
        PATIENCE, "Maximum time to download a level while the viewpoint moves.", metavar="SECONDS"
    )
    delta_t_static: float = option(
        PATIENCE_STILL,
        "Maximum time to download a level while the viewpoint is static.",
        metavar="SECONDS",
    )
    static_memory: str = option(
        "",
        "Texture memory while the viewpoint is static: 16MiB, 40% or inf. Default: the value of "
        "--memory.",
        metavar="SIZE",
    )
    static_after: float = option(
        STILL_SECONDS,
        "Time without movement after which the viewpoint is static.",
        metavar="SECONDS",
    )

    def __post_init__(self) -> None:
        self.memory  # noqa: B018 - raises for an unreadable amount
        for name in ("delta_t", "delta_t_static", "static_after"):
            seconds = getattr(self, name)
            text = f"--{name.replace('_', '-')} {seconds:g} is out of range"
            require((0 <= seconds < math.inf, text, "use 0 or more, finite"))

    @property
    def memory(self) -> MemorySize | None:
        """Texture memory of a static viewpoint; None for that of a moving one."""
        return parse_memory(self.static_memory) if self.static_memory else None

    def limits(self, world: World, budget: int) -> Ints:
        """(F,) bytes of texture memory in each frame; ``budget`` is that of a moving viewpoint."""
        static = budget
        if self.memory:
            static_memory, whole = (
                self.memory.limit_of(world.catalogue.whole),
                world.catalogue.whole,
            )
            static = whole if static_memory is None else static_memory
        return np.where(world.track.still_after(self.static_after), static, budget)


class PaperClient(Client):
    """The client of the module."""

    def __init__(
        self, world: World, link: FluidLink, budget: int, options: PaperOptions = PaperOptions()
    ) -> None:
        super().__init__(world, link, budget)
        self.ticks = max(1, round(FRAMES / world.track.rate))
        self._options = options
        self._static = world.track.still_after(options.static_after)
        self._limits = options.limits(world, budget)
        stock = world.catalogue
        self._pending = np.zeros(stock.texture_count, dtype=bool)
        self._used = np.zeros(stock.texture_count, dtype=bool)
        self._cells = np.zeros(0, np.int64)
        self._weight = np.zeros(0)
        self._shapes: Bools = np.zeros(len(stock.shapes.cell), dtype=bool)
        self._hulls = [
            np.concatenate([leaf["points"] for leaf in r["leaves"]]) for r in stock.records
        ]

    def look(self, frame: int) -> None:
        """See `Client.look`."""
        before = self.cell
        super().look(frame)
        if self.cell >= 0:
            if self.cell != before:
                self._enter()
            self._cull()
        self.tick()

    def tick(self) -> None:
        """Renders a frame: steps 1 to 3, and requests for levels."""
        if self.cell < 0:
            return
        stock, static = self.world.catalogue, bool(self._static[self.frame])
        budget = int(self._limits[self.frame])
        shapes = stock.shapes
        share = np.zeros(stock.texture_count)
        share_out(
            self._cells, self._weight, stock.first_shape, shapes.texture, self._shapes,
            stock.memory, stock.levels, self.column, float(budget), share,
        )  # fmt: skip
        have = self.have
        asks = refresh(share, stock.memory, stock.levels, have, self._pending, budget, self.column)
        limit = self._options.delta_t_static if static else self._options.delta_t
        for t in asks.tolist():
            end = int(stock.ends[t, have[t] + 1])
            size = end - int(self.textures.asked[t])
            if self._used[t] and self.estimate.duration(size) <= limit:
                self._pending[t] = True
                self.ask(FileKind.TEXTURE, t, end, LEVEL)

    def fetch(self) -> None:
        """See `Client.fetch`: documents and geometry; `tick` requests levels."""
        if not self.files[FileKind.INDEX].asked[0]:
            self._request(FileKind.INDEX, 0, CURRENT)
        if not self.index:
            return
        current = int(self.world.track.cell[self.frame])
        self._request(FileKind.RECORD, current, CURRENT)
        self._request(FileKind.GEOMETRY, current, CURRENT)
        if self.cell < 0:
            return
        for cell in self.visible_set().tolist():
            self._request(FileKind.GEOMETRY, cell, VISIBLE)
        # The paper has no levels of detail: the objects as modelled follow the cells.
        known = self.visible_set()
        for mesh in self.finest_meshes(known[self.geometry.whole[known]]):
            self._request(FileKind.MESH, mesh, VISIBLE)
        following = self._next()
        if following >= 0:
            self._request(FileKind.RECORD, following, NEXT)
            self._request(FileKind.GEOMETRY, following, NEXT)

    def receive(self, request: object) -> None:
        """See `Client.receive`."""
        super().receive(request)  # type: ignore[arg-type]
        part = request.tag  # type: ignore[attr-defined]
        if part.kind == FileKind.TEXTURE:
            self._pending[part.number] = False

    def settle(self) -> None:
        """See `Client.settle`: `tick` does it."""

    def visible_set(self) -> Ints:
        """The visible set of the cell in use."""
        return self.world.catalogue.visible[self.cell]

    def _request(self, kind: FileKind, number: int, priority: float) -> None:
        """Requests a file, or raises the priority of its request."""
        files = self.files[kind]
        if not self.whole(kind, number, priority) and not files.whole[number]:
            part = Range(kind, number, 0, int(files.size[number]))
            for request in self.waiting:
                if request.tag == part and request.priority < priority:
                    self.link.reprioritise(request, priority)

    def _enter(self) -> None:
        """Drops textures that the visible set of a new cell does not use."""
        self._used[:] = False
        self._used[self.world.catalogue.in_sight[self.cell]] = True
        self.column[~self._used] = 0

    def _cull(self) -> None:
        stock = self.world.catalogue
        frustum = self.world.frustum(self.frame)
        loaded = self.geometry.whole
        known, hint = self.visible_set(), stock.coverage[self.cell]
        seen = np.array(
            [loaded[c] and (c == self.cell or frustum.meets_hull(self._hulls[c])) for c in known]
        )
        order = np.argsort(-hint[seen], kind="stable")
        self._cells, self._weight = known[seen][order], hint[seen][order]
        self._shapes = frustum.meets_boxes(stock.shapes.low, stock.shapes.high) & (
            stock.shapes.texture >= 0
        )

    def _next(self) -> int:
        """The cell behind the first portal that the recent motion will soon reach, or -1."""
        world, f = self.world, self.frame
        before = max(0, f - round(BEFORE * world.track.rate))
        way = world.track.eye[f] - world.track.eye[before]
        if f == before or not way.any():
            return -1
        way = way * (AHEAD / float(world.track.time[f] - world.track.time[before]))
        result, nearest = -1, np.inf
        for portal in world.catalogue.records[self.cell]["portals"]:
            polygon = np.array(portal["polygon"], dtype=np.float64)
            distance = _crossing(world.track.eye[f], way, polygon)
            if distance < nearest:
                result, nearest = int(portal["neighbour"]), distance
        return result


def _crossing(eye: Floats, way: Floats, polygon: Floats) -> float:
    """The share of a motion at which it reaches a convex polygon, or infinity if it does not pass
    through."""
    turned = np.cross(polygon, np.roll(polygon, -1, axis=0)).sum(axis=0)
    facing = float(turned @ way)
    if facing == 0:
        return float(np.inf)
    share = float(turned @ (polygon[0] - eye)) / facing
    if not 0 <= share <= 1:
        return float(np.inf)
    offset = polygon - (eye + share * way)
    sides = np.cross(offset, np.roll(offset, -1, axis=0)) @ turned
    return share if (sides >= 0).all() or (sides <= 0).all() else float(np.inf)
