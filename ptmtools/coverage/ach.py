"""Average Coverage Hints: the share of each visible cell in the views from a cell (paper §5).

For every cell, K points spread uniformly over its volume; at each, six square views of 90°; in
each pixel, the cell of the surface that shows. ``ACH_j`` is the number of pixels of cell j over
that of all cells of the PVS, so a row sums to 1.

The paper draws "all the objects of its PVS". Here all objects are drawn, so that a pixel can show a
cell outside the PVS, which is an error of the PVS or a crack in the model (`tally`).
"""

from __future__ import annotations

import numpy as np

from ptmtools.cells.model import Cells
from ptmtools.coverage.backends import AUTO, BACKENDS, Backend
from ptmtools.coverage.item_buffer import VIEWS
from ptmtools.coverage.model import Ach
from ptmtools.coverage.options import AchOptions
from ptmtools.coverage.sampling import RULE_OF_THREE, CellHints, HintSampler, estimate
from ptmtools.errors import InputError, MissingComponentError
from ptmtools.executor import Executor
from ptmtools.progress import Progress, silent
from ptmtools.scene.model import Scene
from ptmtools.visibility.model import Pvs


def choose(cells: Cells, pvs: Pvs, options: AchOptions) -> Backend:
    """The backend that the options name; for "auto" the available backend with the least expected
    processor time.

    Raises `MissingComponentError` PTM-M500 if one cannot run though a graphics device is named.
    """
    if options.backend != AUTO:
        return BACKENDS[options.backend]
    triangles, pixels = triangles_of_a_pvs(cells, pvs), len(VIEWS) * options.side**2
    costs = {}
    for name, backend in BACKENDS.items():
        try:
            costs[name] = backend.cost(triangles, pixels, options.gpu)
        except MissingComponentError:
            if options.gpu is not None:  # a named device requires this backend
                raise
    return BACKENDS[min(costs, key=costs.__getitem__)]


def triangles_of_a_pvs(cells: Cells, pvs: Pvs) -> float:
    """Number of pieces of triangles in the cells of a PVS, averaged over the cells."""
    if not cells.cell_count:
        return 0.0
    front, back = cells.triangle_cell.T
    faces = np.bincount(front[front >= 0], minlength=cells.cell_count)
    faces += np.bincount(back[(back >= 0) & (back != front)], minlength=cells.cell_count)
    return float(faces[pvs.cell].sum()) / cells.cell_count


#: Rays that justify another process: it takes a second or two to start, as 5 million rays do.
WORTH_A_PROCESS = 1e7
#: Rays that are cast for one task: a tenth of a second.
TASK = 2e5
#: Sample points that a tolerance takes in most cells, at most.
EXPECTED = 1024


def compute_ach(
    scene: Scene,
    cells: Cells,
    pvs: Pvs,
    options: AchOptions = AchOptions(),  # noqa: B008 - a frozen value
    progress: Progress = silent,
    executor: Executor = Executor(),  # noqa: B008 - has no state
) -> Ach:
    """The coverage hints of every cell, aligned with ``pvs`` (paper §5).

    Equal input and options give equal results whatever the ``executor``; two backends differ in a
    few edge pixels. Where a backend draws `in_processes`, cells are tasks of their own; otherwise
    this process draws them all.

    Raises `InputError` PTM-I400 if the three inputs do not belong together, and
    `MissingComponentError` PTM-M500 if the gl backend is asked for and there is no OpenGL.
    """
    _check(scene, cells, pvs)
    backend = choose(cells, pvs, options)
    points = options.points if options.tolerance is None else EXPECTED
    rays = points * len(VIEWS) * options.side**2
    count = cells.cell_count
    worth = rays * count >= 2 * WORTH_A_PROCESS
    doer = executor if backend.in_processes and executor.workers > 1 and worth else Executor()
    chunk = int(max(1, min(TASK // rays, count // (4 * doer.workers))))
    rows: list[CellHints] = []
    sampler = HintSampler(scene, cells, pvs, options, backend)
    try:
        if doer is executor:
            sampler.renderer.close()  # each process opens one of its own
        for hints in doer.each(HintSampler.of_cell, sampler, range(count), chunk=chunk):
            rows.append(hints)
            progress(len(rows), count, "coverage")
    finally:
        sampler.renderer.close()
    return _gather(rows, sampler)


def _gather(cells: list[CellHints], sampler: HintSampler) -> Ach:
    none = np.zeros((len(VIEWS), 0), dtype=np.int64)
    nothing = estimate(none[:0], none, none[0], 1)  # has the types of what is joined
    rows = [nothing, *(hints.row for hints in cells)]
    entries = {
        name: np.concatenate([getattr(row, name) for row in rows])
        for name in ("value", "pixels", "error", "p95", "seen", "views")
    }
    total = np.array([float(hints.row.pixels.sum()) for hints in cells])
    samples = np.array([hints.samples for hints in cells], dtype=np.int32)
    textures = cells if sampler.options.per_texture else []
    size = np.concatenate([np.zeros(0, np.int64), *(hints.texture_count for hints in textures)])
    return Ach(
        start=sampler.pvs.start.copy(),
        **entries,
        missed=np.array([hints.missed for hints in cells], dtype=np.float64),
        samples=samples,
        rejected=np.array([hints.rejected for hints in cells], dtype=np.int32),
        uncertain=np.array([hints.row.uncertain for hints in cells], dtype=np.float64),
        unseen_below=np.minimum(1.0, RULE_OF_THREE / np.maximum(samples, 1)),
        floor=np.divide(0.5, total, out=np.zeros_like(total), where=total > 0),
        texture_start=np.cumsum(np.append(0, size)) if textures else size,
        texture=np.concatenate([np.zeros(0, np.int32), *(hints.texture for hints in textures)]),
        texture_value=np.concatenate([np.zeros(0), *(hints.texture_value for hints in textures)]),
        backend=sampler.backend.name,
        renderer=sampler.renderer.name,
    )


def _check(scene: Scene, cells: Cells, pvs: Pvs) -> None:
    """Raises `InputError` PTM-I400 unless the three belong together."""
    source = cells.triangle_source
    if pvs.cell_count != cells.cell_count:
        wrong = f"the PVS has {pvs.cell_count} cells, the subdivision {cells.cell_count}"
    elif len(source) and int(source.max()) >= len(scene.triangles):
        wrong = f"the subdivision cuts triangle {int(source.max())} of {len(scene.triangles)}"
    else:
        return
    raise InputError("PTM-I400", wrong, remedy="compute both from the same scene again")
