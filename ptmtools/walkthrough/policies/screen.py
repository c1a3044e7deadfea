"""`screen` and its kin: what an item buffer of the view shows to be missing.

The item buffer has half as many pixels each way as the one that errors are summed over (80 × 45).
It says which texture each pixel shows and which level it wants; ``age`` is how many frames old it
is. What lies around, by distance, coverage or need, counts a fifth: any weight from a twentieth to
one does about as well.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ptmtools.arrays import Floats
from ptmtools.walkthrough.policies.around import geometry_worth
from ptmtools.walkthrough.policies.engine import EngineClient, Worth
from ptmtools.walkthrough.weighing import Weighing, by_difference

#: What lies around counts so much beside what is on the screen, for what is fetched and for what is
#: held.
AROUND, AROUND_HELD = 0.2, 0.02


@dataclass(frozen=True)
class Screen:
    """A policy.

    Attributes
    ----------
    around: (T, K) shares of what lies around the client, or None.
    weighing: of shares.
    age: of the item buffer, frames.
    """

    around: Callable[[EngineClient], Floats] | None = None
    weighing: Weighing = by_difference
    age: int = 1

    def __call__(self, client: EngineClient) -> Worth:
        """See `Policy`."""
        stock = client.world.catalogue
        sight = client.sight(self.age)
        if self.around is None:
            worth = self.weighing(stock, sight)
            return Worth(worth, worth, geometry_worth(client))
        around = self.around(client)
        return Worth(
            hold=self.weighing(stock, sight + AROUND_HELD * around),
            fetch=self.weighing(stock, sight + AROUND * around),
            geometry=geometry_worth(client),
            ahead=self.weighing(stock, around),
        )
