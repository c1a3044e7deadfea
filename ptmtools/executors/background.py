"""One task in the background, whose result may turn out not to be wanted."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from ptmtools.executors.outcome import outcome

if TYPE_CHECKING:
    from multiprocessing.connection import Connection
    from multiprocessing.process import BaseProcess

S = TypeVar("S")
T = TypeVar("T")
R = TypeVar("R")


class BackgroundTask(Generic[R]):
    """See `Pending`: ``function(shared, task)`` in a process of its own, which ends with it.

    Whoever begins one must ask for its result or cancel it. What travels must be picklable, and a
    script needs ``if __name__ == "__main__"``.

    Not a pool of one: that waits forever for the rest of a result whose sender was killed.
    """

    def __init__(self, function: Callable[[S, T], R], shared: S, task: T) -> None:
        self._process: BaseProcess | None = None
        self._cancelled = False
        waiting = ThreadPoolExecutor(1, "background")
        self._done: Future[R] = waiting.submit(self._wait, function, shared, task)
        waiting.shutdown(wait=False)

    def result(self) -> R:
        """Waits for it. Raises what the task raises; WorkerError PTM-W004 if its process ends."""
        return self._done.result()

    def cancel(self) -> None:
        """Ends the process, in the middle of the task if need be."""
        self._cancelled = True
        if self._process:
            self._process.kill()

    def add_done_callback(self, callback: Callable[[Any], object]) -> None:
        """``callback`` is called, by another thread, once the process has ended."""
        self._done.add_done_callback(callback)

    def _wait(self, function: Callable[[S, T], R], shared: S, task: T) -> R:
        from multiprocessing import get_context, resource_tracker

        from ptmtools.executors.processes import ctrl_c_blocked, lost

        context = get_context("spawn")
        ours, theirs = context.Pipe()
        follows, lifeline = context.Pipe(duplex=False)
        process = context.Process(target=_do, args=(follows, theirs), daemon=True)
        resource_tracker.ensure_running()  # which lets Ctrl-C through again when it starts
        with ours, lifeline:
            with follows, theirs, ctrl_c_blocked():
                process.start()
            self._process = process
            if self._cancelled:
                process.kill()
            try:
                ours.send((function, shared, task))
                (result,) = ours.recv()
            except (EOFError, OSError) as fault:
                raise lost() from fault
            finally:
                process.kill()
                process.join()
        found: R = result
        return found


def _do(lifeline: Connection, parent: Connection) -> None:
    """In the process: the task comes, and its result goes, through a pipe of which the parent
    holds one end alone, so that neither waits for one that has ended."""
    from ptmtools.executors.processes import begin

    begin(lifeline)
    function, shared, task = parent.recv()
    parent.send(outcome(function, shared, [task]))
