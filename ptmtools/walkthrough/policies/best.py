"""`best`: what the viewer does (docs/formats/client.md).

`Screen`, with what lies around by distance and by need, half and half. Distance is right about what
one may walk up to, need about what one sees from where one can stand, and how fine; together they
take 3 % off either alone at half a megabit a second (benchmarks/RESULTS.md). Without need
in the records, distance alone.
"""

from __future__ import annotations

from ptmtools.arrays import Floats
from ptmtools.walkthrough.policies.around import by_distance, by_need
from ptmtools.walkthrough.policies.engine import EngineClient
from ptmtools.walkthrough.policies.screen import Screen

#: Of what lies around beside what is on the screen; anything from a twentieth to a half does.
SHARE = 0.1


def by_both(client: EngineClient) -> Floats:
    """(T, K) shares of what lies around."""
    near = by_distance(client)
    if "need" not in client.world.catalogue.records[client.cell]:
        return near
    return (near + by_need(client)) / 2


BEST = Screen(by_both, SHARE)
