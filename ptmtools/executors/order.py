"""Results in the order of the tasks, with a bounded number of them under way."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from typing import Any, TypeVar

from ptmtools.executors.model import Pending

T = TypeVar("T")
R = TypeVar("R")


def in_order(
    submit: Callable[[T], Pending[R]],
    tasks: Iterable[T],
    ahead: Callable[[], int],
    dropped: Callable[[list[Any]], object] | None = None,
) -> Iterator[R]:
    """The results of ``tasks``, of which at most ``ahead()`` are submitted and not yet yielded.

    When it ends early, those that have not begun are cancelled, and all that were under way are
    handed to ``dropped``.
    """
    waiting: deque[Pending[R]] = deque()
    try:
        for task in tasks:
            waiting.append(submit(task))
            while len(waiting) >= ahead():
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    finally:
        for pending in waiting:
            pending.cancel()
        if dropped and waiting:
            dropped(list(waiting))


def in_chunks(
    submit: Callable[[list[T]], Pending[Iterable[R]]],
    tasks: Iterable[T],
    size: int,
    ahead: Callable[[], int],
) -> Iterator[R]:
    """As `in_order`, for tasks that are submitted in lists of ``size``, the last one shorter."""
    rest = iter(tasks)
    chunks = iter(lambda: list(islice(rest, max(1, size))), [])
    for results in in_order(submit, chunks, ahead):
        yield from results
