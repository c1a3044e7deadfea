"""The way of a walk in a floor plan, and where it looks while it stands."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ptmtools.arrays import Bools, Floats
from ptmtools.database.plans.storeys import storey_of

#: (n, 3) eyes, metres, and (n, 3) unit vectors in which they look, at equal or similar steps.
Way = tuple[Floats, Floats]
#: Of its line, and of the arrows.
WAY = "#1a7f4b"
#: An eye rests that moves and turns by less than this from one step to the next: metres, radians.
_STILL = 2e-3
#: The length of an arrow, metres.
_ARROW = 0.8


def draw_way(
    axis: Any, way: Way, floors: Sequence[float], storey: int, shown: Callable[[Floats], Floats]
) -> None:
    """Draws what of a way is in one storey, of those with these ``floors``; ``shown`` brings (…, 2)
    plan coordinates to paper. An arrow stands for each direction in which a standing eye looks."""
    eye, direction = way
    here: Bools = np.array([storey_of(floors, y) == storey for y in eye[:, 1]], dtype=np.bool_)
    line = np.where(here[:, None], shown(eye[:, [0, 2]]), np.nan)
    axis.plot(line[:, 0], line[:, 1], color=WAY, linewidth=0.9, zorder=6)
    change = np.abs(np.diff(eye, axis=0)).max(axis=1) + np.abs(np.diff(direction, axis=0)).max(
        axis=1
    )
    still = np.append(change < _STILL, False)
    begins = np.flatnonzero(still & ~np.append(False, still[:-1]) & here)
    start = shown(eye[begins][:, [0, 2]])
    end = shown((eye[begins] + _ARROW * direction[begins])[:, [0, 2]])
    for tail, head in zip(start, end, strict=True):
        arrow = {"arrowstyle": "->", "color": WAY, "linewidth": 0.9, "shrinkA": 0, "shrinkB": 0}
        axis.annotate("", head, tail, arrowprops=arrow, zorder=6)
