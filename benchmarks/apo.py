"""Octree textures of heavy meshes compared with table 1 of the paper, and the size of their levels.

    python benchmarks/apo.py [FILE...] [--triangles 50000 200000 1000000] [--faces 10000] [--jobs 2]

Without files, the statues of `ptm sample statues`. Times are those of `make_apo` on this
machine, without reading the file; "a second a core" divides by the processor time of all workers.
The paper used a machine of 2008 and other models, and its times exclude simplification.
"""

from __future__ import annotations

import argparse
import resource
import sys
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from ptmtools.parallel import open_executor  # noqa: E402
from ptmtools.pipeline.warm_up import warm_objects  # noqa: E402
from ptmtools.scene import IngestOptions, ingest  # noqa: E402
from ptmtools_systems.apo.files import encode_stream  # noqa: E402
from ptmtools_systems.apo.making import ApoTexture, make_apo  # noqa: E402
from ptmtools_systems.apo.model import ApoOptions  # noqa: E402

#: Model, triangles, faces, seconds, MB, frames a second.
PAPER = (
    ("Stan. Dragon", 874_000, 3_000, 50, 3.6, 58),
    ("Grog", 1_700_000, 5_000, 126, 12.3, 48),
    ("Neptune", 4_000_000, 15_000, 190, 10.3, 68),
    ("XYZ Dragon", 7_200_000, 15_000, 403, 30.6, 46),
    ("Statue", 10_000_000, 20_000, 590, 46.0, 58),
)
HEAD = (
    "| model | triangles | faces | s | triangles/s | a second a core | peak, MB | MB "
    "| bytes/triangle |"
)


def processor_time() -> float:
    """Seconds of this process and of those that it has waited for."""
    used = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(each.ru_utime + each.ru_stime for each in used)


def measure(file: Path, options: ApoOptions, jobs: int) -> tuple[ApoTexture, float, float]:
    """What is made of a file, the seconds that it takes, and those of processors."""
    scene = ingest(file, IngestOptions(up="y", unit="m"))
    began, used = time.perf_counter(), processor_time()
    with open_executor(jobs) as executor:
        made = make_apo(scene, options, executor)
    return made, time.perf_counter() - began, processor_time() - used


def row(name: str, made: ApoTexture, seconds: float, used: float) -> str:
    """Of the table."""
    size = len(encode_stream(made.octree.texels, made.octree)[0])
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    n = made.source
    return (
        f"| {name} | {n:,} | {len(made.mesh.triangles):,} | {seconds:.1f} | {n / seconds:,.0f} "
        f"| {n / used:,.0f} | {peak:,.0f} | {size / 1e6:.2f} | {size / n:.2f} |"
    )


def levels(name: str, made: ApoTexture) -> str:
    """MB of each level, the first seven together as the paper has them."""
    _, actual = encode_stream(made.octree.texels, made.octree)
    each = np.diff(actual["ends"], prepend=0) / 1e6
    first = each[:8].sum()
    rest = ", ".join(f"{k} {mb:.2f}" for k, mb in enumerate(each[8:], start=8))
    return f"{name}: levels 0 to 7 {first:.2f} MB" + (f", {rest}" if rest else "")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE")
    parser.add_argument("--triangles", nargs="+", type=int, default=[50_000, 200_000, 1_000_000])
    parser.add_argument("--only", action="append")
    parser.add_argument("--faces", type=int, default=10_000)
    parser.add_argument("--error", type=float, default=0.05)
    parser.add_argument("--jobs", type=int, default=0)
    given = parser.parse_args()
    files = given.files or list(made_statues(given.triangles, given.only))
    options = ApoOptions(faces=given.faces, error=given.error)
    warm_objects()
    print(f"{HEAD}\n|{'---|' * (HEAD.count('|') - 1)}")
    for name, triangles, faces, seconds, mb, _ in PAPER:
        print(
            f"| {name} (paper) | {triangles:,} | {faces:,} | {seconds} "
            f"| {triangles / seconds:,.0f} | – | – | {mb} | {mb * 1e6 / triangles:.2f} |"
        )
    shown = []
    for file in files:
        actual = measure(file, options, given.jobs)
        name = file.stem if given.files else f"{file.stem} {int(file.parent.name) // 1000}k"
        print(row(name, *actual), flush=True)
        shown.append(levels(name, actual[0]))
    print("\n" + "\n".join(shown))


def made_statues(triangles: list[int], only: list[str] | None) -> list[Path]:
    """The sample statues of each size, in build/bench/statues."""
    from ptmtools_samples.files import write
    from ptmtools_samples.options import STATUES, StatueOptions
    from ptmtools_samples.statues.model import make_statues

    actual = []
    for count in triangles:
        folder = ROOT / "build/bench/statues" / f"{count}"
        for name in only or STATUES:
            file = folder / f"{name}.ply"
            if not file.exists():
                options = StatueOptions(count, only=(name,))
                write(folder, list(make_statues(options)), force=True)
            actual.append(file)
    return actual


if __name__ == "__main__":
    main()
