"""Does the PVS of a database miss anything? Random segments against Embree, a row per database.

    python benchmarks/false_negatives.py DB... [--segments 1000000]

Columns: segments with both ends in cells; those that no structural triangle blocks; pairs of
cells missing from the PVS; segments that showed them; unoccluded segments outside the PVS that
did not survive the jitter (cracks); seconds, reading the database included. Missed pairs are
listed with an example. The exit status is 1 if any pair is missed. The method is that of
`ptmtools.visibility.segments`.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from ptmtools.pipeline.validation import shoot_segments

SHOWN = 10


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("database", type=Path, nargs="+")
    parser.add_argument("--segments", type=int, default=1_000_000)
    given = parser.parse_args(arguments)

    print(f"{'database':24} {'tried':>9} {'clear':>9} {'pairs':>6} {'missed':>7} {'cracks':>6} s")
    failed = False
    for path in given.database:
        begun = time.perf_counter()
        report = shoot_segments(path, given.segments)
        seconds = time.perf_counter() - begun
        print(
            f"{path.name:24} {report.tried:9,} {report.unoccluded:9,} {len(report.missed):6,} "
            f"{report.missed_segments:7,} {report.hairlines:6,} {seconds:.1f}"
        )
        for miss in report.missed[:SHOWN]:
            print(f"    cells {miss.cells}: {miss.segments:,} segments, {miss.start} to {miss.end}")
        failed |= bool(report.missed)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
