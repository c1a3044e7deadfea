"""Worker processes on this machine.

A shared value is written once to a temporary file, which the workers map, so its arrays lie in
memory once (a worker that changes some has those pages for itself). Changes are appended to the
file, and a worker reads on before its next task. Where the system can, the file has no name and
each task says where it is open; so nothing is left behind, however this process ends.
"""

from __future__ import annotations

import mmap
import os
import pickle
import tempfile
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor as Threads, Future
from itertools import count
from queue import LifoQueue
from typing import IO, Any, NamedTuple, TypeVar

from ptmtools.executors.model import AHEAD
from ptmtools.executors.order import in_chunks
from ptmtools.executors.outcome import Outcome
from ptmtools.executors.packing import packed, size, unpacked
from ptmtools.executors.serial import SerialSharing
from ptmtools.executors.worker import Worker
from ptmtools.files import writing

S = TypeVar("S")
T = TypeVar("T")
R = TypeVar("R")


class Processes:
    """So many workers."""

    def __init__(self, workers: int) -> None:
        self._workers = [Worker() for _ in range(workers)]
        #: Those that have been started are taken first.
        self._idle: LifoQueue[Worker] = LifoQueue()
        for worker in self._workers:
            self._idle.put(worker)

    def call(self, function: Callable[..., Iterable[Any]], *arguments: Any) -> Outcome:
        """As `Worker.call`, by one that is idle; any thread may."""
        worker = self._idle.get()
        try:
            return worker.call(function, *arguments)
        finally:
            self._idle.put(worker)

    def close(self) -> None:
        """Ends all of them, for good. Any thread may."""
        for worker in self._workers:
            worker.close()


class InProcesses(SerialSharing[S]):
    """See `Sharing`: each of the processes has a copy; ``threads``, as many, wait for them."""

    def __init__(self, shared: S, processes: Processes, threads: Threads, workers: int) -> None:
        super().__init__(shared)
        self._processes, self._threads, self._ahead = processes, threads, AHEAD * workers
        self._log: _Log | None = None

    def each(
        self, function: Callable[[S, T], R], tasks: Iterable[T], *, chunk: int = 1
    ) -> Iterator[R]:
        """See `Sharing.each`."""
        if self._log is None:
            self._log = _Log(self._shared)
        place = self._log.place()

        def submit(some: list[T]) -> Future[Outcome]:
            return self._threads.submit(self._processes.call, _results, place, function, some)

        return in_chunks(submit, tasks, chunk, lambda: self._ahead)

    def change(self, function: Callable[[S, T], object], change: T) -> None:
        """See `Sharing.change`."""
        super().change(function, change)
        if self._log:
            self._log.append(pickle.dumps((function, change), protocol=5))

    def __enter__(self) -> InProcesses[S]:
        return self

    def __exit__(self, *_: object) -> None:
        if self._log:
            self._log.close()


class _Place(NamedTuple):
    """Where a shared value lies: the name of this value, a path that the workers can open, the
    length of the block, and where the last change so far ends."""

    name: str
    path: str
    block: int
    end: int


class _Log:
    """The file of a shared value: its block, then changes, each after its length in 8 bytes."""

    _numbers = count()

    def __init__(self, shared: object) -> None:
        self._name = f"{os.getpid()}-{next(self._numbers)}"
        with writing(tempfile.gettempdir()):
            self._file, self._path = _temporary()
            pieces = packed(shared)
            self._file.writelines(pieces)
            self._file.flush()
        self._block = self._end = size(pieces)

    def append(self, change: bytes) -> None:
        with writing(tempfile.gettempdir()):
            self._file.write(len(change).to_bytes(8, "little") + change)
            self._file.flush()
        self._end += 8 + len(change)

    def place(self) -> _Place:
        return _Place(self._name, self._path, self._block, self._end)

    def close(self) -> None:
        self._file.close()


def _temporary() -> tuple[IO[bytes], str]:
    """A new file, and a path by which other processes can open it."""
    file = tempfile.TemporaryFile(prefix="ptmtools-")  # noqa: SIM115
    path = f"/proc/{os.getpid()}/fd/{file.fileno()}"
    if os.path.exists(path):
        return file, path
    file.close()
    named = tempfile.NamedTemporaryFile(prefix="ptmtools-")  # noqa: SIM115
    return named, named.name


class _Copy:
    """A worker's copy of a shared value."""

    def __init__(self, place: _Place) -> None:
        self.name = place.name
        self._file = open(place.path, "rb")  # noqa: SIM115
        memory = mmap.mmap(self._file.fileno(), place.block, access=mmap.ACCESS_COPY)
        self._value = unpacked(memoryview(memory))
        self._at = self._file.seek(place.block)

    def value(self, end: int) -> Any:
        """With all changes up to ``end`` of the file."""
        while self._at < end:
            length = int.from_bytes(self._file.read(8), "little")
            function, change = pickle.loads(self._file.read(length))
            function(self._value, change)
            self._at += 8 + length
        return self._value

    def close(self) -> None:
        self._file.close()


_copy: _Copy | None = None


def _results(
    place: _Place, function: Callable[[Any, Any], Any], tasks: Iterable[Any]
) -> Iterator[Any]:
    """In a worker: does some tasks."""
    global _copy
    if _copy is None or _copy.name != place.name:
        if _copy:
            _copy.close()
        _copy = None  # before the next one takes memory
        _copy = _Copy(place)
    value = _copy.value(place.end)
    for task in tasks:
        yield function(value, task)
