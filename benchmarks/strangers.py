"""Made models of the kinds that people have: what cells bring, and what they cost.

    python benchmarks/strangers.py [NAME…] [--segments 100000]

The models are those of ``tests/cells/strangers.py``, with the share of the volume that visitors may
keep resident by expectation. Each is divided twice: with door leaves that hide nothing and without
ceilings, as before these rules, and with the defaults. Seconds are of the processor, for cells and
visible sets; missed pairs are those that random segments find outside the sets.
"""

from __future__ import annotations

import argparse
import resource
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from ptmtools.cells import SubdivideOptions, structural_triangles, subdivide  # noqa: E402
from ptmtools.scene import IngestOptions, ingest  # noqa: E402
from ptmtools.visibility import check_conservative, compute_pvs  # noqa: E402
from tests.cells.buildings import write  # noqa: E402
from tests.cells.strangers import STRANGERS  # noqa: E402

BEFORE = SubdivideOptions(doors="open", ceiling="none")


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description="Models of the kinds that people have.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(STRANGERS))
    parser.add_argument("--segments", type=int, default=100_000)
    given = parser.parse_args()
    print(
        "| model | triangles | expected | before | cells | resident | most | cells | s | missed |"
    )
    print("|---" * 10 + "|")
    for name in given.names or STRANGERS:
        stranger = STRANGERS[name]
        with tempfile.TemporaryDirectory() as folder:
            model = write(Path(folder, f"{name}.obj"), stranger.parts().items())
            scene = ingest(model, IngestOptions(unit="m", up="z"))
        rows = []
        missed = 0
        for options in (BEFORE, SubdivideOptions()):
            begin = time.process_time()
            cells = subdivide(scene, options)
            pvs = compute_pvs(cells)
            seconds = time.process_time() - begin
            corners = scene.corners[structural_triangles(scene, options, cells.opened)]
            missed += len(check_conservative(corners, cells, pvs, given.segments).missed)
            rows.append((*pvs.volume_at_hand, cells.cell_count, seconds))
        (before, _, parts, _), (mean, most, count, seconds) = rows
        row = (
            name,
            f"{len(scene.triangles):,}",
            f"{stranger.resident:.0%}",
            f"{before:.1%}",
            parts,
        )
        row += (f"{mean:.1%}", f"{most:.1%}", count, f"{seconds:.1f}", missed)
        print(f"| {' | '.join(map(str, row))} |", flush=True)
    print(f"\npeak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:,.0f} MB")


if __name__ == "__main__":
    main()
