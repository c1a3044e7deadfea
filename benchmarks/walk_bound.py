"""Compares clients with the optimum of a linear program: ``python benchmarks/walk_bound.py DB...``

No client can show less error than the optimum. The program knows the walk, whose beginning it looks
at once a second, and may load and show fractions: of every exact level, never more than of the
level below; of every preview; of the geometry of every cell; never less than before, and no more
bytes than the link has brought since two latencies after the start, or since one if the walk begins
with the opening of the site. The index, the records and the
headers of requests are free. In every frame the shares of the states that a texture shows sum to 1
at most, each within the share that is loaded, and take their share of texture memory. The error of
a pair of cell and texture falls by the shares of the states that are shown on loaded geometry. The
choices of any client are a solution with fractions of 0 and 1.

bound         mean e of the optimum
each client   mean e over the same frames, and in parentheses its ratio to the bound

The solver is HiGHS, of scipy, which the project does not install: ``pip install scipy``.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np

from ptmtools.arrays import Ints
from ptmtools.link import Conditions
from ptmtools.output.served import read_served
from ptmtools.pipeline.artifacts import Artifacts
from ptmtools.pipeline.command import open_database
from ptmtools.quantities import parse_bandwidth, parse_memory
from ptmtools_lab.comparing import budget_of
from ptmtools_lab.path.making import path_through
from ptmtools_lab.path.options import PathOptions
from ptmtools_lab.policies import POLICIES
from ptmtools_lab.simulation import simulate
from ptmtools_lab.world import World, prepare

#: Latencies before the first byte of geometry or textures: those of the index and of itself; and
#: with an opening.
ROUND_TRIPS, WITH_OPENING = 2, 1
CLIENTS = ("oracle", "best", "best-exact", "ach", "paper")


class Program:
    """A linear program: minimise cost · x, A x ≤ b, 0 ≤ x ≤ 1."""

    def __init__(self) -> None:
        self.cost: list[float] = []
        self._terms: list[tuple[int, int, float]] = []
        self._most: list[float] = []

    def fraction(self, cost: float = 0.0) -> int:
        """Adds a variable."""
        self.cost.append(cost)
        return len(self.cost) - 1

    def at_most(self, terms: list[tuple[int, float]], most: float = 0.0) -> None:
        """Adds a constraint: the sum of factors times variables is at most this."""
        self._terms += [(len(self._most), variable, factor) for variable, factor in terms]
        self._most.append(most)

    def below(self, parts: list[int], whole: int) -> None:
        """Adds a constraint: the sum of variables is at most another one."""
        self.at_most([*((part, 1.0) for part in parts), (whole, -1.0)])

    def optimum(self) -> float:
        """The least cost."""
        from scipy.optimize import linprog
        from scipy.sparse import csr_array

        row, column, value = zip(*self._terms, strict=True)
        matrix = csr_array((value, (row, column)), (len(self._most), len(self.cost)))
        solution = linprog(self.cost, matrix, self._most, bounds=(0, 1), method="highs")
        if not solution.success:
            raise RuntimeError(solution.message)
        return float(solution.fun)


def bound(world: World, frames: Ints, link: Conditions, budget: int) -> float:
    """The least mean error over some frames of a walk."""
    stock, views, program, constant = world.catalogue, world.views, Program(), 0.0
    assert link.bandwidth is not None
    rows = np.concatenate([np.r_[views.rows(int(world.track.view[f]))] for f in frames.tolist()])
    cells = np.unique(views.cell[rows]).tolist()
    textures = np.unique(views.texture[rows][views.texture[rows] >= 0]).tolist()
    before: dict[tuple[str, int, int], int] = {}
    for frame in frames.tolist():
        #: Loaded fractions of geometry, of exact columns, and of previews, and their bytes.
        loaded: dict[tuple[str, int, int], int] = {}
        size: dict[tuple[str, int, int], float] = {}
        for cell in cells:
            size["cell", cell, 0] = float(stock.geometry_bytes[cell])
        for t in textures:
            for k in range(1, int(stock.stored[t]) + 1):
                size["texture", t, k] = float(stock.ends[t, k] - stock.ends[t, k - 1])
            for p in range(*stock.previews.first[t : t + 2].tolist()):
                size["preview", t, p] = float(stock.previews.bytes[p])
        for part in size:
            loaded[part] = program.fraction()
            if part in before:
                program.below([before[part]], loaded[part])
        before = loaded
        trips = WITH_OPENING if world.opening else ROUND_TRIPS
        seconds = max(0.0, float(world.track.time[frame]) - trips * link.latency)
        arrived = link.bandwidth / 8 * seconds
        program.at_most([(loaded[part], size[part]) for part in size], arrived)
        shown = {t: _states(world, program, t, loaded) for t in textures}
        held = [
            (variable, float(stock.memory[t, column]))
            for t, states in shown.items()
            for column, _, variable in states
        ]
        program.at_most(held, float(budget))
        for row in range(*_ends(views.rows(int(world.track.view[frame])))):
            error = views.error[row].astype(np.float64)
            constant += float(error[0])
            drawn = loaded["cell", int(views.cell[row]), 0]
            parts = []
            for _, state, variable in shown.get(int(views.texture[row]), [(0, 0, drawn)]):
                parts.append(program.fraction(float(error[state + 1] - error[0])))
                program.below(parts[-1:], variable)
            program.below(parts, drawn)
    return (constant + program.optimum()) / len(frames)


def _states(
    world: World, program: Program, t: int, loaded: dict[tuple[str, int, int], int]
) -> list[tuple[int, int, int]]:
    """The column, the state and the share of each picture that a texture may show."""
    stock, previews = world.catalogue, world.catalogue.previews
    states = [(0, 0, program.fraction())]
    exact = [(k, k, program.fraction()) for k in range(1, int(stock.stored[t]) + 1)]
    for k in range(len(exact)):
        program.below([variable for _, _, variable in exact[k:]], loaded["texture", t, k + 1])
        if k:
            program.below([loaded["texture", t, k + 1]], loaded["texture", t, k])
    states += exact
    for p in range(*previews.first[t : t + 2].tolist()):
        before, columns = int(previews.state[p]), range(1, int(previews.column[p]) + 1)
        own = [(k, before + k, program.fraction()) for k in columns]
        program.below([variable for _, _, variable in own], loaded["preview", t, p])
        states += own
    program.at_most([(variable, 1.0) for _, _, variable in states], 1.0)
    return states


def _ends(rows: slice) -> tuple[int, int]:
    return rows.start, rows.stop


def begun(world: World, seconds: float) -> World:
    """The first seconds of a walk."""
    part = slice(0, int(seconds * world.track.rate) + 1)
    track = world.track
    track = replace(track.looking(part), time=track.time[part], still=track.still[part])
    return replace(world, track=track)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("db", nargs="+", type=Path)
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--bandwidth", default="512k,4M")
    parser.add_argument("--memory", default="10%")
    given = parser.parse_args()
    clients = [f"`{name}`" for name in CLIENTS]
    print(f"| | bound | {' | '.join(clients)} |\n|---|{'--:|' * (len(CLIENTS) + 1)}")
    for db in given.db:
        options = PathOptions(duration=given.seconds)
        walk = path_through(Artifacts(open_database(db)), options).walk
        world = begun(prepare(read_served(db), walk), given.seconds)
        frames = np.arange(0, world.frames, round(world.track.rate))
        for rate, memory in product(given.bandwidth.split(","), given.memory.split(",")):
            link = Conditions(parse_bandwidth(rate))
            budget = budget_of(world, parse_memory(memory))
            least = bound(world, frames, link, budget)
            cells = [f"{least:.3f}"]
            for name in CLIENTS:
                error = simulate(world, POLICIES[name], link, budget).error[frames].mean()
                cells.append(f"{error:.3f} ({error / least:.2f})")
            print(f"| {db.stem}, {rate}, {memory} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
