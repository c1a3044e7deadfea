"""A thin link between this server and all its clients together: a fluid, in small drops.

The model is that of `ptmtools.lab.network` on HTTP/1.1: a response begins one latency after
its request, then its head and its body flow, and what is under way shares the bandwidth equally.
Here the fluid comes in pieces of which each flow has one on the link at a time, in turn; a piece is
as large as the flow's share of `PIECE` seconds. So each flow receives one every 10 ms, whatever the
bandwidth, as browsers expect of a link; the shares of a second differ from the fluid's by less than
a hundredth.

`Link` knows no clock but is told the time: pieces are booked one after another, each from the
moment at which the one before it is through. A timer that is late therefore costs nothing, within
`LATE`; a client that does not take what it is sent loses what it could have had.
"""

from __future__ import annotations

import asyncio
import math
import time
from dataclasses import dataclass

from ptmtools.link import Conditions

#: Seconds of the link that a round of pieces takes, one piece of each flow.
PIECE = 0.01
#: Seconds by which a flow may be late to ask for its next piece and lose nothing.
LATE = 0.05


@dataclass(frozen=True)
class Throttle:
    """What the link is like.

    Attributes
    ----------
    bandwidth: bit/s of all responses together, or None if it has no limit.
    latency: s from a request to the first byte of its response.

    Raises InputError PTM-I711 for a value that makes no sense.
    """

    bandwidth: float | None = None
    latency: float = 0.0

    def __post_init__(self) -> None:
        # It refuses what makes no sense.
        Conditions(bandwidth=self.bandwidth, latency=self.latency)


class Flow:
    """A response on the link.

    Attributes
    ----------
    ready: s, the moment from which its next piece may be on the link.
    """

    def __init__(self, ready: float) -> None:
        self.ready = ready


class Link:
    """The link, on a clock that whoever calls has; of flows from `open` to `close`."""

    def __init__(self, throttle: Throttle) -> None:
        self.throttle = throttle
        self._rate = math.inf if throttle.bandwidth is None else throttle.bandwidth / 8
        self._flowing: set[Flow] = set()
        self._free = 0.0

    @property
    def shared_by(self) -> int:
        """Responses that are under way."""
        return len(self._flowing)

    def open(self, now: float) -> Flow:
        """A flow for a request that is here at ``now``, s; its ``ready`` is when its first byte may
        be sent."""
        return Flow(now + self.throttle.latency)

    def book(self, flow: Flow, left: int, now: float) -> tuple[int, float]:
        """Put the next of ``left`` bytes on the link.

        Returns how many, at least one, and the moment, s, at which they are through, from which on
        more may be booked. ValueError if none are left.
        """
        if left < 1:
            raise ValueError("nothing is left to send")
        self._flowing.add(flow)
        if self._rate == math.inf:
            flow.ready = max(flow.ready, now)
            return left, flow.ready
        share = self._rate * PIECE / len(self._flowing)
        piece = left if left <= share else max(1, math.floor(share))
        self._free = flow.ready = max(self._free, flow.ready, now - LATE) + piece / self._rate
        return piece, flow.ready

    def close(self, flow: Flow) -> None:
        """The flow has ended, whole or not."""
        self._flowing.discard(flow)


async def until(moment: float) -> None:
    """Wait for a moment of `time.monotonic`; others have their turn even if it is past."""
    await asyncio.sleep(max(0.0, moment - time.monotonic()))
