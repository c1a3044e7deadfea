"""What a call of the simulated link costs: ``python benchmarks/link_speed.py``

A client keeps so many requests of 0 to 20 kB under way at 4 Mbit/s, looks 30 times a second, and
gives up one every ten looks.
"""

from __future__ import annotations

import random
import time

from ptmtools.walkthrough.network import Conditions, Link
from ptmtools.walkthrough.trace import Step, Trace

LOOKS = 40_000
TRACE = Trace(tuple(Step(0.1, 1e6 * (1 + i % 3)) for i in range(30)))


def microseconds(conditions: Conditions, depth: int) -> float:
    """Of a call of `request`, `cancel` or `advance`."""
    draw, link = random.Random(1), Link(conditions)
    under_way = [link.request(20_000, 0.0)]
    calls, begin = 0, time.perf_counter()
    for look in range(LOOKS):
        while len(under_way) < depth:
            under_way.append(link.request(draw.randrange(20_000), draw.random()))
            calls += 1
        if look % 10 == 0:
            link.cancel(under_way.pop(draw.randrange(depth)))
            calls += 1
        if finished := link.advance(link.now + 1 / 30):
            under_way.remove(finished)
        calls += 1
    return (time.perf_counter() - begin) / calls * 1e6


if __name__ == "__main__":
    print("protocol  trace  under way  µs a call")
    for protocol, trace, depth in (
        *(("h1", None, n) for n in (6, 30)),
        *(("h2", None, n) for n in (6, 30, 300)),
        ("h1", TRACE, 6),
    ):
        cost = microseconds(Conditions(4e6, protocol=protocol, trace=trace), depth)
        print(f"{protocol:8}  {'yes' if trace else 'no':5}  {depth:9}  {cost:9.1f}")
