"""Models of the kinds that people have: what a visitor gains, and what a build costs.

    python benchmarks/strangers.py [NAME|FILE…] [--before] [--segments 100000]

A name is that of a model in ``tests/cells/strangers.py``, with its expectations: the share of the
volume that visitors keep resident, the number of cells in which they stand (in brackets), and where
the first viewpoint is. A file is any model. Each is built on one core with the defaults (*now*);
with ``--before`` a made model also with door leaves that hide nothing, without ceilings and levels
of detail, and with all searches for visible cells. Seconds are of the processor, of the whole
build, beside 10 s + 0.2 ms a triangle + 0.3 s a room; those by stage are of the clock. Memory is
the peak. Resident is the share of the volume, its mean over places and its maximum, and of cells.
Kilobytes are those of the database until the first room is drawn, and until it has all objects as
modelled. *Site* is what a visitor downloads in a walk through all rooms, without the page, which is
the same for all (`ptm publish`); *first* is the index, the poster, and the first room with the
geometry of all cells visible from it, each file requested by itself; both as shares of the bytes of
the model with its images. Missed pairs are those that random segments find outside the sets.
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
from ptmtools.site.content import Site, site_of  # noqa: E402
from ptmtools.site.entry import link_bytes  # noqa: E402
from ptmtools.site.files import DATA  # noqa: E402
from ptmtools.site.publishing import weight_of  # noqa: E402
from tests.cells.buildings import write  # noqa: E402
from tests.cells.strangers import STRANGERS, Stranger  # noqa: E402

BEFORE = ("--doors", "open", "--ceiling", "none", "--lods", "none", "--pvs-gain", "0")
STAGES = ("scene", "cells", "pvs", "ach", "textures", "light", "emit")
COLUMNS = (
    "model", "triangles", "", "s", "budget", " / ".join(STAGES), "MB", "cells", "expected",
    "resident", "most", "of cells", "drawn after, kB", "complete, kB", "site : model",
    "first : model", "first viewpoint", "missed",
)  # fmt: skip


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description="Models of the kinds that people have.")
    parser.add_argument("models", nargs="*", metavar="NAME|FILE", help=", ".join(STRANGERS))
    parser.add_argument("--before", action="store_true")
    parser.add_argument("--segments", type=int, default=100_000)
    given = parser.parse_args()
    print(f"| {' | '.join(COLUMNS)} |\n{'|---' * len(COLUMNS)}|")
    for name in given.models or STRANGERS:
        with tempfile.TemporaryDirectory() as folder:
            stranger, file, options = STRANGERS.get(name), Path(name), ()
            if stranger:
                file = write(Path(folder, "model.obj"), stranger.parts().items())
                options = ("--unit", "m", "--up", "z")
            database = Path(folder, "now")
            if given.before and stranger:
                report = build(file, Path(folder, "before"), *options, *BEFORE)
                print_row(name, "before", report, Path(folder, "before"), None, given.segments)
            report = build(file, database, *options)
            print_row(file.stem if not stranger else name, "now", report, database, stranger,
                      given.segments)  # fmt: skip


def build(model: Path, database: Path, *options: str) -> dict[str, Any]:
    """Builds a database; returns the report, with the CPU seconds in ``cpu``."""
    command = [sys.executable, "-m", "ptmtools", "-q", "build-scene", str(model.resolve()), "-o"]
    command += [str(database), "-j", "1", "--json", *options]
    with tempfile.TemporaryFile() as report:
        child = subprocess.Popen(command, cwd=ROOT, stdout=report)
        _, status, usage = os.wait4(child.pid, 0)
        if status:
            code = os.waitstatus_to_exitcode(status)
            raise SystemExit(f"{' '.join(command)}: exit status {code}")
        report.seek(0)
        return {**json.load(report), "cpu": usage.ru_utime + usage.ru_stime}


def print_row(
    name: str, when: str, report: Any, database: Path, stranger: Stranger | None, segments: int
) -> None:
    """Prints the row of a build."""
    seconds = {stage["stage"]: stage["seconds"] for stage in report["stages"]}
    counts = {stage["stage"]: stage["counts"] for stage in report["stages"]}
    scene, cells, sets, emit = (counts[stage] for stage in ("scene", "cells", "pvs", "emit"))
    visit, model = emit["visit"], scene["model_bytes"] + scene["image_bytes"]
    rooms = cells["cells"] - cells["view_only"]
    site = site_of(database)
    weight = weight_of(site)
    hints = json.loads((database / "www/hints.json").read_text())
    first, expected = hints["viewpoints"][0], ""
    viewpoint = first["description"]
    if stranger:
        rooms_expected = "–".join(map(str, dict.fromkeys(stranger.cells)))
        expected = f"≤ {stranger.resident:.0%} ({rooms_expected})"
        viewpoint += "" if as_expected(first["position"], hints["origin"], stranger) else " (!)"
    drawn = visit["first_room"] if visit["simplified"] is None else visit["simplified"]
    row = (
        name, f"{scene['triangles']:,}", when, f"{report['cpu']:.1f}",
        f"{10 + 2e-4 * scene['triangles'] + 0.3 * rooms:.0f}",
        " / ".join(f"{seconds.get(stage, 0):.1f}" for stage in STAGES),
        f"{report['peak_memory'] / 1e6:,.0f}", rooms, expected,
        *(f"{sets[key]:.1%}" for key in ("mean_volume", "most_volume", "average_share")),
        f"{drawn / 1e3:,.1f}", f"{visit['first_room'] / 1e3:,.1f}",
        f"{(weight.whole - weight.page) / model:.2f}", f"{first_room(site) / model:.2f}",
        viewpoint, len(shoot_segments(database, segments).missed),
    )  # fmt: skip
    print(f"| {' | '.join(map(str, row))} |", flush=True)


def first_room(site: Site) -> int:
    """Bytes until the first room is complete, with each file by itself."""
    index, rows = site.index, site.index["cells"]
    cell = rows[index["viewpoints"][0]["cell"]]
    record = json.loads(site.entries[f"{DATA}/{cell['record']}"].read())
    begin = (f"{DATA}/index-", f"{DATA}/poster-")
    size = sum(link_bytes(e) for name, e in site.entries.items() if name.startswith(begin))
    size += cell["recordBytes"] + sum(rows[seen]["geometryBytes"] for seen in record["visible"])
    for texture in record["textures"][0]:
        row = index["textures"][texture]
        size += row["ends"][-1] + sum(p["bytes"] for p in row.get("previews", ())[-1:])
    return int(size)


def as_expected(position: list[float], origin: list[float], stranger: Stranger) -> bool:
    """Whether a position in the world is in one of the boxes of `Stranger.first`."""
    x, y, z = position
    eye = (x + origin[0], -z + origin[1], y + origin[2])
    return any(
        all(a <= c <= b for a, c, b in zip(low, eye, high, strict=True))
        for low, high in stranger.first
    )


if __name__ == "__main__":
    main()
