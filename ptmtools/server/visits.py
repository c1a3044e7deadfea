"""What was asked of a server, in the order in which it was asked."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass


@dataclass
class Visit:
    """A request and what became of it.

    Attributes
    ----------
    method, path: of the request; the path as it was written, without what follows a "?".
    range: its ``Range`` header, or None.
    begun: s, `time.monotonic`, when it was here.
    status: of the response, 0 if none was begun.
    header_bytes, bytes: of the response's head and body that have been sent so far.
    length: bytes that the body has, as the head says; of a HEAD that of a GET.
    first_byte, ended: s, when the head was sent, and when no more was; None before.
    whole: whether all of the response was sent; else it is under way, or the client gave up.
    """

    method: str
    path: str
    range: str | None
    begun: float
    status: int = 0
    header_bytes: int = 0
    bytes: int = 0
    length: int | None = None
    first_byte: float | None = None
    ended: float | None = None
    whole: bool = False


class Visits:
    """A list of visits that a server adds to in its thread, and that others read meanwhile."""

    def __init__(self) -> None:
        self._visits: list[Visit] = []

    def __iter__(self) -> Iterator[Visit]:
        return iter(tuple(self._visits))

    def __len__(self) -> int:
        return len(self._visits)

    def add(self, visit: Visit) -> None:
        """One more; it may change until it has ended."""
        self._visits.append(visit)

    def clear(self) -> None:
        """Forget all that there were."""
        self._visits.clear()

    @property
    def bytes(self) -> int:
        """Sent in all, heads and bodies."""
        return sum(visit.header_bytes + visit.bytes for visit in self)
