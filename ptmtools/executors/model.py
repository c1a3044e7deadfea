"""The contract between a stage and whatever does its tasks.

``executor.each(function, shared, tasks)`` yields ``function(shared, task)`` in the order of the
tasks. For every executor:

* ``function`` is a module-level function and pure: what it returns depends on its two arguments
  alone, and neither is changed. Hence the same results from any number of workers.
* ``tasks`` may be endless: only a few more than there are workers are taken ahead of what has been
  yielded. What waits to be yielded is memory, so a task and its result should be small, or files.
* ``shared`` may be large. It is sent once to each worker, not with each task, and there it is one
  object for all tasks: what is derived from it (a tree, a compiled form) may be kept in it, say in
  a `functools.cached_property`, which its ``__getstate__`` should leave out.
* ``releases_lock`` says that the function spends its time without the interpreter's lock (numba
  kernels, zlib), and that several threads may run it at once over one ``shared``. Otherwise no
  two of its calls run at a time in one process.
* ``chunk`` tasks travel together where travelling costs something.
* A task's exception comes out in its place. Then, or when the iterator is closed, tasks that have
  not begun are dropped.

Functions, shared values, tasks and results must be picklable if they may travel: always but with
`Serial`, or with `releases_lock` and `Local`.

`sharing` is for work in rounds, where each needs the results of those before: the value is sent
once, and between the rounds only its `change` is, to be made on all copies alike::

    with executor.sharing(state, releases_lock=True) as shared:
        for batch in batches:
            found = list(shared.each(search, batch))
            shared.change(settle, (batch, found))  # settle(state, (batch, found)) on every copy
"""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Generic, Protocol, Self, TypeVar

S = TypeVar("S")
S_co = TypeVar("S_co", covariant=True)
T = TypeVar("T")
R = TypeVar("R")
R_co = TypeVar("R_co", covariant=True)

#: For each worker so many tasks are taken ahead at most: one that it does, one that waits for it.
AHEAD = 2


class Pending(Protocol[R_co]):
    """A task under way: a `concurrent.futures.Future`, or what does as one does."""

    def result(self) -> R_co:
        """Waits for it, and returns or raises what it did."""

    def cancel(self) -> object:
        """Its result is not wanted: if it has not begun, it never will."""


@dataclass(frozen=True)
class Deferred(Generic[R_co]):
    """See `Pending`: done by the caller's own thread, when it asks for the result."""

    result: Callable[[], R_co]

    def cancel(self) -> None:
        """It was never begun."""


class Sharing(Protocol[S_co]):
    """A value that every worker has a copy of; the caller's own is kept up to date too."""

    def each(
        self, function: Callable[[S_co, T], R], tasks: Iterable[T], *, chunk: int = 1
    ) -> Iterator[R]:
        """``function(shared, task)`` for each task, in order; see the module's head."""

    def change(self, function: Callable[[S_co, T], object], change: T) -> None:
        """``function(shared, change)`` on every copy before any later task: on the caller's now.

        It changes the value in place, and every copy alike. All that `each` returned must have
        been exhausted or closed.
        """


class Executor(ABC):
    """Does tasks, several at a time. Not to be used by two threads at once."""

    #: Whether all tasks are done elsewhere, by who may see the disks of this machine.
    remote = False

    @property
    @abstractmethod
    def workers(self) -> int:
        """How many tasks are done at a time."""

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

        Raises what a task raises; `WorkerError` PTM-W004 if a worker ends in the middle of one.
        """
        with self.sharing(shared, releases_lock=releases_lock) as sharing:
            yield from sharing.each(function, tasks, chunk=chunk)

    @abstractmethod
    def sharing(
        self, shared: S, *, releases_lock: bool = False
    ) -> AbstractContextManager[Sharing[S]]:
        """Sends ``shared`` to the workers, for several rounds of tasks, until the context ends."""

    def submit(
        self, function: Callable[[S, T], R], shared: S, task: T, *, long: bool = True
    ) -> Pending[R]:
        """Begins ``function(shared, task)`` in the background, where that can be done; elsewhere it
        is done once its result is asked for. ``long``: it takes longer than a process to start."""
        return Deferred(lambda: function(shared, task))

    @abstractmethod
    def close(self) -> None:
        """Ends what was started, tasks included."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def processors() -> int:
    """How many processors this process may use: a batch system may have given it a few only."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not Linux
        return os.cpu_count() or 1
