"""The client of the campus (the paper's III).

1. The index; then the coarsest mesh of every object with textures of the least size, the nearest
   object first.
2. The K nearest objects are wanted in high detail: the finest mesh, then textures of the preset,
   then the lightmap.
3. So many threads each take the nearest object that lacks something that nobody has asked for yet,
   and load its files one after the other. What was begun is finished, wherever the viewpoint is.
4. How near objects are is `ptmtools.neighbours.campus.model`; they are sorted again when the
viewpoint has
   moved by `move` since.
5. An object that is no longer among the K nearest is shown by its coarsest mesh at once. What was
   downloaded stays in main memory, and is shown again without a request.

Read in: a mesh or a texture is shown as soon as it is there, so an object is refined file by file.
A texture is one of a material, not of an object: it is shown wherever its material is, on coarse
meshes too, in the finest size that is in graphics memory. Coarsest meshes and least textures stay
there for good, as the paper's 28 MB do.

Ours: a budget of graphics memory. The client goes through objects as they are sorted, once for what
everybody shows and once for high detail, and passes over what has no room beside what came before;
what has no room is not asked for either. Of meshes it knows the bytes of their files, which are
more than they take.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.lab.campus.options import CampusWalkOptions
from ptmtools.lab.campus.stock import Stock
from ptmtools.lab.network import Link, Request
from ptmtools.neighbours.campus.model import Quality, distances

#: The number of the index among the files.
_INDEX = 0


class CampusClient:
    """A client with a preset, on a link.

    Attributes
    ----------
    order: (m,) objects, the nearest first, as sorted last; empty before the index is there.
    near: those that are wanted in high detail.
    there: (n,) which files are in main memory.
    shown: (n,) which files are in graphics memory.
    low, high: of each object, the files of either detail.
    asked: (n,) which files were asked for. sorts: how often objects were sorted.
    idle: spans of time, s, in which nothing was on the way; the last may have no end yet.
    """

    def __init__(
        self, stock: Stock, link: Link, quality: Quality, options: CampusWalkOptions
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
        #: Files that there is room for, and the objects that may ask for each detail, in order.
        self._room: Bools = np.zeros(files, dtype=np.bool_)
        self._wanted: list[deque[int]] = [deque(), deque()]
        #: What each thread has on the way, and its files after that, by the number of the file.
        self._threads: dict[int, tuple[Request, deque[int]]] = {}

    @property
    def memory(self) -> int:
        """Bytes of graphics memory in use."""
        return int(self.stock.memory[self.shown].sum())

    @property
    def waiting(self) -> list[Request]:
        """What is on the way."""
        return [request for request, _ in self._threads.values()]

    @property
    def begun(self) -> bool:
        """Whether all that is loaded first and has room is there."""
        base = [f for files in self.low for f in files if self._room[f]]
        return bool(len(self.order) and self.loaded[base].all())

    def full(self, number: int) -> bool:
        """Whether an object is shown in the preset's detail."""
        return bool(self.shown[list(self.high[number])].all())

    def look(self, eye: Floats) -> None:
        """The viewpoint is at (3,); what is in graphics memory changes."""
        self._eye = np.array(eye, dtype=np.float64)
        self._sort()
        self.shown = self.loaded & self._room

    def arrived(self, request: Request) -> None:
        """A request is finished: its thread goes on."""
        file = int(request.tag)  # type: ignore[call-overload]
        self.loaded[file] = True
        _, rest = self._threads.pop(file)
        if file == _INDEX:
            self._sort()
        self._continue(rest)

    def fetch(self) -> None:
        """Threads that are free take the next objects; called in every frame, and whenever
        something has arrived."""
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
        """Objects by their distance, and what follows from it, if the viewpoint has moved."""
        if self._eye is None or not self.loaded[_INDEX]:
            return
        if self._sorted_at is not None:
            moved = float(np.linalg.norm(self._eye - self._sorted_at))
            if moved < self.options.move or not moved:
                return
        self._sorted_at = self._eye
        self.sorts += 1
        far = distances(self._eye, self.stock.boxes, self.stock.barycentres)
        self.order = np.argsort(far, kind="stable")
        self.near = tuple(self.order[: self.options.nearest].tolist())
        self._make_room()

    def _make_room(self) -> None:
        budget = self.options.budget
        self._room = np.zeros(len(self.stock.names), dtype=np.bool_)
        left, low = self._filled(self.order.tolist(), self.low, budget)
        _, high = self._filled(self.near, self.high, left)
        self._wanted = [low, high]

    def _filled(
        self, objects: Iterable[int], files: list[tuple[int, ...]], left: int | None
    ) -> tuple[int | None, deque[int]]:
        """What is left of a budget, None without one, and which objects found room in it."""
        chosen: deque[int] = deque()
        for number in objects:
            new = [f for f in files[number] if not self._room[f]]
            takes = int(self.stock.most[new].sum())
            if left is not None:
                if takes > left:
                    continue
                left -= takes
            self._room[new] = True
            chosen.append(number)
        return left, chosen

    def _job(self) -> deque[int] | None:
        """The files of the nearest object that lacks some that nobody has asked for; low detail of
        all objects comes before high detail of any."""
        for wanted, files in zip(self._wanted, (self.low, self.high), strict=True):
            while wanted:
                lacking = deque(f for f in files[wanted[0]] if not self.asked[f])
                if lacking:
                    return lacking
                wanted.popleft()
        return None

    def _continue(self, files: deque[int]) -> None:
        """A thread asks for the next of its files."""
        while files:
            file = files.popleft()
            if not self.asked[file]:
                self.asked[file] = True
                size = 0 if self.quality.cached else int(self._sizes[file])
                self._threads[file] = self.link.request(size, 0.0, file), files
                return
