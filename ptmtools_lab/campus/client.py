"""The client of the campus (the paper's III).

1. It loads the index; then the coarsest mesh of every object with textures of the least size, the
   nearest object first.
2. It wants the K nearest objects in high detail: the finest mesh, then textures of the preset, then
   the lightmap.
3. Each of several threads takes the nearest object with files that are not yet requested, and loads
   them one after the other. A thread finishes its object wherever the viewpoint moves.
4. `ptmtools_systems.campus.model` defines the distance of an object. The client sorts objects
   again when the viewpoint has moved by `move`.
5. An object that leaves the K nearest is shown by its coarsest mesh at once. Downloaded files stay
   in main memory and are shown again without a request.

Our reading: a mesh or a texture is shown as soon as it has arrived, so an object is refined file by
file. A texture belongs to a material, not to an object: it is shown wherever its material is, also
on coarse meshes, in the finest size in graphics memory. Coarsest meshes and least textures always
stay there, as the paper's 28 MB do.

Our addition: a budget of graphics memory. The client goes through the sorted objects, once for low
detail and once for high detail, and skips an object that does not fit into the rest of the budget;
it does not request that object either. It knows only the file sizes of meshes, which exceed their
graphics memory.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools_lab.campus.options import CampusWalkOptions
from ptmtools_lab.campus.stock import Stock
from ptmtools_lab.network import FluidLink, Request
from ptmtools_systems.campus.model import Quality, distances

#: Number of the index among the files.
_INDEX = 0


class CampusClient:
    """A client with a preset, on a link.

    Attributes
    ----------
    order: (m,) objects as last sorted, the nearest first; empty before the index has arrived.
    near: objects wanted in high detail.
    loaded: (n,) which files are in main memory.
    shown: (n,) which files are in graphics memory.
    low, high: of each object, the files of either detail.
    asked: (n,) which files were requested. sorts: number of sorts of the objects.
    idle: intervals, s, without a pending request; the last may have no end yet.
    """

    def __init__(
        self, stock: Stock, link: FluidLink, quality: Quality, options: CampusWalkOptions
    ) -> None:
        self.stock, self.link, self.quality, self.options = stock, link, quality, options
        self.order: Ints = np.zeros(0, np.int64)
        self.near: tuple[int, ...] = ()
        self.low = [stock.low(o) for o in range(stock.objects)]
        self.high = [stock.high(o, quality, options.lightmaps) for o in range(stock.objects)]
        files = len(stock.names)
        self.loaded: Bools = np.zeros(files, dtype=np.bool_)
        self.asked: Bools = np.zeros(files, dtype=np.bool_)
        self.shown: Bools = np.zeros(files, dtype=np.bool_)
        self.idle: list[list[float]] = []
        self.sorts = 0
        self._sizes = stock.stored if options.stored else stock.sent
        self._eye: Floats | None = None
        self._sorted_at: Floats | None = None
        #: Files that fit, and the objects that may request each detail, in order.
        self._room: Bools = np.zeros(files, dtype=np.bool_)
        self._wanted: list[deque[int]] = [deque(), deque()]
        #: By the number of a pending file: the request of a thread, and its further files.
        self._threads: dict[int, tuple[Request, deque[int]]] = {}

    @property
    def memory(self) -> int:
        """Bytes of graphics memory in use."""
        return int(self.stock.memory[self.shown].sum())

    @property
    def waiting(self) -> list[Request]:
        """Pending requests."""
        return [request for request, _ in self._threads.values()]

    @property
    def begun(self) -> bool:
        """Whether all low detail that fits has arrived."""
        base = [f for files in self.low for f in files if self._room[f]]
        return bool(len(self.order) and self.loaded[base].all())

    def full(self, number: int) -> bool:
        """Whether an object is shown in the preset's detail."""
        return bool(self.shown[list(self.high[number])].all())

    def look(self, eye: Floats) -> None:
        """Moves the viewpoint to (3,) and updates graphics memory."""
        self._eye = np.array(eye, dtype=np.float64)
        self._sort()
        self.shown = self.loaded & self._room

    def receive(self, request: Request) -> None:
        """Handles a finished request: its thread goes on."""
        file = int(request.tag)  # type: ignore[call-overload]
        self.loaded[file] = True
        _, rest = self._threads.pop(file)
        if file == _INDEX:
            self._sort()
        self._continue(rest)

    def fetch(self) -> None:
        """Gives the next objects to free threads; called in every frame and after every arrival."""
        if not self.asked[_INDEX]:
            self._continue(deque([_INDEX]))
        elif self.loaded[_INDEX]:
            while len(self._threads) < self.options.threads and (job := self._job()):
                self._continue(job)
        if bool(self.idle and len(self.idle[-1]) == 1) == bool(self._threads):
            if self._threads:
                self.idle[-1].append(self.link.now)
            else:
                self.idle.append([self.link.now])

    def _sort(self) -> None:
        """Sorts objects by distance and updates their demands, if the viewpoint has moved."""
        if self._eye is None or not self.loaded[_INDEX]:
            return
        if self._sorted_at is not None:
            moved = float(np.linalg.norm(self._eye - self._sorted_at))
            if moved < self.options.move or not moved:
                return
        self._sorted_at = self._eye
        self.sorts += 1
        distance = distances(self._eye, self.stock.boxes, self.stock.barycentres)
        self.order = np.argsort(distance, kind="stable")
        self.near = tuple(self.order[: self.options.nearest].tolist())
        self._make_room()

    def _make_room(self) -> None:
        budget = self.options.budget
        self._room = np.zeros(len(self.stock.names), dtype=np.bool_)
        remaining, low = self._fill(self.order.tolist(), self.low, budget)
        _, high = self._fill(self.near, self.high, remaining)
        self._wanted = [low, high]

    def _fill(
        self, objects: Iterable[int], files: list[tuple[int, ...]], remaining: int | None
    ) -> tuple[int | None, deque[int]]:
        """The rest of a budget, None without one, and the objects that fit."""
        chosen: deque[int] = deque()
        for number in objects:
            new = [f for f in files[number] if not self._room[f]]
            size = int(self.stock.most[new].sum())
            if remaining is not None:
                if size > remaining:
                    continue
                remaining -= size
            self._room[new] = True
            chosen.append(number)
        return remaining, chosen

    def _job(self) -> deque[int] | None:
        """The files of the nearest object that are not yet requested; low detail of all objects
        comes before high detail of any."""
        for wanted, files in zip(self._wanted, (self.low, self.high), strict=True):
            while wanted:
                lacking = deque(f for f in files[wanted[0]] if not self.asked[f])
                if lacking:
                    return lacking
                wanted.popleft()
        return None

    def _continue(self, files: deque[int]) -> None:
        """Requests the next file of a thread."""
        while files:
            file = files.popleft()
            if not self.asked[file]:
                self.asked[file] = True
                size = 0 if self.quality.cached else int(self._sizes[file])
                self._threads[file] = self.link.request(size, 0.0, file), files
                return
