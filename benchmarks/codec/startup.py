"""How long `ptm encode` of a 256² image takes, from the shell's point of view.

    python benchmarks/codec/startup.py [--repeat 9]

Warm: the machine code of the compiled loops is in the cache. Cold: it is not (an empty folder is
given as the cache), as at the first run after an installation; later runs, of whatever image, are
warm. Beside it, what Python itself, numpy and numba take to start. Median of the repetitions.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from images import sample
from PIL import Image

PTM = [sys.executable, "-m", "ptmtools"]


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


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description="Start-up time of the command.")
    parser.add_argument("--repeat", type=int, default=9)
    repeat = parser.parse_args().repeat
    print(f"{'':44} {'wall s':>8} {'CPU s':>8}")
    with tempfile.TemporaryDirectory() as folder:
        image = Path(folder) / "a.png"
        Image.fromarray(sample()[:256, :256]).save(image)
        encode = [*PTM, "encode", str(image), "-o", f"{folder}/a.ptm", "--force", "--profile"]
        decode = [*PTM, "decode", f"{folder}/a.ptm", "-o", f"{folder}/b.png", "--force"]
        rows = [
            ("python -c pass", [sys.executable, "-c", "pass"]),
            ("python -c 'import numpy'", [sys.executable, "-c", "import numpy"]),
            ("python -c 'import numba'", [sys.executable, "-c", "import numba"]),
            ("ptm --version", [*PTM, "--version"]),
            ("ptm encode --profile raw", [*encode, "raw"]),
        ]
        for profile in ("fast", "small"):
            rows.append((f"ptm encode --profile {profile}", [*encode, profile]))
            rows.append((f"ptm decode ({profile})", decode))
        for label, command in rows:
            seconds(command)
            wall, cpu = zip(*(seconds(command) for _ in range(repeat)), strict=True)
            print(f"{label:44} {statistics.median(wall):8.2f} {statistics.median(cpu):8.2f}")
        for profile in ("fast", "small"):
            with tempfile.TemporaryDirectory() as cache:
                wall_time, cpu_time = seconds([*encode, profile], cache)
                print(
                    f"{f'ptm encode --profile {profile}, cold':44} {wall_time:8.2f} {cpu_time:8.2f}"
                )
                wall_time, cpu_time = seconds(decode, cache)
                print(
                    f"{f'ptm decode ({profile}), then, cold':44} {wall_time:8.2f} {cpu_time:8.2f}"
                )


if __name__ == "__main__":
    main()
