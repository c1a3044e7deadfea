"""Visibility by random lines alone: quick, and never more than there is to see.

What a straight line crosses on its way through the portals sees each other; what no line happened
to show counts as hidden. So the sets are a lower bound, not conservative: a client that loads by
them shows holes. They serve to compare with, and to see how much of a conservative set may be too
much (`confirmed`).
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ptmtools.visibility.flow import Portals, check, geometry


def sampled_leaves(
    portals: Portals, lines: int, workers: int | None = None, seed: int = 0
) -> NDArray[np.bool_]:
    """(L, L) which leaf sees which on one of ``lines`` random lines through each portal.

    Half of the lines aim at a random point of a random portal, half anywhere. Symmetric; each leaf
    sees itself and its neighbours. The same for any number of ``workers``.

    Raises what `flow.check` raises.
    """
    check(portals)
    count, leaves = len(portals.leaf), portals.leaf_count
    matrix = np.eye(leaves, dtype=np.bool_)
    if count == 0:
        return matrix
    from ptmtools.visibility.lines import kernels

    g = geometry(portals)
    threads = min(workers or os.cpu_count() or 1, count)
    spans = list(pairwise(np.linspace(0, count, threads + 1).astype(np.int64).tolist()))

    def shoot(span: tuple[int, int]) -> NDArray[np.uint64]:
        sees = np.zeros((leaves, (leaves + 63) // 64), np.uint64)
        kernels.shoot(g, span[0], span[1], lines, seed, sees)
        return sees

    with ThreadPoolExecutor(threads) as pool:
        bits = np.bitwise_or.reduce(list(pool.map(shoot, spans)))
    seen = np.unpackbits(bits.view(np.uint8), axis=1, count=leaves, bitorder="little")
    matrix |= seen.astype(np.bool_)
    one, other = portals.leaf.T
    matrix[one, other] = matrix[other, one] = True
    return matrix


def confirmed(
    portals: Portals, pairs: NDArray[np.int32], tries: int, workers: int | None = None
) -> NDArray[np.bool_]:
    """(n,) which pairs (n, 2) of leaves a line shows to see each other, of ``tries`` aimed ones.

    A line leads from a random point of a portal of the one to a random point of a portal of the
    other.

    Raises what `flow.check` raises.
    """
    check(portals)
    if len(pairs) == 0 or len(portals.leaf) == 0:
        return np.zeros(len(pairs), dtype=np.bool_)
    from ptmtools.visibility.lines import kernels

    g = geometry(portals)
    threads = min(workers or os.cpu_count() or 1, len(pairs))
    ends = np.linspace(0, len(pairs), threads + 1).astype(np.int64).tolist()
    hit = np.zeros(len(pairs), np.int64)

    def aim(span: tuple[int, int]) -> None:
        kernels.confirm(g, pairs, span[0], span[1], tries, hit)

    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(aim, pairwise(ends)))
    return hit > 0
