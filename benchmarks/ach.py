"""Coverage hints: what a sample point costs, how far the backends agree, what 8 points are worth.

    python benchmarks/ach.py [MODEL | DATABASE ...] [--points N] [--cells N] [--reference N]

Models are read and cut with the default options; of a database the stages are used as they are.
Without arguments: the two rooms of the sample data. Two tables for each:

1. Milliseconds for a sample point (six views; best of three, median over points) by each backend
   at three sizes of the views, both in this run, one thread of Embree against what Mesa takes; and
   the share of all pixels that count for different cells.
2. The error of the hints by number and choice of sample points: total variation (half the L1
   distance) of a cell's hints against ``--reference`` other points, mean and 95th percentile over
   cells. Views of 32 pixels a side, Embree. The reference has an error of its own, about that of
   as many random points.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells.model import Cells
from ptmtools.coverage.ach import choose_eyes
from ptmtools.coverage.embree import EmbreeRenderer
from ptmtools.coverage.item_buffer import Renderer, Surfaces, sample_coverage
from ptmtools.coverage.matter import Surroundings
from ptmtools.coverage.opengl import OpenGLRenderer, create_context
from ptmtools.coverage.options import AchOptions
from ptmtools.coverage.sampling import candidates, cloud, tetrahedra
from ptmtools.errors import MissingComponentError
from ptmtools.scene.model import Scene
from ptmtools.tolerance import Tolerance

SAMPLE = Path(__file__).resolve().parent.parent / "sample_data/two_rooms/two_rooms.obj"
FACES = (64, 128, 256)


def load(path: Path) -> tuple[Scene, Cells]:
    """A subdivided scene from a database, or from a model."""
    if path.is_dir():
        from ptmtools.pipeline import Artifacts, DatabaseFolder

        stages = Artifacts(DatabaseFolder.open(path))
        return stages.scene, stages.cells
    from ptmtools.cells.subdivide import subdivide
    from ptmtools.scene.ingestion import ingest

    scene = ingest(path)
    return scene, subdivide(scene)


def spread(count: int, most: int) -> list[int]:
    """At most ``most`` of ``count`` numbers, evenly spread."""
    return sorted({int(i) for i in np.linspace(0, count - 1, min(most, count))})


def timed(work: Callable[[], Any]) -> tuple[Any, float]:
    """What ``work`` returns, and the milliseconds of the best of three runs."""
    took = []
    for _ in range(3):
        start = time.perf_counter()
        result = work()
        took.append(1e3 * (time.perf_counter() - start))
    return result, min(took)


def cost(surfaces: Surfaces, around: Surroundings, cells: Cells, clearance: float, n: int) -> None:
    """Prints the first table."""
    eyes = []
    for cell in spread(cells.cell_count, n):
        eyes += choose_eyes(cells, around, cell, AchOptions(samples=1), clearance)[0]
    print(f"{'face':>6} {'gl ms':>8} {'embree ms':>10} {'differ':>9}   renderer")
    for face in FACES:
        rays = EmbreeRenderer(surfaces, face)
        gl: Renderer | None = None
        try:
            gl = OpenGLRenderer(create_context(), surfaces, face)
        except MissingComponentError as missing:
            print(missing)
        covered, differ = 0, 0.0
        took: dict[str, list[float]] = {"gl": [], "embree": []}
        for eye in eyes:
            found = {}
            for renderer in filter(None, (gl, rays)):

                def look(renderer: Renderer = renderer, eye: Any = eye) -> NDArray[np.int64]:
                    return sample_coverage(renderer, surfaces, eye.point, eye.near)

                found[renderer.backend], ms = timed(look)
                took[renderer.backend].append(ms)
            covered += int(found["embree"].sum())
            differ += float(np.abs(found.get("gl", found["embree"]) - found["embree"]).sum()) / 2
        fast = f"{np.median(took['gl']):8.1f}" if gl else f"{'-':>8}"
        share = f"{differ / max(covered, 1):9.1e}" if gl else f"{'-':>9}"
        name = gl.name if gl else "-"
        print(f"{face:6d} {fast} {np.median(took['embree']):10.1f} {share}   {name}")
        if gl:
            gl.close()


def accuracy(
    surfaces: Surfaces,
    around: Surroundings,
    cells: Cells,
    clearance: float,
    most: int,
    reference: int,
) -> None:
    """Prints the second table."""
    rays = EmbreeRenderer(surfaces, 32)
    random = np.random.default_rng(0)

    def usable(point: NDArray[np.float64]) -> bool:
        return around.clearance(point, clearance) >= clearance and not around.in_matter(point)

    def hints(points: list[NDArray[np.float64]]) -> NDArray[np.float64]:
        covered = sum(
            (sample_coverage(rays, surfaces, p, clearance) for p in points),
            np.zeros(surfaces.cell_count + 1, dtype=np.int64),
        )
        return np.asarray(covered / max(covered.sum(), 1))

    def independent(cell: int, count: int) -> list[NDArray[np.float64]]:
        points = cloud(tetrahedra(cells, cell), 64 * count, int(random.integers(2**16)))
        picked = (points[i] for i in random.permutation(len(points)))
        return [p for p, _ in zip(filter(usable, picked), range(count), strict=False)]

    def of_each_part(cell: int, count: int, first: bool) -> list[NDArray[np.float64]]:
        chosen = []
        for part in candidates(cells, cell, count, 0):
            order = range(len(part)) if first else random.permutation(len(part))
            chosen += [part[i] for i in order if usable(part[i])][:1]
        return chosen

    choices: dict[str, Callable[[int, int], list[NDArray[np.float64]]]] = {
        "random points": independent,
        "a random point of each part": lambda c, k: of_each_part(c, k, False),
        "the middle of each part": lambda c, k: of_each_part(c, k, True),
    }
    errors: dict[tuple[str, int], list[float]] = {}
    for cell in spread(cells.cell_count, most):
        truth = hints(independent(cell, reference))
        for name, choose in choices.items():
            for count in (8, 64):
                away = np.abs(hints(choose(cell, count)) - truth).sum() / 2
                errors.setdefault((name, count), []).append(float(away))
    print(f"{'sample points':>32} {'mean error':>11} {'95 %':>7}")
    for (name, count), found in errors.items():
        print(f"{count:4d} {name:>27} {np.mean(found):11.4f} {np.percentile(found, 95):7.4f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("source", nargs="*", type=Path, default=[SAMPLE])
    parser.add_argument("--points", type=int, default=24, help="sample points that are timed")
    parser.add_argument("--cells", type=int, default=12, help="cells of the second table")
    parser.add_argument("--reference", type=int, default=512, help="points of the reference")
    options = parser.parse_args()
    for path in options.source:
        scene, cells = load(path)
        surfaces, around = Surfaces.of(scene, cells), Surroundings.of(scene, cells)
        clearance = Tolerance.for_points(scene.points).thin
        pieces = len(cells.triangle)
        print(f"{path.name}: {cells.cell_count} cells, {pieces} triangles after the cut")
        cost(surfaces, around, cells, clearance, options.points)
        accuracy(surfaces, around, cells, clearance, options.cells, options.reference)


if __name__ == "__main__":
    main()
