"""Cost of leaves and of rooms as cells to a client: ``python benchmarks/rooms.py [MODEL…]``

For every model, and for leaves, rooms split at several `--gain`s, whole rooms, and rooms for
cameras that fly (`--standing anywhere`):

cells         cell files, and the number of view-only ones
volume        share of the volume in the walker's PVS, mean over the way
walk          cell files fetched along a walk, and their megabytes
at hand       megabytes of cell files in the walker's PVS, mean over the way
texels        share of all texels in use in the walker's PVS, mean over the way
ACH error     deviation of the hints from the actual coverage (below), with the standard error
CPU s         grouping, portal flow and coverage hints; the subdivision is the same

The **walk** is that of `walk.py`; it visits the same leaves for all kinds of cells.

The **ACH error** is the mean total variation between the hints of the cell of a random place and
the coverage seen from that place, both summed by room (whole rooms, for comparability): 0 is exact,
1 is the maximum. Coverage varies within a cell, so even exact averages have an error, and fewer
cells have a larger one.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scenes import MODELS, model_file
from walk import at_hand, cell_texts, load, passed, standard_walk, texels_at_hand

from ptmtools.cells import Cells, SubdivideOptions, subdivide
from ptmtools.cells.rooms import group_cells, leaf_of_cell
from ptmtools.coverage.ach import compute_ach
from ptmtools.coverage.backends.embree import EmbreeRenderer
from ptmtools.coverage.item_buffer import ItemSurfaces
from ptmtools.coverage.model import Ach
from ptmtools.coverage.options import AchOptions
from ptmtools.coverage.sample_points import SamplePoints
from ptmtools.coverage.sampling import CLEARANCE
from ptmtools.coverage.solids import SampleObstacles
from ptmtools.coverage.tally import PixelCounter
from ptmtools.scene import Scene, ingest
from ptmtools.visibility import Pvs, compute_pvs

LEAF = SubdivideOptions(cells="leaf")
ANYWHERE = SubdivideOptions(cells="leaf", standing="anywhere")
WHOLE = SubdivideOptions(cells="room", gain=1.0)
GAINS = (0.02, 0.05, 0.1, 0.2)
#: Rooms as they are for cameras that fly.
FLYING = "room, standing anywhere"
#: Random places at which the hints are held against the view, and pixels a side of that view.
PLACES, FACE = 300, 64


def views(scene: Scene, leaves: Cells, seed: int) -> list[tuple[int, NDArray[np.int64]]]:
    """For random places, uniform over where eyes can be, the leaf and (L,) the pixels that each
    leaf covers, seen from there."""
    obstacles, surfaces = (
        SampleObstacles.from_scene(scene, leaves),
        ItemSurfaces.from_scene(scene, leaves),
    )
    clearance = CLEARANCE * scene.tolerance.thin
    random = np.random.default_rng(seed)
    low, high = leaves.root_box
    points = np.zeros((0, 3))
    while len(points) < PLACES:
        tried = random.uniform(low, high, (PLACES, 3))
        leaf = leaves.locate_leaf(tried)
        tried = tried[(leaf >= 0) & leaves.leaf_standing[leaf]]
        tried = tried[leaves.eyes.contains(tried)]
        clear = obstacles.clearance(tried, clearance) >= clearance
        points = np.concatenate([points, tried[clear & ~obstacles.in_solid(tried)]])
    points = points[:PLACES]
    viewers = SamplePoints(points, np.full(PLACES, clearance), np.zeros((PLACES, 2)))
    counter = PixelCounter(EmbreeRenderer(surfaces, FACE), surfaces, leaves, FACE)
    every, kept = np.arange(leaves.cell_count), leaf_of_cell(leaves)
    actual = []
    for i, leaf in enumerate(leaves.locate_leaf(points).tolist()):
        pixels = np.zeros(leaves.leaf_count, dtype=np.int64)
        pixels[kept] = counter.count(viewers.part(slice(i, i + 1)), every).in_views.sum(axis=0)
        actual.append((leaf, pixels))
    return actual


def hint_error(
    cells: Cells, pvs: Pvs, ach: Ach, rooms: Cells, seen: list[tuple[int, NDArray[np.int64]]]
) -> tuple[float, float]:
    """Mean total variation between hints and views, room by room, and its standard error."""
    count = rooms.cell_count
    room_of_cell, kept = np.zeros(cells.cell_count, dtype=np.int64), rooms.leaf_cell >= 0
    room_of_cell[cells.leaf_cell[kept]] = rooms.leaf_cell[kept]
    errors = []
    for leaf, pixels in seen:
        view = np.bincount(rooms.leaf_cell[kept], pixels[kept], count)
        if view.sum() == 0:
            continue
        cell = int(cells.leaf_cell[leaf])
        hint = np.bincount(room_of_cell[pvs.row(cell)], ach.row(cell), count)
        errors.append(float(np.abs(hint - view / view.sum()).sum()) / 2)
    spread = np.std(errors) / np.sqrt(len(errors))
    return float(np.mean(errors)), float(spread)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("models", nargs="*", type=model_file, help="names or files")
    given = parser.parse_args()
    kinds = {
        "leaf": LEAF,
        **{f"room, gain {g:g}": replace(WHOLE, gain=g) for g in GAINS},
        "room, whole": WHOLE,
        FLYING: SubdivideOptions(),
    }
    print(
        "| model | cells are | cells, view-only | walk: volume | files | MB | at hand MB | texels "
        "| ACH error | CPU s |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|")
    for file in [m for m in given.models or MODELS.values() if m.is_file()]:
        scene = ingest(file)
        leaves = subdivide(scene, LEAF)
        rooms = group_cells(leaves, WHOLE)
        way = passed(leaves, standard_walk(rooms).corner)
        seen = views(scene, leaves, seed=1)
        everywhere = group_cells(subdivide(scene, ANYWHERE), SubdivideOptions())
        for name, options in kinds.items():
            start = time.process_time()
            cells = everywhere if name == FLYING else group_cells(leaves, options)
            pvs = compute_pvs(cells)
            ach = compute_ach(scene, cells, pvs, AchOptions(backend="embree"))
            seconds = time.process_time() - start
            hints = [ach.row(c) for c in range(cells.cell_count)]
            texts = cell_texts(scene, cells, pvs, hints)
            walked = load(cells, pvs, way, np.array([len(t.text.encode()) for t in texts]))
            texels = texels_at_hand(scene, cells, pvs, way, texts)
            error, spread = hint_error(cells, pvs, ach, rooms, seen)
            share = at_hand(cells, pvs, way, cells.cell_volumes()) / cells.leaf_volumes().sum()
            print(
                f"| {file.stem} | {name} | {cells.cell_count}, {int((~cells.standing).sum())} "
                f"| {share:.1%} | {walked.files} | {walked.megabytes:.2f} | {walked.at_hand:.2f} "
                f"| {texels:.0%} "
                f"| {error:.3f} ± {spread:.3f} | {seconds:.1f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
