"""Where a walk begins: at a viewpoint, as a visitor's does."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ptmtools.walkthrough.path.ground import Ground
from ptmtools.walkthrough.path.tour import Leg

Triple = tuple[float, float, float]
#: Of each viewpoint the cell, the position in metres, and the unit vector in which it looks.
Viewpoints = Sequence[tuple[int, Triple, Triple]]
#: A viewpoint is where a place of its cell is at most so far away, metres.
_NEAR = 1.0


def beginning(ground: Ground, viewpoints: Viewpoints, seed: int) -> Leg | None:
    """Standing at a viewpoint and looking as it does: of those that can be walked from the first
    for seed 1, the next for seed 2, and so on around; None if there is none."""
    found = []
    for cell, position, direction in viewpoints:
        away = np.linalg.norm(ground.eye - position, axis=1)
        away[ground.cell != cell] = np.inf
        nearest = int(away.argmin())
        if away[nearest] <= _NEAR:
            found.append(Leg.at(nearest, direction))
    return found[(seed - 1) % len(found)] if found else None
