"""The progress of long operations: a function that the caller passes.

``progress(done, total, unit)`` is called from the thread that runs the operation; the default,
`silent`, does nothing. The module also reports waits that cannot be counted.
"""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[int, int, str], None]


def silent(done: int, total: int, unit: str) -> None:
    """Ignores the progress."""


Listener = Callable[[str], None]
_listeners: list[Listener] = []


def listen(listener: Listener) -> None:
    """Adds a listener, which is called with a few words for each wait."""
    _listeners.append(listener)


def announce(wait: str) -> None:
    """Calls the listeners before a wait."""
    for listener in _listeners:
        listener(wait)
