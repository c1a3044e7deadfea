"""A range of bytes that a client has asked for, as `Link` keeps it."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(eq=False, slots=True)
class Request:
    """For the client to read; only its link writes it.

    Attributes
    ----------
    size: bytes of the body.
    overhead: bytes of headers, which come before.
    priority: the greater, the sooner.
    tag: whatever the client wants to know it by.
    number: how many requests were made before.
    issued: when it was asked for, s. late: so many seconds later it goes out on its connection.
    sent: when it went out, s, later than that if it had to wait for a connection; None before.
    first_byte: when its response began to arrive, s; None before.
    ended: when it was finished or cancelled, s; None before.
    finished, cancelled: whether it has come whole; whether the client gave it up.
    left: bytes that are yet to come, headers included.
    kept: what ``left`` was when it was cancelled: what came later, nobody wanted.
    starts, stops: when its response may begin to arrive, s; when, once it is cancelled, the last of
        what was under way has arrived.
    """

    size: int
    overhead: int
    priority: float
    tag: object
    number: int
    issued: float
    late: float = 0.0
    sent: float | None = None
    first_byte: float | None = None
    ended: float | None = None
    finished: bool = False
    cancelled: bool = False
    left: float = math.nan
    kept: float = math.nan
    starts: float = math.inf
    stops: float = math.inf

    def __post_init__(self) -> None:
        self.left = float(self.overhead + self.size)

    @property
    def arrived(self) -> float:
        """Bytes that arrived while they were wanted, headers included."""
        return self.overhead + self.size - (self.kept if self.cancelled else self.left)

    @property
    def received(self) -> float:
        """Bytes of the body, from its beginning, that the client holds."""
        return max(0.0, self.arrived - self.overhead)

    @property
    def unwanted(self) -> float:
        """Bytes that arrived when it had been cancelled, headers included."""
        return self.kept - self.left if self.cancelled else 0.0

    @property
    def rank(self) -> tuple[float, int]:
        """Requests with a lesser one go first."""
        return -self.priority, self.number
