"""Worker processes on this machine.

A shared value is written once to a temporary file, which the workers map, so its arrays lie in
memory once (a worker that changes some has those pages for itself). Changes are appended to the
file, and a worker reads on before its next task. Where the system can, the file has no name and
each task says where it is open; so nothing is left behind, however this process ends.

Nor are the processes: each is at the other end of a pipe that only this process holds open, and
ends with it. (Those of `concurrent.futures` wait for work for ever if their parent is killed, and
it waits for ever for the rest of a result whose sender is. loky 3.7 waits for nobody, but of its
busy workers all still ran 15 s after their parent, and it sends what is shared with every task.)
"""

from __future__ import annotations

import mmap
import os
import pickle
import signal
import tempfile
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor as Threads
from concurrent.futures import Future
from itertools import count
from queue import LifoQueue, SimpleQueue
from typing import IO, TYPE_CHECKING, Any, NamedTuple, TypeVar

from ptmtools.errors import WorkerError
from ptmtools.executors.model import AHEAD
from ptmtools.executors.order import chunks, in_order
from ptmtools.executors.outcome import Outcome, outcome
from ptmtools.executors.packing import packed, size, unpacked
from ptmtools.executors.serial import SerialSharing
from ptmtools.files import writing

if TYPE_CHECKING:
    from multiprocessing.connection import Connection
    from multiprocessing.process import BaseProcess

S = TypeVar("S")
T = TypeVar("T")
R = TypeVar("R")


class Worker:
    """A process that does one thing after the other: started when there is first something to do,
    and again where it was lost."""

    def __init__(self) -> None:
        self._changing = threading.Lock()
        self._closed = False
        self._running: tuple[BaseProcess, Connection] | None = None

    def call(self, function: Callable[..., Iterable[Any]], *arguments: Any) -> Outcome:
        """What ``function(*arguments)`` yields there; all of it must be picklable.

        To be called by a thread that can do without Ctrl-C, of which it hears no more. Raises
        WorkerError PTM-W004 if the process ends.
        """
        try:
            pipe = self._started()
            pipe.send((function, arguments))
            found: Outcome = pipe.recv()
        except (EOFError, OSError) as fault:
            self._end()
            raise WorkerError(
                "PTM-W004",
                "a worker process ended while it worked",
                remedy="if it ran out of memory, use fewer workers (-j 1); a script "
                "that starts processes needs `if __name__ == '__main__'`",
            ) from fault
        return found

    def close(self) -> None:
        """Ends the process, in the middle of a task if need be, for good. Any thread may."""
        self._closed = True
        self._end()

    def _started(self) -> Connection:
        from multiprocessing import get_context, resource_tracker

        with self._changing:
            if self._closed:
                raise EOFError("the worker has been closed")
            if self._running is None:
                resource_tracker.ensure_running()  # which lets Ctrl-C through again when it starts
                if hasattr(signal, "pthread_sigmask"):
                    # For the process too, which hears of none while it is being started.
                    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
                context = get_context("spawn")
                ours, theirs = context.Pipe()
                process = context.Process(target=_work, args=(theirs,), daemon=True)
                with theirs:
                    process.start()
                self._running = process, ours
            return self._running[1]

    def _end(self) -> None:
        with self._changing:
            if self._running:
                process, _ = self._running
                process.kill()
                process.join()
                self._running = None


def _work(parent: Connection) -> None:
    """In a worker: does what comes through the pipe, until that ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    calls: SimpleQueue[bytes] = SimpleQueue()

    def listen() -> None:
        try:
            while True:
                calls.put(parent.recv_bytes())
        finally:
            os._exit(0)  # whatever it is doing

    threading.Thread(target=listen, daemon=True).start()
    while True:
        function, arguments = pickle.loads(calls.get())
        parent.send(outcome(function(*arguments)))


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

        for found in in_order(submit, chunks(tasks, chunk), lambda: self._ahead):
            yield from found

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
    return (function(value, task) for task in tasks)
