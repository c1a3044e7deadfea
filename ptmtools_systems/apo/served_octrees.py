"""Octree textures of a served folder: arrays for kernels, what the levels add to a picture, the
painter of lit views, and the rows of a site."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, areas
from ptmtools.errors import DatabaseError, InputError
from ptmtools.output.names import HINTS
from ptmtools.output.served import BUILD, Served
from ptmtools.output.surfaces import Surfaces
from ptmtools.rendering.records import Sight, Triangles
from ptmtools_systems.apo.declarations import OCTREES
from ptmtools_systems.apo.files import inflate_texels
from ptmtools_systems.apo.model import Octrees

#: Number of points of each object at which the levels of its octree are compared, and the seed of
#: their places.
_POINTS, _SEED = 4096, 1
#: Brightness of the lit surface in the comparison, 0 to 255.
_BRIGHT = 255 * 0.7


def read_octrees(served: Served) -> Octrees:
    """Reads the octree textures of a served folder, if any.

    Raises DatabaseError: PTM-D005 a file is missing; PTM-D006 it is damaged, or does not match the
    index.
    """
    rows = _rows(served)
    if rows and (octree_numbers(served.surfaces) < 0).all():
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
        of=octree_numbers(served.surfaces),
    )


def no_octrees(surfaces: Surfaces) -> Octrees:
    """An empty set of octrees."""
    numbers = np.full(len(surfaces.corner), -1, np.int32)
    none, no_texels = np.zeros(0, np.int64), np.zeros((0, 4), np.uint8)
    return Octrees(no_texels, np.zeros(1, np.int64), none, np.zeros((0, 3)), np.zeros(0), numbers)


def _rows(served: Served) -> Sequence[Mapping[str, Any]]:
    result: Sequence[Mapping[str, Any]] = served.index.get(OCTREES.name, ())
    return result


def _texels(served: Served, row: Mapping[str, Any]) -> NDArray[np.uint8]:
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
            return inflate_texels(data, start, row)
        except (InputError, zlib.error) as fault:
            problem = getattr(fault, "message", str(fault))
    raise DatabaseError("PTM-D006", problem, file=file, remedy=BUILD)


def octree_numbers(surfaces: Surfaces) -> NDArray[np.int32]:
    """(m,) the octree of each triangle, -1 for none."""
    none = np.full(len(surfaces.corner), -1, np.int32)
    return surfaces.represented.get(OCTREES.member, none)


def level_differences(surfaces: Surfaces, octrees: Octrees) -> Floats:
    """(O, L) mean difference of each level to the one before, over the object as displayed, 0 to
    255; 0 for the first level, and after the last."""
    from ptmtools_systems.apo.lighting import DEEP, descend

    steps = np.zeros((octrees.number, int(octrees.levels.max(initial=0))))
    random = np.random.default_rng(_SEED)
    for o in range(octrees.number):
        faces = np.flatnonzero(octrees.of == o)
        if not len(faces):
            continue
        corner = surfaces.corner[faces]
        total = np.cumsum(areas(corner))
        which = np.searchsorted(total, random.uniform(0, total[-1], _POINTS), "right")
        weight = random.dirichlet(np.ones(3), _POINTS)
        place = np.einsum("nk,nkj->nj", weight, corner[np.minimum(which, len(faces) - 1)])
        light = np.zeros(DEEP)
        for x, y, z in place.tolist():
            count = descend(octrees, o, x, y, z, DEEP, light)
            steps[o, 1:count] += np.abs(np.diff(light[:count]))
    return _BRIGHT * steps / _POINTS


class OctreePainter:
    """Lights objects by their octree textures, see `ObjectPainter` of
    `ptmtools.rendering.painting`."""

    def __init__(self, served: Served) -> None:
        """Raises as `read_octrees`."""
        self._octrees = read_octrees(served)

    def paint(
        self, sight: Sight, triangles: Triangles, lamps: Floats, loaded: Bools, shown: Floats
    ) -> None:
        """By all levels."""
        from ptmtools_systems.apo.lighting import relieve

        octrees = self._octrees
        relieve(sight, triangles, lamps, octrees, loaded, octrees.levels, shown)


def published_rows(
    served: Served, place: Callable[[str], tuple[Path, str]]
) -> Iterator[tuple[Mapping[str, Any], Path, str]]:
    """The rows of a site's index, which say what each level adds, with the file of each and its
    SHA-256; see `Representation.published`."""
    differences = level_differences(served.surfaces, read_octrees(served)).round(3).tolist()
    for row, steps in zip(_rows(served), differences, strict=True):
        yield ({**row, "differences": steps[: len(row["levels"])]}, *place(row["file"]))
