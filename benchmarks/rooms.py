"""Leaves or rooms as cells: what each costs a client. ``python benchmarks/rooms.py [MODEL…]``

For every model, and for leaves, rooms parted at several `--gain`s and whole rooms:

cells         cell files
PVS           mean share of all cells that a cell may see
walk          cell files fetched along a walk, and their megabytes
at hand       megabytes of cell files that the walker's PVS holds, on average over the way
texels        share of all texels in use that the walker's PVS holds, on average over the way
ACH error     how far the hints are from what is seen (below), with the standard error
CPU s         grouping, portal flow and coverage hints; the subdivision is the same

The **walk** goes through the middle of the twelve largest rooms, always on to the nearest one left,
through portals of at least 1 m²; leaf by leaf it is the same for all kinds of cells.

The **ACH error** is the mean total variation between the hints of the cell in which a random place
lies and the coverage seen from that place, both summed up room by room (whole rooms, so that all
kinds are held against the same): 0 is exact, 1 is all wrong. An eye that stands elsewhere in the
cell sees something else, so even exact averages have one; fewer cells have a larger one.
"""

from __future__ import annotations

import argparse
import heapq
import os
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ptmtools.cells import Cells, SubdivideOptions, subdivide
from ptmtools.cells.grouping import grouped
from ptmtools.coverage.ach import CLEARANCE, compute_ach
from ptmtools.coverage.embree import EmbreeRenderer
from ptmtools.coverage.item_buffer import Surfaces, sample_coverage
from ptmtools.coverage.matter import Surroundings
from ptmtools.coverage.model import Ach
from ptmtools.coverage.options import AchOptions
from ptmtools.database import TextureRecord
from ptmtools.database.cellfile import CellWriter
from ptmtools.scene import Scene, ingest
from ptmtools.tolerance import Tolerance
from ptmtools.visibility import Pvs, compute_pvs

ROOT = Path(__file__).resolve().parent.parent
SHARED = Path(os.environ.get("PTM_SHARED", ROOT.parent / "shared"))
MODELS = (
    ROOT / "build/museum/museum.obj",
    *(SHARED / f"scenes/{n}/{n}.obj" for n in ("hospital", "willowgarage", "office", "gallery")),
)
LEAF = SubdivideOptions(cells="leaf")
WHOLE = SubdivideOptions(cells="room", gain=1.0)
GAINS = (0.02, 0.05, 0.1, 0.2)
#: Rooms that the walk leads through, and the least portal that it passes (m²).
STOPS, DOOR = 12, 1.0
#: Random places at which the hints are held against the view, and pixels a side of that view.
PLACES, FACE = 300, 64


@dataclass(frozen=True)
class Walk:
    """The leaves that are passed, and how many metres of the way belong to each."""

    leaf: NDArray[np.int64]
    metres: NDArray[np.float64]


def standard_walk(cells: Cells) -> Walk:
    """The walk that the module describes; ``cells`` are whole rooms."""
    middle = np.array([cells.leaf_points(i).mean(axis=0) for i in range(cells.leaf_count)])
    volume = cells.leaf_volumes()
    rooms = np.argsort(-np.bincount(cells.leaf_cell, volume), kind="stable")[:STOPS]
    stops = {int(max(cells.cell_leaves(r), key=lambda leaf: (volume[leaf], -leaf))) for r in rooms}
    doors: list[list[tuple[int, float]]] = [[] for _ in range(cells.leaf_count)]
    for k in np.flatnonzero(cells.portal_area >= DOOR).tolist():
        a, b = cells.portal_leaf[k].tolist()
        at = cells.portal(k).mean(axis=0)
        metres = float(np.linalg.norm(middle[a] - at) + np.linalg.norm(middle[b] - at))
        doors[a].append((b, metres))
        doors[b].append((a, metres))
    here = int(max(stops, key=lambda leaf: volume[leaf]))
    stops.discard(here)
    way, share = [here], [0.0]
    while stops:
        before, far = _distances(doors, here)
        following = min(stops, key=lambda leaf: (far[leaf], leaf))
        if not np.isfinite(far[following]):
            break
        stops.discard(following)
        leg = [following]
        while leg[-1] != here:
            leg.append(before[leg[-1]])
        for a, b in zip(leg[::-1], leg[-2::-1], strict=False):
            step = far[b] - far[a]
            share[-1] += step / 2
            way.append(b)
            share.append(step / 2)
        here = following
    return Walk(np.array(way), np.array(share) if len(way) > 1 else np.ones(1))


def _distances(
    doors: list[list[tuple[int, float]]], start: int
) -> tuple[list[int], NDArray[np.float64]]:
    """For every leaf the one before it on the shortest way from ``start``, and the metres."""
    far = np.full(len(doors), np.inf)
    before = [-1] * len(doors)
    far[start] = 0.0
    waiting = [(0.0, start)]
    while waiting:
        metres, leaf = heapq.heappop(waiting)
        for other, step in doors[leaf] if metres == far[leaf] else ():
            if metres + step < far[other]:
                far[other], before[other] = metres + step, leaf
                heapq.heappush(waiting, (metres + step, other))
    return before, far


def fetched(
    scene: Scene, cells: Cells, pvs: Pvs, ach: Ach, walk: Walk
) -> tuple[int, float, float, float]:
    """Files and MB fetched along the walk; MB and the share of texels at hand."""
    records = {
        i: TextureRecord(i, f"textures/{image.name}.ptm", f"{image.name}.png", 1, 1, 3, (), "")
        for i, image in enumerate(scene.images)
    }
    writer = CellWriter(scene, cells, records, True)
    adjacent = cells.adjacent()
    texts = [
        writer.cell(c, adjacent[c].tolist(), pvs.row(c).tolist(), ach.row(c))
        for c in range(cells.cell_count)
    ]
    size = np.array([len(text.text.encode()) for text in texts])
    texels = _texels(scene)
    used = np.zeros((len(texts), len(texels)), dtype=bool)
    for c, text in enumerate(texts):
        used[c, list(text.images)] = True
    whole = float(texels[used.any(axis=0)].sum())
    met: set[int] = set()
    at_hand = share = 0.0
    for cell, metres in zip(cells.leaf_cell[walk.leaf].tolist(), walk.metres, strict=True):
        row = pvs.row(cell)
        met.update(row.tolist())
        at_hand += metres * size[row].sum()
        share += metres * (texels[used[row].any(axis=0)].sum() / whole if whole else 0.0)
    length = float(walk.metres.sum())
    return len(met), size[sorted(met)].sum() / 1e6, at_hand / length / 1e6, share / length


def _texels(scene: Scene) -> NDArray[np.float64]:
    import io

    from PIL import Image

    found = []
    for image in scene.images:
        with Image.open(io.BytesIO(image.load())) as opened:
            found.append(float(opened.width * opened.height))
    return np.array(found)


def views(scene: Scene, leaves: Cells, seed: int) -> list[tuple[int, NDArray[np.int64]]]:
    """For random places, uniform over the volume and clear of matter, the leaf and (L + 1,) the
    pixels that each leaf covers, seen from there."""
    around, surfaces = Surroundings.of(scene, leaves), Surfaces.of(scene, leaves)
    clearance = CLEARANCE * Tolerance.for_points(scene.points).thin
    renderer = EmbreeRenderer(surfaces, FACE)
    random = np.random.default_rng(seed)
    low, high = leaves.root_box
    found: list[tuple[int, NDArray[np.int64]]] = []
    while len(found) < PLACES:
        place = random.uniform(low, high)
        leaf = int(leaves.locate_leaf(place[None])[0])
        if leaf < 0 or around.clearance(place, clearance) < clearance or around.in_matter(place):
            continue
        found.append((leaf, sample_coverage(renderer, surfaces, place, clearance)))
    return found


def hint_error(
    cells: Cells, pvs: Pvs, ach: Ach, rooms: Cells, seen: list[tuple[int, NDArray[np.int64]]]
) -> tuple[float, float]:
    """Mean total variation between hints and views, room by room, and its standard error."""
    count = rooms.cell_count
    room_of_cell = np.zeros(cells.cell_count, dtype=np.int64)
    room_of_cell[cells.leaf_cell] = rooms.leaf_cell
    errors = []
    for leaf, pixels in seen:
        view = np.bincount(rooms.leaf_cell, pixels[:-1], count)
        if view.sum() == 0:
            continue
        cell = int(cells.leaf_cell[leaf])
        hint = np.bincount(room_of_cell[pvs.row(cell)], ach.row(cell), count)
        errors.append(float(np.abs(hint - view / view.sum()).sum()) / 2)
    spread = np.std(errors) / np.sqrt(len(errors))
    return float(np.mean(errors)), float(spread)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("models", nargs="*", type=Path, help="default: museum and shared scenes")
    given = parser.parse_args()
    kinds = {
        "leaf": LEAF,
        **{f"room, gain {g:g}": replace(WHOLE, gain=g) for g in GAINS},
        "room, whole": WHOLE,
    }
    print(
        "| model | cells are | cells | PVS | walk: files | MB | at hand MB | texels "
        "| ACH error | CPU s |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|")
    for model in [m for m in given.models or MODELS if m.is_file()]:
        scene = ingest(model)
        tolerance = Tolerance.for_points(scene.points)
        leaves = subdivide(scene, LEAF)
        rooms = grouped(leaves, WHOLE, tolerance)
        walk = standard_walk(rooms)
        seen = views(scene, leaves, seed=1)
        for name, options in kinds.items():
            start = time.process_time()
            cells = grouped(leaves, options, tolerance)
            pvs = compute_pvs(cells)
            ach = compute_ach(scene, cells, pvs, AchOptions(face=32, backend="embree"))
            seconds = time.process_time() - start
            files, mb, at_hand, texels = fetched(scene, cells, pvs, ach, walk)
            error, spread = hint_error(cells, pvs, ach, rooms, seen)
            print(
                f"| {model.stem} | {name} | {cells.cell_count} | {pvs.average_share:.1%} | {files} "
                f"| {mb:.2f} | {at_hand:.2f} | {texels:.0%} | {error:.3f} ± {spread:.3f} "
                f"| {seconds:.1f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
