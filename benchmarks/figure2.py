"""The paper's Figure 2: the progressive downloading quality along a walk through all rooms.

    python benchmarks/figure2.py museum.db [--plot figure2.png]

The paper's client walks at 56 kbit/s, at 512 kbit/s and without a limit, with the memory that §6.2
names, 4 MB and 16 MB for who stands, counted in three bytes a texel as there, and with unlimited
memory. Quality is levels downloaded over levels existing, of the textures of the visible set.

Before it runs it says what to expect of the files alone: a level is asked for if it comes within
0.5 s, or 20 s for who stands, so a texture has the levels before the first that does not.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.pipeline import Artifacts
from ptmtools.pipeline.command import open_database
from ptmtools.walkthrough.catalogue import Catalogue
from ptmtools.walkthrough.network import Conditions
from ptmtools.walkthrough.path.options import PathOptions
from ptmtools.walkthrough.path.through import path_through
from ptmtools.walkthrough.policies import POLICIES
from ptmtools.walkthrough.policies.paper import PaperClient, Patience
from ptmtools.walkthrough.served import read_served
from ptmtools.walkthrough.simulation import Run, simulate
from ptmtools.walkthrough.world import World, prepare

#: Bit/s. The text names the first and the last; the second is ours.
BANDWIDTHS = {"56 kbit/s": 56e3, "512 kbit/s": 512e3, "no limit": None}
#: M of §6.2, bytes, while the viewpoint moves and while it is still; and as if there were no limit.
MEMORY = {"4 and 16 MB": (4 << 20, 16 << 20), "unlimited": (1 << 40, 1 << 40)}
LATENCY, OVERHEAD = 0.1, 300
#: The item buffer says nothing of quality: the least will do.
PIXELS = (32, 18)
COLORS = ("#d1603d", "#1b6ca8", "#5a9367")


@dataclass(frozen=True)
class Outcome:
    """A run, the levels of each texture that it downloaded, and what a walker who never stands
    downloaded."""

    run: Run
    levels: Ints
    never_still: Ints


def expected(stock: Catalogue, bandwidth: float | None, seconds: float) -> Ints:
    """(T,) levels of each texture before the first that takes longer, asked for by itself."""
    size = np.diff(stock.ends, axis=1)
    takes = LATENCY + (8 * size / bandwidth if bandwidth else 0 * size)
    soon = np.cumprod(takes <= seconds, axis=1).sum(axis=1)
    return np.minimum(soon, stock.levels)


def play(world: World, bandwidth: float | None, memory: tuple[int, int]) -> Outcome:
    """The paper's client on this walk; once more as if the viewpoint never were still."""
    clients: list[PaperClient] = []

    def make(*place):
        clients.append(PaperClient(*place, still_budget=memory[1]))
        return clients[-1]

    policy = replace(POLICIES["paper"], client=make)
    conditions = Conditions(bandwidth, LATENCY, OVERHEAD)
    run = simulate(world, policy, conditions, memory[0])
    assert (run.memory <= np.where(world.still, memory[1], memory[0])).all()
    simulate(replace(world, still=np.zeros_like(world.still)), policy, conditions, memory[0])
    return Outcome(run, *(client.have for client in clients))


def share(levels: Ints, stock: Catalogue) -> str:
    """Levels of those existing, over all textures, and the most of any one."""
    return f"{levels.sum() / stock.levels.sum():.0%} ({levels.max()})"


def plot(outcomes: dict[str, dict[str, Outcome]], file: Path) -> None:
    """Quality over time, a panel for each memory; where the viewpoint is still it is shaded."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 6), dpi=110, layout="constrained")
    for axes, (memory, by_bandwidth) in zip(
        figure.subplots(len(outcomes), 1, sharex=True), outcomes.items(), strict=True
    ):
        for color, (name, outcome) in zip(COLORS, by_bandwidth.items(), strict=True):
            run = outcome.run
            axes.plot(run.time, 100 * run.quality, color=color, linewidth=1.2, label=name)
        axes.fill_between(
            run.time, 0, 100, where=run.still, step="mid", color="#ececec", linewidth=0
        )
        axes.set(title=f"texture memory: {memory}", ylabel="quality, %", ylim=(0, 102))
        axes.set_xlim(0, run.time[-1])
        axes.legend(loc="lower right", fontsize=8)
    axes.set_xlabel("s; shaded: the viewpoint has been still for a second")
    figure.savefig(file, metadata={"Software": None})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("database")
    parser.add_argument("--plot", type=Path)
    given = parser.parse_args()
    artifacts = Artifacts(open_database(given.database))
    made = path_through(artifacts, PathOptions())
    world = prepare(read_served(given.database), made.walk, pixels=PIXELS).counted_by_paper()
    stock = world.catalogue
    shown = sum(len(stock.in_sight[cell]) for cell in world.cell.tolist()) / world.frames
    print(
        f"{stock.texture_count} textures, {stock.whole / 2**20:.1f} MB by the paper's count; "
        f"{shown:.1f} in the visible set on average; {len(made.visited)} of {made.rooms} rooms in "
        f"{made.walk.duration:.0f} s, still for {world.still.sum() / world.rate:.0f} s\n"
    )
    patience = Patience()
    print("Expected, levels by time alone: share (most)\n\n| | moving | still |\n|---|---|---|")
    for name, bandwidth in BANDWIDTHS.items():
        each = (expected(stock, bandwidth, s) for s in (patience.moving, patience.still))
        print(f"| {name} |", " | ".join(share(levels, stock) for levels in each), "|")
    outcomes: dict[str, dict[str, Outcome]] = {}
    print(
        "\n| memory | bandwidth | 1 s | quality, moving | still | best | risen while still |"
        " downloaded | never still |\n|---|---|---|---|---|---|---|---|---|"
    )
    for memory, bounds in MEMORY.items():
        for name, bandwidth in BANDWIDTHS.items():
            outcome = play(world, bandwidth, bounds)
            outcomes.setdefault(memory, {})[name] = outcome
            run = outcome.run
            moving, still = run.quality[~run.still], run.quality[run.still]
            risen = np.maximum(np.diff(run.quality), 0)
            figures: list[Floats] = [
                run.quality[round(world.rate)], moving.mean(), still.mean(), run.quality.max(),
                risen[run.still[1:]].sum() / risen.sum(),
            ]  # fmt: skip
            rows = [f"{100 * figure:.0f} %" for figure in figures]
            rows += [share(outcome.levels, stock), share(outcome.never_still, stock)]
            print(f"| {memory} | {name} |", " | ".join(rows), "|", flush=True)
    if given.plot:
        plot(outcomes, given.plot)


if __name__ == "__main__":
    main()
