"""The contract of an executor, which runs the independent tasks of a stage.

``executor.each(function, shared, tasks)`` yields ``function(shared, task)`` in the order of the
tasks. The contract, for every executor:

* ``function`` is a module-level function and pure: its result depends on its two arguments alone,
  and it changes neither. So any number of workers gives the same results.
* ``tasks`` may be endless. At most `AHEAD` tasks (or chunks of them) per worker are under way or
  wait to be yielded, which bounds memory: a task and its result should be small, or files.
* ``shared`` may be large. Each worker receives it once per call, not with each task, as one object:
  a function may keep derived data in it, say in a `functools.cached_property`, which
  ``__getstate__`` should leave out.
* ``releases_lock`` states that the function spends its time without the interpreter's lock (numba
  kernels, zlib) and that several threads may run it at once over one ``shared``. Otherwise no two
  of its calls run at the same time in one process.
* ``chunk`` tasks travel in one message to processes and clusters.
* The exception of a task is raised in its place. Tasks that have not begun are then dropped; the
  same happens when the iterator is closed.

Functions, shared values, tasks and results must be picklable, except for a plain `Executor`, and
for `Local` with ``releases_lock``. A script that starts processes needs
``if __name__ == "__main__"``.
"""

from __future__ import annotations

import pickle
import traceback
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future
from dataclasses import dataclass
from itertools import islice
from typing import Any, Generic, Self, TypeVar

S = TypeVar("S")
T = TypeVar("T")
R = TypeVar("R")
#: A function of a shared value and a task.
Task = Callable[[Any, Any], Any]

#: Tasks or chunks per worker that are submitted ahead: one in progress and one that waits.
AHEAD = 2
#: The results of the first tasks of a chunk, and the exception of the next task, if any.
Outcome = tuple[list[Any], Exception | None]


@dataclass(frozen=True)
class Pending(Generic[R]):
    """A task in the background.

    Attributes
    ----------
    result: waits for the task, returns its result or raises its exception.
    cancel: drops the task; a process that runs it is ended.
    """

    result: Callable[[], R]
    cancel: Callable[[], object] = lambda: None


class Executor:
    """Runs each task in the caller's thread when its result is asked for.

    The subclasses run several tasks at a time; each serves one thread only.

    Attributes
    ----------
    workers: number of tasks that run at the same time.
    remote: whether all tasks run in other processes, which may see the disks of this machine.
    machines: whether these may be on other machines.
    """

    remote = False
    machines = False

    @property
    def workers(self) -> int:
        return 1

    def each(
        self,
        function: Callable[[S, T], R],
        shared: S,
        tasks: Iterable[T],
        *,
        releases_lock: bool = False,
        chunk: int = 1,
    ) -> Iterator[R]:
        """``function(shared, task)`` for each task, in order; see the module's head.

        Raises what a task raises; WorkerError PTM-W004 if a worker ends while it runs one.
        """
        return self._each(function, shared, tasks, releases_lock, chunk)

    def _each(
        self, function: Task, shared: Any, tasks: Iterable[Any], releases_lock: bool, chunk: int
    ) -> Iterator[Any]:
        """See `each`."""
        return (function(shared, task) for task in tasks)

    def submit(
        self, function: Callable[[S, T], R], shared: S, task: T, *, long: bool = True
    ) -> Pending[R]:
        """Begins ``function(shared, task)`` in a process, where the executor has any; elsewhere it
        runs when its result is asked for. ``long``: it takes longer than starting a process."""
        return Pending(lambda: function(shared, task))

    def close(self) -> None:
        """Ends all workers, running tasks included."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def in_order(
    submit: Callable[[T], Future[R]],
    tasks: Iterable[T],
    ahead: Callable[[], int],
    dropped: Callable[[list[Future[R]]], object] = lambda _: None,
    result: Callable[[Future[R]], R] = Future.result,
) -> Iterator[R]:
    """The results of ``tasks``, of which at most ``ahead()`` are submitted and not yet yielded.

    If iteration ends early, tasks that have not begun are cancelled, and ``dropped`` receives all
    that were submitted.
    """
    waiting: deque[Future[R]] = deque()
    try:
        for task in tasks:
            waiting.append(submit(task))
            while len(waiting) >= ahead():
                yield result(waiting.popleft())
        while waiting:
            yield result(waiting.popleft())
    finally:
        for future in waiting:
            future.cancel()
        dropped(list(waiting))


def chunks(tasks: Iterable[T], size: int) -> Iterator[list[T]]:
    """Lists of ``size`` tasks; the last one is shorter."""
    rest = iter(tasks)
    return iter(lambda: list(islice(rest, max(1, size))), [])


def results(outcomes: Iterable[Outcome]) -> Iterator[Any]:
    """The results of all chunks; raises the exception of a task in its place."""
    for done, fault in outcomes:
        yield from done
        if fault:
            raise fault


def outcome(function: Task, shared: object, tasks: Iterable[Any]) -> Outcome:
    """Runs a chunk in a worker, up to the first exception."""
    done: list[Any] = []
    try:
        for task in tasks:
            done.append(function(shared, task))
    except Exception as fault:
        return done, _portable(fault)
    return done, None


def _portable(fault: Exception) -> Exception:
    """The exception with its traceback as a note; a RuntimeError with the same message if it cannot
    be pickled."""
    fault.add_note("In a worker:\n" + "".join(traceback.format_exception(fault)))
    fault.__cause__ = fault.__context__ = None
    try:
        if type(pickle.loads(pickle.dumps(fault))) is type(fault):
            return fault
    except Exception:  # its class may raise anything
        pass
    plain = RuntimeError(f"{type(fault).__name__}: {fault}")
    for note in fault.__notes__:
        plain.add_note(note)
    return plain
