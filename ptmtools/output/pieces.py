"""The surfaces of each cell, as the light stage takes them."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, areas
from ptmtools.light.model import CellSurfaces
from ptmtools.light.occlusion import normals
from ptmtools.output.mesh_levels import MANY

if TYPE_CHECKING:
    from ptmtools.cells.model import Cells
    from ptmtools.output.geometry import Geometry

#: The sides of a piece are examined this far off it, in units of the tolerance of planes.
_OFF = 4.0
#: Light is at vertices if pieces of more than this square of texels have less than this share of
#: the area of their object.
_FEW, _LARGE = 4.0, 0.1


def pieces_of(
    geometry: Geometry,
    cells: Cells,
    glass: Bools,
    texel: float,
    replaced: NDArray[np.integer] | None = None,
) -> list[CellSurfaces]:
    """The surfaces of each cell.

    Parameters
    ----------
    glass: (T,) whether a face of the scene has no light, see `CellSurfaces`.
    texel: metres of a lightmap.
    replaced: the objects with a relief. Their light is at vertices, as that of objects with
        thousands of small triangles.
    """
    count = np.diff(geometry.triangle_start)
    shape = np.repeat(np.arange(len(count)), count)
    first = geometry.point_start[:-1][shape]
    corner = geometry.point[geometry.shape_point[first[:, None] + geometry.triangle]]
    cell = np.repeat(np.arange(cells.cell_count), np.diff(geometry.cell_start))[shape]
    side = _facing(corner.astype(np.float64), cell, geometry.two_sided[shape], cells)
    area = areas(corner.astype(np.float64))
    number = geometry.object[shape].astype(np.int64)
    relieved = np.isin(number, [] if replaced is None else replaced)
    face = cells.triangle_source[geometry.piece]
    starts = geometry.triangle_start[geometry.cell_start]
    return [
        CellSurfaces(
            corner[a:b],
            number[a:b],
            shape[a:b] - geometry.cell_start[c],
            glass[face[a:b]],
            relieved[a:b] | _dense(number[a:b], area[a:b], texel),
            side[a:b],
            face[a:b],
        )
        for c, (a, b) in enumerate(pairwise(starts.tolist()))
    ]


def _facing(corner: Floats, cell: Ints, two_sided: Bools, cells: Cells) -> NDArray[np.int8]:
    """(n,) the side of each piece on which its cell lies, see `Piece.side`."""
    side = np.ones(len(corner), np.int8)
    rows = np.flatnonzero(two_sided)
    middle = corner[rows].mean(axis=1)
    off = _OFF * cells.tolerance.plane * normals(corner[rows])
    front, back = (cells.locate(middle + way) == cell[rows] for way in (off, -off))
    side[rows[back & ~front]] = -1
    side[rows[back & front]] = 0
    return side


def _dense(number: Ints, area: Floats, texel: float) -> Bools:
    """(n,) whether each piece belongs to an object with many pieces here, nearly all of which are
    smaller than a few texels. An object may also be a whole storey."""
    _, place, count = np.unique(number, return_inverse=True, return_counts=True)
    large = np.bincount(place, np.where(area > (_FEW * texel) ** 2, area, 0.0), len(count))
    return ((count >= MANY) & (large <= _LARGE * np.bincount(place, area, len(count))))[place]
