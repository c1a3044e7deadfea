"""What another process compiles while this one is busy with other things.

Numba compiles one thing at a time in a process. Machine code is shared on the disk, and a process
waits for what another is compiling (`ptmtools.compiled`), so the two need not agree on anything.
"""

from __future__ import annotations

import atexit
import subprocess
import sys
from collections.abc import Callable

from ptmtools.lazy import Lazy
from ptmtools.machine_code import announce_compilation, is_kept


def compile_ahead(task: Lazy[Callable[[], object]], kernels: str) -> None:
    """Another process calls ``task``, which calls kernels, unless machine code of the module
    ``kernels``, one of theirs, is at hand.

    The other process ends with this one, and whether it fails does not matter.
    """
    if is_kept(kernels):
        return
    announce_compilation()
    # With the modules of this process, wherever they come from; ends tidily when told to.
    program = (
        f"import signal, sys; sys.path[:] = {sys.path!r}\n"
        "signal.signal(signal.SIGTERM, lambda *_: sys.exit())\n"
        f"from ptmtools.lazy import Lazy; Lazy({task.place!r}).load()()"
    )
    nothing = subprocess.DEVNULL
    try:
        other = subprocess.Popen(
            [sys.executable, "-c", program], stdin=nothing, stdout=nothing, stderr=nothing
        )
    except OSError:
        return
    atexit.register(other.terminate)
