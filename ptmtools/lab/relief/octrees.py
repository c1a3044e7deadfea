"""The octree textures of a served folder, as kernels take them, and as what clients fetch.

Octrees as clients know them: textures behind the others (`Catalogue`)."""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints
from ptmtools.errors import DatabaseError, InputError
from ptmtools.lab.catalogue import LEAST, Catalogue, Columns, Shapes, aligned
from ptmtools.output.names import HINTS
from ptmtools.output.served import BUILD, Served, Surfaces

#: Bytes of a texel in texture memory.
_TEXEL = 4


class Octrees(NamedTuple):
    """Octree textures one after the other.

    Attributes
    ----------
    texel: (N, 4) uint8. begin: (O + 1,) where each octree begins in it.
    levels: (O,) how many each has.
    low, side: (O, 3), (O,) of the cubes, metres.
    of: (m,) int32 the octree of each triangle of the surfaces, -1 without.
    """

    texel: NDArray[np.uint8]
    begin: Ints
    levels: Ints
    low: Floats
    side: Floats
    of: NDArray[np.int32]

    @property
    def number(self) -> int:
        """How many there are."""
        return len(self.levels)


def read_octrees(served: Served) -> Octrees:
    """All of a served folder, which may have none.

    Raises DatabaseError: PTM-D005 a file is missing; PTM-D006 it is damaged, or not as the index
    says.
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
    """None at all."""
    of = np.full(len(surfaces.corner), -1, np.int32)
    no = np.zeros(0, np.int64)
    return Octrees(
        np.zeros((0, 4), np.uint8), np.zeros(1, np.int64), no, np.zeros((0, 3)), np.zeros(0), of
    )


def octree_columns(served: Served) -> Columns:
    """What can be fetched of each octree: a column is a level, its size the nodes along a side."""
    rows = []
    for row in _rows(served):
        across = 1 << np.arange(len(row["levels"]))
        memory = np.cumsum(row["levels"]) * _TEXEL
        rows.append((row["ends"], memory, np.stack([across, across], axis=1)))
    return aligned(rows)


def _rows(served: Served) -> Sequence[Mapping[str, Any]]:
    found: Sequence[Mapping[str, Any]] = served.index.get("octrees", ())
    return found


def _texels(served: Served, row: Mapping[str, Any]) -> NDArray[np.uint8]:
    from ptmtools.neighbours.apo.files import Stream, inflated

    file = served.file(row["file"])
    start = np.concatenate([[0], np.cumsum(row["levels"], dtype=np.int64)])
    wrong = ""
    if not len(row["levels"]) == len(row["ends"]) == len(row["crc32"]):
        wrong = "has levels, ends and checksums that do not fit together in hints.json"
    elif start[-1] > 1 << 24 or (np.diff(row["ends"], prepend=0) <= 0).any():
        wrong = "has more texels in hints.json than there can be, or ends that do not ascend"
    if not wrong:
        data = served.read(row["file"])
        try:
            return inflated(data, start, Stream(row["file"], row["ends"], row["crc32"]))
        except (InputError, zlib.error) as fault:
            wrong = getattr(fault, "message", str(fault))
    raise DatabaseError("PTM-D006", wrong, file=file, remedy=BUILD)


#: Points of each object at which the levels of its octree are compared, and where they are put.
_POINTS, _SEED = 4096, 1
#: Share of white that what is lit gives back, where the light on it is compared.
_BRIGHT = 255 * 0.7


def without_octrees(stock: Catalogue, octrees: Octrees) -> Catalogue:
    """What a client knows that draws none: nothing can be fetched of them.

    There are as many columns as the tables of the walk have.
    """
    return _none(stock, octrees.number + 1, octrees)


def with_octrees(stock: Catalogue, served: Served, octrees: Octrees) -> Catalogue:
    """What a client knows that draws octrees; ``stock`` is of the textures alone."""
    columns = octree_columns(served)
    found = stock.beside(columns, differences(served, octrees, columns), _shapes(served, octrees))
    # Behind them what nothing mends, see the package.
    return _none(found, 1, octrees)


def _none(stock: Catalogue, count: int, octrees: Octrees) -> Catalogue:
    """With so many textures more of which nothing can be fetched."""
    wide = 1 + int(octrees.levels.max(initial=1))
    last, table = np.zeros(count, np.int64), np.zeros((count, wide), np.int64)
    nothing = Columns(last, table, table, np.zeros((count, wide, 2), np.int64))
    return stock.beside(nothing, np.zeros((count, wide)))


def differences(served: Served, octrees: Octrees, columns: Columns) -> Floats:
    """(O, K) of each level to the one before it, as pictures show it: on average over the object, 0
    to 255. hints.json does not say them; who writes it could."""
    from ptmtools.lab.relief.kernels import DEEP, descend

    found = np.zeros(columns.ends.shape)
    random, surfaces = np.random.default_rng(_SEED), served.surfaces
    for o in range(octrees.number):
        own = np.flatnonzero(octrees.of == o)
        levels = int(octrees.levels[o])
        if len(own):
            corner = surfaces.corner[own]
            area = np.linalg.norm(
                np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1
            )
            total = np.cumsum(area)
            which = np.searchsorted(total, random.uniform(0, total[-1], _POINTS), "right")
            weight = random.dirichlet(np.ones(3), _POINTS)
            place = np.einsum("nk,nkj->nj", weight, corner[np.minimum(which, len(own) - 1)])
            light, steps = np.zeros(DEEP), np.zeros(levels)
            for x, y, z in place.tolist():
                count = descend(octrees, o, x, y, z, DEEP, light)
                steps[1:count] += np.abs(np.diff(light[:count]))
            found[o, 1 : levels + 1] = _BRIGHT * steps / _POINTS
        stored = found[o, 1 : levels + 1]
        found[o, 1 : levels + 1] = np.maximum(stored, LEAST)
    return found


def _shapes(served: Served, octrees: Octrees) -> Shapes:
    """The shapes that show octrees, once more with these."""
    surfaces, first = served.surfaces, len(served.index["textures"])
    low, high = surfaces.boxes()
    shape, where = np.unique(surfaces.shape, return_index=True)
    some = octrees.of[where] >= 0
    shape, where = shape[some], where[some]
    cell, number = surfaces.cell[where].astype(np.int64), octrees.of[where].astype(np.int64)
    side = np.repeat(octrees.side[number][:, None], 2, axis=1)
    return Shapes(cell, first + number, low[shape], high[shape], side)
