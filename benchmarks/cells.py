"""Cells of the test models: ``python benchmarks/cells.py [MODEL…] [OPTION]``

Prints a Markdown table with a row for each model at the default options: triangles, cells,
view-only cells, leaves, dropped leaves, portals, and the resident share of the volume, mean over
walkable places and maximum. ``--wall-area 8 4 2 1`` prints a row for each minimum wall area, with
each leaf as a cell. ``--joined`` prints the number of triangles of each model that cells emit, the
same counted once per emitting cell, and the number of emitted triangles, cut to the leaves and
rejoined.

All figures are exact, the same on every machine. The tables of pvs_trade.py give the cost of the
settings in seconds. The script generates the museum with textures of 16 texels, which do not affect
the figures.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path
from unittest.mock import patch

import numpy as np
from scenes import MODELS, MUSEUM

from ptmtools.cells import Cells, SubdivideOptions, subdivide, subdivision
from ptmtools.scene import Scene, ingest
from ptmtools.visibility import compute_pvs

AREA = SubdivideOptions().wall_area


def opened(name: str) -> Scene:
    """One of the `MODELS`."""
    if name != MUSEUM:
        return ingest(MODELS[name])
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "ptmtools", "sample", "museum"]
        command += ["-o", f"{folder}/{name}", "--size", "16"]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        return ingest(Path(folder, name, f"{name}.obj"))


def row(name: str, scene: Scene) -> str:
    """A model at the default options."""
    cells = subdivide(scene)
    view_only = int(np.count_nonzero(~cells.standing))
    dropped = int(np.count_nonzero(cells.leaf_cell < 0))
    leaves = cells.leaf_count, dropped, cells.portal_count
    counts = len(scene.triangles), cells.cell_count, view_only, *leaves
    closed = "closed" if cells.closed else "open"
    return f"| {name} | {closed} | {' | '.join(f'{n:,}' for n in counts)} | {at_hand(cells)} |"


def at_hand(cells: Cells) -> str:
    """The share of the volume at hand: mean and worst."""
    mean, most = compute_pvs(cells).volume_at_hand
    return f"{mean:.1%} | {most:.1%}"


def area_row(name: str, scene: Scene, area: float) -> str:
    """A model cut by walls of at least that many m²."""
    cells = subdivide(scene, SubdivideOptions(cells="leaf", wall_area=area))
    shown = f"**{area:g}**" if area == AREA else f"{area:g}"
    counts = f"{cells.leaf_count:,} | {cells.portal_count:,}"
    return f"| {name} | {shown} | {counts} | {at_hand(cells)} |"


def joined_row(name: str, scene: Scene) -> str:
    """The triangles of a model before and after joining."""
    with patch.object(subdivision, "join_pieces", wraps=subdivision.join_pieces) as joined:
        cells = subdivide(scene)
    _, pieces, owner, _ = joined.call_args.args
    front, back = owner.T
    behind = (back >= 0) & (back != front) & scene.two_sided[pieces.source]
    cut = np.count_nonzero(front >= 0) + np.count_nonzero(behind)
    emitted = len(cells.emitted(scene.two_sided)[0])
    counts = len(scene.triangles), cells.visible, cells.owners, cut, emitted
    shares = f"{cut / cells.owners:.2f} | {emitted / cells.owners:.2f}"
    return f"| {name} | {' | '.join(f'{n:,}' for n in counts)} | {shares} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    there = [name for name in MODELS if name == MUSEUM or MODELS[name].is_file()]
    parser.add_argument("models", nargs="*", default=there, help=f"of {' '.join(MODELS)}")
    parser.add_argument("--wall-area", nargs="+", type=float, metavar="M2")
    parser.add_argument("--joined", action="store_true")
    given = parser.parse_args()
    if given.joined:
        columns = (
            "triangles",
            "seen",
            "by cell",
            "cut",
            "joined",
            "cut / by cell",
            "joined / by cell",
        )
        print(f"| model | {' | '.join(columns)} |")
        print("|---|---|---|---|---|---|---|---|")
    elif given.wall_area:
        print("| model | wall area, m² | leaves | portals | volume at hand | at most |")
        print("|---|---|---|---|---|---|")
    else:
        columns = "cells | view-only | leaves | dropped | portals | volume at hand | at most"
        print(f"| model | | triangles | {columns} |")
        print("|---|---|---|---|---|---|---|---|---|---|")
    for name in given.models:
        scene = opened(name)
        if given.joined:
            print(joined_row(name, scene), flush=True)
        elif not given.wall_area:
            print(row(name, scene), flush=True)
        for area in given.wall_area or ():
            print(area_row(name, scene, area), flush=True)


if __name__ == "__main__":
    main()
