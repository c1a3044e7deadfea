"""Levels of detail of objects: bytes and seconds until a heavy hall is drawn, with and without.

    python benchmarks/mesh_levels.py [MODEL …] [--triangles 81920] [--links 512k,4M]

Without models: a hall with six statues, and the cave of PTM_SHARED if it is at hand. Each is built
with ``--lods none`` and ``auto``. Columns: seconds of the stage ``emit``; bytes of the site's files
for the first viewpoint's cell; of each link, by the page in Chromium from an empty cache, seconds
until the first picture and until the view is complete. The ratio is none / auto.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import trimesh

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from ptmtools.quantities import parse_bandwidth  # noqa: E402
from ptmtools.site.content import Site, SiteOptions, site_of  # noqa: E402
from ptmtools.site.serving import serving  # noqa: E402
from ptmtools.site.throttle import Throttle  # noqa: E402

CAVE = Path(os.environ.get("PTM_SHARED", "")) / "scenes" / "cave" / "cave.glb"
#: Width, height and depth of the hall, and the radius of a statue, metres.
HALL, RADIUS = (14.0, 5.0, 9.0), 0.7
LATENCY = 0.04


def write_hall(file: Path, triangles: int) -> None:
    """A hall with six statues of at least this many triangles."""
    depth = 0
    while 20 * 4**depth < triangles:
        depth += 1
    hall = trimesh.creation.box(extents=HALL)
    hall.invert()
    hall.apply_translation([0, HALL[1] / 2, 0])
    scene = trimesh.Scene({"hall": hall})
    for k in range(6):
        statue = trimesh.creation.icosphere(subdivisions=depth)
        x, y, z = (statue.vertices * [7, 11, 5]).T
        bumps = 1 + 0.06 * (np.sin(x + k) * np.cos(y) + np.sin(z + y))
        statue.vertices *= RADIUS * bumps[:, None]
        statue.apply_translation([4 * (k % 3 - 1), -statue.bounds[0][1], 2.2 * (2 * (k // 3) - 1)])
        scene.add_geometry(statue, geom_name=f"statue {k + 1}", node_name=f"statue {k + 1}")
    scene.export(file)


def build(model: Path, database: Path, lods: str) -> float:
    """Builds a database; returns the seconds of its last stage."""
    ptm = Path(sys.executable).with_name("ptm")
    command = [ptm, "-q", "build-scene", model, "-o", database, "--format", "gltf", "--unit", "m"]
    subprocess.run([str(w) for w in (*command, "--lods", "none")], check=True)
    begun = time.perf_counter()
    options = ["--format", "gltf", "--lods", lods, "--title", lods]
    subprocess.run([str(w) for w in (ptm, "-q", "emit", database, *options)], check=True)
    return time.perf_counter() - begun


def first_bytes(site: Site) -> int:
    """Bytes of the record and the GLB of the first viewpoint's cell."""
    row = site.index["cells"][site.index["viewpoints"][0]["cell"]]
    return int(row["recordBytes"] + row["geometryBytes"])


def visit(browser: object, site: Site, bandwidth: float) -> tuple[float, float]:
    """Seconds until the first picture, and until the view is complete."""
    with serving(site.entries, throttle=Throttle(bandwidth, LATENCY)) as url:
        page = browser.new_context(viewport={"width": 960, "height": 540}).new_page()  # type: ignore[attr-defined]
        begun = time.perf_counter()
        page.goto(url, wait_until="commit")
        page.wait_for_function("window.ptm?.walk.begun", timeout=600_000, polling=50)
        first = time.perf_counter() - begun
        page.wait_for_function("window.ptm.walk.complete", timeout=600_000, polling=50)
        whole = time.perf_counter() - begun
        page.context.close()
    return first, whole


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(prog="python benchmarks/mesh_levels.py")
    parser.add_argument("models", nargs="*", type=Path, metavar="MODEL")
    parser.add_argument("--triangles", type=int, default=81_920, help="of a statue, at least")
    parser.add_argument("--links", default="512k,4M", help="bit/s")
    given = parser.parse_args()
    links = given.links.split(",")
    from playwright.sync_api import sync_playwright

    with TemporaryDirectory() as folder, sync_playwright() as playwright:
        models = given.models
        if not models:
            models = [Path(folder) / "hall.glb", *([CAVE] if CAVE.is_file() else [])]
            write_hall(models[0], given.triangles)
        browser = playwright.chromium.launch(
            executable_path=os.environ.get("CHROMIUM", "/usr/bin/chromium"), args=["--no-sandbox"]
        )
        heads = "".join(f"{f'{link} first':>14}{'complete':>10}" for link in links)
        print(f"{'model':<12}{'lods':>6}{'emit':>9}{'first view':>14}{heads}")
        for model in models:
            rows = []
            for lods in ("none", "auto"):
                seconds = build(model, Path(folder) / f"{model.stem}-{lods}.db", lods)
                site = site_of(
                    Path(folder) / f"{model.stem}-{lods}.db", SiteOptions(pictures=False)
                )
                times = [
                    each
                    for link in links
                    for each in visit(browser, site, float(parse_bandwidth(link) or 1e12))
                ]
                rows.append([seconds, first_bytes(site) / 1000, *times])
                print(line(model.stem, lods, rows[-1], ("s", "kB")), flush=True)
            print(line("", "ratio", [a / b for a, b in zip(*rows, strict=True)], ("×", "×")))
        browser.close()


def line(name: str, lods: str, row: list[float], units: tuple[str, str]) -> str:
    """A line of the table; units of seconds and of bytes."""
    seconds, size, *times = row
    text = f"{name:<12}{lods:>6}{seconds:>7.1f} {units[0]}{size:>11.1f} {units[1]}"
    for k, each in enumerate(times):
        text += f"{each:>{8 if k % 2 else 12}.1f} {units[0]}"
    return text


if __name__ == "__main__":
    main()
