"""What another process compiles while this one is busy with other things.

Numba compiles one thing at a time in a process. Machine code is shared on the disk, and a process
waits for what another is compiling (`ptmtools.compiled`), so the two need not agree on anything.
"""

from __future__ import annotations

import atexit
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress

from ptmtools.lazy import Lazy
from ptmtools.machine_code import announce_compilation, marker

Task = Lazy[Callable[[], object]]
#: For the other process to end, seconds, when this one does.
PATIENCE = 5.0
_begun: set[Task] = set()
_waiting: list[Task] = []


def compile_now(task: Task) -> bool:
    """Calls a task, which calls kernels, so that they are compiled; whether that was still to be
    done."""
    done = marker(task.place)
    if done and done.exists():
        return False
    task.load()()
    if done:
        with suppress(OSError):
            done.parent.mkdir(parents=True, exist_ok=True)
            done.touch()
    return True


def compile_ahead_if_needed(task: Task) -> None:
    """As `compile_ahead`, but only once this process compiles something: for what is over before
    another process could find out that all is there."""
    _waiting.append(task)


def begin_waiting() -> None:
    """Called as something is compiled."""
    while _waiting:
        compile_ahead(_waiting.pop(0))


def compile_ahead(task: Task) -> None:
    """As `compile_now`, by another process, if the machine code can be kept.

    That process ends with this one, and whether it fails does not matter.
    """
    done = marker(task.place)
    if done is None or done.exists() or task in _begun:
        return
    _begun.add(task)
    announce_compilation()
    # With the modules of this process, wherever they come from; ends tidily when told to.
    program = (
        f"import signal, sys; sys.path[:] = {sys.path!r}\n"
        "signal.signal(signal.SIGTERM, lambda *_: sys.exit())\n"
        "from ptmtools.ahead import Lazy, compile_now\n"
        f"compile_now(Lazy({task.place!r}))"
    )
    nothing = subprocess.DEVNULL
    try:
        other = subprocess.Popen(
            [sys.executable, "-c", program], stdin=nothing, stdout=nothing, stderr=nothing
        )
    except OSError:
        return
    atexit.register(_end, other)


def _end(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    try:
        process.wait(PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
