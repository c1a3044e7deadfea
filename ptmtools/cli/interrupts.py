"""Ctrl-C in callbacks.

Compiled code that calls Python cannot pass an exception on: ctypes and Cython report it to
`sys.unraisablehook` and return. So an interrupt in a callback, as of LLVM while it compiles a loop,
is lost, or becomes an error of what called back. It is sent again here.
"""

from __future__ import annotations

import _thread
import signal
import sys
import threading
from typing import Any, Self

#: Seconds after which a lost interrupt is sent again: the callback has returned by then.
_LATER = 0.05


class LostInterrupts:
    """A context in which interrupts that are lost in callbacks are sent again to the main thread.

    Attributes
    ----------
    any: whether one was lost.
    """

    def __init__(self) -> None:
        self.any = False
        self._timer: threading.Timer | None = None

    def __enter__(self) -> Self:
        self._report, sys.unraisablehook = sys.unraisablehook, self._look
        return self

    def __exit__(self, *_: object) -> None:
        sys.unraisablehook = self._report
        if self._timer:
            self._timer.cancel()
            self._timer.join()

    def _look(self, unraisable: Any) -> None:
        if not issubclass(unraisable.exc_type, KeyboardInterrupt):
            self._report(unraisable)
            return
        self.any = True
        self._timer = threading.Timer(_LATER, _interrupt)
        self._timer.daemon = True
        self._timer.start()


def _interrupt() -> None:
    if hasattr(signal, "pthread_kill"):  # ends a wait of the main thread, too
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
    else:
        _thread.interrupt_main()


def is_interrupt(fault: BaseException | None) -> bool:
    """Whether an exception is a consequence of Ctrl-C, as a SystemError of compiled code is."""
    while fault and not isinstance(fault, KeyboardInterrupt):
        fault = fault.__cause__ or fault.__context__
    return fault is not None
