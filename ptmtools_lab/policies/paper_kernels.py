"""Compiled steps of the paper's client: the division of memory (§6.1), and adding and removing
levels (§6.2)."""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.jit import kernel, plain_kernel


@plain_kernel
def share_out(
    cells: Ints,
    weight: Floats,
    first_shape: Ints,
    texture: Ints,
    shown: Bools,
    memory: Ints,
    levels: Ints,
    column: Ints,
    budget: float,
    share: Floats,
) -> None:
    """Adds to ``share`` (T,) the bytes that each texture keeps.

    Parameters
    ----------
    cells, weight: (n,) cells in the frustum by descending hint, and their hints.
    first_shape, texture, shown: (C + 1,), (S,), (S,) shapes of cells, their textures, and whether
        they are textured and in the frustum.
    memory, levels, column: (T, K), (T,), (T,): column 0 is nothing.
    """
    left, total = budget, weight.sum()
    for i in range(len(cells)):
        begin, end = first_shape[cells[i]], first_shape[cells[i] + 1]
        part = left * weight[i] / total if total > 0.0 else 0.0
        total -= weight[i]
        waiting = 0
        for s in range(begin, end):
            waiting += shown[s]
        rest = part
        for s in range(begin, end):
            if not shown[s]:
                continue
            offer = rest / waiting
            waiting -= 1
            t = texture[s]
            wanted = float(memory[t, min(column[t] + 1, levels[t])])
            if wanted > share[t] + offer:
                share[t] += offer
                rest -= offer
            else:
                rest -= max(0.0, wanted - share[t])
                share[t] = max(share[t], wanted)
        left -= part - rest


@kernel
def refresh(
    share: Floats,
    memory: Ints,
    levels: Ints,
    have: Ints,
    pending: Bools,
    budget: int,
    column: Ints,
) -> Ints:
    """Removes and adds a level of each texture, by its kept and downloaded bytes; returns the
    textures whose next level is to be requested. ``column`` (T,) changes.

    Further levels are removed while all together exceed the budget, as when it has shrunk.
    """
    asks = np.zeros(len(share), np.int64)
    count, used, removed = 0, budget + 1, True
    before = column.copy()
    while removed and used > budget:
        used, removed = 0, False
        for t in range(len(share)):
            if column[t] > 0 and memory[t, column[t]] > share[t]:
                column[t] -= 1
                removed = True
            used += memory[t, column[t]]
    for t in range(len(share)):
        here = column[t]
        if here < before[t] or here >= levels[t] or memory[t, here + 1] > share[t]:
            continue
        if here + 1 <= have[t]:
            more = memory[t, here + 1] - memory[t, here]
            if used + more <= budget:
                used += more
                column[t] = here + 1
        elif not pending[t]:
            asks[count] = t
            count += 1
    return asks[:count]
