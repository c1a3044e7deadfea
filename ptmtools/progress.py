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


def listen(listener: Listener) -> None:
    """From now on ``listener`` is called with a few words for each wait that is announced."""
    _listeners.append(listener)


def announce(what: str) -> None:
    """Calls the listeners before something that takes a while."""
    for listener in _listeners:
        listener(what)
