"""Visibility by random lines alone: quick, and never more than there is to see.

What a straight line crosses on its way through the portals sees each other; what no line happened
to show counts as hidden. So the sets are a lower bound, not conservative: a client that loads by
them shows holes. They serve to compare with, and to see how much of a conservative set may be too
much (`confirmed`).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.executors.model import Executor
from ptmtools.executors.serial import Serial
from ptmtools.visibility.flow import Portals, check, geometry
from ptmtools.visibility.storage import Geometry

#: Tasks that the lines are shared out to.
SPANS = 64


class Shooting(NamedTuple):
    """What the tasks share: lines through each portal, and of which kind."""

    geometry: Geometry
    leaf_count: int
    lines: int
    seed: int


class Aiming(NamedTuple):
    """What the tasks share: (n, 2) pairs of leaves and tries for each."""

    geometry: Geometry
    pairs: NDArray[np.int32]
    tries: int


def sampled_leaves(
    portals: Portals,
    lines: int,
    executor: Executor = Serial(),  # noqa: B008 - has no state
    seed: int = 0,
) -> NDArray[np.bool_]:
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
    shooting = Shooting(geometry(portals), leaves, lines, seed)
    bits = np.zeros((leaves, (leaves + 63) // 64), np.uint64)
    for sees in executor.each(_shoot, shooting, _spans(count), releases_lock=True):
        bits |= sees
    seen = np.unpackbits(bits.view(np.uint8), axis=1, count=leaves, bitorder="little")
    matrix |= seen.astype(np.bool_)
    one, other = portals.leaf.T
    matrix[one, other] = matrix[other, one] = True
    return matrix


def confirmed(
    portals: Portals,
    pairs: NDArray[np.int32],
    tries: int,
    executor: Executor = Serial(),  # noqa: B008 - has no state
) -> NDArray[np.bool_]:
    """(n,) which pairs (n, 2) of leaves a line shows to see each other, of ``tries`` aimed ones.

    A line leads from a random point of a portal of the one to a random point of a portal of the
    other.

    Raises what `flow.check` raises.
    """
    check(portals)
    if len(pairs) == 0 or len(portals.leaf) == 0:
        return np.zeros(len(pairs), dtype=np.bool_)
    aiming = Aiming(geometry(portals), pairs, tries)
    hits = executor.each(_aim, aiming, _spans(len(pairs)), releases_lock=True)
    return np.concatenate(list(hits)) > 0


def _spans(count: int) -> Iterator[tuple[int, int]]:
    """0 … count in a few parts."""
    step = -(-count // SPANS)
    return ((first, min(first + step, count)) for first in range(0, count, step))


def _shoot(shared: Shooting, span: tuple[int, int]) -> NDArray[np.uint64]:
    from ptmtools.visibility.lines import kernels

    sees = np.zeros((shared.leaf_count, (shared.leaf_count + 63) // 64), np.uint64)
    kernels.shoot(shared.geometry, *span, shared.lines, shared.seed, sees)
    return sees


def _aim(shared: Aiming, span: tuple[int, int]) -> NDArray[np.int64]:
    from ptmtools.visibility.lines import kernels

    hit = np.zeros(len(shared.pairs), np.int64)
    kernels.confirm(shared.geometry, shared.pairs, *span, shared.tries, hit)
    return hit[slice(*span)]
