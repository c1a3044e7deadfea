"""Visits of the pages of other forms in a browser, and again in their simulators.

    python benchmarks/form_replay.py DB WALK | CAMPUS WALK | APO | SET …

DB        a database with interlaced images (`--format …,interlace`): the walk with `?form=gpuii`,
          and `ptm simulate --policy gpuii` for its recording
CAMPUS    a folder of `ptm campus`: the walk, and `ptm walk-campus` for its recording
APO       a folder of `ptm apo`: a turn around the object that comes nearer, and its levels one
          after the other, as the recorded camera wants them
SET       a folder of `ptm interlace`: the picture grows to a texel a pixel, and its files one after
          the other

Headless Chromium opens the site over a throttled server with an empty cache. Prints, as medians of
the runs, requests, MB, and the mean time at which a byte of these arrived, of the browser and of
the simulator, and their ratio. Times count from the request of the index; on a busy machine they
differ by more.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "site")]

from browser import visiting  # noqa: E402

from ptmtools.folder_kinds import folder_kind  # noqa: E402
from ptmtools.link import Conditions  # noqa: E402
from ptmtools.output.served import read_served  # noqa: E402
from ptmtools.quantities import parse_bandwidth, parse_duration  # noqa: E402
from ptmtools.rendering.pyramids import read_pyramids  # noqa: E402
from ptmtools.site.content import Site, SiteOptions, site_of  # noqa: E402
from ptmtools.site.entry import link_bytes  # noqa: E402
from ptmtools.site.forms import form_site  # noqa: E402
from ptmtools.site.throttle import Throttle  # noqa: E402
from ptmtools.walk import Walk, parse_walk, read_walk  # noqa: E402
from ptmtools_lab.campus.options import CampusWalkOptions  # noqa: E402
from ptmtools_lab.campus.simulation import simulate_campus  # noqa: E402
from ptmtools_lab.campus.stock import Stock  # noqa: E402
from ptmtools_lab.campus.world import CampusFrames, prepare_campus  # noqa: E402
from ptmtools_lab.network import FluidLink  # noqa: E402
from ptmtools_lab.policies import POLICIES  # noqa: E402
from ptmtools_lab.simulation import simulate  # noqa: E402
from ptmtools_lab.tables import Drawing  # noqa: E402
from ptmtools_lab.world import prepare, read_forms  # noqa: E402
from ptmtools_systems.apo.files import read_mesh  # noqa: E402
from ptmtools_systems.campus.model import MASK, PRESETS  # noqa: E402
from tests.e2e.browsers import web  # noqa: E402

#: Window, pixels; poses a second; preset of a campus.
WIDTH, HEIGHT, RATE, PRESET = 320, 240, 20, PRESETS[1]
#: Distances from the object, diameters; levels of the first request, and bytes before the first
#: level and after the last (`web/systems/octree/octree.js`).
FAR, NEAR, FIRST, HEAD, CHECK = 8.0, 0.6, 7, 2, 4
#: Poses the page from its first frame on, and records. `at` gives the arguments of a pose.
SCRIPT = """
const poses = {poses}, rate = {rate};
let app = null;
Object.defineProperty(window, "ptm", {{ get: () => app, set(made) {{
  app = made;
  window.begun = performance.now();
  app.record?.();
  const step = () => {{
    const k = Math.floor((performance.now() - window.begun) / 1000 * rate);
    if (k < poses.length) ({place})(poses[k]);
    requestAnimationFrame(step);
  }};
  step();
}} }});
"""
#: A pose of a walk; of an object; of a picture.
WALKED, CAMPUS_WALKED, TURNED, GROWN = (
    "([x, y, z, yaw, pitch]) => app.goTo({ eye: [x, y, z], yaw, pitch })",
    "([x, y, z, yaw, pitch]) => app.place([x, y, z], yaw, pitch)",
    "([...all]) => app.place(...all)",
    "([scale]) => app.place(scale)",
)

Floats = NDArray[np.float64]


class Traffic(NamedTuple):
    """Requests, bytes, and the mean time at which they arrived, s."""

    requests: int
    bytes: float
    time: float


def traffic(requests: int, time: Floats, arrived: Floats) -> Traffic:
    """Of (n,) bytes that have arrived by (n,) s, both ascending."""
    mean = float((time * np.diff(arrived, prepend=0)).sum() / arrived[-1])
    return Traffic(requests, float(arrived[-1]), mean)


def traffic_of(answers: Sequence[tuple[float, float, float]]) -> Traffic:
    """Of answers: s of the first byte and of the last, and bytes, which arrive evenly."""
    begun, ended, size = np.array(answers).T
    total = float(size.sum())
    return Traffic(len(answers), total, float((size * (begun + ended)).sum() / 2 / total))


@dataclass(frozen=True)
class Visit:
    """A visit in the browser: its traffic, the recording, and s from the index to its begin."""

    traffic: Traffic
    recording: Any
    begun: float


def visit(
    browser: Any, site: Site, query: str, place: str, poses: Any, link: Conditions, seconds: float
) -> Visit:
    """Opens a page, poses it as often as `RATE` says, and counts the files of its data."""
    script = SCRIPT.format(poses=json.dumps(poses), rate=RATE, place=place)
    throttle = Throttle(link.bandwidth, link.latency)
    with visiting(
        browser, site.entries, query=query, width=WIDTH, height=HEIGHT, throttle=throttle,
        prepare=lambda page: page.add_init_script(script), reduced_motion="reduce",
    ) as visitor:  # fmt: skip
        visitor.page.wait_for_function(
            f"performance.now() > window.begun + {1000 * seconds}", timeout=300_000
        )
        now = time.monotonic()
        recording = visitor.page.evaluate("window.ptm.recording ?? null")
        asked = [v for v in visitor.visits if v.path.startswith("/data")]
        begun = visitor.page.evaluate(
            "(window.begun - performance.getEntriesByType('resource')"
            ".find(({ name }) => name.endsWith('.json')).requestStart) / 1000"
        )
        if visitor.messages:
            print("the page reported", visitor.messages, file=sys.stderr)
    # Documents of interlaced images are no files of the simulated client.
    asked = [v for v in asked if "/sets-" not in v.path]
    first = min(v.begun for v in asked)
    answers = [
        (v.first_byte - first, (v.ended or now) - first, v.bytes) for v in asked if v.first_byte
    ]
    return Visit(traffic_of(answers)._replace(requests=len(asked)), recording, begun)


def poses_of(walk: Walk, seconds: float) -> list[list[float]]:
    """x, y, z, yaw and pitch of each pose of a walk."""
    eye, direction = walk.at(np.arange(0, seconds, 1 / RATE))
    yaw = np.arctan2(-direction[:, 0], -direction[:, 2])
    pitch = np.arcsin(np.clip(direction[:, 1], -1, 1))
    rows: list[list[float]] = np.column_stack([eye, yaw, pitch]).tolist()
    return rows


def steps(
    files: Sequence[Sequence[int]],
    wanted: Callable[[int, float], bool],
    link: Conditions,
    seconds: float,
) -> Traffic:
    """A client that requests the files of a step together, and those of the next one when they are
    here and wanted at that time."""
    line = FluidLink(link)
    answers = []
    for step, sizes in enumerate(files):
        while not wanted(step, line.now) and line.now < seconds:
            line.advance(line.now + 1 / 60)
        if line.now >= seconds:
            break
        for size in sizes:
            line.request(size, 0.0, size)
        for _ in sizes:
            if finished := line.advance(1e9):
                answers.append((finished.first_byte or 0.0, line.now, finished.size))
    return traffic_of(answers)


class Scene(NamedTuple):
    """A page and its simulator.

    Attributes
    ----------
    name, site, query, place, poses: as `visit` takes them.
    simulated: the traffic of the simulator for a visit over a link.
    """

    name: str
    site: Site
    query: str
    place: str
    poses: list[list[float]]
    simulated: Callable[[Visit, Conditions], Traffic]


def database(folder: Path, walk: Walk, seconds: float) -> Scene:
    """A walk among interlaced images."""
    served = read_served(folder)
    pyramids = read_pyramids(served)
    shows = read_forms(served, pyramids, ["interlaced"])

    def simulated(visit: Visit, link: Conditions) -> Traffic:
        recording = parse_walk(json.dumps(visit.recording).encode())
        assert recording.browser
        world = prepare(served, recording, pyramids, drawing=Drawing(forms=shows))
        run = simulate(world, POLICIES["gpuii"], link, recording.browser.budget)
        moment = run.time - recording.browser.begun + visit.begun
        return traffic(run.requests, moment, run.fetched)

    site = site_of(folder, SiteOptions(pictures=False, opening=False))
    return Scene(folder.stem, site, "?form=gpuii", WALKED, poses_of(walk, seconds), simulated)


def since_index(visit: Visit) -> Walk:
    """The recorded walk from the request of the index on: until the page begins, it stands."""
    (_, *pose), *_ = samples = visit.recording["samples"]
    moved = [[time + visit.begun, *rest] for time, *rest in samples]
    return parse_walk(json.dumps(visit.recording | {"samples": [[0, *pose], *moved]}).encode())


def without_masks(stock: Stock) -> Stock:
    """The files that the page fetches: it draws no reflections."""
    materials = [
        replace(one, channels=tuple(c for c in one.channels if c != MASK))
        for one in stock.campus.materials
    ]
    return replace(stock, campus=replace(stock.campus, materials=tuple(materials)))


def campus(folder: Path, site: Site, walk: Walk, seconds: float) -> Scene:
    """A walk through a campus."""

    def simulated(visit: Visit, link: Conditions) -> Traffic:
        place = prepare_campus(folder, since_index(visit), frames=CampusFrames(every=0))
        place = replace(place, stock=without_masks(place.stock))
        run = simulate_campus(place, PRESET, CampusWalkOptions(), conditions=link)
        return traffic(run.requests, run.time, run.fetched)

    query = f"?preset={PRESET.name}"
    return Scene(folder.name, site, query, CAMPUS_WALKED, poses_of(walk, seconds), simulated)


def octree(folder: Path, site: Site, seconds: float) -> Scene:
    """A turn around an object, which comes nearer."""
    index, points = site.index, read_mesh(folder).points
    low, high = points.min(axis=0), points.max(axis=0)
    side, levels = index["cube"]["side"], len(index["levels"])
    radius, middle = np.linalg.norm(high - low) / side / 2, (low + high) / 2
    streams = [index[name] for name in ("normals", "colors") if name in index]
    ends = [[HEAD, *stream["ends"][:-1], stream["ends"][-1] - CHECK] for stream in streams]
    shown = [0, *range(min(FIRST, levels), levels + 1)]
    parts = [[end[b] - end[a] for end in ends] for a, b in pairwise(shown)]
    documents = [[link_bytes(entry)] for name in ("apo.json", "mesh.glb")
                 for entry in site.entries.values() if entry.name.endswith(name)]  # fmt: skip

    def simulated(visit: Visit, link: Conditions) -> Traffic:
        recording = parse_walk(json.dumps(visit.recording).encode())
        lens = HEIGHT / (2 * np.tan(recording.field_of_view / 2))

        def wanted(step: int, now: float) -> bool:
            if step <= len(documents):
                return True
            eye, _ = recording.at(np.array([now - visit.begun]))
            away = max(float(np.linalg.norm(eye[0] - middle)) / side - radius, 1e-6)
            return bool(lens / away * 2.0 ** (1 - shown[step - len(documents)]) > 1)

        return steps([*documents, *parts], wanted, link, seconds)

    part = np.arange(0, seconds, 1 / RATE) / seconds
    poses = np.column_stack([360 * part, np.full(len(part), 15.0), FAR * (NEAR / FAR) ** part])
    return Scene(folder.name, site, "", TURNED, poses.tolist(), simulated)


def picture(folder: Path, site: Site, seconds: float) -> Scene:
    """An interlaced image that grows to a texel a pixel."""
    index = site.index
    original = index["original"]["width"], index["original"]["height"]
    fits = min(WIDTH / original[0], HEIGHT / original[1])
    part = np.arange(0, seconds, 1 / RATE) / seconds
    # Grown after half of the time.
    scales = np.exp(np.log(fits) * np.maximum(1 - 2 * part, 0))
    (document,) = (e for e in site.entries.values() if e.name.endswith("interlace.json"))
    files = [[link_bytes(document)], *([part["bytes"]] for part in index["files"])]

    def simulated(visit: Visit, link: Conditions) -> Traffic:
        def wanted(step: int, now: float) -> bool:
            if step < 2:
                return True
            k = int((now - visit.begun) * RATE)
            pixels = scales[min(max(k, 0), len(scales) - 1)]
            joined = index["files"][step - 2]["joined"]
            size = joined["width"], joined["height"]
            return any(have < pixels * side for have, side in zip(size, original, strict=True))

        return steps(files, wanted, link, seconds)

    return Scene(folder.name, site, "", GROWN, scales[:, None].tolist(), simulated)


def scenes(given: Sequence[str], seconds: float) -> Iterator[Scene]:
    """The scenes of the arguments."""
    rest = [*given]
    while rest:
        folder = Path(rest.pop(0))
        form = folder_kind(folder)
        site = form_site(folder, form) if form else None
        if form and site and form.index != "campus.json":
            yield (octree if form.index == "apo.json" else picture)(folder, site, seconds)
        else:
            walk = read_walk(rest.pop(0))
            yield campus(folder, site, walk, seconds) if site else database(folder, walk, seconds)


@contextmanager
def chromium() -> Iterator[Any]:
    """Headless Chromium."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=web.chromium(), args=["--no-sandbox"])
        yield browser
        browser.close()


def text(there: float, here: float, digits: int) -> str:
    """A measure in the browser, in the simulator, and by how much they differ."""
    return f"{there:.{digits}f} | {here:.{digits}f} ({here / there - 1:+.1%})"


def main() -> None:
    """Prints a row for each scene and link."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("scene", nargs="+", help="folders; databases and campuses with walks")
    parser.add_argument("--bandwidth", default="512k,4M")
    parser.add_argument("--latency", default="100ms")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=40, help="of a visit")
    options = parser.parse_args()
    print("| | bit/s | requests | replayed | MB | replayed | s | replayed |")
    print("|---|--:" + "|--:" * 6 + "|")
    with chromium() as browser:
        for scene in scenes(options.scene, options.seconds):
            for bandwidth in options.bandwidth.split(","):
                link = Conditions(parse_bandwidth(bandwidth), parse_duration(options.latency))
                runs = []
                for _ in range(options.runs):
                    seen = visit(
                        browser, scene.site, scene.query, scene.place, scene.poses, link,
                        options.seconds,
                    )  # fmt: skip
                    runs.append((seen.traffic, scene.simulated(seen, link)))
                there, here = (
                    Traffic(*map(median, zip(*(run[k] for run in runs), strict=True)))
                    for k in (0, 1)
                )
                there, here = (t._replace(bytes=t.bytes / 1e6) for t in (there, here))
                cells = [text(a, b, d) for a, b, d in zip(there, here, (0, 3, 2), strict=True)]
                print(f"| {scene.name} | {bandwidth} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
