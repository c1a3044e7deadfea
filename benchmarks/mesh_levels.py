"""Forms of heavy objects: bytes and seconds until a hall of them is drawn.

    python benchmarks/mesh_levels.py [MODEL …] [--triangles 81920] [--links 512k,4M]

Without models: a hall with six statues, and the cave of PTM_SHARED if it is at hand. Each is built
as modelled, with levels of detail, and the statues also with octree textures and with normal maps
(``--apo``, ``--relief``). Columns:
seconds of the build; bytes of the site's files for the first viewpoint's cell; of each link, by the
page in Chromium from an empty cache, seconds until the first picture, until the view is complete,
and bytes received until then.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from collections.abc import Sequence
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
#: Options of `ptm build-scene`.
FORMS = {
    "as modelled": ("--lods", "none"),
    "levels of detail": ("--lods", "auto"),
    "octrees": ("--lods", "none", "--apo", "statue*"),
    "normal maps": ("--lods", "none", "--apo", "statue*", "--relief", "normal-map"),
}


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


def build(model: Path, database: Path, options: Sequence[str]) -> float:
    """Builds a database; returns the seconds."""
    ptm = Path(sys.executable).with_name("ptm")
    command = [ptm, "-q", "build-scene", model, "-o", database, "--format", "gltf", "--unit", "m",
               "--light", "none"]  # fmt: skip
    begun = time.perf_counter()
    subprocess.run([str(word) for word in (*command, *options)], check=True)
    return time.perf_counter() - begun


def first_bytes(site: Site) -> int:
    """Bytes of the record and the GLB of the first viewpoint's cell."""
    row = site.index["cells"][site.index["viewpoints"][0]["cell"]]
    return int(row["recordBytes"] + row["geometryBytes"])


def visit(browser: object, site: Site, bandwidth: float) -> tuple[float, float, float]:
    """Seconds until the first picture, and until the view is complete; kilobytes until then."""
    with serving(site.entries, throttle=Throttle(bandwidth, LATENCY)) as url:
        size = {"width": 960, "height": 540}
        context = browser.new_context(viewport=size, bypass_csp=True)  # type: ignore[attr-defined]
        page = context.new_page()
        begun = time.perf_counter()
        page.goto(url, wait_until="commit")
        page.wait_for_function("window.ptm?.walk.begun", timeout=600_000, polling=50)
        first = time.perf_counter() - begun
        page.wait_for_function("window.ptm.walk.complete", timeout=600_000, polling=50)
        whole = time.perf_counter() - begun
        size = page.evaluate("window.ptm.state().bytes") / 1000
        page.context.close()
    return first, whole, size


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
        heads = "".join(f" {link}, first | complete | kB |" for link in links)
        print(f"| model | form | build, s | first view, kB |{heads}")
        print("|---|---|---|---|" + "---|---|---|" * len(links))
        for model in models:
            for form, options in FORMS.items():
                if "--apo" in options and (given.models or model == CAVE):
                    continue  # no statues
                database = Path(folder) / f"{model.stem}-{form}.db"
                seconds = build(model, database, options)
                site = site_of(database, SiteOptions(pictures=False))
                cells = [f"{seconds:.1f}", f"{first_bytes(site) / 1000:.1f}"]
                for link in links:
                    first, whole, size = visit(browser, site, parse_bandwidth(link) or 1e12)
                    cells += [f"{first:.1f}", f"{whole:.1f}", f"{size:.0f}"]
                print(f"| {model.stem} | {form} | {' | '.join(cells)} |", flush=True)
        browser.close()


if __name__ == "__main__":
    main()
