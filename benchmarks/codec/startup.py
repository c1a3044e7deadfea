"""Times first runs, which compile, and later ones from the shell.

    python benchmarks/codec/startup.py [--runs 3] [--only encode]

First: `ptm encode` of a 1024² image and `ptm build-scene -j 2` of the sample museum, each with an
empty folder as the place for machine code (as on a fresh installation), and once more. Then, always
with compiled loops: the start of Python itself, numpy and numba, and the commands on a
256² image. Prints Markdown tables: the least, the median and the most of the runs, in seconds of
wall and processor time, children included.
"""

from __future__ import annotations

import argparse
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from images import SHARED
from numpy.typing import NDArray
from PIL import Image

PTM = [sys.executable, "-m", "ptmtools"]
HEAD = "| command | wall s | CPU s |\n|---|---|---|"

Times = list[tuple[float, float]]


def photo_like(side: int) -> NDArray[np.uint8]:
    """(side, side, 3): sums of waves, and some noise."""
    random = np.random.default_rng(1)
    y, x = np.mgrid[:side, :side] / side
    waves = np.zeros((side, side, 3))
    for frequency in 2.0 ** np.arange(1, 7):
        a, b, phase = random.normal(size=(3, 3))
        waves += np.cos(frequency * (x[..., None] * a + y[..., None] * b) * 6 + phase) / frequency
    return (128 + 90 * waves + random.normal(size=waves.shape) * 4).clip(0, 255).astype(np.uint8)


def seconds(command: list[str], cache: str | None = None) -> tuple[float, float]:
    """Wall and CPU time of a command."""
    environment = dict(os.environ)
    if cache is not None:
        environment["NUMBA_CACHE_DIR"] = cache
    before, start = os.times(), time.perf_counter()
    subprocess.run(command, check=True, env=environment, stdout=subprocess.DEVNULL)
    wall, after = time.perf_counter() - start, os.times()
    cpu = after.children_user + after.children_system
    return wall, cpu - before.children_user - before.children_system


def line(label: str, times: Times) -> str:
    """A row of a table."""
    cells = (
        f"{statistics.median(values):.2f} ({min(values):.2f}–{max(values):.2f})"
        for values in zip(*times, strict=True)
    )
    return f"| {label} | {' | '.join(cells)} |"


def print_first(label: str, command: list[str], made: Path, runs: int) -> None:
    """Rows of a command's first and second run, and the ratio of their medians.

    What it made is removed between them: stages that are up to date are not built again.
    """
    rows: tuple[Times, Times] = ([], [])
    for _ in range(runs):
        with tempfile.TemporaryDirectory() as cache:
            for row in rows:
                row.append(seconds([*command, "-o", str(made)], cache))
                made.unlink() if made.is_file() else shutil.rmtree(made)
    first, second = rows
    print(line(f"{label}, first", first))
    print(line(f"{label}, second", second))
    ratios = (
        f"{statistics.median(a) / statistics.median(b):.2f}"
        for a, b in zip(zip(*first, strict=True), zip(*second, strict=True), strict=True)
    )
    print(f"| first / second | {' | '.join(ratios)} |", flush=True)


def print_first_runs(only: list[str], runs: int, folder: str) -> None:
    """The table of first and second runs."""
    print(HEAD)
    if "encode" in only:
        image = SHARED / "textures" / "wood.png"
        if not image.exists():
            image = Path(folder) / "image.png"
            Image.fromarray(photo_like(1024)).save(image)
        command = [*PTM, "encode", str(image)]
        print_first("`ptm encode`, 1024²", command, Path(folder) / "a.ptm", runs)
    if "build" in only:
        make = [*PTM, "sample", "museum", "-o", folder, "--force"]
        subprocess.run(make, check=True, stdout=subprocess.DEVNULL)
        command = [*PTM, "build-scene", f"{folder}/museum.obj", "-j", "2"]
        print_first("`ptm build-scene -j 2`, museum", command, Path(folder) / "museum.db", runs)


def print_warm_runs(runs: int, folder: str) -> None:
    """The table of commands on a small image, with compiled loops."""
    print(f"\n{HEAD}")
    image = f"{folder}/small.png"
    Image.fromarray(photo_like(256)).save(image)
    encode = [*PTM, "encode", image, "-o", f"{folder}/b.ptm", "--force", "--profile"]
    decode = [*PTM, "decode", f"{folder}/b.ptm", "-o", f"{folder}/b.png", "--force"]
    commands = {
        "python -c pass": [sys.executable, "-c", "pass"],
        "python -c 'import numpy'": [sys.executable, "-c", "import numpy"],
        "python -c 'import numba'": [sys.executable, "-c", "import numba"],
        "ptm --version": [*PTM, "--version"],
        "ptm encode --profile raw": [*encode, "raw"],
    }
    for profile in ("fast", "small"):
        commands[f"ptm encode --profile {profile}"] = [*encode, profile]
        commands[f"ptm decode, {profile}"] = decode
    for label, command in commands.items():
        seconds(command)
        print(line(f"`{label}`", [seconds(command) for _ in range(runs)]), flush=True)


def main() -> None:
    """Prints the tables."""
    parser = argparse.ArgumentParser(description="What starting takes.")
    parser.add_argument("--runs", type=int, default=3)
    choices = ("encode", "build", "warm")
    parser.add_argument("--only", nargs="+", choices=choices, default=choices)
    options = parser.parse_args()
    load = os.getloadavg()[0]
    print(f"{os.cpu_count()} processors, load average before {load:.1f}\n")
    with tempfile.TemporaryDirectory() as folder:
        if {"encode", "build"} & set(options.only):
            print_first_runs(options.only, options.runs, folder)
        if "warm" in options.only:
            print_warm_runs(options.runs, folder)


if __name__ == "__main__":
    main()
