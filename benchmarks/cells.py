"""What the size of the cells costs and brings, on models: ``python benchmarks/cells.py MODEL…``.

For every least wall area: cells, portals, average PVS, and CPU seconds of the subdivision and the
portal flow, compilation excluded.
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path

from ptmtools.cells import SubdivideOptions, subdivide
from ptmtools.scene import ingest
from ptmtools.visibility import compute_pvs

ROOT = Path(__file__).resolve().parent.parent
SHARED = Path(os.environ.get("PTM_SHARED", ROOT.parent / "shared"))
WALL_AREAS = (8.0, 4.0, 2.0, 1.0)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("models", nargs="*", type=Path, help="default: hospital and gallery")
    parser.add_argument("--wall-area", nargs="+", type=float, default=WALL_AREAS, metavar="M2")
    given = parser.parse_args()
    models = given.models or [
        SHARED / f"scenes/{name}/{name}.obj" for name in ("hospital", "gallery")
    ]
    models = [model for model in models if model.is_file()]
    if not models:
        parser.exit(message="no model at hand\n")
    print("model         wall m²  cells  portals  average PVS  cut  CPU s: cells    pvs")
    compute_pvs(subdivide(ingest(models[0]), SubdivideOptions(max_cells=4)))  # compiles
    for model in models:
        scene = ingest(model)
        for area in given.wall_area:
            begin = time.process_time()
            cells = subdivide(scene, SubdivideOptions(cells="leaf", wall_area=area))
            middle = time.process_time()
            pvs = compute_pvs(cells)
            end = time.process_time()
            print(
                f"{model.stem:13} {area:7g} {cells.cell_count:6} {cells.portal_count:8} "
                f"{pvs.average_share:12.1%} {pvs.fallbacks:4} {middle - begin:13.1f} "
                f"{end - middle:6.1f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
