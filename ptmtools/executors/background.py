"""One task in the background, whose result may turn out not to be wanted."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, Generic, TypeVar

from ptmtools.executors.processes import Worker

S = TypeVar("S")
T = TypeVar("T")
R = TypeVar("R")


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
