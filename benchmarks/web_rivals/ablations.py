"""Time until a view is complete without parts of the walk page, or with other options.

    python -m benchmarks.web_rivals.ablations [--scene museum,hospital] [--link 512k,4M]

Each line of `CHANGES` is one change of a site as `ptm publish` writes it by default: an option of
`publish`, or a database built with an option of `build-scene`, made below ``build/bench`` if it is
missing. Columns and runs as in ``python -m benchmarks.web_rivals``; the full picture is that of the
default.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "benchmarks")]

from scenes import BUILD, FOLDER, database_of, model_of, ptm  # noqa: E402

from benchmarks.web_rivals.__main__ import Desk, speed  # noqa: E402
from benchmarks.web_rivals.entrants import WALK, Entrant  # noqa: E402
from benchmarks.web_rivals.nginx import certificate  # noqa: E402
from benchmarks.web_rivals.results import Conditions  # noqa: E402
from benchmarks.web_rivals.tables import GOALS, goals_of  # noqa: E402
from benchmarks.web_rivals.timeline import chromium  # noqa: E402
from ptmtools.quantities import parse_duration  # noqa: E402
from ptmtools.site.content import SiteOptions, site_of  # noqa: E402
from ptmtools.site.throttle import Throttle  # noqa: E402

HTTP = "2"


@dataclass(frozen=True)
class Change:
    """Options that differ from the default: of `publish`, and of `build-scene`."""

    site: dict[str, Any] = field(default_factory=dict)
    build: tuple[str, ...] = ()


CHANGES = {
    "as published": Change(),
    "no previews": Change({"preview": False}),
    "previews of quality 50": Change(build=("--preview", "50")),
    "previews of quality 90": Change(build=("--preview", "90")),
    "previews as AVIF": Change(build=("--preview-format", "avif")),
    "no openings": Change({"opening": False}),
    "plain glTF": Change(build=("--plain-gltf",)),
    "no exact levels": Change({"exact": "never"}),
}


def main() -> None:
    """Prints a table for each scene."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.web_rivals.ablations")
    parser.add_argument("--scene", default="museum,hospital")
    parser.add_argument("--link", default="512k,4M", help="bit/s")
    parser.add_argument("--rtt", default="100ms", help="of a round trip")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--patience", type=float, default=30, help="seconds")
    given = parser.parse_args()
    way = parse_duration(given.rtt)
    links = [Throttle(speed(text), way) for text in given.link.split(",")]
    with certificate() as own, chromium(own) as browser:
        desk = Desk(browser, own, given.repeats, given.patience)
        for scene in given.scene.split(","):
            print(f"\n{scene}, HTTP/{HTTP}, {given.repeats} runs\n")
            for line in table(desk, scene, links):
                print(line, flush=True)


def table(desk: Desk, scene: str, links: list[Throttle]) -> Iterator[str]:
    """Its lines."""
    rates = [f"{(link.bandwidth or 0) / 1e6:g} Mbit/s" for link in links]
    heads = [f"{rate} {goal}" for rate in rates for goal in GOALS]
    yield f"| | site, MB | {' | '.join(heads)} |"
    yield "|---" + "|--:" * (len(heads) + 1) + "|"
    pages = {name: page_of(scene, name, change) for name, change in CHANGES.items()}
    full = desk.full_picture(next(iter(pages.values())))
    first: list[float | None] = []
    for name, page in pages.items():
        cells = [f"{sum(len(entry.read()) for entry in page.files.values()) / 1e6:.2f}"]
        times: list[float | None] = []
        for link in links:
            runs = [
                desk.run(page, Conditions(link, HTTP, k, desk.patience), desk.patience)
                for k in range(desk.repeats)
            ]
            reached = goals_of(runs, full)
            for goal in GOALS:
                at = reached[goal]
                times.append(at and at[0])
                cells.append(f"{at[0]:.1f} s, {at[1] / 1e6:.2f} MB" if at else "–")
        first = first or times
        for k, (own, default) in enumerate(zip(times, first, strict=True), 1):
            cells[k] += f" ({own / default:.2f} ×)" if own and default else ""
        yield f"| {name} | {' | '.join(cells)} |"


def page_of(scene: str, name: str, change: Change) -> Entrant:
    """The site with a change."""
    database = database_of(scene)
    if change.build:
        database = FOLDER / "ablations" / f"{scene}-{'-'.join(name.split())}.db"
        if not database.is_dir():
            part = database.with_suffix(".part")
            shutil.rmtree(part, ignore_errors=True)
            shutil.copytree(database_of(scene), part)
            ptm("build-scene", model_of(scene), "-o", part, *BUILD, *change.build)
            part.replace(database)
    files = site_of(database, SiteOptions(**change.site)).entries
    return Entrant(WALK, files, "window.ptm?.state().complete", steady=False)


if __name__ == "__main__":
    main()
