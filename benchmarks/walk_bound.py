"""How far from the best possible the greedy oracle is: a bound from below, by linear programming.

    python benchmarks/walk_bound.py DB [--seconds 30] [--bandwidth 512k] [--memory 10%]

On the beginning of a walk, looked at once a second. What a client could have done at best is
relaxed to fractions of levels: of each level of each texture a fraction is there, never less than
before and never more than of the level below; a fraction of that is in texture memory, within the
budget; of each cell a fraction of the geometry is there; and all bytes that are there could have
come since two latencies after the beginning, without headers, index or records. The error of a
pair of cell and texture falls linearly with the fraction of each level, as far as its geometry is
there. Every client's walk is a solution of that with fractions of 0 and 1, so no client can show
less than the optimum; how much of the rest is the relaxation's, nobody knows.

Needs scipy (HiGHS): pip install scipy.
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ptmtools.pipeline import Artifacts
from ptmtools.pipeline.command import open_database
from ptmtools.quantities import parse_bandwidth, parse_memory
from ptmtools.walkthrough.network import Conditions
from ptmtools.walkthrough.path.options import PathOptions
from ptmtools.walkthrough.path.through import path_through
from ptmtools.walkthrough.policies import POLICIES
from ptmtools.walkthrough.served import read_served
from ptmtools.walkthrough.simulation import simulate
from ptmtools.walkthrough.world import World, prepare

#: Frames a second that the bound looks at.
EVERY = 1.0
#: Latencies before the first byte of geometry or textures: of the index, and of itself.
ROUND_TRIPS = 2


class Program:
    """A linear program in the making: minimise cost · x, A x ≤ b, 0 ≤ x ≤ 1."""

    def __init__(self) -> None:
        self.cost: list[float] = []
        self._row: list[int] = []
        self._column: list[int] = []
        self._value: list[float] = []
        self._most: list[float] = []

    def fraction(self, cost: float = 0.0) -> int:
        """A new variable."""
        self.cost.append(cost)
        return len(self.cost) - 1

    def at_most(self, terms: list[tuple[int, float]], most: float) -> None:
        """A new constraint: the sum of (variable, factor) is at most this."""
        for column, value in terms:
            self._row.append(len(self._most))
            self._column.append(column)
            self._value.append(value)
        self._most.append(most)

    def below(self, one: int, other: int) -> None:
        """One variable is at most another."""
        self.at_most([(one, 1.0), (other, -1.0)], 0.0)

    def optimum(self) -> float:
        """The least cost."""
        from scipy.optimize import linprog
        from scipy.sparse import csr_array

        shape = (len(self._most), len(self.cost))
        matrix = csr_array((self._value, (self._row, self._column)), shape=shape)
        found = linprog(self.cost, matrix, self._most, bounds=(0, 1), method="highs")
        if not found.success:
            raise RuntimeError(found.message)
        return float(found.fun)


def bound(world: World, frames: NDArray[np.int64], link: Conditions, budget: int) -> float:
    """No client's mean error over these frames is less."""
    stock, views = world.catalogue, world.views
    program, constant = Program(), 0.0
    assert link.bandwidth is not None
    there: dict[int, int] = {}  # of the geometry, at the frame before
    levels: dict[tuple[int, int], int] = {}
    ever_cells, ever = _ever(world, frames)
    for frame in frames.tolist():
        seconds = max(0.0, float(world.time[frame]) - ROUND_TRIPS * link.latency)
        arrived = link.bandwidth / 8 * seconds
        now = {cell: program.fraction() for cell in ever_cells}
        here = {pair: program.fraction() for pair in ever}
        resident = {pair: program.fraction() for pair in ever}
        for cell, variable in there.items():
            program.below(variable, now[cell])
        for pair, variable in levels.items():
            program.below(variable, here[pair])
        there, levels = now, here
        loads = [(v, float(stock.geometry_bytes[cell])) for cell, v in now.items()]
        held = []
        for (t, k), variable in here.items():
            loads.append((variable, float(stock.ends[t, k] - stock.ends[t, k - 1])))
            held.append((resident[t, k], float(stock.memory[t, k] - stock.memory[t, k - 1])))
            program.below(resident[t, k], variable)
            if k > 1:
                program.below(variable, here[t, k - 1])
                program.below(resident[t, k], resident[t, k - 1])
        program.at_most(loads, arrived)
        program.at_most(held, float(budget))
        rows = views.rows(int(world.view[frame]))
        for row in range(rows.start, rows.stop):
            cell, t = int(views.cell[row]), int(views.texture[row])
            error = views.error[row].astype(np.float64)
            constant += float(error[0])
            program.cost[now[cell]] -= float(error[0] - error[1])
            for k in range(1, int(stock.levels[t]) + 1 if t >= 0 else 1):
                shown = program.fraction(float(error[k + 1] - error[k]))
                program.below(shown, resident[t, k])
                program.below(shown, now[cell])
                if k > 1:
                    program.below(shown, shown - 1)
    return (constant + program.optimum()) / len(frames)


def _ever(world: World, frames: NDArray[np.int64]) -> tuple[list[int], list[tuple[int, int]]]:
    """The cells, and the pairs of texture and column, that are on the screen in any frame."""
    views, stock = world.views, world.catalogue
    rows = np.concatenate([np.r_[views.rows(int(world.view[f]))] for f in frames.tolist()])
    textures = np.unique(views.texture[rows])
    pairs = [
        (t, k) for t in textures[textures >= 0].tolist() for k in range(1, int(stock.levels[t]) + 1)
    ]
    return np.unique(views.cell[rows]).tolist(), pairs


def begun(world: World, seconds: float) -> World:
    """The first seconds of a walk."""
    count = int(seconds * world.rate) + 1
    part = slice(0, count)
    fields = ("view", "time", "eye", "direction", "cell", "still")
    return replace(world, **{name: getattr(world, name)[part] for name in fields})


def main() -> None:
    """Prints the bound, and what clients reach."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("db")
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--bandwidth", default="512k")
    parser.add_argument("--memory", default="10%")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    made = Artifacts(open_database(given.db))
    options = PathOptions(seed=given.seed, duration=given.seconds)
    walk = path_through(made, options).walk
    world = begun(prepare(read_served(given.db), walk), given.seconds)
    link = Conditions(parse_bandwidth(given.bandwidth))
    budget = parse_memory(given.memory).of(world.catalogue.whole)
    budget = world.catalogue.whole if budget is None else budget
    frames = np.arange(0, world.frames, round(world.rate / EVERY))
    least = bound(world, frames, link, budget)
    print(f"{given.db}, {given.seconds:g} s, {given.bandwidth}bit/s, memory {given.memory}")
    print(f"| client | e | over the bound |\n|---|---|---|\n| bound | {least:.3f} | 1.00 |")
    for name in ("oracle", "best", "ach", "paper"):
        error = float(simulate(world, POLICIES[name], link, budget).error[frames].mean())
        print(f"| {name} | {error:.3f} | {error / least:.2f} |")


if __name__ == "__main__":
    main()
