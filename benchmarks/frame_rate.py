"""Frames per second in a browser, without a limit of the link.

    python benchmarks/frame_rate.py [museum | DB | FOLDER]… [--budgets 4 8 16 32 64]
    python benchmarks/frame_rate.py DB --angle gl-egl                 on a graphics card

Databases (Marvie & Bouatouch 2003, §7 and Figure 2, bottom): a walk with many turns, by `ptm path`
or the recording `--walk`, is played twice in each page; the first time loads all that it needs, and
the second one is measured. `whole` is what a page without levels of detail does: each texture in
view is in texture memory whole, or is uploaded when it is drawn, and the least recently drawn one
leaves; one that is larger than the budget has its mean colour. `best` and `paper` keep to the same
budget by levels of detail.

Folders of `ptm apo` (Lacoste et al., Table 1): one turn around the object, with all levels that the
screen can show. Folders of `ptm campus` (Chart 4 of their paper): the walk `--walk` by each
preset.

Prints of each row the median and the 5th percentile of the frames per second, over windows of a
second; both as ratios to `whole` of the same budget; frames longer than 50 ms and the longest one;
texels uploaded in a second, and the share of the time that the calls take; and what drew. Draws the
frames per second over time into `build/bench/frame_rate`.

The page draws at the full resolution of the window: it does not draw fewer pixels when it is slow.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "benchmarks"), str(ROOT / "tests" / "e2e")]

from browsers import web  # noqa: E402
from scenes import SAMPLES, SCENES, database_of, make_scene, ptm  # noqa: E402

from ptmtools.errors import PtmError  # noqa: E402
from ptmtools.folder_kinds import folder_kind  # noqa: E402
from ptmtools.site.content import Site, SiteOptions, site_of  # noqa: E402
from ptmtools.site.forms import form_site  # noqa: E402
from ptmtools.site.serving import serving  # noqa: E402
from ptmtools.walk import Walk, read_walk  # noqa: E402

Floats = NDArray[np.float64]
SCRIPT = Path(__file__).with_suffix(".js")
BUDGETS, POLICIES = (4, 8, 16, 32, 64), ("whole", "best", "paper")
PEER, SOFTWARE = POLICIES[0], "swiftshader"
#: s of a window in which frames are counted, and between two windows; s of a frame that stalls.
WINDOW, STEP, STALL = 1.0, 0.1, 0.05
#: The visitor looks left and right: radians, and s of a period.
SWING, PERIOD = np.radians(100), 5.0
#: s of a stop before a picture: the way is to lead through many rooms.
BRIEF = 0.5
#: s without a request after which nothing more is on its way; the longest waits for this, and for
#: the beginning.
IDLE, PATIENCE, BEGINNING = 1.0, 300.0, 120.0
#: Degrees of the turn around an object, and of its elevation.
TURN, ELEVATION = 360.0, 15.0
UNSHOWN = """\
Not shown: the card of the paper had 64 MB and read other textures over its AGP bus. Here the budget
of the page stands for the memory of the card, and an upload for a transfer over the bus. A card
whose memory holds the scene is never short of it, and its bus is faster. With software rendering
texture memory is main memory: an upload is a copy, and drawing takes most of the time of a large
picture."""


class Pace(NamedTuple):
    """Frames per second of a played way: median, 5th percentile; frames over `STALL`, and the
    longest frame, s; MiB of texels that were uploaded in a second, and s of the calls in it."""

    median: float
    low: float
    stalls: int
    longest: float
    upload: float
    upload_time: float


def rates(time: Floats) -> tuple[Floats, Floats]:
    """(m,) middles of windows, s, and (m,) frames per second in them, of (n,) times of frames. A
    frame counts by the share of it that lies in a window: so the rate of slow frames is exact."""
    duration = float(time[-1] - time[0])
    window = min(WINDOW, duration)
    begin = time[0] + np.arange(0.0, duration - window + 1e-9, STEP)
    count = np.arange(len(time), dtype=np.float64)
    frames = np.interp(begin + window, time, count) - np.interp(begin, time, count)
    return begin - time[0] + window / 2, frames / window


def pace_of(frames: Floats) -> Pace:
    """The `Pace` of (n, 3) frames: s, and bytes and ms of uploads until then."""
    time, length = frames[:, 0], np.diff(frames[:, 0])
    each = rates(time)[1]
    seconds = float(time[-1] - time[0])
    megabytes, busy = (frames[-1, 1:] - frames[0, 1:]) / (2**20, 1000)
    return Pace(
        float(np.median(each)),
        float(np.percentile(each, 5)),
        int((length > STALL).sum()),
        float(length.max()),
        float(megabytes) / seconds,
        float(busy) / seconds,
    )


def way_of(walk: Walk, seconds: float, swing: float = SWING) -> Floats:
    """(n, 6) s, eye, yaw and pitch, radians, of the beginning of a walk; the visitor looks to both
    sides of where the walk looks."""
    time = np.arange(0.0, min(seconds, walk.duration) + 1e-9, 0.1)
    eye, (x, y, z) = walk.at(time)[0], walk.at(time)[1].T
    yaw = np.unwrap(np.arctan2(-x, -z)) + swing * np.sin(2 * np.pi * time / PERIOD)
    return np.column_stack([time, eye, yaw, np.arcsin(np.clip(y, -1, 1))])


@dataclass(frozen=True)
class Page:
    """A page and how it is played.

    Attributes
    ----------
    name: of the row. query: behind the URL. way: rows of s and numbers for `place`.
    place: a function of JavaScript. prepare: is run once the page is `ready`. idle: a condition.
    """

    name: str
    query: str
    way: Floats
    place: str
    ready: str
    idle: str
    prepare: str = ""


def pages_of_database(way: Floats, budgets: Sequence[int], policies: Sequence[str]) -> list[Page]:
    return [
        Page(
            f"{policy}, {budget} MiB",
            f"?policy={policy}&memory={budget}",
            way,
            "(x, y, z, yaw, pitch) => ptm.walker.place({ eye: [x, y, z], yaw, pitch })",
            "window.ptm?.walk.begun && ptm.walk.viewport.full",
            "ptm.state().pending === 0",
            # The way is exact, and each picture has all pixels.
            "ptm.walker.step = () => {}; ptm.walk.viewport.settle = () => false;",
        )
        for budget in budgets
        for policy in policies
    ]


def pages_of_octree(seconds: float) -> list[Page]:
    way = np.array([[0, 0, ELEVATION], [seconds, TURN, ELEVATION]])
    idle = "ptm.state().complete || ptm.state().paused"
    place = "(azimuth, elevation) => ptm.place(azimuth, elevation)"
    return [Page("octree", "", way, place, "window.ptm", idle)]


def pages_of_campus(way: Floats, presets: Sequence[str]) -> list[Page]:
    place = "(x, y, z, yaw, pitch) => ptm.place([x, y, z], yaw, pitch)"
    return [
        Page(name, f"?preset={name}", way, place, "window.ptm?.state().begun",
             "ptm.state().pending === 0")
        for name in presets
    ]  # fmt: skip


def played(browser: Any, site: Site, page: Page, *, size: tuple[int, int]) -> tuple[Floats, str]:
    """(n, 3) frames of a page the second time that its way is played, and what drew them.

    Raises RuntimeError with the text of the page if it never becomes ready.
    """
    from playwright.sync_api import TimeoutError as TooLong

    context = browser.new_context(viewport={"width": size[0], "height": size[1]}, bypass_csp=True)
    try:
        tab = context.new_page()
        tab.add_init_script(path=SCRIPT)
        with serving(site.entries) as url:
            tab.goto(url + page.query)
            try:
                tab.wait_for_function(page.ready, timeout=1000 * BEGINNING)
            except TooLong as fault:
                raise RuntimeError(
                    f"{page.name} does not begin: {tab.inner_text('body')}"
                ) from fault
            tab.evaluate(page.prepare)
            play = f"(way) => play(way, {page.place})"
            tab.evaluate(play, page.way.tolist())
            tab.wait_for_function(
                f"({page.idle}) ? performance.now() - (window.since ??= performance.now()) > "
                f"{1000 * IDLE} : (window.since = undefined)",
                timeout=1000 * PATIENCE,
            )
            frames = np.array(tab.evaluate(play, page.way.tolist()), dtype=np.float64)
            return frames, str(tab.evaluate("rendererName()"))
    finally:
        context.close()


@contextmanager
def chromium(options: argparse.Namespace) -> Iterator[Any]:
    """A browser that draws as the options say."""
    from playwright.sync_api import sync_playwright

    flags = [f for f in web.FLAGS if f != "--headless" and "swiftshader" not in f]
    flags += [f"--use-angle={options.angle}", "--hide-scrollbars"]
    flags += [
        "--enable-unsafe-swiftshader" if options.angle == SOFTWARE else "--ignore-gpu-blocklist"
    ]
    if options.uncapped:
        flags += ["--disable-frame-rate-limit", "--disable-gpu-vsync"]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=web.chromium(), args=flags, headless=not options.headed
        )
        try:
            yield browser
        finally:
            browser.close()


HEAD = "| {} | frames/s | 5 % | ratios | > 50 ms | longest | uploads, MiB/s | their time |"


def row(page: Page, own: Pace, peer: Pace | None) -> str:
    """A row of the table; the ratios are those of the medians and of the 5th percentiles."""
    ratios = f"{own.median / peer.median:.2f}, {own.low / peer.low:.2f}" if peer else "–"
    return (
        f"| {page.name} | {own.median:.1f} | {own.low:.1f} | {ratios} | {own.stalls} "
        f"| {1000 * own.longest:.0f} ms | {own.upload:.1f} | {own.upload_time:.1%} |"
    )


def plot(title: str, lines: Sequence[tuple[Page, Floats]], file: Path) -> None:
    """Frames per second over time: pages of one budget share a diagram."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    groups: dict[str, list[tuple[str, Floats]]] = {}
    for page, frames in lines:
        name, _, group = page.name.partition(", ")
        groups.setdefault(group, []).append((name, frames))
    figure, axes = plt.subplots(
        len(groups), 1, figsize=(8, 0.6 + 2.0 * len(groups)), squeeze=False, sharex=True
    )
    top = max(float(rates(frames[:, 0])[1].max()) for _, frames in lines)
    for ax, (group, some) in zip(axes[:, 0], groups.items(), strict=True):
        for name, frames in some:
            ax.plot(*rates(frames[:, 0]), label=name, linewidth=1.2)
        ax.set_ylim(0, 1.2 * top)
        ax.set_title(group, fontsize=9, loc="left")
        ax.set_ylabel("frames/s", fontsize=8)
        ax.grid(alpha=0.3)
    axes[0, 0].legend(fontsize=8, loc="upper right", ncols=4)
    axes[-1, 0].set_xlabel("s", fontsize=8)
    figure.suptitle(title, fontsize=10)
    figure.tight_layout()
    figure.savefig(file, dpi=120)
    plt.close(figure)


def opened(given: str, options: argparse.Namespace) -> tuple[Site, list[Page]]:
    """The site of a scene, database or folder, and its pages.

    Raises PtmError if it cannot be read, or a campus comes without a walk.
    """
    folder = Path(given)
    if form := folder_kind(folder):
        site = form_site(folder, form)
        if form.index == "apo.json":
            return site, pages_of_octree(options.seconds)
        if form.index != "campus.json" or not options.walk:
            message = "is no folder of `ptm apo`, nor of `ptm campus` with --walk"
            raise PtmError("PTM-I122", message, file=folder)
        way = way_of(read_walk(options.walk), options.seconds, swing=0.0)
        # Those of the same sizes differ by the cache alone.
        presets = {
            (one["diffuse"], one["light"]): one["name"] for one in site.index["presets"][::-1]
        }
        return site, pages_of_campus(way, [*presets.values()][::-1])
    database = folder
    if given in (*SCENES, *SAMPLES):
        make_scene(given)
        database = database_of(given)
    site, walk = site_of(database, SiteOptions(pictures=False)), options.walk
    if not walk:
        walk = options.output / f"{folder.stem}.json"
        words = ("--duration", options.seconds, "--stop", BRIEF, "--force")
        ptm("path", database, "-o", walk, *words)
    way = way_of(read_walk(walk), options.seconds, swing=0.0 if options.walk else SWING)
    return site, pages_of_database(way, options.budgets, options.policies)


def lines_of(
    title: str, pages: Sequence[Page], play: Callable[[Page], tuple[Floats, str]], file: Path
) -> Iterator[str]:
    """The table of a site, line by line, and its plot."""
    peers: dict[str, Pace] = {}
    drawn: list[tuple[Page, Floats]] = []
    names: set[str] = set()
    yield HEAD.format(title)
    yield "|---" + "|--:" * (HEAD.count("|") - 2) + "|"
    for page in pages:
        frames, name = play(page)
        names.add(name)
        drawn.append((page, frames))
        policy, _, group = page.name.partition(", ")
        own = pace_of(frames)
        if policy == PEER:
            peers[group] = own
        yield row(page, own, peers.get(group))
    plot(title, drawn, file)
    yield f"\nDrawn by {', '.join(sorted(names))}; plot: {file}\n"


def sides(text: str) -> tuple[int, int]:
    """Width and height, pixels. Raises ValueError if the text names none."""
    width, height = (int(side) for side in text.split("x"))
    return width, height


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="Frames per second in a browser.")
    add = parser.add_argument
    add("given", nargs="*", default=["museum"], metavar="SCENE", help="scene, database or folder")
    add("--budgets", type=int, nargs="+", default=BUDGETS, metavar="MIB", help="texture memory")
    add("--policies", nargs="+", default=POLICIES, choices=POLICIES)
    add("--seconds", type=float, default=60.0, help="of the walk (default 60)")
    add("--walk", type=Path, help="walk of `ptm path`, or a recording of the page; played as it is")
    add("--size", type=sides, default="1280x1024", metavar="WIDTHxHEIGHT",
        help="of the window (default 1280x1024)")  # fmt: skip
    add("--headed", action="store_true", help="show the window")
    add("--angle", default=SOFTWARE, metavar="NAME",
        help="what draws: swiftshader (default), gl, gl-egl, vulkan, metal, d3d11")  # fmt: skip
    add("--uncapped", action="store_true",
        help="more frames than the screen shows, by software")  # fmt: skip
    add("-o", "--output", type=Path, default=ROOT / "build/bench/frame_rate", metavar="DIR")
    options = parser.parse_args(arguments)
    if web.chromium() is None:
        parser.exit(1, "frame_rate: apt install chromium\n")
    options.output.mkdir(parents=True, exist_ok=True)
    with chromium(options) as browser:
        for given in options.given:
            try:
                site, pages = opened(given, options)
            except PtmError as error:
                parser.exit(error.exit_status, f"frame_rate: {error}\n")
            title = f"{Path(given).stem}, {options.size[0]} × {options.size[1]}"
            file = options.output / f"{Path(given).stem}.png"
            play = partial(played, browser, site, size=options.size)
            try:
                for line in lines_of(title, pages, play, file):
                    print(line, flush=True)
            except RuntimeError as error:
                parser.exit(1, f"frame_rate: {error}\n")
            if not folder_kind(Path(given)):
                print(UNSHOWN, end="\n\n", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
