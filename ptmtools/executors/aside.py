"""One task beside what its caller does meanwhile, whose result may turn out not to be wanted."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Generic, TypeVar

from ptmtools.executors.model import Pending

S = TypeVar("S")
T = TypeVar("T")
R = TypeVar("R")
R_co = TypeVar("R_co", covariant=True)


@dataclass(frozen=True)
class Asked(Generic[R_co]):
    """See `Pending`: done by the caller's own thread, once it asks for it."""

    result: Callable[[], R_co]

    def cancel(self) -> None:
        """It was never begun."""


class Aside(Generic[R]):
    """See `Pending`: ``function(shared, task)`` in a process of its own, which ends with it.

    ``ended`` is called then, by another thread. Whoever begins one must ask for its result or
    cancel it. As for those of an executor, what travels must be picklable, and a script needs ``if
    __name__ == "__main__"``.
    """

    def __init__(
        self,
        function: Callable[[S, T], R],
        shared: S,
        task: T,
        ended: Callable[[], object] = lambda: None,
    ) -> None:
        from ptmtools.executors.processes import Processes

        self._processes = Processes(1)
        self._ended = ended
        waiting = ThreadPoolExecutor(1, "aside")
        self._done = waiting.submit(self._do, function, shared, task)
        waiting.shutdown(wait=False)

    def result(self) -> R:
        """Waits for it. Raises what the task raises; WorkerError PTM-W004 if its process ends."""
        return self._done.result()

    def cancel(self) -> None:
        """Ends the process, in the middle of the task if need be."""
        self._processes.close()

    def _do(self, function: Callable[[S, T], R], shared: S, task: T) -> R:
        try:
            with self._processes.sharing(shared) as sharing:
                return next(iter(sharing.each(function, [task])))
        finally:
            self._processes.close()
            self._ended()


#: How `Aside` and `Asked` are begun: ``begin(function, shared, task)``.
Begin = Callable[[Callable[[S, T], R], S, T], Pending[R]]


def asked(function: Callable[[S, T], R], shared: S, task: T) -> Pending[R]:
    """An `Asked` of that task."""
    return Asked(lambda: function(shared, task))
