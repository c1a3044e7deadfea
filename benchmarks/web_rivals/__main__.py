"""Time until a view is complete, for the walk page and for usual alternatives.

    python -m benchmarks.web_rivals [DB] [--bandwidth 4M,16M] [--latency 100ms] [--only ptm,glb-png]
    python -m benchmarks.web_rivals [DB] --memory

Of each page (``entrants.py``), opened at the first viewpoint of a database over a link of so much
bandwidth and latency, with an empty cache: seconds and bytes until (a) FLIP is at most 0.05 for
good, (b) at most 0.01, (c) the page has all that it asks for. FLIP is against the page's own full
picture, which is kind to lossy ones; *lossy* is how far that is from the picture of ``glb-png``,
which ``ptm`` is not compared with. In parentheses: how many times as long as the walk page, or else
as the best.

A page is looked at for ``--patience`` seconds. What takes longer is computed from the run over the
next faster link, for pages that ask for the same in the same order whatever the link is: its bytes
take as much longer, and nothing else changes. Where both is known, both is printed.

``--memory`` prints the second table instead (``memory.py``): FLIP in so much texture memory.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "benchmarks")]

from render import load  # noqa: E402
from scenes import database_of  # noqa: E402

from benchmarks.web_rivals import memory  # noqa: E402
from benchmarks.web_rivals.entrants import RIVALS, WALK, Entrant, require, rival, walk_page  # noqa: E402
from benchmarks.web_rivals.tables import memory_table, times_table  # noqa: E402
from benchmarks.web_rivals.timeline import Timeline, chromium, watch  # noqa: E402
from ptmtools.output.served import read_served  # noqa: E402
from ptmtools.quantities import parse_bandwidth, parse_duration  # noqa: E402
from ptmtools.site.throttle import Throttle  # noqa: E402

#: Of the second table, bytes; the last holds everything.
BUDGETS = tuple(kib << 10 for kib in (256, 512, 1024, 2048, 4096, 8192, 16384, 1 << 30))


def main() -> None:
    """Prints the tables."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.web_rivals")
    parser.add_argument("database", nargs="?", type=Path, default=database_of("museum"))
    parser.add_argument("--bandwidth", default="512k,4M,16M")
    parser.add_argument("--latency", default="100ms")
    parser.add_argument("--patience", type=float, default=100, help="seconds")
    parser.add_argument("--only", default=",".join((WALK, *RIVALS)), help="of these pages")
    parser.add_argument("--memory", action="store_true", help="the table of texture memory")
    given = parser.parse_args()
    scene = load(given.database)
    viewpoint = json.loads((given.database / "www/hints.json").read_text())["viewpoints"][0]
    if given.memory:
        rows = memory.measured(read_served(given.database), scene, viewpoint, BUDGETS)
        print(memory_table(rows))
        return
    require(given.only.split(","))
    entrants = [
        walk_page(given.database) if name == WALK else rival(name, scene, viewpoint)
        for name in given.only.split(",")
    ]
    bandwidths = sorted((speed(text) for text in given.bandwidth.split(",")), reverse=True)
    latency = parse_duration(given.latency)
    runs: dict[str, list[Timeline]] = {}
    with chromium() as browser:
        for entrant in entrants:
            links = [Throttle(bandwidth, latency) for bandwidth in bandwidths]
            runs[entrant.name] = list(timelines(browser, entrant, links, given.patience))
    for k, bandwidth in enumerate(bandwidths):
        title = f"{given.database.stem}, {bandwidth / 1e6:g} Mbit/s, {1000 * latency:.0f} ms"
        print(f"\n{title}\n\n{times_table({name: rows[k] for name, rows in runs.items()})}")


def speed(text: str) -> float:
    """bit/s."""
    actual = parse_bandwidth(text)
    if not actual:
        raise SystemExit(f"{text}: a link without a limit has no timeline to compare")
    return float(actual)


def timelines(
    browser: Any, entrant: Entrant, links: list[Throttle], patience: float
) -> Iterator[Timeline]:
    """Over each link, the fastest first."""
    before: tuple[Throttle, Timeline] | None = None
    for link in links:
        computed = before[1].over(before[0], link) if before and entrant.steady else None
        if computed is None:
            actual = watch(browser, entrant, link)
        elif computed.begins > patience:
            actual = computed
        else:
            actual = watch(browser, entrant, link, seconds=patience)
            if actual.done == math.inf:
                actual = actual.continued(computed)
            else:
                print(
                    f"{entrant.name}, {(link.bandwidth or 0) / 1e6:g} Mbit/s: all in "
                    f"{actual.done:.2f} s, computed {computed.done:.2f}"
                )
        for message in actual.messages:
            print(f"{entrant.name}: {message}", file=sys.stderr)
        before = link, actual
        yield actual


if __name__ == "__main__":
    main()
