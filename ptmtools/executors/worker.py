"""A process that works for this one, and a task in the background.

The process is at the other end of a pipe that only this one holds open, and ends with it. (Tried:
those of `concurrent.futures` wait for work for ever if their parent is killed, and it waits for
ever for the rest of a result whose sender is. loky 3.7 waits for nobody, but its busy workers all
still ran 15 s after their parent was killed, and it sends what is shared with every task.)
"""

from __future__ import annotations

import os
import pickle
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from ptmtools.errors import WorkerError
from ptmtools.executors.outcome import Outcome, failed, outcome

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
        found = outcome(function(*arguments))
        try:
            parent.send(found)
        except Exception as fault:  # of pickling, before anything is sent
            parent.send(failed(fault))


class BackgroundTask(Generic[R]):
    """See `Pending`: ``function(shared, task)`` in a process of its own, which ends with it.

    Whoever begins one must ask for its result or cancel it. What travels must be picklable, and a
    script needs ``if __name__ == "__main__"``.
    """

    def __init__(self, function: Callable[[S, T], R], shared: S, task: T) -> None:
        self._worker = Worker()
        waiting = ThreadPoolExecutor(1, "background")
        self._done: Future[R] = waiting.submit(self._wait, function, shared, task)
        waiting.shutdown(wait=False)

    def result(self) -> R:
        """Waits for it. Raises what the task raises; WorkerError PTM-W004 if its process ends."""
        return self._done.result()

    def cancel(self) -> None:
        """Ends the process, in the middle of the task if need be."""
        self._worker.close()

    def add_done_callback(self, callback: Callable[[Any], object]) -> None:
        """``callback`` is called, by another thread, once the process has ended."""
        self._done.add_done_callback(callback)

    def _wait(self, function: Callable[[S, T], R], shared: S, task: T) -> R:
        try:
            (found,) = self._worker.call(_result, function, shared, task)
        finally:
            self._worker.close()
        result: R = found
        return result


def _result(function: Callable[[S, T], R], shared: S, task: T) -> Iterator[R]:
    yield function(shared, task)
