"""Several tasks at a time on this machine: threads where they can, processes where they must.

Threads share all memory and start at once, but only where the interpreter's lock is released do
they add speed. The processes are started anew ("spawn"), when there is first something for them,
and kept. See `processes` for them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import AbstractContextManager, nullcontext
from typing import Any, TypeVar

from ptmtools.executors.model import AHEAD, Executor, Pending, Sharing, processors
from ptmtools.executors.order import in_order
from ptmtools.executors.processes import InProcesses, Processes
from ptmtools.executors.serial import Serial, SerialSharing
from ptmtools.executors.worker import BackgroundTask

S = TypeVar("S")
T = TypeVar("T")
R = TypeVar("R")


class Local(Executor):
    """See `Executor`. ``workers`` threads or processes, 0 is one for each processor.

    Without ``threads`` all is done by processes, for a caller beside whom another thread of this
    process keeps the interpreter's lock. A script that has processes started needs
    ``if __name__ == "__main__"``.
    """

    def __init__(self, workers: int = 0, *, threads: bool = True) -> None:
        self._workers = workers or processors()
        self.remote = not threads
        # Both start what they consist of when there is first something to do.
        self._threads = ThreadPoolExecutor(self._workers, "ptmtools")
        self._processes = Processes(self._workers)

    @property
    def workers(self) -> int:
        """How many threads, or processes."""
        return self._workers

    def sharing(
        self, shared: S, *, releases_lock: bool = False
    ) -> AbstractContextManager[Sharing[S]]:
        """See `Executor.sharing`."""
        if self._workers == 1 and not self.remote:
            return nullcontext(SerialSharing(shared))
        if releases_lock and not self.remote:
            return nullcontext(_InThreads(shared, self._threads, self._workers))
        return InProcesses(shared, self._processes, self._threads, self._workers)

    def submit(
        self, function: Callable[[S, T], R], shared: S, task: T, *, long: bool = True
    ) -> Pending[R]:
        """See `Executor.submit`: in a process of its own."""
        if self._workers == 1 or not long:
            return super().submit(function, shared, task)
        return BackgroundTask(function, shared, task)

    def close(self) -> None:
        """See `Executor.close`. Any thread may; no more is begun then."""
        self._threads.shutdown(wait=False, cancel_futures=True)
        self._processes.close()
        self._threads.shutdown()


class _InThreads(SerialSharing[S]):
    """See `Sharing`: the one copy is the caller's own, and threads read it."""

    def __init__(self, shared: S, pool: ThreadPoolExecutor, workers: int) -> None:
        super().__init__(shared)
        self._pool, self._workers = pool, workers

    def each(
        self, function: Callable[[S, T], R], tasks: Iterable[T], *, chunk: int = 1
    ) -> Iterator[R]:
        """See `Sharing.each`. Nothing travels, so there are no chunks."""

        def submit(task: T) -> Any:
            return self._pool.submit(function, self._shared, task)

        # Whoever is told of an error may change what the threads are still reading.
        return in_order(submit, tasks, lambda: AHEAD * self._workers, wait)


def open_executor(workers: int = 0, scheduler: str | None = None) -> Executor:
    """The executor for ``workers`` tasks at a time, or a cluster's; to be closed after use.

    Parameters
    ----------
    workers: 0 is one for each processor that this process may use, or each thread of the cluster.
        Changes nothing in the result.
    scheduler: address of a Dask scheduler, such as ``tcp://10.0.0.1:8786``.

    Raises
    ------
    MissingComponentError: PTM-M700 Dask is not installed.
    WorkerError: PTM-W001 the scheduler cannot be reached, PTM-W002 it has no workers, PTM-W003
        they have other software than this process.
    """
    if scheduler is not None:
        from ptmtools.executors.cluster import Cluster

        return Cluster(scheduler, workers)
    workers = workers or processors()
    return Serial() if workers == 1 else Local(workers)
