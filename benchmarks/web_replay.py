"""Walks in a browser, and again in the simulator: ``python benchmarks/web_replay.py DB WALK``

Headless Chromium opens the site of a database over a throttled server with an empty cache, stands
at the first viewpoint, then goes along a walk of `ptm path`, pose by pose at the time each is due.
What the page recorded (`window.ptm.recording`) is replayed by the simulator. Printed for both, as
medians over the runs: requests and bytes of what the client asked for, as the server saw them, and
the seconds since navigation until the picture of who stands at the viewpoint is within FLIP 0.01 of
the full one; both pictures are the simulator's, of the levels that were in texture memory.
With ``--requests N`` the first requests side by side, of the last run.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import statistics
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from at_hand import ROOT

sys.path[:0] = [str(ROOT), str(ROOT / "tests/viewer")]
from browser import visiting  # noqa: E402

from ptmtools.quantities import parse_bandwidth, parse_duration  # noqa: E402
from ptmtools.server.throttle import Throttle  # noqa: E402
from ptmtools.viewer.site import Site, SiteOptions, site_of  # noqa: E402
from ptmtools.walkthrough.client import Client, Kind  # noqa: E402
from ptmtools.walkthrough.flip import flip  # noqa: E402
from ptmtools.walkthrough.network import Conditions  # noqa: E402
from ptmtools.walkthrough.policies import POLICIES, Declared  # noqa: E402
from ptmtools.walkthrough.served import Served, read_served  # noqa: E402
from ptmtools.walkthrough.simulation import Run, simulate  # noqa: E402
from ptmtools.walkthrough.view.pyramids import read_pyramids  # noqa: E402
from ptmtools.walkthrough.view.records import Pyramids  # noqa: E402
from ptmtools.walkthrough.view.render import Renderer  # noqa: E402
from ptmtools.walkthrough.walk import Walk, parse_walk, read_walk  # noqa: E402
from ptmtools.walkthrough.world import World, prepare  # noqa: E402
from tests.e2e.browsers import web  # noqa: E402

#: FLIP of a picture that counts as the full one. Lines of it. Poses a second of the walk.
ENOUGH, LINES, RATE = 0.01, 240, 20
#: Walks along poses, notes what is in texture memory, and records, all from the first frame on.
SCRIPT = """
const walk = %s, held = (window.held = []);
let app = null, begun = 0, last = -1, noted = "";
Object.defineProperty(window, "ptm", { get: () => app, set(made) {
  app = made;
  app.record();
  begun = performance.now();
  const step = () => {
    const due = Math.floor((performance.now() - begun) / 1000 * walk.rate);
    if (due >= walk.from && due !== last && due < walk.from + walk.poses.length) {
      const [x, y, z, yaw, pitch] = walk.poses[(last = due) - walk.from];
      app.goTo({ eye: [x, y, z], yaw, pitch });
    }
    const { memory, renderer, client } = app.walk;
    const here = JSON.stringify([[...memory.held], [...renderer.cells.keys()], [...client.column]]);
    if (here !== noted) held.push([performance.now() / 1000, ...JSON.parse((noted = here))]);
    requestAnimationFrame(step);
  };
  requestAnimationFrame(step);
} });
"""


@dataclass(frozen=True)
class Asked:
    """A request: what it was for, when it was made, s since navigation."""

    time: float
    kind: str
    number: int
    begin: int
    end: int

    def __str__(self) -> str:
        part = f" {self.begin}-{self.end}" if self.kind == "texture" else ""
        return f"{self.time:7.3f} {self.kind} {self.number}{part}"


#: When, s, so many levels of each texture (T,), and whose geometry (C,).
Shown = list[tuple[float, np.ndarray[Any, Any], np.ndarray[Any, Any]]]


@dataclass(frozen=True)
class Walked:
    """A walk, in the browser or in the simulator.

    Attributes
    ----------
    asked: what the client asked for. bytes: of bodies that came of it.
    shown, chosen: what was in texture memory, and what the client had chosen of what was there.
    """

    asked: list[Asked]
    bytes: float
    shown: Shown
    chosen: Shown


def in_browser(
    browser: Any, site: Site, walk: Walk, throttle: Throttle, stand: float, seconds: float
) -> tuple[Any, Walked, float]:
    """A walk there: the recording, what came of it, and frames a second."""
    eye, direction = walk.at(np.arange(0, seconds - stand, 1 / RATE))
    yaw = np.arctan2(-direction[:, 0], -direction[:, 2])
    pitch = np.arcsin(np.clip(direction[:, 1], -1, 1))
    poses = np.column_stack([eye, yaw, pitch]).tolist()
    script = SCRIPT % json.dumps({"rate": RATE, "from": round(stand * RATE), "poses": poses})

    def prepare_page(page: Any) -> None:
        page.add_init_script(script)

    with visiting(
        browser, site.entries, width=320, height=240, throttle=throttle, prepare=prepare_page,
        reduced_motion="reduce",
    ) as visitor:  # fmt: skip
        visitor.page.wait_for_function("window.ptm", timeout=60_000)
        time.sleep(seconds)
        found = visitor.page.evaluate(
            "({ recording: ptm.recording, held: window.held, origin: performance.timeOrigin })"
        )
        now, wall = time.monotonic(), time.time()
        recording = parse_walk(json.dumps(found["recording"]).encode())
        last = recording.browser.begun + recording.duration
        visits = [
            (v.begun - now + wall - found["origin"] / 1000, v.path, v.range, v.bytes)
            for v in visitor.visits
        ]
        messages = visitor.messages
    if messages:
        print("the page said", messages, file=sys.stderr)
    asked, received = [], 0
    names = _names(site)
    for begun, path, span, count in visits:
        if begun > last or path.removeprefix("/") not in names:
            continue
        kind, number = names[path.removeprefix("/")]
        begin, end = (int(x) for x in span.removeprefix("bytes=").split("-")) if span else (0, 0)
        asked.append(Asked(begun, kind, number, begin, end + 1))
        received += count
    shown = []
    chosen = []
    for at, held, cells, column in found["held"]:
        there = np.zeros(len(site.index["cells"]), dtype=np.bool_)
        there[cells] = True
        shown.append((at, np.array(held, np.int64), there))
        chosen.append((at, np.array(column, np.int64), there))
    return (
        found["recording"],
        Walked(asked, received, shown, chosen),
        len(recording.time) / recording.duration,
    )


def _names(site: Site) -> dict[str, tuple[str, int]]:
    """What each file of the data is."""
    found = {name: ("index", 0) for name in site.entries if name.startswith("data/index-")}
    for number, row in enumerate(site.index["cells"]):
        found |= {f"data/{row[kind]}": (kind, number) for kind in ("record", "geometry")}
    for number, row in enumerate(site.index["textures"]):
        found[f"data/{row['file']}"] = ("texture", number)
    return found


def in_simulator(world: World, link: Conditions) -> Walked:
    """The same walk there."""
    assert world.browser
    asked: list[Asked] = []

    def client(*given: Any) -> Client:
        made = POLICIES[world.browser.policy].client(*given)
        ask = made.ask

        def noted(kind: Kind, number: int, end: int, priority: float) -> None:
            begin = int(made.files[kind].asked[number])
            asked.append(Asked(made.link.now, kind.name.lower(), number, begin, end))
            ask(kind, number, end, priority)

        vars(made).update(ask=noted)
        return made

    declared = POLICIES[world.browser.policy]
    policy = Declared(declared.name, declared.about, declared.knows, client)
    run = simulate(world, policy, link, world.browser.budget)
    shown = list(_changes(run))
    return Walked(asked, run.body, shown, shown)


def _changes(run: Run) -> Iterator[tuple[float, Any, Any]]:
    for f in range(len(run.time)):
        if (
            not f
            or (run.column[f] != run.column[f - 1]).any()
            or run.there[f].sum() != run.there[f - 1].sum()
        ):
            yield float(run.time[f]), run.column[f], run.there[f]


class Eyes:
    """Judges pictures of who stands where a walk begins."""

    def __init__(self, world: World) -> None:
        self._renderer = Renderer(world, LINES)
        self._sight = self._renderer.look(world.eye[0], world.direction[0])
        self._full = self._renderer.full(self._sight)
        self._known: dict[bytes, float] = {}

    def satisfied(self, shown: Shown, until: float) -> float:
        """When the picture was as good as the full one, s; NaN if it was not by then."""
        for at, column, there in shown:
            if at > until:
                break
            key = column.tobytes() + there.tobytes()
            if key not in self._known:
                shown = self._renderer.colors(self._sight, there, column)
                self._known[key] = flip(self._full, shown)
            if self._known[key] <= ENOUGH:
                return at
        return math.nan


def compare(
    name: str, browser: Any, site: Site, scene: tuple[Served, Pyramids], walk: Walk,
    link: Conditions, options: argparse.Namespace,
) -> None:  # fmt: skip
    """Prints a row for each run, and one of medians."""
    rows = []
    for number in range(options.runs):
        load = os.getloadavg()[0]
        document, there, rate = in_browser(
            browser,
            site,
            walk,
            Throttle(link.bandwidth, link.latency),
            options.stand,
            options.seconds,
        )
        if options.keep:
            file = options.keep / f"{name}-{link.bandwidth:.0f}-{number}.json"
            file.write_text(json.dumps(document))
        recording = parse_walk(json.dumps(document).encode())
        world = prepare(scene[0], recording, scene[1])
        here = in_simulator(world, link)
        eyes, begun = Eyes(world), recording.browser.begun
        until = begun + options.stand
        row = [
            (
                len(w.asked),
                w.bytes / 1e6,
                eyes.satisfied(w.shown, until),
                eyes.satisfied(w.chosen, until),
            )
            for w in (there, here)
        ]
        rows.append(row)
        print(
            f"{name:10} {link.bandwidth:9.0f} {_text(row)}  {rate:4.1f} frames/s, load {load:.1f}",
            flush=True,
        )
    median = [
        tuple(map(statistics.median, zip(*(r[k] for r in rows), strict=True))) for k in (0, 1)
    ]
    print(f"{name:10} {link.bandwidth:9.0f} {_text(median)}  median", flush=True)
    for a, b in zip(there.asked[: options.requests], here.asked, strict=False):
        print(f"    {a!s:40} {b!s}")


def _text(row: Sequence[Sequence[float]]) -> str:
    there, here = row
    return "  ".join(
        f"{a:8.3f} {b:8.3f} {b / a - 1:+7.1%}" for a, b in zip(there, here, strict=True)
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("scene", nargs="+", metavar="DB WALK", help="databases and walks in turn")
    parser.add_argument("--bandwidth", default="512k,4M")
    parser.add_argument("--latency", default="100ms")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--stand", type=float, default=10, help="s at the first viewpoint")
    parser.add_argument("--seconds", type=float, default=40, help="of a run")
    parser.add_argument("--requests", type=int, default=0, help="of each to be printed")
    parser.add_argument("--keep", type=Path, help="folder for recordings")
    options = parser.parse_args()
    from playwright.sync_api import sync_playwright

    print(
        "scene      bit/s: browser, simulator, ratio of requests, MB, s to FLIP",
        ENOUGH,
        "in texture memory and as chosen",
    )
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=web.chromium(), args=["--no-sandbox"])
        for database, walk in zip(options.scene[::2], options.scene[1::2], strict=True):
            served = read_served(database)
            scene = served, read_pyramids(served)
            site = site_of(database, SiteOptions(pictures=False))
            for bandwidth in options.bandwidth.split(","):
                link = Conditions(parse_bandwidth(bandwidth), parse_duration(options.latency))
                name = Path(database).stem
                compare(name, browser, site, scene, read_walk(walk), link, options)
        browser.close()


if __name__ == "__main__":
    main()
