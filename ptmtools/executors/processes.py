"""Worker processes on this machine.

A shared value is written once to a temporary file, which the workers map, so its arrays lie in
memory once (a worker that changes some has those pages for itself). Changes are appended to the
file, and a worker reads on before its next task. Where the system can, the file has no name and
each task says where it is open; so nothing is left behind, however this process ends.

Nor are the processes: each waits, in a thread, for the end of a pipe that only this process holds
open. (Those of `concurrent.futures` would wait for work for ever if their parent was killed.)
"""

from __future__ import annotations

import mmap
import os
import pickle
import signal
import tempfile
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import IO, Any, Generic, TypeVar

from ptmtools.errors import WorkerError
from ptmtools.executors.model import AHEAD
from ptmtools.executors.order import chunks, in_order
from ptmtools.executors.outcome import Outcome, outcome
from ptmtools.executors.packing import packed, size, unpacked
from ptmtools.files import writing

S = TypeVar("S")
T = TypeVar("T")
R = TypeVar("R")


class Processes:
    """A pool of processes, started when there is first something to do."""

    def __init__(self, workers: int) -> None:
        self.workers = workers
        self._changing = threading.Lock()
        self._closed = False
        self._pool: ProcessPoolExecutor | None = None
        self._lifeline: Connection | None = None

    @contextmanager
    def sharing(self, shared: S) -> Iterator[_InProcesses[S]]:
        """See `Executor.sharing`."""
        with _InProcesses(self, shared) as sharing:
            yield sharing

    def outcomes(self, jobs: Iterable[tuple[Any, ...]]) -> Iterator[Outcome]:
        """``_outcome(*job)`` for each job, in order.

        Raises WorkerError PTM-W004 if a process ends.
        """
        pool = self._opened()

        def submit(job: tuple[Any, ...]) -> Future[Outcome]:
            with ctrl_c_blocked():
                return pool.submit(_outcome, *job)

        try:
            yield from in_order(submit, jobs, lambda: AHEAD * self.workers)
        except BrokenProcessPool as fault:
            self._drop()
            raise lost() from fault

    def close(self) -> None:
        """Ends the processes, whatever they are doing; no more are started. Any thread may."""
        self._drop(for_good=True)

    def _drop(self, for_good: bool = False) -> None:
        with self._changing:
            pool, lifeline = self._pool, self._lifeline
            self._pool = self._lifeline = None
            self._closed |= for_good
        if lifeline:
            lifeline.close()
        if pool:
            pool.shutdown(cancel_futures=True)

    def _opened(self) -> ProcessPoolExecutor:
        with self._changing:
            if self._closed:
                raise RuntimeError("these processes have been closed")
            if self._pool is None:
                context = get_context("spawn")
                theirs, self._lifeline = context.Pipe(duplex=False)
                self._pool = ProcessPoolExecutor(self.workers, context, begin, (theirs,))
            return self._pool


class _InProcesses(Generic[S]):
    """See `Sharing`."""

    def __init__(self, processes: Processes, shared: S) -> None:
        self._processes, self._shared = processes, shared
        self._log: _Log | None = None

    def each(
        self, function: Callable[[S, T], R], tasks: Iterable[T], *, chunk: int = 1
    ) -> Iterator[R]:
        """See `Sharing.each`."""
        if self._log is None:
            self._log = _Log(self._shared)
        place = self._log.place()
        jobs = ((place, function, some) for some in chunks(tasks, chunk))
        for found in self._processes.outcomes(jobs):
            yield from found

    def change(self, function: Callable[[S, T], object], change: T) -> None:
        """See `Sharing.change`."""
        function(self._shared, change)
        if self._log:
            self._log.append(pickle.dumps((function, change), protocol=5))

    def __enter__(self) -> _InProcesses[S]:
        return self

    def __exit__(self, *_: object) -> None:
        if self._log:
            self._log.close()


@dataclass(frozen=True)
class _Place:
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


def _outcome(place: _Place, function: Callable[[Any, Any], Any], tasks: list[Any]) -> Outcome:
    """In a worker: does some tasks."""
    global _copy
    if _copy is None or _copy.name != place.name:
        if _copy:
            _copy.close()
        _copy = None  # before the next one takes memory
        _copy = _Copy(place)
    return outcome(function, _copy.value(place.end), tasks)


def lost() -> WorkerError:
    """The error for a process that is no more, PTM-W004."""
    return WorkerError(
        "PTM-W004",
        "a worker process ended while it worked",
        remedy="if it ran out of memory, use fewer workers (-j 1); a script "
        "that starts processes needs `if __name__ == '__main__'`",
    )


@contextmanager
def ctrl_c_blocked() -> Iterator[None]:
    """A process that this thread starts hears of no Ctrl-C, not even while it is being started."""
    if not hasattr(signal, "pthread_sigmask"):  # not POSIX
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def begin(lifeline: Connection) -> None:
    """In a worker, first of all: end with the parent, and leave Ctrl-C to it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def follow() -> None:
        try:
            lifeline.poll(None)
        finally:
            os._exit(0)

    threading.Thread(target=follow, daemon=True).start()
