"""What a build takes with one worker and with two, and what it takes to build again.

Each build is a process of its own, and the whole command is timed; of several runs the fastest
counts. Kernels are compiled beforehand. Builds with different numbers of workers must give the
same bytes, and so must the database that was updated and one built anew.

    python benchmarks/rebuild.py [MODEL] [--runs 3]
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from PIL import Image, ImageOps

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(Path(__file__).parent)]
from kills import state  # noqa: E402


@dataclass(frozen=True)
class Taken:
    """Seconds of a command, and what it reported."""

    seconds: float
    report: dict[str, Any]

    @property
    def peaks(self) -> str:
        own = f"peak memory {self.report['peak_memory'] / 1e6:.0f} MB"
        other = self.report["peak_memory_of_workers"]
        return own + (f", {other / 1e6:.0f} MB in a process of its own" if other else "")


def build(model: Path, db: Path, *more: str) -> Taken:
    command = [sys.executable, "-m", "ptmtools", "build-scene", str(model), "-o", str(db)]
    start = time.perf_counter()
    done = subprocess.run([*command, "--json", *more], check=True, stdout=subprocess.PIPE)
    return Taken(time.perf_counter() - start, json.loads(done.stdout))


def fastest(runs: int, once: Callable[[], Taken]) -> Taken:
    return min((once() for _ in range(runs)), key=lambda taken: taken.seconds)


def shares(taken: Taken, full: dict[int, Taken]) -> str:
    """What share of a build anew it took."""
    return ", ".join(f"{taken.seconds / full[j].seconds:.1%} of -j {j}" for j in (1, 2))


def summary_of(stages: list[dict[str, Any]]) -> str:
    return ", ".join(f"{stage['stage']} {stage['seconds']:.2f}" for stage in stages)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("model", type=Path, nargs="?", default=ROOT / "build/museum/museum.obj")
    parser.add_argument("--runs", type=int, default=3)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="rebuild-") as made:
        folder = Path(made)
        model = Path(shutil.copytree(asked.model.parent, folder / "model")) / asked.model.name

        def anew(workers: int) -> Taken:
            shutil.rmtree(folder / f"j{workers}", ignore_errors=True)
            return build(model, folder / f"j{workers}", "-j", str(workers))

        anew(1)
        full = {workers: fastest(asked.runs, lambda w=workers: anew(w)) for workers in (1, 2)}
        for workers, taken in full.items():
            stages = summary_of(taken.report["stages"])
            print(f"-j {workers}: {taken.seconds:.2f} s ({stages}); {taken.peaks}")
        same = state(folder / "j1") == state(folder / "j2")
        ratio = full[1].seconds / full[2].seconds
        print(f"-j 2 is {ratio:.2f} times as fast; {'the same' if same else 'OTHER'} bytes")

        db = folder / "j2"
        time.sleep(0.2)
        build(model, db)
        nothing = fastest(asked.runs + 2, lambda: build(model, db))
        assert not any(stage["ran"] for stage in nothing.report["stages"])
        print(
            f"again, nothing to do: {nothing.seconds:.3f} s, "
            f"{shares(nothing, full)}; {nothing.peaks}"
        )

        images = json.loads((db / "stages/images.json").read_text())["images"]
        plain = [image["files"][0] for image in images if image["plain"] and image["files"]]

        def touched() -> Taken:
            file = model.parent / plain[0]
            with Image.open(file) as image:
                inverted = ImageOps.invert(image.convert("RGB"))
            inverted.save(file)
            time.sleep(0.1)
            return build(model, db)

        one = fastest(asked.runs + 2, touched)
        ran = [stage for stage in one.report["stages"] if stage["ran"]]
        assert [stage["stage"] for stage in ran] == ["scene", "textures", "emit"]
        print(
            f"1 of {len(images)} textures painted over: {one.seconds:.2f} s ({summary_of(ran)}), "
            f"{shares(one, full)}"
        )
        build(model, folder / "fresh")
        updated = state(db) == state(folder / "fresh")
        print(f"updated and built anew: {'the same' if updated else 'OTHER'} bytes")
    return 0 if same and updated else 1


if __name__ == "__main__":
    sys.exit(main())
