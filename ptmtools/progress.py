"""How a long operation tells of its progress: a function handed in by the caller.

``progress(done, total, what)`` is called from the thread that runs the operation; `silent` does
nothing and is the default everywhere.
"""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[int, int, str], None]


def silent(done: int, total: int, what: str) -> None:
    """Says nothing."""
