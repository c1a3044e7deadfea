"""One task after the other, in the caller's own thread."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, nullcontext
from typing import Generic, TypeVar

from ptmtools.executors.model import Executor, Sharing

S = TypeVar("S")
T = TypeVar("T")
R = TypeVar("R")


class Serial(Executor):
    """See `Executor`. Takes no task before its result is asked for."""

    workers = 1

    def sharing(
        self, shared: S, *, releases_lock: bool = False
    ) -> AbstractContextManager[Sharing[S]]:
        """See `Executor.sharing`."""
        return nullcontext(SerialSharing(shared))

    def close(self) -> None:
        """Nothing was started."""


class SerialSharing(Generic[S]):
    """See `Sharing`: the one copy is the caller's own."""

    def __init__(self, shared: S) -> None:
        self._shared = shared

    def each(
        self, function: Callable[[S, T], R], tasks: Iterable[T], *, chunk: int = 1
    ) -> Iterator[R]:
        """See `Sharing.each`."""
        for task in tasks:
            yield function(self._shared, task)

    def change(self, function: Callable[[S, T], object], change: T) -> None:
        """See `Sharing.change`."""
        function(self._shared, change)
