"""Octree textures of a served folder as arrays for kernels."""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints
from ptmtools.errors import DatabaseError, InputError
from ptmtools.output.names import HINTS
from ptmtools.output.served import BUILD, Served
from ptmtools.output.surfaces import Surfaces


class Octrees(NamedTuple):
    """Concatenated octree textures.

    Attributes
    ----------
    texel: (N, 4) uint8. begin: (O + 1,) first texel of each octree.
    levels: (O,) number of levels.
    low, side: (O, 3), (O,) lower corner and side of the cubes, metres.
    of: (m,) int32 octree of each triangle of the surfaces, -1 for none.
    """

    texel: NDArray[np.uint8]
    begin: Ints
    levels: Ints
    low: Floats
    side: Floats
    of: NDArray[np.int32]

    @property
    def number(self) -> int:
        """Number of octrees."""
        return len(self.levels)


def read_octrees(served: Served) -> Octrees:
    """Reads the octree textures of a served folder, if any.

    Raises DatabaseError: PTM-D005 a file is missing; PTM-D006 it is damaged, or does not match the
    index.
    """
    rows = _rows(served)
    if rows and (served.surfaces.octree < 0).all():
        raise DatabaseError(
            "PTM-D006",
            "lists octree textures, and no object in the GLBs has one",
            file=served.folder / HINTS,
            remedy=BUILD,
        )
    texel = [_texels(served, row) for row in rows]
    count = len(rows)
    return Octrees(
        texel=np.concatenate([np.zeros((0, 4), np.uint8), *texel]),
        begin=np.cumsum([0, *map(len, texel)]).astype(np.int64),
        levels=np.array([len(row["levels"]) for row in rows], dtype=np.int64),
        low=np.array([row["cube"]["low"] for row in rows], dtype=np.float64).reshape(count, 3),
        side=np.array([row["cube"]["side"] for row in rows], dtype=np.float64),
        of=served.surfaces.octree,
    )


def no_octrees(surfaces: Surfaces) -> Octrees:
    """An empty set of octrees."""
    of = np.full(len(surfaces.corner), -1, np.int32)
    no = np.zeros(0, np.int64)
    return Octrees(
        np.zeros((0, 4), np.uint8), np.zeros(1, np.int64), no, np.zeros((0, 3)), np.zeros(0), of
    )


def _rows(served: Served) -> Sequence[Mapping[str, Any]]:
    result: Sequence[Mapping[str, Any]] = served.index.get("octrees", ())
    return result


def _texels(served: Served, row: Mapping[str, Any]) -> NDArray[np.uint8]:
    from ptmtools_systems.apo.files import inflated

    file = served.file(row["file"])
    start = np.concatenate([[0], np.cumsum(row["levels"], dtype=np.int64)])
    problem = ""
    if not len(row["levels"]) == len(row["ends"]) == len(row["crc32"]):
        problem = "has levels, ends and checksums that do not fit together in hints.json"
    elif start[-1] > 1 << 24 or (np.diff(row["ends"], prepend=0) <= 0).any():
        problem = "has more texels in hints.json than there can be, or ends that do not ascend"
    if not problem:
        data = served.read(row["file"])
        try:
            return inflated(data, start, row)
        except (InputError, zlib.error) as fault:
            problem = getattr(fault, "message", str(fault))
    raise DatabaseError("PTM-D006", problem, file=file, remedy=BUILD)
