"""Average Coverage Hints: how much of what is seen from a cell belongs to which cell (paper §5).

For every cell, K points spread uniformly over its volume; at each, six square views of 90°; in
each pixel, the cell of the surface that shows. ``ACH_j`` is the number of pixels of cell j over
that of all cells of the PVS, so a row sums to 1.

The paper takes 8 points and large views. The points decide (docs/coverage.md), so by default there
are hundreds of them, with views of a few pixels.

The paper draws "all the objects of its PVS". Here what else shows is found too, since only so can a
pixel fall on a cell outside the PVS, which would be an error of the PVS or a crack in the model.
Such pixels are asked again, left out of the hints and reported as missed mass (`looking`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells.model import Cells
from ptmtools.coverage.backend import open_renderer
from ptmtools.coverage.embree import EmbreeRenderer
from ptmtools.coverage.estimate import RULE_OF_THREE
from ptmtools.coverage.item_buffer import VIEWS, Renderer, Surfaces
from ptmtools.coverage.looking import Owners
from ptmtools.coverage.model import Ach
from ptmtools.coverage.options import AchOptions
from ptmtools.coverage.sampling import CellHints, Sampler
from ptmtools.errors import InputError
from ptmtools.executors.model import Executor
from ptmtools.executors.serial import Serial
from ptmtools.progress import Progress, silent
from ptmtools.scene.model import Scene
from ptmtools.visibility.model import Pvs

#: Rays that a process of its own is worth: it takes a second or two to start, as 5 million rays do.
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
    executor: Executor = Serial(),  # noqa: B008 - has no state
) -> Ach:
    """The coverage hints of every cell, aligned with ``pvs`` (paper §5).

    Equal input and options give equal results whatever the ``executor``; two backends differ in a
    few edge pixels. Cells are tasks of their own with Embree, whose binding keeps the interpreter's
    lock, so that here they mean processes; OpenGL draws them in this one.

    Raises `InputError` PTM-I501 if the three inputs do not belong together, and
    `MissingComponentError` PTM-M500 if the gl backend is asked for and there is no OpenGL.
    """
    _check(scene, cells, pvs)
    surfaces = Surfaces.of(scene, cells)
    renderer = open_renderer(surfaces, cells, pvs, options)
    points = options.points if options.tolerance is None else EXPECTED
    rays = points * len(VIEWS) * options.side**2
    count = cells.cell_count
    apart = executor.workers > 1 and rays * count >= 2 * WORTH_A_PROCESS
    try:
        if apart and renderer.backend == "embree":
            renderer.close()
            sampling = Sampling(replace(scene, images=()), cells, pvs, options)
            chunk = int(max(1, min(TASK // rays, count // (4 * executor.workers))))
            each = executor.each(_sampled, sampling, range(count), chunk=chunk)
        else:
            sampler = Sampler(scene, cells, pvs, options, surfaces, renderer)
            each = map(sampler.of_cell, range(count))
        found: list[CellHints] = []
        for hints in each:
            found.append(hints)
            progress(len(found), count, "coverage")
    finally:
        renderer.close()
    return _gathered(pvs, found, Owners.of(surfaces, options.per_texture), renderer, options)


@dataclass(frozen=True)
class Sampling:
    """What the tasks share. A scene without images, whose bytes are not needed."""

    scene: Scene
    cells: Cells
    pvs: Pvs
    options: AchOptions

    @cached_property
    def sampler(self) -> Sampler:
        """Built once in each process, with trees of its own."""
        surfaces = Surfaces.of(self.scene, self.cells)
        renderer = EmbreeRenderer(surfaces, self.options.side)
        return Sampler(self.scene, self.cells, self.pvs, self.options, surfaces, renderer)

    def __getstate__(self) -> dict[str, object]:
        return {name: value for name, value in vars(self).items() if name != "sampler"}


def _sampled(sampling: Sampling, cell: int) -> CellHints:
    return sampling.sampler.of_cell(cell)


def _gathered(
    pvs: Pvs, found: list[CellHints], owners: Owners, renderer: Renderer, options: AchOptions
) -> Ach:
    rows = [hints.row for hints in found]

    def joined(name: str, width: tuple[int, ...] = ()) -> NDArray[np.float64]:
        return np.concatenate([np.zeros((0, *width)), *(getattr(row, name) for row in rows)])

    samples = np.array([hints.samples for hints in found], dtype=np.int32)
    total = np.array([float(row.pixels.sum()) for row in rows])
    textures = [hints.textures for hints in found] if options.per_texture else []
    every = np.concatenate([np.zeros(0), *(t.share for t in textures)])
    owner = np.concatenate([np.zeros(0, np.int64), *(t.owner for t in textures)])
    size = np.concatenate([np.zeros(0, np.int64), *(t.count for t in textures)])
    return Ach(
        start=pvs.start.copy(),
        value=joined("value"),
        pixels=joined("pixels"),
        error=joined("error"),
        p95=joined("p95"),
        seen=joined("seen"),
        views=joined("views", (6,)),
        missed=np.array([hints.missed for hints in found], dtype=np.float64),
        samples=samples,
        rejected=np.array([hints.rejected for hints in found], dtype=np.int32),
        uncertain=np.array([row.uncertain for row in rows], dtype=np.float64),
        unseen_below=np.minimum(1.0, RULE_OF_THREE / np.maximum(samples, 1)),
        floor=np.divide(0.5, total, out=np.zeros_like(total), where=total > 0),
        texture_start=np.cumsum(np.append(0, size)) if textures else np.zeros(0, np.int64),
        texture=owners.image[owner],
        texture_value=every,
        backend=renderer.backend,
        renderer=renderer.name,
    )


def _check(scene: Scene, cells: Cells, pvs: Pvs) -> None:
    """Raises `InputError` PTM-I501 unless the three belong together."""
    source = cells.triangle_source
    if pvs.cell_count != cells.cell_count:
        wrong = f"the PVS has {pvs.cell_count} cells, the subdivision {cells.cell_count}"
    elif len(source) and int(source.max()) >= len(scene.triangles):
        wrong = f"the subdivision cuts triangle {int(source.max())} of {len(scene.triangles)}"
    else:
        return
    raise InputError("PTM-I501", wrong, remedy="compute both from the same scene again")
