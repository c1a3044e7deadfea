"""Runs tasks on many machines by Dask's scheduler (the extra ``cluster``).

A shared value is scattered once to all workers; one that joins later fetches it from another. Dask
repeats the tasks of a lost worker. If all workers that had the value are lost, it is scattered
again, to those that have come meanwhile.

Tried and rejected: `Client.get_executor`, whose futures never end if all that had a result are lost
while it is fetched (four of ten runs of ``test_dying_workers``); and the value as the result of a
task, which Dask computes again by itself. With 320 MB the client held 975 MB and the scheduler
1,280 MB for good, instead of 365 MB each.
"""

from __future__ import annotations

import asyncio
import logging
import os
import pickle
import sys
import threading
import time
from collections import deque
from collections.abc import Generator, Iterable, Iterator
from concurrent.futures import CancelledError, Future
from contextlib import closing, contextmanager, nullcontext, suppress
from functools import cache
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from itertools import chain
from pathlib import Path
from typing import Any

from ptmtools.child import watch_thread
from ptmtools.errors import WorkerError
from ptmtools.executor import AHEAD, Executor, Outcome, Task, chunks, in_order, outcome, results
from ptmtools.lazy import component
from ptmtools.progress import announce
from ptmtools.version import __version__

#: Seconds to wait for the scheduler, and for a first worker.
PATIENCE = 15
#: Seconds between two counts of the workers.
COUNT_INTERVAL = 5
#: Seconds without any processor time in which a task may wait, say for a child, in a worker.
IDLE = 7200.0
#: Times that a shared value is scattered again in one call.
AGAIN = 3
#: Libraries whose arithmetic affects the results of tasks.
LIBRARIES = ("numpy", "numba", "embreex", "pillow")


class Cluster(Executor):
    """The workers of the Dask scheduler at ``address``.

    ``workers`` limits the tasks that run at the same time; 0 is one for each thread of the cluster.

    Raises
    ------
    MissingComponentError: PTM-M100 Dask is not installed.
    WorkerError: PTM-W001 the scheduler cannot be reached or has no workers, PTM-W003 they have
        other software than this process.
    """

    remote = True
    machines = True

    def __init__(self, address: str, workers: int = 0) -> None:
        component("distributed", "PTM-M100", "a cluster needs Dask", "cluster")
        from distributed import Client

        logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # raised below instead
        self.address, self._limit = address, workers
        self._counted, self._threads = 0.0, 0
        announce(f"waiting for the scheduler at {address}")
        try:
            self._client = _connect(Client, address)
        except (OSError, ValueError) as fault:
            raise WorkerError(
                "PTM-W001",
                "no scheduler answers",
                file=address,
                remedy="start one with `dask scheduler`, and use the address that it prints, such "
                "as tcp://10.0.0.1:8786",
            ) from fault
        try:
            self._wait_for_workers()
            self._check_software()
        except BaseException:
            self.close()
            raise

    @property
    def workers(self) -> int:
        """The threads of all present workers, or the limit."""
        if time.monotonic() - self._counted > COUNT_INTERVAL:
            with self._losses():
                self._threads = sum(self._client.nthreads().values())
            self._counted = time.monotonic()
        return max(1, min(self._threads, self._limit or self._threads))

    def _each(
        self, function: Task, shared: Any, tasks: Iterable[Any], releases_lock: bool, chunk: int
    ) -> Iterator[Any]:
        outcomes = self._outcomes(function, shared, chunks(tasks, chunk), not releases_lock)
        with closing(outcomes):  # a fault's traceback would keep it open
            yield from results(outcomes)

    def _outcomes(
        self, function: Task, shared: Any, rest: Iterator[list[Any]], alone: bool
    ) -> Generator[Outcome]:
        sent: deque[list[Any]] = deque()  # chunks whose results have not come
        value: Any = None

        def unsent_chunks() -> Iterator[list[Any]]:
            for some in rest:
                sent.append(some)
                yield some

        def submit(some: list[Any]) -> Future[Outcome]:
            call = pickle.dumps((function, some), 5)
            with self._losses():
                remote = self._client.submit(_perform, value, call, alone, software(), pure=False)
                # Results are fetched as soon as they are ready, many at a time.
                return asyncio.run_coroutine_threadsafe(_fetch(remote), loop)

        loop = self._client.loop.asyncio_loop
        for attempts in range(AGAIN, -1, -1):
            todo = chain(tuple(sent), unsent_chunks())
            try:
                value = self._scatter(shared)
                for done in in_order(submit, todo, self._ahead, result=self._result):
                    sent.popleft()
                    yield done
                return
            except WorkerError as fault:
                # A worker ended, with what had the value, or while it was to get it.
                lost = isinstance(fault.__cause__, (CancelledError, OSError))
                lost &= fault.code == "PTM-W004"
                if not (attempts and lost and self._client.status == "running"):
                    raise
                self._wait_for_workers()
            finally:
                if value is not None:
                    value.release()  # or the client would keep it on the workers

    def _scatter(self, shared: Any) -> Any:
        """The Dask future of a shared value."""
        with self._losses():
            try:
                [value] = self._client.scatter([shared], broadcast=True, hash=False)
            except ValueError as fault:  # Dask's own, if the worker that received it has ended
                raise OSError("the shared value was lost") from fault
        return value

    def close(self) -> None:
        """Leaves the cluster, which drops our tasks."""
        with suppress(Exception):
            self._client.close(timeout=2)

    def _ahead(self) -> int:
        return AHEAD * self.workers

    def _result(self, future: Future[Outcome]) -> Outcome:
        with self._losses():
            while True:
                try:
                    return future.result(COUNT_INTERVAL)
                except TimeoutError:
                    self._wait_for_workers()

    @contextmanager
    def _losses(self) -> Iterator[None]:
        """Turns Dask's errors of a lost scheduler or worker into WorkerErrors."""
        from distributed import KilledWorker

        try:
            yield
        except WorkerError:
            raise
        except (KilledWorker, CancelledError, OSError, TimeoutError) as fault:
            if isinstance(fault, KilledWorker) or self._client.status == "running":
                raise WorkerError(
                    "PTM-W004",
                    "workers repeatedly ended while they worked",
                    file=self.address,
                    remedy="if they ran out of memory, start fewer on each machine",
                ) from fault
            raise WorkerError(
                "PTM-W001",
                "the scheduler was lost",
                file=self.address,
                remedy="start it again, then run the same command to resume",
            ) from fault

    def _wait_for_workers(self) -> None:
        if not self._client.nthreads():
            announce(f"waiting for workers of {self.address}")
        try:
            self._client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError as fault:
            raise WorkerError(
                "PTM-W001",
                "the scheduler has no workers",
                file=self.address,
                remedy=f"start some: dask worker {self.address}",
            ) from fault

    def _check_software(self) -> None:
        answers = self._client.run(_difference, software(), on_error="return")
        for worker, answer in sorted(answers.items()):
            if isinstance(answer, Exception):
                answer = f"the worker cannot use ptmtools ({type(answer).__name__}: {answer})"
            if answer:
                raise _other_software(worker, answer)


def _connect(kind: Any, address: str) -> Any:
    """A Dask client of ``address``. One that fails is closed here with its loop: if the garbage
    collector closed it in the thread of the next client's loop, it would wait for the lock that
    the start of that loop holds, and the next client would fail by an assertion after 10 s."""
    client = kind.__new__(kind)
    try:
        client.__init__(address, timeout=PATIENCE, set_as_default=False, name="ptmtools")
    except BaseException:
        with suppress(Exception):
            client.close(timeout=2)
        with suppress(Exception):
            client._loop_runner.stop()
        raise
    return client


async def _fetch(remote: Any) -> Any:
    """The result of a Dask future; drops its task if cancelled. Dask's fetch goes on then, because
    it is one for many results: if it were cancelled while it waits its turn, the client would join
    all later results to it, which would be cancelled too."""
    fetch = asyncio.ensure_future(remote.result())
    fetch.add_done_callback(lambda done: done.cancelled() or done.exception())  # logged otherwise
    try:
        return await asyncio.shield(fetch)
    finally:
        remote.release()


def _other_software(worker: str, difference: str) -> WorkerError:
    remedy = "install the same software on all machines"
    return WorkerError("PTM-W003", difference, file=worker, remedy=remedy)


#: In a worker: held by functions that must not run twice at a time in one process.
_alone = threading.Lock()


def _perform(value: Any, call: bytes, alone: bool, theirs: tuple[str, ...]) -> Outcome:
    """In a worker: runs a chunk of tasks. Raises WorkerError PTM-W003 if it joined with other
    software."""
    if difference := _difference(theirs):
        from distributed import get_worker

        raise _other_software(get_worker().address, difference)
    function, tasks = pickle.loads(call)
    # Dask repeats the task elsewhere.
    with _alone if alone else nullcontext(), watch_thread(lambda: os._exit(1), IDLE):
        return outcome(function, value, tasks)


def _difference(theirs: tuple[str, ...]) -> str:
    """In a worker: the first difference from the software of the asking process, if any."""
    pairs = zip(theirs, software(), strict=False)
    return next((f"the worker has {b}, this process has {a}" for a, b in pairs if a != b), "")


@cache
def software() -> tuple[str, ...]:
    """Versions of ptmtools (with a digest of its sources), Python and the libraries: processes of
    equal software give equal results."""
    digest = sha256()
    package = Path(__file__).parent
    for file in sorted(package.rglob("*.py")):
        digest.update(file.relative_to(package).as_posix().encode() + b"\0" + file.read_bytes())
    python = f"Python {sys.version_info.major}.{sys.version_info.minor}"
    ours = f"ptmtools {__version__} ({digest.hexdigest()[:12]})"
    return ours, python, *(f"{name} {_version(name)}" for name in LIBRARIES)


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "missing"
