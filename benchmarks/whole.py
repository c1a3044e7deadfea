"""What building whole models takes and gives: ``python benchmarks/whole.py MODEL…``

Every model is built from nothing by ``ptm build-scene``, and right before by that of older sources,
a folder with another ``ptmtools`` in it; both with the libraries of this Python, and after the two
rooms of the sample data, which compile the kernels. For each it prints seconds by the clock, the
memory of the largest process, what the cells are, the megabytes of cell files of a kind, and the
triangles in them over those of the model, and over the visible ones each counted in all cells that
own it.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
SMALL = ROOT / "sample_data/two_rooms/two_rooms.obj"
COLUMNS = "cells|view-only|leaves|wrl MB|glb MB|triangles / model|/ Σ owners|s|MiB"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("models", nargs="+", type=Path)
    parser.add_argument("--before", type=Path, help="a folder with older sources")
    arguments = parser.parse_args()
    versions = {"now": ROOT}
    if arguments.before:
        versions = {"before": arguments.before.resolve(), **versions}
    print("| model | version | " + " | ".join(COLUMNS.split("|")) + " |")
    print("|---|---|" + "---|" * (COLUMNS.count("|") + 1))
    for sources in versions.values():
        with tempfile.TemporaryDirectory() as folder:
            _built(SMALL, sources, Path(folder))
    for model in arguments.models:
        for version, sources in versions.items():
            with tempfile.TemporaryDirectory() as folder:
                found = _built(model.resolve(), sources, Path(folder))
            print(f"| {model.stem} | {version} | " + " | ".join(found) + " |", flush=True)


def _built(model: Path, sources: Path, folder: Path) -> list[str]:
    """The columns for a model, built by the ``sources`` in a folder."""
    ptm = [sys.executable, "-m", "ptmtools"]
    environment = os.environ | {"PYTHONPATH": str(sources)}
    database = folder / "model.db"
    before = time.perf_counter()
    process = subprocess.Popen(
        [*ptm, "build-scene", str(model), "-o", str(database), "--quiet"],
        env=environment,
        cwd=folder,
    )
    _, status, usage = os.wait4(process.pid, 0)
    seconds = time.perf_counter() - before
    if status:
        sys.exit(f"{model}: {sources} stopped with {os.waitstatus_to_exitcode(status)}")
    info = subprocess.run(
        [*ptm, "info", str(database), "--json"],
        env=environment,
        cwd=folder,
        check=True,
        capture_output=True,
    )
    counts = {name: stage["counts"] for name, stage in json.loads(info.stdout)["stages"].items()}
    return _columns(counts, database, seconds, usage.ru_maxrss / 1024)


def _columns(
    counts: dict[str, dict[str, Any]], database: Path, seconds: float, memory: float
) -> list[str]:
    cells, emitted = counts["cells"], counts["emit"]["triangles"]
    owners = cells.get("owners")
    size = {
        kind: sum(path.stat().st_size for path in database.rglob(f"www/*/*.{kind}"))
        for kind in ("wrl", "glb")
    }
    return [
        f"{cells['cells']}",
        f"{cells.get('view_only', 0)}",
        f"{cells['leaves']}",
        *(f"{size[kind] / 1e6:.2f}" if size[kind] else "" for kind in size),
        f"{emitted / counts['scene']['triangles']:.2f}",
        f"{emitted / owners:.2f}" if owners else "",
        f"{seconds:.0f}",
        f"{memory:.0f}",
    ]


if __name__ == "__main__":
    main()
