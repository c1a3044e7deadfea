"""Time until a view is complete, for the walk page and for usual alternatives.

    python -m benchmarks.web_rivals [--scene museum,atrium] [--link 512k,4M] [--http 1.1,2]
                                    [--entrant ptm,glb-png]
    python -m benchmarks.web_rivals --round-trips [--scene museum]
    python -m benchmarks.web_rivals --memory [--scene museum]
    python -m benchmarks.web_rivals.bytes

Of each page (``entrants.py``), opened at the first viewpoint of a scene (``benchmarks/scenes.py``,
or the path of a database) over a link (``link.py``) from nginx (``nginx.py``), with an empty cache:
seconds and bytes until (a) FLIP is at most 0.05 for good, (b) at most 0.01, (c) the page has all
that it asks for; FLIP at the end; requests. FLIP is against the full picture with all texels exact,
as the page's own renderer draws it. In parentheses: how many times as long as the walk page, or
else as the best. Medians of ``--repeats`` runs.

A page is looked at for ``--patience`` seconds, the walk page for ``--walk-patience``, three times
as long if that is not given. What takes longer is computed from the run over the next faster link,
for pages that ask for the same in the same order whatever the link is: its bytes take as much
longer, and nothing else changes.

Runs are kept (``results.py``): stopped and started again, the benchmark continues. Tables are
printed scene by scene, and at the end one with the walk page beside the best of the rivals, by
scene and link. ``--common`` measures the walk page, too, from three.js's full picture.
``--round-trips`` prints instead by how many round trips a longer way of `WAYS` delays each goal,
over the fastest link; ``--memory``, FLIP in so much texture memory (``memory.py``).
"""

from __future__ import annotations

import argparse
import math
import signal
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "benchmarks")]

from render import load  # noqa: E402
from scenes import database_of, model_of  # noqa: E402

from benchmarks.web_rivals import memory  # noqa: E402
from benchmarks.web_rivals.entrants import (  # noqa: E402
    LOSSLESS,
    RIVALS,
    SOURCE,
    WALK,
    WALKS,
    Entrant,
    Subject,
    require,
    rival,
    walk_page,
)
from benchmarks.web_rivals.nginx import HTTP, Certificate, certificate  # noqa: E402
from benchmarks.web_rivals.results import Conditions, kept  # noqa: E402
from benchmarks.web_rivals.tables import (  # noqa: E402
    Reached,
    goals_of,
    memory_table,
    round_trips_table,
    summary_table,
    times_table,
)
from benchmarks.web_rivals.timeline import (  # noqa: E402
    Picture,
    Timeline,
    chromium,
    difference,
    watch,
)
from ptmtools.output.served import read_served  # noqa: E402
from ptmtools.quantities import parse_bandwidth, parse_duration  # noqa: E402
from ptmtools.site.throttle import Throttle  # noqa: E402

SCENES = ("museum", "rooms", "hospital", "office", "web_gallery", "atrium")
LINKS = ("512k", "4M", "16M")
#: Of the second table, bytes; the last holds everything.
BUDGETS = tuple(kib << 10 for kib in (256, 512, 1024, 2048, 4096, 8192, 16384, 1 << 30))
#: How many times as long the walk page is looked at, since nothing of it is computed.
LONGER = 3
#: s at most over the fastest link.
WHOLE = 600.0
#: s of a round trip, near and far.
WAYS = (0.05, 0.35)
#: Over which full pictures are drawn.
FAST = Throttle(None, 0.0)


@dataclass(frozen=True)
class Desk:
    """What runs share: the browser, the certificate that it accepts, and the numbers given; by
    default the walk page has `LONGER` times the patience."""

    browser: Any
    own: Certificate
    repeats: int
    patience: float
    walk_patience: float | None = None

    def run(self, entrant: Entrant, conditions: Conditions, seconds: float) -> Timeline:
        """A timeline, kept or new."""

        def measure() -> Timeline:
            print(f"{entrant.name}: {conditions}", file=sys.stderr, flush=True)
            http = conditions.http
            return watch(
                self.browser, entrant, conditions.link, self.own, http=http, seconds=seconds
            )

        actual = kept(entrant, conditions, measure)
        for message in actual.messages:
            if not message.startswith("debug:"):
                print(f"{entrant.name}: {message}", file=sys.stderr)
        return actual

    def full_picture(self, entrant: Entrant) -> Picture:
        """The last picture of a page that has all texels."""
        return self.run(entrant, Conditions(FAST, HTTP[0], 0, WHOLE), WHOLE).full


def main() -> None:
    """Prints the tables."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.web_rivals")
    parser.add_argument("--scene", default=",".join(SCENES), help="names, or paths of databases")
    parser.add_argument("--link", default=",".join(LINKS), help="bit/s")
    parser.add_argument("--http", default=",".join(HTTP))
    parser.add_argument("--entrant", default=",".join((WALK, *RIVALS)))
    parser.add_argument("--rtt", default="100ms", help="of a round trip")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--patience", type=float, default=60, help="seconds")
    parser.add_argument("--walk-patience", type=float, help="seconds")
    parser.add_argument("--reference", type=Path, help="a database with all exact levels")
    parser.add_argument("--common", action="store_true", help="three.js's full picture for all")
    parser.add_argument("--round-trips", action="store_true", help="the table of round trips")
    parser.add_argument("--memory", action="store_true", help="the table of texture memory")
    given = parser.parse_args()
    # Whatever ends the run also ends nginx and Chromium.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    names = given.entrant.split(",")
    require(names)
    links = sorted((speed(text) for text in given.link.split(",")), reverse=True)
    throttles = [Throttle(bandwidth, parse_duration(given.rtt)) for bandwidth in links]
    if given.round_trips:
        throttles = [Throttle(links[0], way) for way in WAYS]
    summary: dict[str, Mapping[str, Mapping[str, Reached]]] = {}
    for scene in given.scene.split(","):
        database = database_in(scene)
        if given.memory:
            served = read_served(database)
            view = served.index["viewpoints"][0]
            rows = memory.measured(served, load(database), view, BUDGETS)
            print(f"\n{database.stem}\n\n{memory_table(rows)}", flush=True)
            continue
        with certificate() as own, chromium(own) as browser:
            desk = Desk(browser, own, given.repeats, given.patience, given.walk_patience)
            exact = None if given.common else given.reference or database
            protocols = given.http.split(",")
            summary |= print_scene(desk, database, names, throttles, protocols, exact)
    if summary and WALK in names and not {*names} <= {*WALKS}:
        print(f"\n{summary_table(summary)}")


def database_in(scene: str) -> Path:
    """The database of a name or path; raises SystemExit with the remedy."""
    database = Path(scene) if Path(scene).is_dir() else database_of(scene)
    if not database.is_dir():
        raise SystemExit(f"{database} is missing; python benchmarks/scenes.py {scene}")
    return database


def subject_of(database: Path) -> Subject:
    """What a database shows."""
    model = model_of(database.stem)
    source = model if model.suffix == ".glb" and model.is_file() else None
    return Subject(load(database), read_served(database).index, source)


def print_scene(
    desk: Desk,
    database: Path,
    names: Sequence[str],
    links: Sequence[Throttle],
    protocols: Sequence[str],
    exact: Path | None,
) -> dict[str, Mapping[str, Mapping[str, Reached]]]:
    """Prints the tables of one scene, a link and a protocol each; ``exact``: see `full_pictures`.
    Returns what each page reached, by link and protocol."""
    summary: dict[str, Mapping[str, Mapping[str, Reached]]] = {}
    subject = subject_of(database)
    names = [name for name in names if name != SOURCE or subject.source]
    entrants = [
        walk_page(database, name) if name in WALKS else rival(name, subject) for name in names
    ]
    full = full_pictures(desk, entrants, subject, exact)
    for http in protocols:
        runs: dict[str, list[list[Timeline]]] = {}
        for entrant in entrants:
            repetitions = [
                list(timelines(desk, entrant, links, http, k)) for k in range(desk.repeats)
            ]
            runs[entrant.name] = [list(rows) for rows in zip(*repetitions, strict=True)]
        if links[0].bandwidth == links[-1].bandwidth and len(links) > 1:
            title = f"{database.stem}, {(links[0].bandwidth or 0) / 1e6:g} Mbit/s, HTTP/{http}"
            print(f"\n{title}\n\n{round_trips_table(runs, full, WAYS)}", flush=True)
            continue
        for k, link in enumerate(links):
            title = f"{database.stem}, {(link.bandwidth or 0) / 1e6:g} Mbit/s, "
            title += f"{1000 * link.latency:.0f} ms, HTTP/{http}, {desk.repeats} runs"
            of_link = {name: rows[k] for name, rows in runs.items()}
            print(f"\n{title}\n\n{times_table(of_link, full)}", flush=True)
            short = f"{database.stem}, {(link.bandwidth or 0) / 1e6:g} Mbit/s, HTTP/{http}"
            summary[short] = {name: goals_of(rows, full[name]) for name, rows in of_link.items()}
    if exact is None:
        print("\nAll from three.js's full picture.")
        return summary
    two = {name in WALKS: picture for name, picture in full.items()}
    if len(two) == 2:
        print(f"\nThe two renderers' full pictures differ by {difference(*two.values()):.4f}.")
    return summary


def full_pictures(
    desk: Desk, entrants: Sequence[Entrant], subject: Subject, exact: Path | None
) -> Mapping[str, Picture]:
    """The full picture of each page, as its renderer draws it; the walk page's of a database with
    all ``exact`` levels, or without one as three.js draws it."""
    kinds = {entrant.name in WALKS for entrant in entrants}
    drawn = {
        ours: desk.full_picture(walk_page(exact) if ours and exact else rival(LOSSLESS, subject))
        for ours in kinds
    }
    return {entrant.name: drawn[entrant.name in WALKS] for entrant in entrants}


def speed(text: str) -> float:
    """bit/s."""
    actual = parse_bandwidth(text)
    if not actual:
        raise SystemExit(f"{text}: a link without a limit has no timeline to compare")
    return float(actual)


def timelines(
    desk: Desk, entrant: Entrant, links: Sequence[Throttle], http: str, repetition: int
) -> Iterator[Timeline]:
    """Over each link, the fastest first."""
    before: tuple[Throttle, Timeline] | None = None
    for link in links:
        conditions = Conditions(link, http, repetition, desk.patience)
        computed = None
        if before and entrant.steady and before[0].latency == link.latency:
            computed = before[1].over(before[0], link)
        if not entrant.steady:
            patience = desk.walk_patience or LONGER * desk.patience
            longer = replace(conditions, patience=patience)
            actual = desk.run(entrant, longer, longer.patience)
        elif computed is None:
            whole = replace(conditions, patience=WHOLE)
            actual = desk.run(entrant, whole, WHOLE)
        elif computed.begins > desk.patience:
            actual = computed
        else:
            actual = desk.run(entrant, conditions, desk.patience)
            if actual.done == math.inf:
                actual = actual.continued(computed)
        before = link, actual
        yield actual


if __name__ == "__main__":
    main()
