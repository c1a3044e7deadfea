"""The campus client beside the clients of a database, on the same model, walk, link and picture.

    python benchmarks/neighbours_campus.py DB CAMPUS WALK [--policy best,screen]
        [--bandwidth 512k,4M] [--memory inf]

DB is what `ptm build-scene` made of a model, CAMPUS what `ptm campus --lightmaps none` did, WALK
leads through both. Pictures are compared with the full picture of DB. Every client walks over every
link; below each preset stands ``best`` over a link that brings as many bytes in all, but evenly
over the walk: *same bytes*. The campus client has most of its bytes in the first seconds, so the
column of e without these is the fairer one. The memory is a budget of each: of a campus for meshes
and textures, of a database for textures, as `ptm simulate` counts. Prints Markdown: e, on average,
after the first ten seconds, and what 95 % of the frames do not exceed; MB received, headers
included, and graphics memory at most.
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np

from ptmtools.quantities import parse_bandwidth
from ptmtools.walkthrough.campus import (
    CampusWalkOptions,
    prepare_campus,
    simulate_campus,
)
from ptmtools.walkthrough.comparing import SimulateOptions, budget_of, require_hints
from ptmtools.walkthrough.network import Conditions
from ptmtools.walkthrough.policies import POLICIES
from ptmtools.walkthrough.report import rate_text
from ptmtools.walkthrough.served import read_served
from ptmtools.walkthrough.simulation import Run, simulate
from ptmtools.walkthrough.walk import read_walk
from ptmtools.walkthrough.world import RATE, prepare

#: Seconds that are left out of the second column of e.
FIRST = 10.0


def row(name: str, time: np.ndarray, error: np.ndarray, received: float, memory: int) -> str:
    known = np.isfinite(error)
    later = error[known & (time >= FIRST)]
    return (
        f"| {name} | {error[known].mean():.2f} | {later.mean():.2f} "
        f"| {np.percentile(error[known], 95):.2f} | {received / 1e6:.2f} | {memory / 1e6:.1f} |"
    )


def of_database(name: str, run: Run) -> str:
    received = run.body + run.overhead + run.cancelled
    return row(name, run.time, run.error, received, int(run.memory.max()))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("db")
    parser.add_argument("campus")
    parser.add_argument("walk")
    parser.add_argument("--policy", default="best,screen")
    parser.add_argument("--preset", default=CampusWalkOptions.preset)
    parser.add_argument("--bandwidth", default="512k,4M")
    parser.add_argument("--memory", default="inf")
    parser.add_argument("--rate", type=float, default=RATE, help="frames a second")
    given = parser.parse_args()
    served, walk = read_served(given.db), read_walk(given.walk)
    world = prepare(served, walk, rate=given.rate)
    place = prepare_campus(given.campus, walk, served, rate=given.rate)
    policies = SimulateOptions(policy=given.policy).policies
    require_hints(served, policies)
    budget = budget_of(world, SimulateOptions(memory=given.memory).memories[0])
    best = POLICIES["best"]
    print(
        f"{walk.length:.0f} m in {walk.duration:.0f} s; a database of {served.cell_count} cells, "
        f"a campus of {place.stock.objects} objects\n"
    )
    print(f"| | e | from {FIRST:g} s on | p95 | MB | memory, MB |\n|---|--:|--:|--:|--:|--:|")
    for bandwidth in given.bandwidth.split(","):
        link = Conditions(parse_bandwidth(bandwidth))
        print(f"| **{rate_text(link.bandwidth)}** | | | | | |")
        for policy in policies:
            print(of_database(f"`{policy.name}`", simulate(world, policy, link, budget)))
        options = CampusWalkOptions(given.preset, bandwidth, memory=given.memory, lightmaps=False)
        for quality in options.qualities:
            run = simulate_campus(place, quality, options)
            received = run.body + run.overhead
            name = f"`campus`, {quality.name}"
            print(row(name, run.time, run.error, received, int(run.memory.max())))
            if quality.cached:
                continue
            even = replace(link, bandwidth=8 * received / walk.duration)
            print(of_database("`best`, same bytes", simulate(world, best, even, budget)))


if __name__ == "__main__":
    main()
