"""Whether a model can be seen from its inside.

Where faces have no backs, as in glTF, a model whose faces are all turned over, or a shell that was
made to be looked at from outside, is empty to whoever stands in its rooms. On sample lines
(`lines`), a stretch of free space as long as a room ends at two faces, and in a sound model both
are turned to it. Signed volumes tell nothing here: a box is a room seen from inside or a block seen
from outside, and both are right.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats
from ptmtools.scene.lines import SampleLines
from ptmtools.tolerance import PLANE_SHARE

#: A shorter stretch between two faces, in metres, may be a wall or a cupboard.
ROOM = 1.5
#: Above this share of ends of rooms at which nothing is seen, a model is inside out.
TURNED_AWAY = 0.5


def turned_away(points: Floats, triangles: NDArray[np.integer], backed: Bools) -> float:
    """The share of ends of rooms whose face is turned away from the room, 0 to 1.

    ``points`` are (V, 3) in metres, ``triangles`` (T, 3), and ``backed`` is (T,), which of them are
    seen from both sides.
    """
    if backed.all():
        return 0.0
    lines = SampleLines(points, triangles)
    together = PLANE_SHARE * float(np.ptp(points, axis=0).max())
    ends = away = 0
    for axis in range(3):
        found = lines.along(axis)
        a, b, c = np.moveaxis(points[triangles[found.triangle]], 1, 0)
        u, v = (axis + 1) % 3, (axis + 2) % 3
        one, other = b - a, c - a
        along = one[:, u] * other[:, v] - one[:, v] * other[:, u] > 0
        both = backed[found.triangle]
        # Faces in one place are one surface, which shows what any of them shows.
        near = np.zeros(len(found.line), dtype=bool)
        after, gap = found.gaps()
        near[after + 1] = gap <= together
        first = np.flatnonzero(~near)
        if not len(first):
            continue
        shows_up = np.logical_or.reduceat(both | along, first)
        shows_down = np.logical_or.reduceat(both | ~along, first)
        line, at = found.line[first], found.position[first]
        room = np.flatnonzero((line[1:] == line[:-1]) & (np.diff(at) >= ROOM))
        ends += 2 * len(room)
        away += int(np.count_nonzero(~shows_up[room]) + np.count_nonzero(~shows_down[room + 1]))
    return away / ends if ends else 0.0
