"""What a client believes of its link, from what it has downloaded lately (§6.2: "network bandwidth
and latency analysis performed for some recent downloadings").

Bandwidth is bytes over the time during which any were arriving, both forgotten with a half-life of
such time: so a pause, in which nothing was asked for, neither lowers the estimate nor ages it, and
parallel requests are not counted against each other. What arrives between two looks is taken to
arrive evenly, and fades from where it arrives, so that the estimate does not depend on how often
one looks. Latency is the mean of the last few, of
requests whose response did not have to wait for those of others: on `h2` the others tell nothing of
the network. (A client sees it: another response ended as this one began.)
"""

from __future__ import annotations

import math
from collections import deque

from ptmtools.walkthrough.network import Link
from ptmtools.walkthrough.request import Request

#: After so many s of arriving bytes they count half.
HALF_LIFE = 1.0
#: With fewer bytes and less time than these, B and s, the prior is believed.
ENOUGH_BYTES, ENOUGH_SECONDS = 16_384, 0.25
#: So many latencies are remembered.
LATENCIES = 8


class Estimate:
    """Bandwidth and latency as a client of ``link`` believes them.

    Parameters
    ----------
    link: whose bytes and whose time of arrivals are observed; nothing else of it is looked at.
    bandwidth, latency: the prior, bit/s and s: what is believed until enough is known.
    """

    def __init__(self, link: Link, bandwidth: float, latency: float) -> None:
        self._link, self._prior = link, bandwidth
        self._seen = (link.carried, link.busy)
        self._bytes = self._seconds = 0.0
        self._latencies: deque[float] = deque([latency], LATENCIES)
        self._guessed = True

    def observe(self, finished: Request | None = None) -> None:
        """To be called after each `Link.advance`, with what that returned."""
        carried, busy = self._link.carried, self._link.busy
        seconds = busy - self._seen[1]
        age = math.log(2) * seconds / HALF_LIFE
        fading, kept = math.exp(-age), -math.expm1(-age) / age if age else 1.0
        self._bytes = self._bytes * fading + kept * (carried - self._seen[0])
        self._seconds = self._seconds * fading + kept * seconds
        self._seen = (carried, busy)
        if finished and finished.sent is not None and finished.first_byte == finished.starts:
            if self._guessed:
                self._latencies.clear()
                self._guessed = False
            self._latencies.append(finished.starts - finished.sent)

    @property
    def bandwidth(self) -> float:
        """Bit/s; infinite if bytes took no time."""
        if self._bytes < ENOUGH_BYTES and self._seconds < ENOUGH_SECONDS:
            return self._prior
        return 8 * self._bytes / self._seconds if self._seconds else math.inf

    @property
    def latency(self) -> float:
        """s to the first byte."""
        return sum(self._latencies) / len(self._latencies)

    def duration(self, size: float) -> float:
        """s until a request of ``size`` bytes would be finished, if it had the link for itself."""
        return self.latency + 8 * size / self.bandwidth if self.bandwidth else math.inf
