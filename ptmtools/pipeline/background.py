"""The workers that a user asked for, and what they do in the background of a stage of one thread.

While one thread cuts cells, textures are encoded by processes. Where there are just two processors,
these wait for the other task that cutting hands over (`Executor.submit`): it is wanted first.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cached_property
from threading import Event
from typing import Any, TypeVar

from ptmtools.executors.local import Local, open_executor
from ptmtools.executors.model import Executor, Pending, processors
from ptmtools.executors.serial import Serial
from ptmtools.executors.worker import BackgroundTask

S = TypeVar("S")
T = TypeVar("T")
R = TypeVar("R")

#: So many tasks are worth starting a process, which takes a second.
WORTH_A_PROCESS = 8


class Workers:
    """Executors as the user wants them, opened when there is first something to do."""

    def __init__(self, workers: int, scheduler: str | None) -> None:
        self._asked = workers, scheduler
        #: How many threads of this machine may be used.
        self.here = processors() if scheduler else workers or processors()
        #: The executor for a stage of one thread.
        self.alone = _Alone(self.here, shared=bool(scheduler))

    @cached_property
    def executor(self) -> Executor:
        """All workers, for the stage whose turn it is."""
        return open_executor(*self._asked)

    def background(self, tasks: int) -> Executor | None:
        """Who does so many tasks while `alone` is busy, to be closed after use; None if that is
        not worth it."""
        workers, scheduler = self._asked
        if tasks < WORTH_A_PROCESS or (self.here == 1 and not scheduler):
            return None
        if scheduler:
            return open_executor(workers, scheduler)
        return Local(min(max(1, self.here - 2), tasks // WORTH_A_PROCESS), threads=False)

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, *_: object) -> None:
        if "executor" in vars(self):  # it was asked for
            self.executor.close()


class _Alone(Serial):
    """One thread, and a process for what it submits.

    ``free`` is set while what others do in the background need not wait.
    """

    def __init__(self, processors: int, *, shared: bool) -> None:
        self._processors = processors
        self.free = Event()
        if shared or processors != 2:
            self.free.set()

    def submit(
        self, function: Callable[[S, T], R], shared: S, task: T, *, long: bool = True
    ) -> Pending[R]:
        """See `Executor.submit`."""
        if self._processors == 1 or not long:
            self.free.set()
            return super().submit(function, shared, task)
        begun = BackgroundTask(function, shared, task)
        begun.add_done_callback(lambda _: self.free.set())
        return begun


class BackgroundLoop:
    """A loop over tasks, run by another thread until it is stopped.

    ``work(executor, stop)`` does the tasks; it takes no more of them once ``stop`` is set.
    """

    def __init__(
        self, work: Callable[[Executor, Event], object], executor: Executor, free: Event
    ) -> None:
        self._executor, self._free, self._stop = executor, free, Event()
        self._pool = ThreadPoolExecutor(1, "background")
        self._task: Future[Any] = self._pool.submit(self._run, work)

    def check(self) -> None:
        """Raises what has gone wrong so far."""
        if self._task.done():
            self._task.result()

    def finish(self) -> None:
        """Waits for the tasks that have begun, and raises what went wrong."""
        self._stop.set()
        self._free.set()
        self._task.result()
        self._pool.shutdown()

    def abandon(self) -> None:
        """Ends it, tasks included."""
        self._stop.set()
        self._free.set()
        self._executor.close()  # whoever waits for one of its tasks waits no longer
        self._pool.shutdown()

    def _run(self, work: Callable[[Executor, Event], object]) -> None:
        self._free.wait()
        with self._executor:
            if not self._stop.is_set():
                work(self._executor, self._stop)
