"""What octree textures of statues make of a building.

    python benchmarks/apo_in_building.py [--triangles 50000] [--samples 64] [--jobs 2]

The two rooms of the sample with a bust and a column of sample_data/make_statues.py, on pedestals of
air: built as modelled, and with their statues replaced by the options' defaults and other ones.
Seconds are those of the stages, on this machine; all that the stages compile is compiled before.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "sample_data")]

from make_statues import StatueOptions, make_statue  # noqa: E402

from ptmtools.apo.options import ReplaceOptions  # noqa: E402
from ptmtools.coverage.options import AchOptions  # noqa: E402
from ptmtools.pipeline import BuildReport, build_scene  # noqa: E402

#: By name: the middle of the foot, and the height, metres.
PLACES = {"bust": ((2.0, 1.0, 1.2), 0.8), "column": ((6.2, 0.0, 2.6), 2.0)}
#: None replaces nothing.
VARIANTS: dict[str, ReplaceOptions] = {
    "as modelled": ReplaceOptions(),
    "--apo '*_statue'": ReplaceOptions(apo=("*_statue",)),
    "… --apo-faces 10000": ReplaceOptions(apo=("*_statue",), apo_faces=10_000),
    "… --apo-error 0.1": ReplaceOptions(apo=("*_statue",), apo_error=0.1),
}


def write_model(folder: Path, triangles: int) -> Path:
    """The rooms with their statues."""
    model = Path(shutil.copytree(ROOT / "sample_data/two_rooms", folder)) / "two_rooms.obj"
    lines = [model.read_text()]
    begin = sum(line.startswith("v ") for line in lines[0].splitlines())
    for name, (foot, height) in PLACES.items():
        statue = make_statue(name, StatueOptions(triangles))
        low, high = statue.points.min(axis=0), statue.points.max(axis=0)
        middle = (low + high) / 2 * [1, 0, 1] + low * [0, 1, 0]
        points = (statue.points - middle) * (height / (high[1] - low[1])) + foot
        lines.append(f"o {name}_statue\nusemtl ceiling")
        lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in points.tolist()]
        corners = statue.triangles + begin + 1
        lines += [f"f {a} {b} {c}" for a, b, c in corners.tolist()]
        begin += len(points)
    model.write_text("\n".join(lines) + "\n")
    return model


def bytes_in(folder: Path) -> int:
    return sum(f.stat().st_size for f in folder.rglob("*") if f.is_file())


def row(name: str, report: BuildReport, db: Path) -> str:
    """A row of the table."""
    seconds = {stage.stage: stage.seconds for stage in report.stages}
    made = report.counts("apo")
    shown = made.get("triangles", report.counts("scene")["triangles"])
    visit: Any = report.visitor.visit if report.visitor else {}
    kilobytes = [bytes_in(db / "www" / part) / 1e3 for part in ("gltf", "apo")]
    later = sum(seconds[stage] for stage in ("cells", "pvs", "ach", "emit"))
    return (
        f"| {name} | {shown:,} | {kilobytes[0]:,.0f} | {kilobytes[1]:,.0f} "
        f"| {visit['first_room'] / 1e3:,.0f} | {seconds['apo']:.1f} | {later:.1f} |"
    )


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--triangles", type=int, default=50_000, help="of each statue")
    parser.add_argument("--samples", type=int, default=64, help="of the coverage hints")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    ach = AchOptions(samples=options.samples, backend="embree")
    with TemporaryDirectory() as folder:
        small = write_model(Path(folder, "small"), 4_000)
        warm = ReplaceOptions(apo=("*",), apo_faces=500)
        build_scene(small, Path(folder, "warm.db"), ach, warm, workers=options.jobs)
        model = write_model(Path(folder, "model"), options.triangles)
        print("| build | triangles | GLBs, kB | octrees, kB | first room, kB | apo, s | later, s |")
        print("|---|---|---|---|---|---|---|")
        for number, (name, chosen) in enumerate(VARIANTS.items()):
            db = Path(folder, f"{number}.db")
            report = build_scene(model, db, ach, chosen, workers=options.jobs)
            print(row(name, report, db), flush=True)


if __name__ == "__main__":
    main()
