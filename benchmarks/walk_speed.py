"""Times the simulator: ``python benchmarks/walk_speed.py [SCENE…]``

A walk of five minutes through the sample museum and through the museum of 40 rooms (`scenes.py`):
processor seconds of the preparation and its parts; then of a run of each policy at 512 kbit/s and
10 % of texture memory. Machine code is loaded before.

served        documents and geometry
decoding      textures, all levels
rays          the first surface of each pixel
sampling      textures at each pixel, at all levels
rest          of the preparation
total         the preparation and a run of the slowest policy
"""

from __future__ import annotations

import sys
import time
from cProfile import Profile
from pstats import Stats

from scenes import database_of, make_scene, walk_file

from ptmtools.link import Conditions
from ptmtools.output.served import read_served
from ptmtools.quantities import parse_memory
from ptmtools.walk import Walk, read_walk
from ptmtools_lab.comparing import budget_of
from ptmtools_lab.forms import PTM
from ptmtools_lab.policies import POLICIES
from ptmtools_lab.simulation import simulate
from ptmtools_lab.track import RATE
from ptmtools_lab.world import World, prepare

#: The policies that take `.ptm`s.
OURS = [name for name, policy in POLICIES.items() if policy.form == PTM]
SECONDS, BANDWIDTH, MEMORY = 300, 512e3, "10%"
#: The parts of a preparation, and the functions that do them.
PARTS = {
    "served": "read_served",
    "decoding": "read_pyramids",
    "rays": "first",
    "sampling": "add_frame",
}


def main() -> None:
    scenes = sys.argv[1:] or ["museum", "rooms"]
    print("| scene | frames | " + " | ".join([*PARTS, "rest", "preparation", "total"]) + " |")
    print("|---" + "|--:" * (len(PARTS) + 4) + "|")
    runs: dict[str, list[float]] = {name: [] for name in OURS}
    for scene in scenes:
        make_scene(scene)
        walk = read_walk(walk_file(scene, 1, SECONDS))
        world = prepared(scene, walk, 1 / SECONDS)
        for policy in OURS:
            run(world, policy)
        profile, begin = Profile(time.process_time), time.process_time()
        world = profile.runcall(prepared, scene, walk, RATE)
        whole = time.process_time() - begin
        parts = seconds_of(profile)
        for policy, took in runs.items():
            took.append(run(world, policy))
        slowest = max(took[-1] for took in runs.values())
        figures = [*parts, whole - sum(parts), whole, whole + slowest]
        print(f"| {scene} | {world.frames} | " + " | ".join(f"{s:.1f}" for s in figures) + " |")
    print("\n| a run | " + " | ".join(scenes) + " |\n|---" + "|--:" * len(scenes) + "|")
    for policy, took in runs.items():
        print(f"| {policy} | " + " | ".join(f"{s:.2f}" for s in took) + " |")


def prepared(scene: str, walk: Walk, rate: float) -> World:
    """The world of a walk, from nothing."""
    return prepare(read_served(database_of(scene)), walk, rate=rate)


def run(world: World, policy: str) -> float:
    """Processor seconds of a run."""
    budget, begin = budget_of(world, parse_memory(MEMORY)), time.process_time()
    simulate(world, POLICIES[policy], Conditions(BANDWIDTH), budget)
    return time.process_time() - begin


def seconds_of(profile: Profile) -> list[float]:
    """What the `PARTS` took, with all that they call."""
    actual = dict.fromkeys(PARTS.values(), 0.0)
    for (file, _, name), (_, _, _, cumulative, _) in Stats(profile).stats.items():  # type: ignore[attr-defined]
        if name in actual and "walkthrough" in file:
            actual[name] += cumulative
    return list(actual.values())


if __name__ == "__main__":
    main()
