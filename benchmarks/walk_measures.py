"""Which number says best how a walk looks: e, its parts, and FLIP, on pictures of real frames.

    python benchmarks/walk_measures.py DB WALK.json [--frames 12] [--bandwidth 512k] [--memory 10%]

Prints, over some frames (seeded) of the runs of several policies,

* how far e of the tables, on 160 × 90 pixels, is from e of pictures of 1080 lines, pixel by pixel:
  the correlation, the mean of both, and the median of the relative difference;
* how e, root mean square error, missing levels and the paper's quality go with FLIP (extra
  ``measures``): the correlation of Pearson, and that of ranks.
"""

from __future__ import annotations

import argparse

import numpy as np
from numpy.typing import NDArray

from ptmtools.progress import silent
from ptmtools.quantities import parse_memory
from ptmtools.walkthrough.comparing import SimulateOptions, budget_of
from ptmtools.walkthrough.flip import PER_DEGREE, SEED, Flip
from ptmtools.walkthrough.policies import POLICIES
from ptmtools.walkthrough.served import read_served
from ptmtools.walkthrough.simulation import Run, simulate
from ptmtools.walkthrough.view.rays import LINES
from ptmtools.walkthrough.view.render import Renderer
from ptmtools.walkthrough.walk import read_walk
from ptmtools.walkthrough.world import World, prepare

Floats = NDArray[np.float64]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("db")
    parser.add_argument("walk")
    parser.add_argument("--frames", type=int, default=12)
    parser.add_argument("--policy", default="paper,lru,ach,distance,screen,screen+distance,oracle")
    parser.add_argument("--bandwidth", default="512k")
    parser.add_argument("--memory", default="10%")
    arguments = parser.parse_args()
    options = SimulateOptions(policy=arguments.policy, bandwidth=arguments.bandwidth)
    world = prepare(read_served(arguments.db), read_walk(arguments.walk), progress=silent)
    budget = budget_of(world, parse_memory(arguments.memory))
    (link, *_) = options.links()
    runs = [simulate(world, POLICIES[p.name], link, budget) for p in options.policies]
    flip = Flip(world, arguments.frames)
    seen = np.array([flip.each(run) for run in runs])
    print(
        f"{len(runs)} policies, {len(flip.frame)} frames (seed {SEED}), {flip.width} × "
        f"{flip.height} pixels for FLIP, {PER_DEGREE:g} to a degree"
    )
    true = pictures(world, runs, flip.frame)
    table = np.array([run.error[flip.frame] for run in runs])
    print(f"e of tables against e of pictures of {LINES} lines:")
    print(f"  correlation {pearson(table, true):.4f}, ranks {ranked(table, true):.4f}")
    some = true > 0.1
    relative = np.abs(table[some] / true[some] - 1)
    bias = table.mean() / true.mean() - 1
    print(f"  mean {table.mean():.3f} against {true.mean():.3f} ({bias:+.1%})")
    print(f"  median difference {np.median(relative):.1%}, where e is above 0.1")
    print("against FLIP: correlation, of ranks")
    for name, values in {
        "e": table,
        "e of pictures": true,
        "rmse": np.array([np.sqrt(run.square[flip.frame]) for run in runs]),
        "missing": np.array([run.missing[flip.frame] for run in runs]),
        "quality": np.array([run.quality[flip.frame] for run in runs]),
    }.items():
        print(f"  {name:<14} {pearson(values, seen):6.3f} {ranked(values, seen):6.3f}")


def pictures(world: World, runs: list[Run], frames: NDArray[np.int64]) -> Floats:
    """(runs, frames) e of pictures, from every pixel of a screen."""
    renderer = Renderer(world, LINES, samples=1)
    found = np.zeros((len(runs), len(frames)))
    for k, f in enumerate(frames.tolist()):
        sight = renderer.look(world.eye[f], world.direction[f])
        full = renderer.full(sight)
        for r, run in enumerate(runs):
            apart = renderer.colors(sight, run.there[f], run.column[f]) - full
            found[r, k] = np.sqrt((apart**2).mean(axis=2)).mean()
    return found


def pearson(a: Floats, b: Floats) -> float:
    return float(np.corrcoef(a.ravel(), b.ravel())[0, 1])


def ranked(a: Floats, b: Floats) -> float:
    """The correlation of ranks; equal values share the mean of theirs."""
    return pearson(_ranks(a.ravel()), _ranks(b.ravel()))


def _ranks(values: Floats) -> Floats:
    _, which, count = np.unique(values, return_inverse=True, return_counts=True)
    last = np.cumsum(count)
    ranks: Floats = (last - (count - 1) / 2)[which]
    return ranks


if __name__ == "__main__":
    main()
