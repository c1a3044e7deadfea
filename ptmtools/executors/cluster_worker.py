"""What runs in the workers of a cluster: copies of shared values, and tasks over them.

A copy is made of the block that Dask has brought here, and brought up to date with the changes
that `receive` was sent. A worker that missed some (it joined late) says so, and is sent them.
"""

from __future__ import annotations

import pickle
import threading
from collections import defaultdict
from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import WorkerError
from ptmtools.executors.outcome import Outcome, outcome
from ptmtools.executors.packing import unpacked
from ptmtools.executors.software import software


@dataclass(frozen=True)
class Work:
    """Some tasks to be done together.

    Attributes
    ----------
    sharing: names the shared value.
    version: with how many changes.
    alone: whether no two calls of the function may run at a time in one process.
    software: what the asking process computes with.
    call: pickled, the function and the list of tasks.
    """

    sharing: str
    version: int
    alone: bool
    software: tuple[str, ...]
    call: bytes


@dataclass(frozen=True)
class Behind:
    """The answer of a worker that lacks changes: its address, and how many it has."""

    worker: str
    version: int


class _Copy:
    def __init__(self, block: NDArray[np.uint8]) -> None:
        # A copy, since the block is not ours: Dask may pass it on.
        self.value = unpacked(block.copy().data)
        self.version = 0
        self.lock = threading.Lock()  # held while the value changes
        self.alone = threading.Lock()


_lock = threading.Lock()
_copies: dict[str, _Copy] = {}
_changes: dict[str, dict[int, bytes]] = defaultdict(dict)


def perform(block: NDArray[np.uint8], work: Work) -> Outcome | Behind:
    """Does some tasks over the value packed in the ``block``.

    Raises WorkerError PTM-W003 where the software is another.
    """
    check(work.software, _address())
    with _lock:
        if work.sharing not in _copies:
            _copies[work.sharing] = _Copy(block)
        copy = _copies[work.sharing]
    with copy.lock:
        while copy.version < work.version:
            change = _changes[work.sharing].pop(copy.version, None)
            if change is None:
                return Behind(_address(), copy.version)
            function, changed = pickle.loads(change)
            function(copy.value, changed)
            copy.version += 1
    function, tasks = pickle.loads(work.call)
    with copy.alone if work.alone else nullcontext():
        return outcome(function(copy.value, task) for task in tasks)


def receive(sharing: str, changes: Mapping[int, bytes]) -> None:
    """Keeps changes of a shared value, by their number, until a task needs them."""
    _changes[sharing].update(changes)


def forget(sharing: str) -> None:
    """Drops the copy of a shared value."""
    _copies.pop(sharing, None)
    _changes.pop(sharing, None)


def check(theirs: tuple[str, ...], here: str) -> None:
    """Raises WorkerError PTM-W003 unless this process computes with the same as the asking one."""
    ours = software()
    for one, other in zip(theirs, ours, strict=False):
        if one != other:
            raise WorkerError(
                "PTM-W003",
                f"the worker has {other}, this process has {one}",
                file=here,
                remedy="install the same software on all machines",
            )


def check_in(theirs: tuple[str, ...], dask_worker: Any) -> None:
    """`check`, to be run by Dask outside any task."""
    check(theirs, dask_worker.address)


def _address() -> str:
    from distributed import get_worker

    return str(get_worker().address)
