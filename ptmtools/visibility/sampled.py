"""Visibility by random lines alone: quick, and never more than there is to see.

What a straight line crosses on its way through the portals sees each other; what no line happened
to show counts as hidden. So the sets are a lower bound, not conservative: a client that loads by
them shows holes. They serve to compare with. Lines are walked as in `cells.sight`, which spreads
them evenly; random ones, as many as wanted, show more.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.cells.sight import LONGEST
from ptmtools.executors.model import Executor
from ptmtools.executors.serial import Serial
from ptmtools.portal_flow.flow import Portals, check, geometry
from ptmtools.portal_flow.storage import Geometry

#: Tasks that the lines are shared out to.
SPANS = 64


#: What the tasks share: portals, how many leaves, lines through each portal, and the seed.
Shooting = tuple[Geometry, int, int, int]


def sampled_leaves(
    portals: Portals,
    lines: int,
    executor: Executor = Serial(),  # noqa: B008 - has no state
    seed: int = 0,
) -> Bools:
    """(L, L) which leaf sees which on one of ``lines`` random lines through each portal.

    Half of the lines aim at a random point of a random portal, half anywhere. Symmetric; each leaf
    sees itself and its neighbours. The same for any ``executor``.

    Raises what `flow.check` raises.
    """
    check(portals)
    count, leaves = len(portals.leaf), portals.leaf_count
    matrix = np.eye(leaves, dtype=np.bool_)
    if count == 0:
        return matrix
    shooting = (geometry(portals), leaves, lines, seed)
    step = -(-count // SPANS)
    spans = [(first, min(first + step, count)) for first in range(0, count, step)]
    for bits in executor.each(_shoot, shooting, spans, releases_lock=True):
        matrix |= np.unpackbits(bits, axis=1, count=leaves).astype(np.bool_)
    one, other = portals.leaf.T
    matrix[one, other] = matrix[other, one] = True
    return matrix


def _shoot(shared: Shooting, span: tuple[int, int]) -> NDArray[np.uint8]:
    """As a task: (L, ⌈L / 8⌉) bits, who sees whom by lines of the portals ``span``."""
    from ptmtools.portal_flow.line_kernels import Openings, sight_lines

    g, leaves, lines, seed = shared
    openings = Openings(g.point, g.start, g.leaf, g.out_start, g.out)
    path = np.empty(2 * LONGEST, np.int64)
    seen = np.zeros((leaves, leaves), np.bool_)
    for k in range(*span):
        rng = np.random.default_rng([seed, k])
        portal = np.full(lines, k)
        origin = _points(rng, g, portal)
        aimed = _points(rng, g, rng.integers(len(g.normal), size=lines)) - origin
        anywhere = rng.normal(size=origin.shape)
        along = np.where(rng.random((lines, 1)) < 0.5, aimed, anywhere)
        speed = along @ g.normal[k]
        across = np.abs(speed) > g.slack
        along *= np.sign(speed)[:, None]
        sight_lines(openings, origin[across], along[across], portal[across], path, seen)
    return np.packbits(seen, axis=1)


def _points(rng: np.random.Generator, g: Geometry, portal: Ints) -> Floats:
    """(n, 3) a random point of each of (n,) portals, in a random triangle of its fan."""
    first, size = g.start[portal], np.diff(g.start)[portal]
    corner = 1 + rng.integers(np.maximum(size - 2, 1))
    fan = [np.zeros_like(corner), corner, corner + 1]
    a, b, c = (g.point[first + np.minimum(i, size - 1)] for i in fan)
    u, v = np.sqrt(rng.random((len(portal), 1))), rng.random((len(portal), 1))
    points: Floats = a + u * (b - a + v * (c - b))
    return points
