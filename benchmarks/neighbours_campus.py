"""The campus client beside the clients of a database, on the same model, walk, link and picture.

    python benchmarks/neighbours_campus.py DB CAMPUS WALK [--lossy DB2] [--policy best,screen]
        [--preset low,medium,ultra] [--bandwidth 512k,4M] [--memory inf]

DB is what `ptm build-scene` made of a model, CAMPUS what `ptm campus --lightmaps none` did, WALK
leads through both; DB2 is DB built again with ``--max-error``, since the images of a campus are not
exact either. Pictures are compared with the full picture of DB. The memory is a budget of each: of
a campus for meshes and textures, of a database for textures, as `ptm simulate` counts. `h1`, 100 ms
to the first byte, 300 bytes of headers a request. Prints Markdown:

along the walk    e on average, after the first ten seconds, and what 95 % of the frames do not
                  exceed; MB received, headers included; graphics memory at most
e at 250 kB, …    of who stands, at `PLACES` places of the walk, each from an empty cache, once so
                  many bytes of bodies have been received over the last of the links; and after a
                  minute
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ptmtools.quantities import parse_bandwidth, size
from ptmtools.walkthrough.campus import (
    CampusRun,
    CampusWalkOptions,
    CampusWorld,
    prepare_campus,
    simulate_campus,
)
from ptmtools.walkthrough.comparing import SimulateOptions, budget_of, require_hints
from ptmtools.walkthrough.measures import STANDS
from ptmtools.walkthrough.network import Conditions
from ptmtools.walkthrough.policies import Declared
from ptmtools.walkthrough.report import rate_text
from ptmtools.walkthrough.served import read_served
from ptmtools.walkthrough.simulation import Run, simulate
from ptmtools.walkthrough.view.pyramids import read_pyramids
from ptmtools.walkthrough.walk import read_walk
from ptmtools.walkthrough.world import RATE, World, prepare

#: Seconds that are left out of the second column of e.
FIRST = 10.0
#: Bytes received at which pictures are compared, and at how many places.
MARKS, PLACES = (250_000, 500_000, 1_000_000, 2_000_000, 4_000_000, 8_000_000), 8


@dataclass(frozen=True)
class System:
    """A client: along the walk over a link, and standing at a frame of it."""

    name: str
    walk: Callable[[str], Run | CampusRun]
    stand: Callable[[str, int], Run | CampusRun]


def of_database(world: World, name: str, policy: Declared, memory: str) -> System:
    budget = budget_of(world, SimulateOptions(memory=memory).memories[0])

    def stand(bandwidth: str, frame: int) -> Run:
        there = {
            part: getattr(world, part)[frame:] for part in ("view", "eye", "direction", "cell")
        }
        stands = replace(world, **there).standing(STANDS)
        return simulate(stands, policy, Conditions(parse_bandwidth(bandwidth)), budget)

    def walk(bandwidth: str) -> Run:
        return simulate(world, policy, Conditions(parse_bandwidth(bandwidth)), budget)

    return System(name, walk, stand)


def of_campus(world: CampusWorld, preset: str, memory: str) -> System:
    def run(walked: CampusWorld, bandwidth: str) -> CampusRun:
        options = CampusWalkOptions(preset, bandwidth, memory=memory, lightmaps=False)
        return simulate_campus(walked, options.qualities[0], options)

    def stand(bandwidth: str, frame: int) -> CampusRun:
        return run(world.standing(STANDS, frame), bandwidth)

    return System(f"`campus`, {preset}", partial(run, world), stand)


def along(systems: list[System], bandwidths: list[str]) -> Iterator[str]:
    yield f"| along the walk | e | from {FIRST:g} s on | p95 | MB | memory, MB |"
    yield "|---|--:|--:|--:|--:|--:|"
    for bandwidth in bandwidths:
        yield f"| **{rate_text(parse_bandwidth(bandwidth))}** | | | | | |"
        for system in systems:
            run = system.walk(bandwidth)
            later = run.error[run.time >= FIRST]
            received = run.body + run.overhead + getattr(run, "cancelled", 0)
            yield (
                f"| {system.name} | {run.error.mean():.2f} | {later.mean():.2f} "
                f"| {np.percentile(run.error, 95):.2f} | {received / 1e6:.2f} "
                f"| {run.memory.max() / 1e6:.1f} |"
            )


def standing(systems: list[System], bandwidth: str, frames: int) -> Iterator[str]:
    heads = " | ".join(f"{size(mark)}" for mark in MARKS)
    yield f"| standing, e at | {heads} | a minute | MB by then |"
    yield "|---" + "|--:" * (len(MARKS) + 2) + "|"
    places = np.linspace(0, frames - 1, PLACES + 2).astype(int)[1:-1].tolist()
    for system in systems:
        found = []
        for frame in places:
            run = system.stand(bandwidth, frame)
            at = np.searchsorted(run.fetched, MARKS, "right") - 1
            found.append([*run.error[np.maximum(at, 0)], run.error[-1], run.fetched[-1]])
        *errors, received = np.mean(found, axis=0).tolist()
        cells = " | ".join(f"{e:.2f}" for e in errors)
        yield f"| {system.name} | {cells} | {received / 1e6:.1f} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("db")
    parser.add_argument("campus")
    parser.add_argument("walk")
    parser.add_argument("--lossy")
    parser.add_argument("--policy", default="best,screen")
    parser.add_argument("--preset", default="low,medium,ultra")
    parser.add_argument("--bandwidth", default="512k,4M")
    parser.add_argument("--memory", default="inf")
    parser.add_argument("--rate", type=float, default=RATE, help="frames a second")
    given = parser.parse_args()
    served, walk, bandwidths = (
        read_served(given.db),
        read_walk(given.walk),
        given.bandwidth.split(","),
    )
    exact = read_pyramids(served)
    policies = SimulateOptions(policy=given.policy).policies
    require_hints(served, policies)
    world = prepare(served, walk, exact, rate=given.rate)
    systems = [of_database(world, f"`{p.name}`", p, given.memory) for p in policies]
    if given.lossy:
        lossy = prepare(read_served(given.lossy), walk, rate=given.rate, full=exact)
        systems += [of_database(lossy, f"`{p.name}`, lossy", p, given.memory) for p in policies]
    place = prepare_campus(given.campus, walk, served, rate=given.rate)
    systems += [of_campus(place, preset, given.memory) for preset in given.preset.split(",")]
    print(
        f"{walk.length:.0f} m in {walk.duration:.0f} s; {served.cell_count} cells; "
        f"{place.stock.objects} objects, whose meshes leave out e of {place.lacking:.3f}\n"
    )
    print("\n".join(along(systems, bandwidths)), "\n")
    print("\n".join(standing(systems, bandwidths[-1], world.frames)))


if __name__ == "__main__":
    main()
