"""What a database means for a visitor: what it takes to look at it, and what is at hand on a walk.

All are bytes as they lie on the disk, textures losslessly and whole unless said otherwise.

A *VRML browser* opens the root and loads everything that this leads to: all cells, and the
fallback image of every texture. A client of the *hints* fetches the index, the record of the cell
that it is in, and of what that cell sees the geometry and the textures; the geometry in a form
that has no entry of its own, and so is there for such clients, if one was written. For it **the
first room is complete** when the index, the record of the first viewpoint's cell, the geometry of
all cells that it sees and the textures of the cell itself are there, and of the textures of the
other cells the coarsest level: nothing is missing, and the room is as fine as the model. **At
hand** is what it holds in a cell once everything it sees is whole. Means are over
places, not over cells: a cell counts by its volume.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ptmtools.database.emitters import Emitter, chosen_emitters
from ptmtools.database.names import HINTS, RECORD_FILES, path_of
from ptmtools.visibility.model import over_places

if TYPE_CHECKING:
    from ptmtools.database.content import Content


@dataclass(frozen=True)
class Visit:
    """See the module's description.

    Attributes
    ----------
    browser: bytes that a VRML browser fetches; None without VRML.
    first_room: bytes until the first room is complete.
    mean_at_hand, most_at_hand: bytes.
    mean_volume, most_volume: share of the volume of all cells that is at hand.
    mean_texels, most_texels: share of the texels in use; None without textures.
    """

    browser: int | None
    first_room: int
    mean_at_hand: int
    most_at_hand: int
    mean_volume: float
    most_volume: float
    mean_texels: float | None
    most_texels: float | None


def visit_of(content: Content, sizes: Mapping[str, int]) -> Visit:
    """What what has been written means for a visitor.

    ``sizes``: bytes of each file, by its path in the served folder.
    """
    pvs, records = content.pvs, content.textures
    forms = [e for e in chosen_emitters(content.options.format) if e.cell_files]
    nothing = np.zeros(pvs.cell_count, np.int64)
    fetched = [f for f in forms if not f.entry] or forms
    geometry = _geometry(content, fetched[0], sizes) if fetched else nothing
    paints = np.zeros((pvs.cell_count, len(records)), dtype=np.bool_)
    for cell, places in enumerate(content.painted):
        paints[cell, places] = True
    sees = np.array([paints[pvs.row(c)].any(axis=0) for c in range(pvs.cell_count)])
    used = np.flatnonzero(paints.any(axis=0))
    whole, coarsest = (
        np.array([r.levels[n].end if r.levels else 0 for r in records], np.int64) for n in (-1, 0)
    )
    at_hand = pvs.at_hand(geometry) + sees @ whole
    first = content.viewpoints[0].cell
    opening = [
        sizes[HINTS],
        sizes[path_of(first, RECORD_FILES)],
        geometry[pvs.row(first)].sum(),
        whole[paints[first]].sum(),
        coarsest[sees[first] & ~paints[first]].sum(),
    ]
    texels = np.array([r.width * r.height for r in records], np.float64)
    shares: tuple[float, float] | tuple[None, None] = (None, None)
    if len(used):
        shares = over_places(sees @ texels / texels[used].sum(), pvs.viewers)
    mean, most = over_places(at_hand, pvs.viewers)
    volume = pvs.volume_at_hand
    images = sum(records[i].fallback_bytes for i in used.tolist() if content.options.fallback)
    browsed = [sizes[f.entry] + _total(_geometry(content, f, sizes)) for f in forms if f.entry]
    return Visit(
        browser=browsed[0] + images if browsed else None,
        first_room=int(sum(opening)),
        mean_at_hand=round(mean),
        most_at_hand=round(most),
        mean_volume=volume[0],
        most_volume=volume[1],
        mean_texels=shares[0],
        most_texels=shares[1],
    )


def _geometry(content: Content, form: Emitter, sizes: Mapping[str, int]) -> NDArray[np.int64]:
    """(C,) bytes of the cells in a form."""
    paths = (path_of(cell, form.cell_files) for cell in range(content.cells.cell_count))
    return np.array([sizes[path] for path in paths], np.int64)


def _total(sizes: NDArray[np.int64]) -> int:
    return int(sizes.sum())
