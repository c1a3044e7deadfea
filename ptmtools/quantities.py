"""Numbers as people read them."""

from __future__ import annotations


def size(count: int) -> str:
    """A number of bytes: ``97.5 MB`` (MB = 10⁶ B)."""
    for power, unit in ((9, "GB"), (6, "MB"), (3, "kB")):
        if count >= 10**power:
            return f"{count / 10**power:.1f} {unit}"
    return f"{count} B"


def count(number: int, one: str, many: str | None = None) -> str:
    """``1 portal``, ``2 portals``."""
    return f"{number:,} {one if number == 1 else many or one + 's'}"
