"""`screen` and its kin: what an item buffer of the view shows to be missing.

The item buffer has half as many pixels each way as the one that errors are summed over (80 × 45).
It says which texture each pixel shows and which level it wants, or of which cell it shows the
placeholder; ``age`` is how many frames old it is. What lies around, by distance, coverage or need,
counts a fifth: any weight from a twentieth to one does about as well.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ptmtools.arrays import Floats
from ptmtools.walkthrough.policies.around import geometry_by_placeholders
from ptmtools.walkthrough.policies.engine import EngineClient, Worth
from ptmtools.walkthrough.weighing import Weighing, by_difference

#: What lies around counts so much beside what is on the screen, and of that so much for what is to
#: be in texture memory now.
AROUND, HELD = 0.2, 0.1


@dataclass(frozen=True)
class Screen:
    """A policy.

    Attributes
    ----------
    around: (T, K) shares of what lies around the client, or None.
    share: what lies around counts so much beside what is on the screen.
    weighing: of shares.
    age: of the item buffer, frames.
    """

    around: Callable[[EngineClient], Floats] | None = None
    share: float = AROUND
    weighing: Weighing = by_difference
    age: int = 1

    def __call__(self, client: EngineClient) -> Worth:
        """See `Policy`."""
        stock = client.world.catalogue
        sight = client.sight(self.age)
        if self.around is None:
            worth = self.weighing(stock, sight)
            return Worth(worth, worth, geometry_by_placeholders(client, self.age))
        around = self.around(client)
        return Worth(
            hold=self.weighing(stock, sight + HELD * self.share * around),
            fetch=self.weighing(stock, sight + self.share * around),
            geometry=geometry_by_placeholders(client, self.age),
            ahead=self.weighing(stock, around),
        )
