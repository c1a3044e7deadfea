"""Growth of time and memory with the model: ``python benchmarks/growth.py [KIND…] [--jobs 2]``

rooms         sample museums of 12, 50, 200 and 800 rooms (`ptm sample museum`)
buildings     streets of 3, 6 and 12 buildings (`ptm sample campus`)
walls         the museum of 12 rooms, its walls subdivided into 200,000 to 5 million triangles
furniture     the same with an equal number of triangles of curved furniture (`enlarging.py`)

The models have minimal textures, are written to a temporary folder, or to ``--folder``, and pass
through the stages with default options:

scene         reading the model
cells         the subdivision into cells, of convex leaves, with their portals
pvs           the portal flow
ach           coverage hints, Embree, the default preset
emit          the served files except textures, which do not depend on cells

Every stage of every model runs in a separate process, after a warm-up on the two rooms of the
sample data, which compiles the kernels and loads the libraries. *CPU* and *wall* are seconds of the
stage alone, without reading and writing between stages, and without those of the processes that
more than one job starts. *Peak* is the maximum resident memory of
the stage less that before it, with inputs read; on systems without this figure it is that of the
process.

The last rows are the exponents b of seconds or megabytes = a · leavesᵇ (of triangles instead of
leaves where rooms are constant, and for streets) by least squares in the logarithms, with the
standard error of b. An asterisk marks a model that hit `--max-leaves`.
"""

from __future__ import annotations

import argparse
import csv
import gc
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from enlarging import enlarged
from memory import with_peak

from ptmtools.cells import Cells, SubdivideOptions, subdivide
from ptmtools.coverage.ach import compute_ach
from ptmtools.coverage.model import Ach
from ptmtools.coverage.options import AchOptions
from ptmtools.output import EmitExtras, TextureRecord, emit
from ptmtools.parallel import Workers
from ptmtools.scene import Scene, SourceImage, ingest
from ptmtools.store.archive import pack_arrays, unpack_arrays
from ptmtools.visibility import Pvs, compute_pvs

ROOT = Path(__file__).resolve().parent.parent
SMALL = ROOT / "sample_data/two_rooms/two_rooms.obj"
#: Kinds of growth: the counted quantity, its values, and the quantity that exponents refer to.
KINDS = {
    "rooms": ("rooms", (12, 50, 200, 800), "leaves"),
    "buildings": ("buildings", (3, 6, 12), "triangles"),
    "walls": ("triangles", (200_000, 1_000_000, 5_000_000), "triangles"),
    "furniture": ("triangles", (200_000, 1_000_000, 5_000_000), "triangles"),
}
#: The rooms of the museum that other things than rooms are added to.
FEW_ROOMS = 12
STAGES = ("scene", "cells", "pvs", "ach", "emit")
#: Metres of street for a building.
PLOT = 32
FIGURES = ("cpu", "wall", "peak")


@dataclass(frozen=True)
class Work:
    """A model's folder, in which a stage leaves its result for the next, and the options."""

    folder: Path
    model: Path
    wall_area: float
    max_leaves: int
    jobs: int

    def run(self, stage: str) -> dict[str, float]:
        """Runs a stage, leaves its result and returns its figures."""
        with Workers(self.jobs, None) as workers:
            work = self._prepared(stage, workers)
            gc.collect()
            cpu, wall = time.process_time(), time.perf_counter()
            result, peak = with_peak(work)
            cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
        figures = {"cpu": cpu, "wall": wall, "peak": peak / 1e6}
        if isinstance(result, Scene | Cells | Pvs | Ach):
            (self.folder / f"{stage}.npz").write_bytes(pack_arrays(result.to_arrays()))
        if isinstance(result, Scene):
            names = json.dumps([image.name for image in result.images])
            (self.folder / "images.json").write_text(names)
            figures["triangles"] = len(result.triangles)
        if isinstance(result, Cells):
            figures |= {
                "leaves": result.leaf_count,
                "cells": result.cell_count,
                "portals": result.portal_count,
                "limited": any("limit of" in note for note in result.notes),
            }
        return figures

    def _prepared(self, stage: str, workers: Workers) -> Callable[[], Any]:
        """The stage as a function, its inputs read."""
        if stage == "scene":
            return lambda: ingest(self.model)
        scene = Scene.from_arrays(self._arrays("scene"), self._images())
        options = SubdivideOptions(wall_area=self.wall_area, max_leaves=self.max_leaves)
        if stage == "cells":
            return lambda: subdivide(scene, options, executor=workers.alone)
        cells = Cells.from_arrays(self._arrays("cells"))
        if stage == "pvs":
            return lambda: compute_pvs(cells, executor=workers.executor)
        pvs = Pvs.from_arrays(self._arrays("pvs"))
        if stage == "ach":
            asked = AchOptions(backend="embree")
            return lambda: compute_ach(scene, cells, pvs, asked, executor=workers.executor)
        ach = Ach.from_arrays(self._arrays("ach"))
        textures = tuple(
            TextureRecord(i, f"textures/{image.name}.ptm", f"{image.name}.png", 1, 1, 3, (), "")
            for i, image in enumerate(scene.images)
        )
        out = self.folder / "www"
        extras = EmitExtras(force=True, workers=self.jobs)
        return lambda: emit(scene, cells, pvs, ach, textures, out, extras=extras)

    def _images(self) -> list[SourceImage]:
        """Their names; nothing here asks for their bytes."""
        names = json.loads((self.folder / "images.json").read_text())
        return [SourceImage(name, "", bytes) for name in names]

    def _arrays(self, stage: str) -> dict[str, Any]:
        file = self.folder / f"{stage}.npz"
        return unpack_arrays(file.read_bytes(), file=file)


def one_stage(stage: str, work: Work) -> None:
    """What a process of its own does: the small model as far as the stage, then the stage."""
    with tempfile.TemporaryDirectory(dir=work.folder) as small:
        warm = replace(work, folder=Path(small), model=SMALL)
        for name in STAGES[: STAGES.index(stage) + 1]:
            warm.run(name)
    print(json.dumps(work.run(stage)))


def make_model(kind: str, size: int, folder: Path) -> None:
    """Makes a museum of ``size`` rooms, or of `FEW_ROOMS` rooms with ``size`` triangles, or a
    street of ``size`` buildings."""
    model = folder / "model/museum.obj"
    if model.is_file():
        return
    if kind == "buildings":
        maker = [sys.executable, "-m", "ptmtools", "sample", "campus", "-o", str(model.parent)]
        maker += ["--buildings", str(size), "--length", str(PLOT * size), "--texture", "16"]
        subprocess.run([*maker, "--force"], check=True, stdout=subprocess.DEVNULL)
        model.with_name("campus.obj").rename(model)
        return
    rooms = size if kind == "rooms" else FEW_ROOMS
    maker = [sys.executable, "-m", "ptmtools", "sample", "museum", "-o", str(model.parent)]
    maker += ["--rooms", str(rooms), "--size", "16", "--force"]
    subprocess.run(maker, check=True, stdout=subprocess.DEVNULL)
    if kind != "rooms":
        model.write_bytes(b"".join(enlarged(ingest(model), kind, size, "museum.mtl")))


def measured(kind: str, size: int, folder: Path, options: list[str]) -> dict[str, Any]:
    """Makes a model and runs all of its stages, each in a process of its own."""
    folder = folder / f"{kind}{size}"
    make_model(kind, size, folder)
    row: dict[str, Any] = {"size": size}
    for stage in STAGES:
        call = [sys.executable, __file__, "--stage", stage, "--folder", str(folder), *options]
        done = subprocess.run(call, check=True, stdout=subprocess.PIPE, text=True)
        for name, value in json.loads(done.stdout.splitlines()[-1]).items():
            row[f"{stage} {name}" if name in FIGURES else name] = value
    return row


def exponent(sizes: list[float], figures: list[float]) -> tuple[float, float]:
    """The slope of log figures over log sizes, and its standard error (nan below 3 points)."""
    x, y = np.log(sizes), np.log(np.maximum(figures, 1e-9))
    spread = float(((x - x.mean()) ** 2).sum())
    if len(x) < 2 or spread == 0:
        return float("nan"), float("nan")
    slope = float(((x - x.mean()) * (y - y.mean())).sum()) / spread
    rest = y - y.mean() - slope * (x - x.mean())
    error = (rest @ rest / (len(x) - 2) / spread) ** 0.5 if len(x) > 2 else float("nan")
    return slope, float(error)


def print_row(row: dict[str, Any]) -> None:
    mark = "*" if row["limited"] else ""
    sizes = " | ".join(f"{row[k]:,}" for k in ("triangles", "leaves", "cells", "portals"))
    for figure, digits in (("cpu", 1), ("wall", 1), ("peak", 0)):
        head = f"{row['size']:,} | {sizes}{mark}" if figure == "cpu" else " | | | | "
        stages = " | ".join(f"{row[f'{stage} {figure}']:,.{digits}f}" for stage in STAGES)
        print(f"| {head} | {_UNITS[figure]} | {stages} |", flush=True)


_UNITS = {"cpu": "CPU s", "wall": "wall s", "peak": "peak MB"}


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "kinds", nargs="*", choices=[[], *KINDS], metavar="KIND", help=", ".join(KINDS)
    )
    parser.add_argument("--sizes", metavar="N,N,…", help="other numbers of rooms or triangles")
    parser.add_argument("--wall-area", type=float, default=SubdivideOptions().wall_area)
    parser.add_argument("--max-leaves", type=int, default=SubdivideOptions().max_leaves)
    parser.add_argument("--jobs", type=int, default=1, help="workers of every stage")
    parser.add_argument("--csv", type=Path, metavar="FILE", help="the figures as a table")
    parser.add_argument("--folder", type=Path, help="where museums are made, left and found again")
    parser.add_argument("--stage", choices=STAGES, help=argparse.SUPPRESS)
    given = parser.parse_args(arguments)
    if given.stage:
        model = given.folder / "model/museum.obj"
        work = Work(given.folder, model, given.wall_area, given.max_leaves, given.jobs)
        one_stage(given.stage, work)
        return 0
    options = [f"--wall-area={given.wall_area}", f"--max-leaves={given.max_leaves}"]
    options.append(f"--jobs={given.jobs}")
    with tempfile.TemporaryDirectory() as scratch:
        folder = given.folder or Path(scratch)
        rows = []
        for kind in given.kinds or KINDS:
            rows += [{"kind": kind, **row} for row in grow(kind, given.sizes, folder, options)]
    if given.csv:
        with given.csv.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, fieldnames=list(rows[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
    return 0


def grow(kind: str, sizes: str | None, folder: Path, options: list[str]) -> list[dict[str, Any]]:
    """Measures and prints one kind of growth."""
    counted, usual, against = KINDS[kind]
    print(f"\n{kind}\n")
    print(f"| {counted} | triangles | leaves | cells | portals | | {' | '.join(STAGES)} |")
    print("|---" * (6 + len(STAGES)) + "|")
    rows = []
    for size in [int(float(n)) for n in sizes.split(",")] if sizes else usual:
        rows.append(measured(kind, size, folder, options))
        print_row(rows[-1])
    x = [row[against] for row in rows]
    for figure in FIGURES:
        fits = [exponent(x, [row[f"{stage} {figure}"] for row in rows]) for stage in STAGES]
        cells = " | ".join(f"{slope:.2f} ± {error:.2f}" for slope, error in fits)
        print(f"| exponent | | | | | {_UNITS[figure]} | {cells} |", flush=True)
    return rows


if __name__ == "__main__":
    sys.exit(main())
