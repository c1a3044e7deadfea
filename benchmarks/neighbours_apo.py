"""Octree textures on a walk, beside the triangles that they replace.

    python benchmarks/neighbours_apo.py [--scenes statues,museum] [--bandwidth 512k,4M]
        [--memory 10%,inf]

A hall of six statues of 100,000 triangles each (`sample_data/make_statue_hall.py`), which octree
textures are made for, and the sample museum, whose statues have 626 to 866 (`make sample`). Each is
built as modelled, and with `--apo`; all pictures are lit, and compared with the full one of the
database as modelled. `h1`, 100 ms to the first byte, 300 bytes of headers a request. What is
missing is made in ``build/bench/neighbours`` first.

as modelled       `best`, all triangles in the geometry of cells
simplified        `best` on the database with `--apo`: who draws no octrees
apo, best+apo     the same with octrees, as their paper transmits them, and by the measure of `best`

e, p95, …         as benchmarks/neighbours.py has them; who stands does so where most of the
                  screen is statues
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

import numpy as np
from at_hand import ROOT
from neighbours import FOLDER, LINK, MARKS, PLACES, SECONDS, by_bytes, made
from walk_scenes import ptm

from ptmtools.quantities import size
from ptmtools.walkthrough.comparing import Played, SimulateOptions, play
from ptmtools.walkthrough.policies import POLICIES
from ptmtools.walkthrough.relief.light import lit
from ptmtools.walkthrough.report import link_text
from ptmtools.walkthrough.served import read_served
from ptmtools.walkthrough.view.pyramids import read_pyramids
from ptmtools.walkthrough.walk import read_walk
from ptmtools.walkthrough.world import World, prepare, relief_of

#: What is walked, by what it is called: with octrees or as modelled, and the policy.
SYSTEMS = {
    "as modelled": (False, "best"),
    "simplified": (True, "best"),
    "`apo`": (True, "apo"),
    "`best+apo`": (True, "best+apo"),
}


@dataclass(frozen=True)
class Scene:
    """A scene: what makes its model, where that is, and how its statues are replaced."""

    script: str
    model: Path
    options: tuple[str, ...]


SCENES = {
    "statues": Scene(
        "make_statue_hall.py",
        ROOT / "build/statue_hall/statue_hall.obj",
        ("--apo", "statue_*"),
    ),
    "museum": Scene(
        "make_museum.py",
        ROOT / "build/museum/museum.obj",
        ("--apo", "statue_*", "--apo-faces", "250"),
    ),
}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scenes", default=",".join(SCENES))
    parser.add_argument("--bandwidth", default="512k,4M")
    parser.add_argument("--memory", default="10%,inf")
    given = parser.parse_args()
    for name in given.scenes.split(","):
        worlds = worlds_of(name, SCENES[name])
        print(f"## {name}\n")
        for line in stock_table(worlds):
            print(line)
        for line in walks(worlds, given.bandwidth, given.memory):
            print(line, flush=True)
        print(f"\nStanding before statues, {link_text(LINK)}, all memory\n")
        for line in bytes_table(worlds):
            print(line, flush=True)
        print()


def worlds_of(name: str, scene: Scene) -> dict[bool, World]:
    """The worlds of a walk through a scene, with octrees and without."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    made(scene.script, scene.model)
    walk = FOLDER / f"{name}-{SECONDS}.json"
    databases = {False: FOLDER / f"{name}-modelled.db", True: FOLDER / f"{name}-apo.db"}
    for octrees, database in databases.items():
        options = scene.options if octrees else ()
        ptm("build-scene", scene.model, "-o", database, "--unit", "m", "--up", "y", *options)
    ptm("path", databases[False], "-o", walk, "--duration", SECONDS, "--force")
    modelled, light = (lit(read_served(database)) for database in databases.values())
    found = {}
    for octrees, served in ((False, modelled), (True, light)):
        pyramids = read_pyramids(served)
        relief = relief_of(served, pyramids, modelled if octrees else None)
        found[octrees] = prepare(served, read_walk(walk), pyramids, relief=relief)
    return found


def stock_table(worlds: dict[bool, World]) -> Iterator[str]:
    """What there is to fetch."""
    yield "| database | geometry | textures | octrees | their memory |"
    yield "|---|--:|--:|--:|--:|"
    for octrees, world in worlds.items():
        first = len(world.pyramids.levels)
        stock = world.in_form("octree").catalogue if octrees else world.catalogue
        ends, memory = stock.ends[:, -1], stock.memory[:, -1]
        cells = (
            int(stock.geometry_bytes.sum()),
            int(ends[:first].sum()),
            int(ends[first:].sum()),
            int(memory[first:].sum()),
        )
        name = "with `--apo`" if octrees else "as modelled"
        yield f"| {name} | {' | '.join(size(c) for c in cells)} |"


def walks(worlds: dict[bool, World], bandwidth: str, memory: str) -> Iterator[str]:
    """A table for each link and memory, a row for each system."""
    runs: list[tuple[str, Played]] = []
    for name, (octrees, policy) in SYSTEMS.items():
        options = SimulateOptions(policy=policy, bandwidth=bandwidth, memory=memory, lit=True)
        runs += [(name, played) for played in play({"": worlds[octrees]}, options)]
    order = {link: k for k, link in enumerate(dict.fromkeys(p.run.conditions for _, p in runs))}
    runs.sort(key=lambda r: (order[r[1].run.conditions], memory.index(r[1].memory)))
    for (link, held), block in groupby(runs, lambda r: (r[1].run.conditions, r[1].memory)):
        yield f"\n{link_text(link)}; texture memory {held}\n"
        yield "| | e | p95 | received | memory at most | 50 %, s | 90 %, s | 99 %, s |"
        yield "|---" + "|--:" * 7 + "|"
        for name, played in block:
            m = played.measures
            until = " | ".join("–" if t is None else f"{t:.1f}" for t in m.final)
            most = size(int(played.run.memory.max()))
            yield (
                f"| {name} | {m.e.mean:.2f} | {m.e.p95:.2f} | {size(m.bytes)} | {most} | {until} |"
            )


def bytes_table(worlds: dict[bool, World]) -> Iterator[str]:
    """e by bytes received, means over places."""
    places = before_statues(worlds[True])
    yield "| | " + " | ".join(f"e at {size(mark)}" for mark in MARKS) + " | at the end | received |"
    yield "|---" + "|--:" * (len(MARKS) + 2) + "|"
    for name, (octrees, policy) in SYSTEMS.items():
        errors, received = by_bytes(worlds[octrees], POLICIES[policy], places)
        yield f"| {name} | {' | '.join(_cells(errors))} | {size(round(received))} |"


def before_statues(world: World) -> list[int]:
    """Frames spread over the tenth of the walk that shows most of the statues with octrees."""
    views, first = world.views, len(world.pyramids.levels)
    shows = np.where(views.texture >= first, views.need[:, 0], 0.0)
    of = np.repeat(np.arange(views.frames), np.diff(views.start))
    share = np.bincount(of, shows, views.frames)[world.view]
    best = np.sort(np.argsort(-share, kind="stable")[: max(world.frames // 10, PLACES)])
    found: list[int] = best[np.linspace(0, len(best) - 1, PLACES).astype(int)].tolist()
    return found


def _cells(errors: Sequence[float]) -> list[str]:
    return [f"{e:.2f}" if np.isfinite(e) else "–" for e in errors]


if __name__ == "__main__":
    main()
