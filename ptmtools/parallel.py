"""Executors on this machine: this thread, threads, processes; and the choice of an executor.

Each worker process ("spawn") sits at the other end of a pipe of its own, which only this process
holds open, and ends when the pipe closes, even if this process is killed. A shared value is written
once to an unnamed temporary file that all processes map, so its arrays are in memory once.

Tried and rejected: `concurrent.futures.ProcessPoolExecutor` (Python 3.11). If a worker is killed
while it sends a result larger than a pipe's buffer, the pool waits forever and Python cannot exit;
idle workers survive a parent that is killed; and there is no public call that ends a running task.
loky 3.7: busy workers still ran 15 s after their parent was killed.
"""

from __future__ import annotations

import atexit
import os
import pickle
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import ExitStack, contextmanager, suppress
from functools import cached_property
from itertools import count
from queue import LifoQueue, SimpleQueue
from typing import IO, TYPE_CHECKING, Any, NamedTuple

from ptmtools.child import watch_child
from ptmtools.errors import WorkerError
from ptmtools.executor import (
    AHEAD,
    Executor,
    Outcome,
    Pending,
    R,
    S,
    T,
    Task,
    _portable,
    chunks,
    in_order,
    outcome,
    results,
)

if TYPE_CHECKING:
    from multiprocessing.connection import Connection
    from multiprocessing.process import BaseProcess


#: Alignment of arrays in the file of a shared value, bytes.
ALIGNMENT = 64
#: Arrays of fewer bytes stay in the pickle.
SMALL = 1 << 12
#: Background tasks for each process: starting one takes a second.
WORTH_A_PROCESS = 8
#: Seconds without any progress after which a worker process is ended; attempts at its call.
IDLE, _ATTEMPTS = 600.0, 2
#: Seconds to wait for a killed process, which a lost disk may keep.
_ENDING = 10.0


def processors() -> int:
    """Processors that this process may use, which a batch system may have limited."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not Linux
        return os.cpu_count() or 1


def open_executor(workers: int = 0, scheduler: str | None = None) -> Executor:
    """An executor for ``workers`` tasks at a time, to be closed after use.

    Parameters
    ----------
    workers: 0 is one for each processor that this process may use, or each thread of the cluster.
        Changes nothing in the result.
    scheduler: address of a Dask scheduler, such as ``tcp://10.0.0.1:8786``.

    Raises
    ------
    MissingComponentError: PTM-M100 Dask is not installed.
    WorkerError: PTM-W001 the scheduler cannot be reached or has no workers, PTM-W003 they have
        other software than this process.
    """
    if scheduler is not None:
        from ptmtools.cluster import Cluster

        return Cluster(scheduler, workers)
    workers = workers or processors()
    return Executor() if workers == 1 else Local(workers)


class Local(Executor):
    """Threads for functions that release the lock, processes for all others.

    Parameters
    ----------
    workers: number of threads or processes.
    threads: False runs everything in processes, while another thread of this process keeps the
        interpreter's lock.
    """

    def __init__(self, workers: int, *, threads: bool = True) -> None:
        self._workers = workers
        self.remote = not threads
        # Threads and processes start when there is a first task for them.
        self._threads = ThreadPoolExecutor(self._workers, "ptmtools")
        self._processes = [Process() for _ in range(self._workers)]
        #: Last in, first out: processes that have been started are used first.
        self._idle: LifoQueue[Process] = LifoQueue()
        for process in self._processes:
            self._idle.put(process)

    @property
    def workers(self) -> int:
        return self._workers

    def _each(
        self, function: Task, shared: Any, tasks: Iterable[Any], releases_lock: bool, chunk: int
    ) -> Iterator[Any]:
        ahead = AHEAD * self._workers
        if releases_lock and not self.remote:

            def submit(task: Any) -> Future[Any]:
                return self._threads.submit(function, shared, task)

            # After an error the caller may change what running threads still read: wait for them.
            yield from in_order(submit, tasks, lambda: ahead, wait)
            return
        with _shared_file(shared) as file:

            def send(some: list[Any]) -> Future[Outcome]:
                return self._threads.submit(self._call, file, function, some)

            yield from results(in_order(send, chunks(tasks, chunk), lambda: ahead))

    def submit(
        self, function: Callable[[S, T], R], shared: S, task: T, *, long: bool = True
    ) -> Pending[R]:
        """See `Executor.submit`."""
        if not long:
            return super().submit(function, shared, task)
        return in_background(function, shared, task)

    def close(self) -> None:
        """See `Executor.close`. Any thread may call it; nothing can be begun afterwards."""
        self._threads.shutdown(wait=False, cancel_futures=True)
        for process in self._processes:
            process.close()
        self._threads.shutdown()

    def _call(self, file: _File, function: Task, tasks: list[Any]) -> Outcome:
        process = self._idle.get()
        try:
            return process.call(_over_file, file, function, tasks)
        finally:
            self._idle.put(process)


def map_in_order(function: Callable[[T], R], tasks: Iterable[T], threads: int) -> Iterator[R]:
    """``function`` of each task, in order, by threads of its own; at most ``threads`` + 1 tasks are
    begun and not yielded. With one thread, a task begins when its result is asked for."""
    if threads <= 1:
        yield from map(function, tasks)
        return
    with ThreadPoolExecutor(threads) as pool:

        def submit(task: T) -> Future[R]:
            return pool.submit(function, task)

        yield from in_order(submit, tasks, lambda: threads + 1)


# A shared value in a file: pickle and arrays, each aligned, then the pickled list of their places.


class _File(NamedTuple):
    number: int  # unique in this process
    path: str
    end: int  # offset of the list of places


_numbers = count()


@contextmanager
def _shared_file(shared: object) -> Iterator[_File]:
    """A temporary file with a pickled value; on Linux it has no name, so nothing is left behind.

    Raises OutputError PTM-O003 if the disk is full.
    """
    import tempfile

    from ptmtools.files import writing

    arrays: list[bytes | memoryview] = []

    def stays(buffer: pickle.PickleBuffer) -> bool:
        raw = buffer.raw()
        if raw.nbytes >= SMALL:
            arrays.append(raw)
        return raw.nbytes < SMALL

    pickled = pickle.dumps(shared, 5, buffer_callback=stays)
    cleaning = ExitStack()
    with writing(tempfile.gettempdir()):
        file: IO[bytes] = tempfile.TemporaryFile(prefix="ptmtools-")  # noqa: SIM115
        path = f"/proc/{os.getpid()}/fd/{file.fileno()}"
        if not os.path.exists(path):
            file.close()
            # A second process may open it on Windows, too, if its name does not end with it.
            named = tempfile.NamedTemporaryFile(prefix="ptmtools-", delete=False)  # noqa: SIM115
            file, path = named, named.name
            cleaning.callback(_remove, path)
    with cleaning, file:
        places = []
        with writing(tempfile.gettempdir()):
            for data in [pickled, *arrays]:
                start = file.seek(-file.tell() % ALIGNMENT, os.SEEK_CUR)
                places.append((start, start + file.write(data)))
            end = file.tell()
            pickle.dump(places, file)
            file.flush()
        yield _File(next(_numbers), path, end)


def _remove(path: str) -> None:
    """Removes a file; one that a worker still maps on Windows, when this process ends."""
    try:
        os.remove(path)
    except PermissionError:
        atexit.register(_remove_if_possible, path)


def _remove_if_possible(path: str) -> None:
    with suppress(OSError):
        os.remove(path)


#: In a worker process: the value of the last file.
_last: tuple[_File, Any] | None = None


def _over_file(file: _File, function: Task, tasks: list[Any]) -> Outcome:
    """In a worker process: runs a chunk over the value in a file. Its arrays can be written; pages
    that the worker changes are its own."""
    global _last
    if _last is None or _last[0] != file:
        import mmap

        _last = None  # frees the memory of the previous value first
        with open(file.path, "rb") as stream:
            memory = memoryview(mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_COPY))
        pickled, *arrays = (memory[a:b] for a, b in pickle.loads(memory[file.end :]))
        _last = file, pickle.loads(pickled, buffers=arrays)
    return outcome(function, _last[1], tasks)


class Process:
    """A worker process, started at the first call, and again after it was lost."""

    def __init__(self) -> None:
        self._changing = threading.Lock()
        self._closed = False
        self._running: tuple[BaseProcess, Connection] | None = None

    def call(self, function: Callable[..., Outcome], *arguments: Any) -> Outcome:
        """``function(*arguments)`` in the process; again in a new one if it makes no progress.
        Blocks Ctrl-C in the calling thread for good.

        Raises WorkerError PTM-W004 if the process ends, PTM-W006 without progress in all attempts.
        """
        for _ in range(_ATTEMPTS):
            watch = None
            try:
                process, pipe = self._start()
                with watch_child(process.pid or 0, process.kill, IDLE) as watch:
                    pipe.send((function, arguments))
                    answer: Outcome = pipe.recv()
                if watch.expired:  # just when it replied
                    self._end()
                return answer
            except (EOFError, OSError) as fault:
                self._end()
                if watch is None or not watch.expired:
                    raise WorkerError(
                        "PTM-W004",
                        "a worker process ended while it worked",
                        remedy="if it ran out of memory, use fewer workers (-j 1); a script "
                        "that starts processes needs `if __name__ == '__main__'`",
                    ) from fault
        raise WorkerError(
            "PTM-W006",
            f"a worker process stood still for {IDLE:g} s, {_ATTEMPTS} times",
            remedy="run the same command again to resume; if it happens again, with -j 1",
        )

    def close(self) -> None:
        """Ends the process for good, during a task if need be. Any thread may call it."""
        self._closed = True
        self._end()

    def _start(self) -> tuple[BaseProcess, Connection]:
        from multiprocessing import get_context, resource_tracker

        with self._changing:
            if self._closed:
                raise EOFError("the worker has been closed")
            if self._running is None:
                if hasattr(signal, "pthread_sigmask"):  # not Windows
                    resource_tracker.ensure_running()  # unblocks Ctrl-C when it starts
                    # Inherited by the process, which so ignores Ctrl-C while it starts.
                    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
                context = get_context("spawn")
                ours, theirs = context.Pipe()
                process = context.Process(target=_serve, args=(theirs,), daemon=True)
                with theirs:
                    process.start()
                self._running = process, ours
            return self._running

    def _end(self) -> None:
        with self._changing:
            if self._running:
                process, _ = self._running
                process.kill()
                process.join(_ENDING)
                self._running = None


def _serve(parent: Connection) -> None:
    """The main function of a worker process: answers calls until the pipe closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    calls: SimpleQueue[bytes] = SimpleQueue()

    def listen() -> None:
        try:
            while True:
                calls.put(parent.recv_bytes())
        finally:
            os._exit(0)  # also during a task

    threading.Thread(target=listen, daemon=True).start()
    while True:
        try:
            function, arguments = pickle.loads(calls.get())
            answer = function(*arguments)
        except Exception as fault:  # of unpickling
            answer = [], _portable(fault)
        try:
            parent.send(answer)
        except Exception as fault:  # of pickling, before anything is sent
            parent.send(([], _portable(fault)))


def in_background(
    function: Callable[[S, T], R],
    shared: S,
    task: T,
    ended: Callable[[], object] = lambda: None,
) -> Pending[R]:
    """Begins ``function(shared, task)`` in a process of its own. Everything must be picklable.

    ``result`` or ``cancel`` of the returned task must be called; ``ended`` is called by another
    thread once the process has ended.
    """
    process, thread = Process(), ThreadPoolExecutor(1, "background")

    def run() -> R:
        try:
            done: list[R] = list(results([process.call(outcome, function, shared, [task])]))
        finally:
            process.close()
            ended()
        return done[0]

    future = thread.submit(run)
    thread.shutdown(wait=False)
    return Pending(future.result, process.close)


class Workers:
    """The executors of a build, each opened at its first use; see `open_executor`.

    Attributes
    ----------
    here: threads of this machine that may be used.
    alone: the executor for a stage of one thread.
    """

    def __init__(self, workers: int, scheduler: str | None) -> None:
        self._arguments = workers, scheduler
        self.here = processors() if scheduler else workers or processors()
        self.alone = _Alone(self.here, wait=self.here == 2 and not scheduler)

    @cached_property
    def executor(self) -> Executor:
        """All workers, for the stage in turn."""
        return open_executor(*self._arguments)

    def background(self, tasks: int) -> Executor | None:
        """A new executor for ``tasks`` tasks while `alone` is busy; None if they are too few."""
        workers, scheduler = self._arguments
        if tasks < WORTH_A_PROCESS or (self.here == 1 and not scheduler):
            return None
        if scheduler:
            return open_executor(workers, scheduler)
        return Local(min(max(1, self.here - 2), tasks // WORTH_A_PROCESS), threads=False)

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, *_: object) -> None:
        if "executor" in vars(self):  # was opened
            self.executor.close()


class _Alone(Executor):
    """One thread, a process for the task that it submits, and workers that end with each call.

    On two processors that task comes first: a background loop waits until ``free`` is set.
    """

    def __init__(self, processors: int, *, wait: bool) -> None:
        self._processors = processors
        self.free = threading.Event()
        if not wait:
            self.free.set()

    def _each(
        self, function: Task, shared: Any, tasks: Iterable[Any], releases_lock: bool, chunk: int
    ) -> Iterator[Any]:
        if self._processors == 1:
            yield from super()._each(function, shared, tasks, releases_lock, chunk)
            return
        with Local(self._processors) as workers:
            yield from workers.each(
                function, shared, tasks, releases_lock=releases_lock, chunk=chunk
            )

    def submit(
        self, function: Callable[[S, T], R], shared: S, task: T, *, long: bool = True
    ) -> Pending[R]:
        """See `Executor.submit`."""
        if self._processors == 1 or not long:
            self.free.set()
            return super().submit(function, shared, task)
        return in_background(function, shared, task, self.free.set)


class BackgroundLoop:
    """Another thread that runs ``work(executor, stop)`` once ``free`` is set, then closes the
    executor. ``work`` takes no more tasks once ``stop`` is set."""

    def __init__(
        self,
        work: Callable[[Executor, threading.Event], object],
        executor: Executor,
        free: threading.Event,
    ) -> None:
        self._executor, self._free, self._stop = executor, free, threading.Event()
        self._pool = ThreadPoolExecutor(1, "background")
        self._task: Future[Any] = self._pool.submit(self._run, work)

    def check(self) -> None:
        """Raises the exception of a loop that has failed."""
        if self._task.done():
            self._task.result()

    def finish(self) -> None:
        """Waits for the tasks that have begun. Raises the exception of the loop."""
        self._stop.set()
        self._free.set()
        self._task.result()
        self._pool.shutdown()

    def abandon(self) -> None:
        """Ends the loop and its tasks."""
        self._stop.set()
        self._free.set()
        self._executor.close()  # the loop stops waiting for its tasks
        self._pool.shutdown()

    def _run(self, work: Callable[[Executor, threading.Event], object]) -> None:
        self._free.wait()
        with self._executor:
            if not self._stop.is_set():
                work(self._executor, self._stop)
