"""Cells shared out among processes: Embree's binding keeps the interpreter's lock.

Every process is sent the scene once and builds its own trees; then it is sent numbers of cells and
returns their hints. Results come in the order of the cells, so nothing depends on who did what.
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context

from ptmtools.cells.model import Cells
from ptmtools.coverage.embree import EmbreeRenderer
from ptmtools.coverage.item_buffer import Surfaces
from ptmtools.coverage.options import AchOptions
from ptmtools.coverage.sampling import CellHints, Sampler
from ptmtools.scene.model import Scene
from ptmtools.visibility.model import Pvs

#: Cells that are handed out together.
TASK = 4

_sampler: Sampler | None = None


def shared_out(
    scene: Scene, cells: Cells, pvs: Pvs, options: AchOptions, workers: int
) -> Iterator[CellHints]:
    """The hints of every cell, in order, from ``workers`` processes with Embree."""
    bare = replace(scene, images=())  # their bytes are not needed
    with ProcessPoolExecutor(
        workers, get_context("spawn"), _prepare, (bare, cells, pvs, options)
    ) as pool:
        yield from pool.map(_of_cell, range(cells.cell_count), chunksize=TASK)


def _prepare(scene: Scene, cells: Cells, pvs: Pvs, options: AchOptions) -> None:
    global _sampler
    surfaces = Surfaces.of(scene, cells)
    renderer = EmbreeRenderer(surfaces, options.side)
    _sampler = Sampler(scene, cells, pvs, options, surfaces, renderer)


def _of_cell(cell: int) -> CellHints:
    assert _sampler is not None
    return _sampler.of_cell(cell)
