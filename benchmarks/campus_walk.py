"""A walk through a campus with the client of its paper: bytes, memory, and what comes too late.

    python benchmarks/campus_walk.py CAMPUS WALK [--preset low,medium,…] [--memory 64MiB]
        [--pictures 5]

CAMPUS is a folder that `ptm campus` wrote, WALK what `ptm path` or sample_data/make_campus.py
writes. Prints, as Markdown, what each preset costs and shows, and the bytes that it has received
every thirty seconds. The link has 4 Mbit/s, as the paper's, unless ``--bandwidth`` says otherwise.
The viewpoint is looked at five times a second, and of every so-manieth of these frames
(``--pictures``, 0 for none) the error is measured: against the full picture of a database of the
same model, ``--db``, or else against the campus itself with everything loaded.

The other options are those of `ptmtools.walkthrough.campus.CampusWalkOptions`.
"""

from __future__ import annotations

import argparse
from dataclasses import fields

from ptmtools.walkthrough.campus import CampusWalkOptions, prepare_campus, simulate_campus
from ptmtools.walkthrough.campus.report import received, table
from ptmtools.walkthrough.served import read_served
from ptmtools.walkthrough.walk import read_walk


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("campus")
    parser.add_argument("walk")
    parser.add_argument("--db")
    parser.add_argument("--pictures", type=int, default=5)
    for each in fields(CampusWalkOptions):
        if isinstance(each.default, bool):
            parser.add_argument(
                f"--{each.name}", action=argparse.BooleanOptionalAction, default=each.default
            )
        else:
            parser.add_argument(f"--{each.name}", type=type(each.default), default=each.default)
    given = parser.parse_args()
    options = CampusWalkOptions(
        **{f.name: getattr(given, f.name) for f in fields(CampusWalkOptions)}
    )
    walk = read_walk(given.walk)
    served = read_served(given.db) if given.db else None
    world = prepare_campus(given.campus, walk, served, every=given.pictures)
    runs = [simulate_campus(world, quality, options) for quality in options.qualities]
    print(
        f"{walk.length:.0f} m in {walk.duration:.0f} s, {world.stock.objects} objects, "
        f"{options.bandwidth}bit/s, {options.latency}\n"
    )
    print("\n".join(table(runs)), "\n")
    print("\n".join(received(runs)))


if __name__ == "__main__":
    main()
