"""What the page takes of the main thread on a walk, what an upload blocks, and what memory does.

    python benchmarks/page_frames.py [DB…] [--seconds 40] [--minutes 10]

Each database is opened in headless Chromium and walked through as ``ptm path`` walks (the file
beside the database that is called ``NAME-1-150.json``, over and over). Milliseconds of each part of
our own work, wrapped from outside: n, mean, 99th percentile and longest; of calls within another
part only the inner one counts. *drawing* is what WebGL's calls that draw or wait for drawing take,
which here is done by software. *frame, rest* is what a frame takes beside all of these. Then long
tasks, and kB of the JavaScript heap, after a collection, and of textures and geometry at the end of
each minute (``--minutes``) or of the walk. Of times only histograms are kept, lest the heap grow by
them. On a machine that does other things the longest is what those took.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "benchmarks"), str(ROOT / "tests" / "viewer")]

import numpy as np  # noqa: E402
from browser import visiting  # noqa: E402
from walk_scenes import database_of  # noqa: E402

from ptmtools.viewer.site import SiteOptions, site_of  # noqa: E402
from tests.e2e.browsers import web  # noqa: E402

WIDTH, HEIGHT = 320, 240

#: Before the page: the clock of nested parts, and the calls of WebGL.
CLOCK = """
(() => {
  const parts = (window.parts = {}), open = [], tasks = (window.longTasks = { n: 0, longest: 0 });
  window.took = (name, ms) => {
    const part = (parts[name] ??= { n: 0, sum: 0, longest: 0, bins: new Array(1001).fill(0) });
    part.n++;
    part.sum += ms;
    part.longest = Math.max(part.longest, ms);
    part.bins[Math.min(Math.floor(10 * ms), 1000)]++;
  };
  window.timed = (name, f) => function (...given) {
    open.push(0);
    const begun = performance.now();
    try {
      return f.apply(this, given);
    } finally {
      const whole = performance.now() - begun, own = whole - open.pop();
      if (open.length) open[open.length - 1] += whole;
      took(name, own);
    }
  };
  window.wrap = (object, name, part) => { object[name] = timed(part, object[name]); };
  const gl = WebGL2RenderingContext.prototype;
  const drawing = ["drawElements", "drawArrays", "clear", "clearBufferfv", "readPixels", "flush",
                   "getBufferSubData", "getSyncParameter", "fenceSync", "bindFramebuffer",
                   "getProgramParameter", "linkProgram"];
  for (const name of drawing) wrap(gl, name, "drawing");
  wrap(gl, "texSubImage2D", "upload call");
  wrap(gl, "texStorage2D", "storage call");
  wrap(gl, "bufferData", "bufferData call");
  wrap(JSON, "parse", "parsing JSON");
  const frames = window.requestAnimationFrame;
  window.requestAnimationFrame = (f) => frames.call(window, timed("frame, rest", f));
  const { set } = Object.getOwnPropertyDescriptor(Worker.prototype, "onmessage");
  Object.defineProperty(Worker.prototype, "onmessage", {
    set(f) { set.call(this, timed("messages of workers", f)); },
  });
  new PerformanceObserver((list) => {
    for (const { duration } of list.getEntries()) {
      tasks.n++;
      tasks.longest = Math.max(tasks.longest, duration);
    }
  }).observe({ entryTypes: ["longtask"] });
})();
"""

#: Once the page is there: its parts.
PARTS = """
(() => {
  const { walk, walker, solids } = window.ptm, { client, stream, memory, renderer, items } = walk;
  const of = (object) => Object.getPrototypeOf(object);
  wrap(of(walker), "step", "walker step");
  wrap(of(solids), "add", "solids");
  if (solids.grow) wrap(of(solids), "grow", "solids");
  wrap(of(renderer), "add", "geometry to the GPU");
  wrap(of(renderer), "draw", "calls that draw");
  wrap(of(items), "draw", "calls of the item buffer");
  wrap(of(items), "poll", "reading the item buffer");
  wrap(of(client), "sees", "what is seen");
  wrap(of(client), "look", "look: allocation");
  wrap(of(client), "missing", "what is missing");
  wrap(of(client), "next", "next: requests");
  wrap(of(client), "learnRecord", "records and shapes learned");
  wrap(of(client), "learnGeometry", "records and shapes learned");
  wrap(of(walk.locator), "learn", "records and shapes learned");
  wrap(of(walk.locator), "locate", "locating");
  wrap(of(memory), "settle", "texture memory");
  wrap(of(memory), "pump", "texture memory");
  wrap(of(walk), "state", "numbers of the overlay");
  wrap(of(stream.files[0]), "append", "bytes of textures");
  // Between a body and what is told of it lies the reading of it.
  const { fetcher } = walk, { whole } = fetcher, { arrived } = client;
  let since = 0;
  fetcher.whole = (...given) =>
    whole.apply(fetcher, given).then((body) => ((since = performance.now()), body));
  client.arrived = (request, ...more) => {
    // Not of what was on its way before this.
    if (since && request.kind !== "texture") {
      took(`reading ${request.kind}`, performance.now() - since);
    }
    since = 0;
    return arrived.call(client, request, ...more);
  };
  document.querySelector("nav [aria-controls=details]").click();
})()
"""


def walk_of(database: Path) -> list[dict[str, Any]]:
    """Poses of the page, ten a second."""
    file = database.with_name(f"{database.stem}-1-150.json")
    samples = json.loads(file.read_text())["samples"]
    return [{"eye": row[1:4], "along": row[4:7]} for row in samples]


WALK = """
(samples) => {
  const begun = performance.now();
  const step = () => {
    const at = Math.floor((performance.now() - begun) / 100) % samples.length;
    const { eye, along: [x, y, z] } = samples[at];
    window.ptm.goTo({ eye: [...eye], yaw: Math.atan2(-x, -z), pitch: Math.asin(y) });
  };
  setInterval(step, 50);
}
"""


#: Bins of a millisecond.
BINS = 10


def report(parts: dict[str, dict[str, Any]], tasks: dict[str, float]) -> None:
    """Prints the table of parts."""
    print("| ms | n | mean | 99 % | longest |\n|---|--:|--:|--:|--:|")
    for name, part in sorted(parts.items(), key=lambda row: -row[1]["longest"]):
        upto = np.cumsum(part["bins"])
        late = min((np.searchsorted(upto, 0.99 * part["n"]) + 1) / BINS, part["longest"])
        mean = part["sum"] / part["n"]
        print(f"| {name} | {part['n']} | {mean:.2f} | {late:.1f} | {part['longest']:.1f} |")
    print(f"\nlong tasks: {tasks['n']}, the longest {tasks['longest']:.0f} ms")


def memory(page: Any, session: Any) -> str:
    """kB of the heap, of textures, of geometry."""
    session.send("HeapProfiler.collectGarbage")
    heap = session.send("Runtime.getHeapUsage")["usedSize"]
    state = page.evaluate("window.ptm.state()")
    numbers = (heap, state["residentBytes"], state["geometryBytes"])
    return ", ".join(f"{number / 1024:.0f}" for number in numbers)


def main() -> None:
    """Walks through each database."""
    from playwright.sync_api import sync_playwright

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    default = [database_of("museum"), database_of("hospital")]
    parser.add_argument("databases", nargs="*", type=Path, default=default)
    parser.add_argument("--seconds", type=float, default=40)
    parser.add_argument("--minutes", type=int, default=0)
    given = parser.parse_args()
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=web.chromium(), args=["--no-sandbox"])
        for database in given.databases:
            entries = site_of(database, SiteOptions(pictures=False)).entries
            with visiting(
                browser,
                entries,
                width=WIDTH,
                height=HEIGHT,
                prepare=lambda page: page.add_init_script(CLOCK),
            ) as visitor:
                visitor.until("s.cell >= 0 && window.ptm")
                page = visitor.page
                page.evaluate(PARTS)
                page.evaluate(WALK, walk_of(database))
                session = page.context.new_cdp_session(page)
                print(f"\n{database.stem}\n")
                kept = []
                for _ in range(given.minutes or 1):
                    time.sleep(60 if given.minutes else given.seconds)
                    kept.append(memory(page, session))
                report(page.evaluate("window.parts"), page.evaluate("window.longTasks"))
                print("kB of heap, textures, geometry: " + "; ".join(kept))
        browser.close()


if __name__ == "__main__":
    main()
