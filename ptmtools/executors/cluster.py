"""Tasks on many machines, by Dask's scheduler (the extra ``cluster``).

A shared value is scattered to all workers as one block, which they pass on among themselves, and
not again while it is the last one. Tasks name it, so that a worker that joins later is brought it.
Changes go to all workers at once. What a lost worker was doing, others do again.
"""

from __future__ import annotations

import logging
import pickle
import socket
import time
import uuid
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from hashlib import sha256
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import WorkerError
from ptmtools.executors.cluster_worker import Behind, Work, check_in, forget, perform, receive
from ptmtools.executors.model import AHEAD, Executor
from ptmtools.executors.order import in_chunks
from ptmtools.executors.outcome import Outcome
from ptmtools.executors.packing import packed
from ptmtools.executors.software import software
from ptmtools.lazy import component
from ptmtools.progress import announce

if TYPE_CHECKING:
    from distributed import Client, Future

S = TypeVar("S")
T = TypeVar("T")
R = TypeVar("R")

#: Seconds to wait for the scheduler, and then for its first worker.
PATIENCE = 15
#: Seconds after which the workers are counted again.
COUNTED_FOR = 5
#: How often in turn what was under way is handed out again after workers that had data were lost.
AGAIN = 3
#: Bytes of a call above which it does not pass through the scheduler.
LARGE = 1 << 20


class Cluster(Executor):
    """See `Executor`: the workers of the Dask scheduler at ``address``.

    ``workers`` limits how many tasks are done at a time; 0 is one for each thread of the cluster.

    Raises
    ------
    MissingComponentError: PTM-M700 Dask is not installed.
    WorkerError: PTM-W001 the scheduler cannot be reached, PTM-W002 it has no workers, PTM-W003
        they have other software than this process.
    """

    remote = True

    def __init__(self, address: str, workers: int = 0) -> None:
        self.address, self._limit = address, workers
        self._client = _connected(address)
        self._counted, self._threads = -np.inf, 0
        self._last: tuple[bytes, Future[NDArray[np.uint8]]] | None = None
        try:
            self.wait_for_workers()
            self._check_software()
        except BaseException:
            self.close()
            raise

    @property
    def workers(self) -> int:
        """The threads of all workers that there are now, or as many as were asked for."""
        if time.monotonic() - self._counted > COUNTED_FOR:
            with self.naming_losses():
                self._threads = sum(self._client.nthreads().values())
            self._counted = time.monotonic()
        return max(1, min(self._threads, self._limit or self._threads))

    @contextmanager
    def sharing(self, shared: S, *, releases_lock: bool = False) -> Iterator[_OnCluster[S]]:
        """See `Executor.sharing`."""
        sharing = _OnCluster(self, self._client, shared, alone=not releases_lock)
        try:
            yield sharing
        finally:
            sharing.close()

    def close(self) -> None:
        """Leaves the cluster, which goes on without us."""
        with suppress(Exception):
            self._client.close(timeout=2)

    def shipped(self, shared: object) -> Future[NDArray[np.uint8]]:
        """The block of a value, on all workers that there are."""
        block = np.concatenate([np.frombuffer(piece, np.uint8) for piece in packed(shared)])
        digest = sha256(block.data).digest()
        if self._last is None or self._last[0] != digest:
            self._last = None
            # Never under a name that there was: it might just be being forgotten.
            name = _name()
            self._last = digest, self._client.scatter({name: block}, broadcast=True)[name]
        return self._last[1]

    @contextmanager
    def naming_losses(self) -> Iterator[None]:
        """What Dask says of a lost scheduler or worker becomes a WorkerError."""
        from distributed import KilledWorker

        try:
            yield
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

    def forget_last(self) -> None:
        """Ships the last value again, if it is asked for."""
        self._last = None

    def wait_for_workers(self) -> None:
        """Raises WorkerError PTM-W002 if none come."""
        if not self._client.nthreads():
            announce(f"waiting for workers of {self.address}")
        try:
            self._client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError as fault:
            raise WorkerError(
                "PTM-W002",
                "the scheduler has no workers",
                file=self.address,
                remedy=f"start some: dask worker {self.address}",
            ) from fault

    def _check_software(self) -> None:
        answers = self._client.run(check_in, software(), on_error="return")
        for worker, fault in sorted(answers.items()):
            if isinstance(fault, WorkerError):
                raise fault
            if fault is not None:
                raise WorkerError(
                    "PTM-W003",
                    f"the worker cannot use ptmtools ({type(fault).__name__}: {fault})",
                    file=worker,
                    remedy="install the same software on all machines",
                )


class _OnCluster(Generic[S]):
    """See `Sharing`."""

    def __init__(self, cluster: Cluster, client: Client, shared: S, *, alone: bool) -> None:
        self._cluster, self._client = cluster, client
        self._shared, self._alone = shared, alone
        self._name = _name()
        self._there: Future[NDArray[np.uint8]] | None = None
        self._changes: list[bytes] = []
        self._again = 0
        self.under_way: list[_Pending] = []

    def each(
        self, function: Callable[[S, T], R], tasks: Iterable[T], *, chunk: int = 1
    ) -> Iterator[R]:
        """See `Sharing.each`."""

        def submit(some: list[T]) -> _Pending:
            return _Pending(self, pickle.dumps((function, some), protocol=5))

        return in_chunks(submit, tasks, chunk, lambda: AHEAD * self._cluster.workers)

    def change(self, function: Callable[[S, T], object], change: T) -> None:
        """See `Sharing.change`."""
        function(self._shared, change)
        if self._there is None:
            return
        pickled = pickle.dumps((function, change), protocol=5)
        with self._cluster.naming_losses():
            fresh = {len(self._changes): pickled}
            self._client.run(receive, self._name, fresh, on_error="ignore")
        self._changes.append(pickled)

    def close(self) -> None:
        """Frees the workers' memory."""
        if self._there is not None:
            self._there = None
            with suppress(Exception):  # of a lost cluster
                self._client.run(forget, self._name, on_error="ignore")

    def submit(self, call: bytes) -> Future[Outcome | Behind]:
        """Hands out some tasks."""
        with self._cluster.naming_losses():
            if self._there is None:
                self._there = self._cluster.shipped(self._shared)
            work: Any = Work(self._name, len(self._changes), self._alone, software(), call)
            if len(call) > LARGE:
                work = self._client.scatter(work, hash=False, direct=True)
            return self._client.submit(perform, self._there, work, pure=False)

    def catch_up(self, behind: Behind) -> None:
        """Sends a worker what it lacks."""
        lacking = dict(enumerate(self._changes[behind.version :], behind.version))
        with self._cluster.naming_losses():
            self._client.run(receive, self._name, lacking, workers=[behind.worker])

    def fetch(self, wanted: _Pending) -> None:
        """Waits for ``wanted``, and fetches it with all others that are done: each journey takes
        some 10 ms, however much it brings. The results come from where they are, not through the
        scheduler."""
        from distributed import wait

        with self._cluster.naming_losses():
            try:
                with self._client.as_current():
                    wait([wanted.future])
                if wanted.future.status != "finished":
                    wanted.future.result()  # raises what went wrong
                done = [p for p in self.under_way if p.future.status == "finished"]
                found = self._client.gather([p.future for p in done], direct=True)
            except CancelledError:
                if self._again == AGAIN:
                    raise
                self._hand_out_again()
                return
        self._again = 0
        for pending, came in zip(done, found, strict=True):
            self.under_way.remove(pending)
            pending.came = came

    def _hand_out_again(self) -> None:
        """All workers that had the shared value are lost: brings it to those that there are now."""
        self._again += 1
        self._cluster.wait_for_workers()
        self._cluster.forget_last()
        self.close()
        # The caller's own is as changed as it is for all that is under way.
        self._name, self._changes = _name(), []
        for pending in self.under_way:
            pending.hand_out()


class _Pending:
    """See `order.Pending`: some tasks on their way."""

    def __init__(self, sharing: _OnCluster[Any], call: bytes) -> None:
        self._sharing, self._call = sharing, call
        self.came: Outcome | Behind | None = None
        self.hand_out()
        sharing.under_way.append(self)

    def hand_out(self) -> None:
        """Once more, where it was lost."""
        self.future = self._sharing.submit(self._call)

    def result(self) -> Outcome:
        while not isinstance(self.came, Outcome):
            if self.came:
                self._sharing.catch_up(self.came)
                self.came = None
                self.hand_out()
                self._sharing.under_way.append(self)
            self._sharing.fetch(self)
        return self.came

    def cancel(self) -> None:
        if self in self._sharing.under_way:
            self._sharing.under_way.remove(self)
        self.future.release()  # nobody wants it now, so the scheduler drops it


def _name() -> str:
    """One that there has never been."""
    return f"ptmtools-{uuid.uuid4().hex}"


def _connected(address: str) -> Client:
    """Raises MissingComponentError PTM-M700, WorkerError PTM-W001."""
    component("distributed", "PTM-M700", "a cluster needs Dask", "cluster")
    from distributed import Client
    from distributed.comm import get_address_host_port

    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # it is raised below
    try:
        host, port = get_address_host_port(address)
        _wait_for_answer(host, port)
        return Client(address, timeout=PATIENCE, set_as_default=False, name="ptmtools")
    except (OSError, ValueError) as fault:
        raise WorkerError(
            "PTM-W001",
            "no scheduler answers",
            file=address,
            remedy="start one with `dask scheduler`, and give the address that it prints, such as "
            "tcp://10.0.0.1:8786",
        ) from fault


def _wait_for_answer(host: str, port: int) -> None:
    """Waits until somebody listens: the scheduler may be starting beside us. (Dask's client, asked
    in vain, complains once more much later, when it is collected.) Raises OSError."""
    began, announced = time.monotonic(), False
    while True:
        try:
            socket.create_connection((host, port), timeout=PATIENCE).close()
            return
        except OSError:
            if time.monotonic() - began > PATIENCE:
                raise
        if not announced:
            announce(f"waiting for the scheduler at {host}:{port}")
            announced = True
        time.sleep(0.5)
