"""Names of rooms: those of the volumes (`room_volumes`) that most of a room is in."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ptmtools.arrays import Ints
from ptmtools.cells.model import Cells
from ptmtools.cells.room_volumes import Volumes, left_out

#: A room has the name of a volume if more than this share of its standing leaves is in it.
_MOST = 0.5


def unused_notes(volumes: Volumes, before: Ints, after: Ints) -> Iterator[str]:
    """Notes on volumes that no leaf is in, or of several rooms: (L,) leaves are in them before
    these are left out, but not after."""
    rooms = range(len(volumes.rooms))
    empty = [k for k in rooms if not (before == k).any()]
    several = [k for k in rooms if (before == k).any() and not (after == k).any()]
    for which, reason in ((empty, "no cell is mostly inside"), (several, "several rooms in one")):
        if which:
            yield left_out([volumes.rooms[k].name for k in which], reason)


def named(cells: Cells, volumes: Volumes, volume: Ints, room: Ints) -> Cells:
    """Cells with names: those of the volume that most of their room is in. A cell of several rooms
    has the name of one that is most of it.

    ``volume``, ``room``: (L,) the volume, -1 for none, and the room that each leaf is in.
    """
    leaf = np.flatnonzero(cells.leaf_cell >= 0)
    cell, size = cells.leaf_cell[leaf], cells.leaf_volumes()[leaf]
    rooms, row = np.unique(room[leaf], return_inverse=True)
    row = row.reshape(-1)
    inside = np.zeros((len(rooms), len(volumes.rooms) + 1))  # the last column: in no volume
    np.add.at(inside, (row, volume[leaf]), size * cells.leaf_standing[leaf])
    best = inside[:, :-1].argmax(axis=1)
    most = inside[np.arange(len(rooms)), best] > _MOST * inside.sum(axis=1)
    called = [volumes.rooms[k].name * bool(m) for k, m in zip(best.tolist(), most, strict=True)]
    pair, part = np.unique(cell.astype(np.int64) * len(rooms) + row, return_inverse=True)
    share = np.bincount(part.reshape(-1), size) / np.bincount(cell, size)[pair // len(rooms)]
    number: dict[int, int] = {}
    cell_room = np.full(cells.cell_count, -1, dtype=np.int32)
    for k in pair[share > _MOST].tolist():
        if called[k % len(rooms)]:
            cell_room[k // len(rooms)] = number.setdefault(k % len(rooms), len(number))
    if not number:
        return cells
    return replace(cells, cell_room=cell_room, rooms=tuple(called[r] for r in number))
