"""Average Coverage Hints: how much of what is seen from a cell belongs to which cell (paper §5).

For every cell, K points spread uniformly over its volume; at each, six square views of 90°; in
each pixel, the cell of the surface that shows. ``ACH_j`` is the number of pixels of cell j over
that of all cells of the PVS, so a row sums to 1.

The paper draws "all the objects of its PVS". Here *everything* is drawn, from every cell: only so
can a pixel fall on a cell outside the PVS, which would be an error of the PVS or a crack in the
model. Such pixels are checked with a ray, left out of the hints and reported as missed mass.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells.model import Cells
from ptmtools.coverage.backend import open_renderer
from ptmtools.coverage.item_buffer import Renderer, Surfaces, sample_coverage
from ptmtools.coverage.matter import Surroundings
from ptmtools.coverage.model import Ach
from ptmtools.coverage.options import AchOptions
from ptmtools.coverage.sampling import candidates
from ptmtools.errors import InputError
from ptmtools.progress import Progress, silent
from ptmtools.scene.model import Scene
from ptmtools.tolerance import Tolerance
from ptmtools.visibility.model import Pvs

#: The default clearance as a share of the thinnest that a cell may be, so that even such a cell
#: has usable points.
CLEARANCE = 0.25


@dataclass(frozen=True)
class Eye:
    """A sample point (3,), metres, and a distance within which it has no surface."""

    point: NDArray[np.float64]
    near: float


def compute_ach(
    scene: Scene,
    cells: Cells,
    pvs: Pvs,
    options: AchOptions = AchOptions(),  # noqa: B008 - a frozen value
    progress: Progress = silent,
) -> Ach:
    """The coverage hints of every cell, aligned with ``pvs`` (paper §5).

    Equal input and options give equal results whatever the number of workers; two backends
    differ in a few edge pixels.

    Raises `InputError` PTM-I501 if the three inputs do not belong together, and
    `MissingComponentError` PTM-M500 if the gl backend is asked for and there is no OpenGL.
    """
    _check(scene, cells, pvs)
    surfaces = Surfaces.of(scene, cells)
    around = Surroundings.of(scene, cells)
    clearance = options.clearance or CLEARANCE * Tolerance.for_points(scene.points).thin
    renderer = open_renderer(surfaces, options)

    def look(cell: int) -> tuple[NDArray[np.int64], int, int]:
        eyes, rejected = choose_eyes(cells, around, cell, options, clearance)
        expected = np.zeros(cells.cell_count, dtype=np.bool_)
        expected[pvs.row(cell)] = True
        return look_around(renderer, surfaces, eyes, expected), len(eyes), rejected

    try:
        pixels = np.zeros(len(pvs.cell), dtype=np.int64)
        missed = np.zeros(cells.cell_count)
        samples = np.zeros(cells.cell_count, dtype=np.int32)
        rejected = np.zeros(cells.cell_count, dtype=np.int32)
        threads = (options.workers or os.cpu_count() or 1) if renderer.backend == "embree" else 1
        for cell, (covered, used, refused) in enumerate(_each(look, cells.cell_count, threads)):
            row = slice(int(pvs.start[cell]), int(pvs.start[cell + 1]))
            pixels[row] = covered[pvs.cell[row]]
            total = int(covered.sum())
            missed[cell] = (total - int(pixels[row].sum())) / total if total else 0.0
            samples[cell], rejected[cell] = used, refused
            progress(cell + 1, cells.cell_count, "coverage")
    finally:
        renderer.close()
    return Ach(
        start=pvs.start.copy(),
        value=shares(pvs.start, pixels),
        pixels=pixels,
        missed=missed,
        samples=samples,
        rejected=rejected,
        backend=renderer.backend,
        renderer=renderer.name,
    )


def shares(start: NDArray[np.int64], pixels: NDArray[np.int64]) -> NDArray[np.float64]:
    """(n,) each row of (n,) counts over its sum; a row of zeros becomes 1 for its first entry.

    Each quotient is off by half a unit in its last place at most, so the exact sum of a row is
    within 1.2e-16 of 1.
    """
    total = np.add.reduceat(pixels, start[:-1]) if len(start) > 1 else np.zeros(0, np.int64)
    empty = start[:-1][total == 0]
    counted = pixels.copy()
    counted[empty] = 1
    return np.asarray(counted / np.repeat(np.maximum(total, 1), np.diff(start)))


def choose_eyes(
    cells: Cells, around: Surroundings, cell: int, options: AchOptions, clearance: float
) -> tuple[list[Eye], int]:
    """The sample points of a cell, and how many were rejected on the way.

    Every part of the cell gives its first usable point; a part without one, such as one filled
    by a statue, gives none. If no part has any, the cell is looked at from the one point that is
    outside matter, if possible, and farthest from all surfaces.
    """
    eyes: list[Eye] = []
    refused: list[tuple[bool, float, NDArray[np.float64]]] = []
    for part in candidates(cells, cell, options.samples, options.seed):
        for point in part:
            free = around.clearance(point, clearance)
            inside = around.in_matter(point)
            if free >= clearance and not inside:
                eyes.append(Eye(point, free))
                break
            refused.append((not inside, free, point))
    if not eyes and refused:
        best = max(refused, key=lambda r: r[:2])
        # On the surface itself, where nothing can be right, the near plane still has to be.
        eyes.append(Eye(best[2], max(best[1], clearance / 1024)))
    return eyes, len(refused)


def look_around(
    renderer: Renderer, surfaces: Surfaces, eyes: list[Eye], expected: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """(C + 1,) pixels covered by each cell over all sample points; the last belong to no cell.
    ``expected`` (C,): the PVS."""
    covered = np.zeros(surfaces.cell_count + 1, dtype=np.int64)
    for eye in eyes:
        covered += sample_coverage(renderer, surfaces, eye.point, eye.near, expected)
    return covered


def _each(
    look: Callable[[int], tuple[NDArray[np.int64], int, int]], count: int, threads: int
) -> Iterator[tuple[NDArray[np.int64], int, int]]:
    """What ``look`` says of every cell, in order."""
    if threads == 1:
        yield from map(look, range(count))
        return
    with ThreadPoolExecutor(threads) as pool:
        yield from pool.map(look, range(count))


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
