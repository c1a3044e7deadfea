"""The kinds of space at given points, as a visitor would call them: a room, a hall, a court, open
ground, a low hollow such as a plenum, or the inside of a solid.

Level rays and a ray upwards from the height of the eye decide. Glass and furniture count as walls:
a room with a glass front is a room. Where most space under the sky seems solid, or most enclosed
space if none is under the sky, faces are turned out of rooms, and their sense tells nothing
(`Surroundings.solid`). Enclosed space alone cannot tell, since a town of solid houses has no other.
A shell with openings is hollow, whatever its faces say.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.cells.structure import AWAY, INSIDE, Surroundings

#: Least and greatest clear height of a room, metres.
CLEAR = 2.0, 12.0


class SpaceKind(IntEnum):
    """The kind of a space; visits rather begin in one of a smaller number."""

    ROOM = 0  # walls around, and a ceiling
    HALL = 1  # with a higher ceiling than rooms have
    COURT = 2  # walls around, under the sky
    OPEN = 3  # terrain, a roof, a street
    LOW = 4  # a plenum, a shaft below a floor
    SOLID = 5  # the inside of a wall or of the ground


def space_kinds(
    around: Surroundings, points: Floats, height: Floats, weight: Floats, scale: float
) -> Ints:
    """(n,) the kind of each space by (n, k, 3) points in it at the height of the eye, which is (n,)
    ``height`` metres above its floor: that of most points. ``weight``: (n,) of each space, such as
    its area. ``scale``: see `Walker.scale`."""
    count, looks = points.shape[:2]
    flat = points.reshape(-1, 3)
    met = around.walls_met(flat)
    walled = met >= INSIDE
    up = around.first(flat, np.tile([0.0, 1.0, 0.0], (len(flat), 1)))[0]
    clear = (up + np.repeat(height, looks)) / scale
    kind = np.select(
        [clear < CLEAR[0], ~walled, clear <= CLEAR[1], np.isfinite(clear)],
        [SpaceKind.LOW, SpaceKind.OPEN, SpaceKind.ROOM, SpaceKind.HALL],
        SpaceKind.COURT,
    )
    votes = np.zeros((count, len(SpaceKind)), dtype=np.int64)
    np.add.at(votes, (np.repeat(np.arange(count), looks), kind), 1)
    result: Ints = votes.argmax(axis=1)
    backs = around.backs(points)
    solid, sure = backs >= AWAY, np.isfinite(backs)
    sky = sure & np.isin(result, (SpaceKind.COURT, SpaceKind.OPEN))
    judges = weight * (sky if sky.any() else sure & (result <= SpaceKind.HALL))
    if judges[solid].sum() <= judges.sum() / 2:
        sealed = (met.reshape(count, looks) == 1).all(axis=1)
        result[solid & sealed] = SpaceKind.SOLID
    return result
