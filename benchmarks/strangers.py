"""Made models of the kinds that people have: what a visitor gains, and what a build costs.

    python benchmarks/strangers.py [NAME…] [--segments 100000]

The models are those of ``tests/cells/strangers.py``, with the share of the volume that visitors may
keep resident by expectation. Each is built twice on one core: *before* with door leaves that hide
nothing, without ceilings and levels of detail, and with all searches for visible cells; *now* with
the defaults. Bytes are those until the first room is drawn, until it has all objects as modelled,
and, in order of coverage, of 90 and 99 % of the average view. Seconds are of the processor, and
memory is the peak, of the whole build; missed pairs are those that random segments find outside the
sets.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from ptmtools.pipeline.validation import shoot_segments  # noqa: E402
from tests.cells.buildings import write  # noqa: E402
from tests.cells.strangers import STRANGERS  # noqa: E402

BEFORE = ("--doors", "open", "--ceiling", "none", "--lods", "none", "--pvs-gain", "0")
COLUMNS = (
    "model", "triangles", "expected", "", "resident", "most", "cells", "drawn after, kB",
    "complete, kB", "90%, kB", "99%, kB", "s", "MB", "missed",
)  # fmt: skip


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description="Models of the kinds that people have.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(STRANGERS))
    parser.add_argument("--segments", type=int, default=100_000)
    given = parser.parse_args()
    print(f"| {' | '.join(COLUMNS)} |\n{'|---' * len(COLUMNS)}|")
    for name in given.names or STRANGERS:
        stranger = STRANGERS[name]
        with tempfile.TemporaryDirectory() as folder:
            model = write(Path(folder, f"{name}.obj"), stranger.parts().items())
            for when, options in (("before", BEFORE), ("now", ())):
                database = Path(folder, when)
                seconds, megabytes = build(model, database, *options)
                missed = len(shoot_segments(database, given.segments).missed)
                stages = json.loads((database / "manifest.json").read_text())["stages"]
                head = (name, f"{stages['scene']['counts']['triangles']:,}")
                if when == "now":
                    head = ("", "")
                expected = f"{stranger.resident:.0%}" if when == "now" else ""
                row = (*head, expected, when, *measured(stages))
                row += (f"{seconds:.1f}", f"{megabytes:,.0f}", missed)
                print(f"| {' | '.join(map(str, row))} |", flush=True)


def build(model: Path, database: Path, *options: str) -> tuple[float, float]:
    """Builds a database; returns CPU seconds and the peak in MB."""
    command = [sys.executable, "-m", "ptmtools", "-q", "build-scene", str(model), "-o"]
    command += [str(database), "--unit", "m", "--up", "z", "-j", "1", *options]
    with tempfile.TemporaryFile() as report:
        child = subprocess.Popen([*command, "--json"], cwd=ROOT, stdout=report)
        _, status, usage = os.wait4(child.pid, 0)
        if status:
            code = os.waitstatus_to_exitcode(status)
            raise SystemExit(f"{' '.join(command)}: exit status {code}")
        report.seek(0)
        peak = json.load(report)["peak_memory"]
    return usage.ru_utime + usage.ru_stime, peak / 1e6


def measured(stages: Any) -> list[str]:
    """Shares, cells and kilobytes by the counts of a build."""
    sets, visit = stages["pvs"]["counts"], stages["emit"]["counts"]["visit"]
    first = visit["first_room"] if visit["simplified"] is None else visit["simplified"]
    sizes = (first, visit["first_room"], visit["mean_90"], visit["mean_99"])
    shares = [f"{sets['mean_volume']:.1%}", f"{sets['most_volume']:.1%}"]
    return [*shares, str(stages["cells"]["counts"]["cells"]), *(f"{s / 1e3:,.1f}" for s in sizes)]


if __name__ == "__main__":
    main()
