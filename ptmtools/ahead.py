"""What another process compiles while this one compiles something else.

Numba compiles one thing at a time in a process. Machine code is shared on the disk, and a process
waits for what another is compiling (`ptmtools.compiled`), so the two need not agree on anything.
"""

from __future__ import annotations

import atexit
import subprocess
import sys
from collections.abc import Callable

from ptmtools.lazy import Lazy

_tasks: list[str] = []


def compile_ahead(task: Lazy[Callable[[], object]]) -> None:
    """As soon as this process compiles anything, another one calls ``task``, which calls kernels.

    Nothing happens where all machine code is at hand. The other process ends with this one, and
    whether it fails does not matter. Tasks are called in order.
    """
    _tasks.append(task.place)


def start_ahead() -> None:
    """Starts the other process, if there is something for it."""
    if not _tasks:
        return
    # With the modules of this process, wherever they come from.
    program = (
        f"import sys; sys.path[:] = {sys.path!r}\n"
        "from ptmtools.lazy import Lazy\n"
        f"for place in {_tasks!r}: Lazy(place).load()()"
    )
    nothing = subprocess.DEVNULL
    try:
        other = subprocess.Popen(
            [sys.executable, "-c", program], stdin=nothing, stdout=nothing, stderr=nothing
        )
    except OSError:
        return
    atexit.register(other.kill)
