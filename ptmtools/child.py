"""Child processes of this package: how they are started, and how long the parent waits for them.

A library in a child may deadlock, and a pipe does not show that. So a thread of the parent watches
each child that owes a reply, and kills one that makes no progress; the blocked read or write of the
parent then ends as after a crash. Progress is processor time: a deadlocked process uses none at
all, and one that watches a child of its own uses a little.

Tried and rejected: heartbeats by a thread of the child, which cannot run while a library keeps the
interpreter's lock, and runs on while another thread is deadlocked.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Self

import ptmtools

#: Longest time between two looks at a child, and the share of its bound, seconds.
_INTERVAL, _SHARE = 5.0, 0.25
#: Longest wait, in seconds, on a system that does not tell processor times.
_UNMEASURED = 86_400.0


def module_process(module: str, *arguments: str | os.PathLike[str]) -> dict[str, Any]:
    """The ``args`` and ``env`` by which `subprocess` runs a module of this package with this
    interpreter. The module is not searched for in the working folder."""
    words = (os.fspath(argument) for argument in arguments)
    root = os.fspath(Path(ptmtools.__file__).parent.parent)
    search = os.environ.get("PYTHONPATH")
    return {
        "args": [sys.executable, "-P", "-m", module, *words],
        "env": {**os.environ, "PYTHONPATH": f"{root}{os.pathsep}{search}" if search else root},
    }


class ProgressWatch:
    """A context that is ended, by ``end()`` in another thread, if it makes no progress.

    Parameters
    ----------
    progress: a number that grows, such as processor time; None where it cannot be known.
    idle: seconds without progress. Time in which this process is stopped does not count.

    Attributes
    ----------
    expired: whether ``end`` was called.
    """

    def __init__(
        self, progress: Callable[[], float | None], end: Callable[[], object], idle: float
    ) -> None:
        self.expired = False
        self._progress, self._end, self._idle = progress, end, idle
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()  # a later end would hit the next task of the child

    def _watch(self) -> None:
        step = min(_INTERVAL, _SHARE * self._idle)
        state, idle = self._progress(), 0.0
        while not self._over.wait(step):
            before, state = state, self._progress()
            idle = idle + step if state == before else 0.0
            if idle >= (_UNMEASURED if state is None else self._idle):
                self.expired = True
                self._end()
                return


def watch_child(process_id: int, kill: Callable[[], object], idle: float) -> ProgressWatch:
    """Calls ``kill`` if the process uses no processor for ``idle`` seconds."""
    clock = ~process_id << 3 | 2  # clock_getcpuclockid(3) of Linux
    return ProgressWatch(partial(_processor_time, clock), kill, idle)


def watch_thread(end: Callable[[], object], idle: float) -> ProgressWatch:
    """Calls ``end`` if the calling thread uses no processor for ``idle`` seconds."""
    clock_of = getattr(time, "pthread_getcpuclockid", None)
    clock = clock_of(threading.get_ident()) if clock_of else -1
    return ProgressWatch(partial(_processor_time, clock), end, idle)


def _processor_time(clock: int) -> float | None:
    """Seconds of processor time; None where the system does not tell it, or no longer."""
    try:
        return time.clock_gettime(clock)
    except (AttributeError, OSError):
        return None
