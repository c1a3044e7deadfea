"""A world in which nothing is seen is a mistake in the model, and not a result."""

from __future__ import annotations

import numpy as np

from ptmtools.cells.model import Cells
from ptmtools.cells.vectors import normals
from ptmtools.errors import InputError
from ptmtools.scene.model import Scene


def check_seen(scene: Scene, cells: Cells) -> None:
    """Raises InputError PTM-I304 if from nowhere in the cells a face of the scene is seen."""
    if _something_seen(scene, cells):
        return
    if scene.two_sided.all():
        raise InputError(
            "PTM-I304",
            "no face of the model lies in or around a cell",
            remedy="give a --viewpoint X,Y,Z inside a room",
        )
    raise InputError(
        "PTM-I304",
        "nothing of the model is seen from inside: no face around its cells is turned towards "
        "them or has a back",
        remedy="give --two-sided to draw every face from both sides, or turn the normals",
    )


def _something_seen(scene: Scene, cells: Cells) -> bool:
    """Whether some face is two-sided or faces the box around its cell. In doubt it does: what lies
    in a side of the root box is emitted with the cell there, whichever way it looks."""
    piece, cell = cells.emitted(scene.two_sided)
    if not len(piece) or scene.two_sided[cells.triangle_source[piece]].any():
        return len(piece) > 0
    low, high = np.full((2, cells.cell_count, 3), [[[np.inf]], [[-np.inf]]])
    starts = cells.leaf_point_start[:-1]
    kept = cells.leaf_cell >= 0
    of = cells.leaf_cell[kept]
    np.minimum.at(low, of, np.minimum.reduceat(cells.leaf_point, starts)[kept])
    np.maximum.at(high, of, np.maximum.reduceat(cells.leaf_point, starts)[kept])
    corners = cells.vertex[cells.triangle[piece]]
    facing = normals(corners)
    furthest = np.where(facing > 0, high[cell], low[cell])
    ahead = np.einsum("nk,nk->n", furthest - corners[:, 0], facing)
    return bool((ahead > cells.tolerance.thin * np.linalg.norm(facing, axis=1)).any())
