"""How a long operation tells of its progress: a function handed in by the caller.

``progress(done, total, what)`` is called from the thread that runs the operation; `silent` does
nothing and is the default everywhere. Waits that cannot be counted are announced to whoever
listens.
"""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[int, int, str], None]


def silent(done: int, total: int, what: str) -> None:
    """Says nothing."""


Listener = Callable[[str], None]
_listeners: list[Listener] = []


def listen(tell: Listener) -> None:
    """From now on ``tell`` hears, in a few words, of each wait that is announced."""
    _listeners.append(tell)


def announce(what: str) -> None:
    """Tells whoever listens that something takes a while."""
    for tell in _listeners:
        tell(what)
