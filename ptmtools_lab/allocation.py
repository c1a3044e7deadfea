"""Compiled choice of texture levels, and of their sources, by worth per byte.

The worth of each level is given. A coarse level of no worth may lead to a fine one of some worth,
so a step comprises any number of levels, and the best step has the greatest worth per byte. Taking
the steps of all textures in that order, as long as they fit, is the greedy solution of a knapsack
whose items are chains.

Tables by source (R, K) have the worth that each column adds in each source
(`ptmtools_lab.catalogue`); the value of a column is the sum up to it.
"""

from __future__ import annotations

import heapq

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, Singles
from ptmtools.jit import kernel, plain_kernel
from ptmtools.site.choice import Previews

#: Most exchanges of steps in one choice.
_EXCHANGES = 8
Numbers = NDArray[np.int32]


@plain_kernel
def best_step(worth: Floats, cost: Ints, column: int, paid: int, last: int) -> tuple[float, int]:
    """The worth per byte of the best step from ``column`` to ``last`` at most, and the column it
    leads to; (0, column) if no step has worth.

    Parameters
    ----------
    worth: (K,) that each column adds to those before it. cost: (K,) bytes up to each column.
    paid: bytes already paid, at least those of ``column``.
    """
    best, to, total = 0.0, column, 0.0
    for k in range(column + 1, last + 1):
        total += worth[k]
        density = total / max(cost[k] - paid, 1)
        if total > 0.0 and density >= best:
            best, to = density, k
    return best, to


@kernel
def allocate(worth: Floats, cost: Ints, last: Ints, budget: int, column: Ints, exact: bool) -> int:
    """Writes to ``column`` (T,) the column each texture should hold; returns the bytes used, at
    most ``budget``.

    Parameters
    ----------
    worth, cost: (T, K) see `best_step`. last: (T,) the last column that each may have.
    exact: whether worth is exact and not an estimate; only then are steps exchanged. With an
        estimate that overrates the finest levels, exchanging makes pictures worse.
    """
    used = 0
    heap = [(0.0, 0, 0) for _ in range(0)]
    limit = last.copy()
    for t in range(len(last)):
        column[t] = 0
        density, to = best_step(worth[t], cost[t], 0, 0, limit[t])
        if to > 0:
            heap.append((-density, t, to))
    heapq.heapify(heap)
    while len(heap) > 0:
        _, t, to = heapq.heappop(heap)
        current = column[t]
        more = cost[t, to] - cost[t, current]
        if used + more <= budget:
            used += more
            column[t] = to
            current = to
        else:
            limit[t] = to - 1
        if current < limit[t]:
            density, to = best_step(worth[t], cost[t], current, cost[t, current], limit[t])
            if to > current:
                heapq.heappush(heap, (-density, t, to))
    return exchange(worth, cost, last, budget, used, column) if exact else used


@kernel
def exchange(worth: Floats, cost: Ints, last: Ints, budget: int, used: int, column: Ints) -> int:
    """Takes steps that did not fit, in exchange for steps of less worth. A greedy choice misses
    these where steps are large beside the budget. Returns the bytes used afterwards."""
    candidate, better = column.copy(), column.copy()
    for _ in range(_EXCHANGES):
        best_gain, after = 0.0, used
        for t in range(len(last)):
            _, to = best_step(worth[t], cost[t], column[t], cost[t, column[t]], last[t])
            if to == column[t] or cost[t, to] > budget:
                continue
            gain = worth[t, column[t] + 1 : to + 1].sum()
            candidate[:] = column
            candidate[t] = to
            size = used + cost[t, to] - cost[t, column[t]]
            while size > budget and gain > best_gain:
                victim, down, loss = _least(worth, cost, candidate, t)
                gain -= loss
                size -= cost[victim, candidate[victim]] - cost[victim, down]
                candidate[victim] = down
            if gain > best_gain:
                best_gain, after = gain, size
                better[:] = candidate
        if best_gain <= 0.0:
            break
        column[:] = better
        used = after
    return used


@plain_kernel
def _least(worth: Floats, cost: Ints, column: Ints, kept: int) -> tuple[int, int, float]:
    """The texture other than ``kept`` whose last levels are worth least per byte, the column to
    reduce it to, and the worth lost."""
    texture, to, lost, least = -1, 0, 0.0, np.inf
    for t in range(len(column)):
        loss = 0.0
        for k in range(column[t] - 1 if t != kept else -1, -1, -1):
            loss += worth[t, k + 1]
            density = loss / max(cost[t, column[t]] - cost[t, k], 1)
            if density < least:
                texture, to, lost, least = t, k, loss, density
    return texture, to, lost


@kernel
def choose_sources(
    worth: Floats, have: Ints, previews: Previews, present: Bools,
    step: Floats, source: Ints, last: Ints,
) -> None:  # fmt: skip
    """Chooses the source of each column of each texture among those present: the exact one, else
    the preview of the greatest value, of equal ones the finer.

    Parameters
    ----------
    worth: (R, K). have: (T,) columns whose ranges are present. present: (P,) whether a preview is.
    step: (T, K) becomes the worth that each column adds, from its best source, to the column
        before. source: (T, K) becomes that source. last: (T,) becomes the last column with one.
    """
    count, total = len(have), np.zeros(len(present))
    for t in range(count):
        begin, end = previews.first[t], previews.first[t + 1]
        value, last[t] = 0.0, have[t]
        for p in range(begin, end):
            if present[p]:
                last[t] = max(last[t], previews.column[p])
        for k in range(1, last[t] + 1):
            best, chosen = -np.inf, t
            for p in range(begin, end):
                total[p] += worth[count + p, k]
                if present[p] and k <= previews.column[p]:
                    if previews.exact[p]:
                        best, chosen = np.inf, count + p
                    elif total[p] >= best:
                        best, chosen = total[p], count + p
            if k <= have[t] or best == np.inf:
                step[t, k] = worth[t, k]
                source[t, k] = t if k <= have[t] else chosen
                value += worth[t, k]
            else:
                step[t, k] = best - value
                source[t, k], value = chosen, best


@plain_kernel
def gather(
    start: int, end: int, cell: Numbers, texture: Numbers, table: Singles,
    loaded: Bools, worth: Floats,
) -> None:  # fmt: skip
    """Adds rows of a table (R, L) of pairs to the worth (T, L + 1) of their textures, from its
    second column on, for the loaded cells (C,)."""
    for r in range(start, end):
        t = texture[r]
        if t < 0 or not loaded[cell[r]]:
            continue
        for k in range(table.shape[1]):
            worth[t, k + 1] += table[r, k]


@plain_kernel
def holes(
    ray: Floats, owner: Numbers, depth: Singles, eye: Floats,
    low: Floats, high: Floats, loaded: Bools, missing: Ints, share: Floats,
) -> None:  # fmt: skip
    """Adds to ``share`` (C,) the pixels that would show placeholders of cells with missing
    geometry: the far faces of their boxes, which are rooms.

    Parameters
    ----------
    ray, owner, depth: (n, 3), (n,), (n,) of the pixels, as in `WalkViews`. eye: (3,).
    low, high: (C, 3) boxes of the cells. loaded: (C,) whether the geometry is loaded.
    missing: cells whose placeholders are drawn.
    """
    for i in range(len(owner)):
        nearest, nearest_cell = np.inf, -1
        if owner[i] >= 0 and loaded[owner[i]]:
            nearest = depth[i]
        for m in range(len(missing)):
            cell = missing[m]
            begin, end = 0.0, np.inf
            for k in range(3):
                a, b = low[cell, k] - eye[k], high[cell, k] - eye[k]
                if ray[i, k] == 0.0:
                    if a > 0.0 or b < 0.0:
                        end = -1.0
                    continue
                a, b = a / ray[i, k], b / ray[i, k]
                begin, end = max(begin, min(a, b)), min(end, max(a, b))
            if begin <= end < nearest:
                nearest, nearest_cell = end, cell
        if nearest_cell >= 0:
            share[nearest_cell] += 1.0 / len(owner)


@plain_kernel
def picture(
    start: int, end: int, cell: Numbers, texture: Numbers, error: Singles,
    square: Singles, need: Singles, loaded: Bools, column: Ints, source: Ints, state: Ints,
    colored: bool, shown: Bools, drawn: Bools,
) -> tuple[float, float, float]:  # fmt: skip
    """Sums up the rows of a frame: mean error, mean squared error, and the share of wanted levels
    that is missing. Marks what is displayed.

    Parameters
    ----------
    cell, texture, error, square, need: see `WalkViews`. loaded: (C,) whether the geometry is
        loaded. column, source, state: (T,) resident column, its source, and its state (`Lossy`).
    colored: whether mean colours are known.
    shown: (R, K) becomes true for columns that were wanted and resident. drawn: (C,) the same for
        geometry.
    """
    mean, squared, missing, wanted = 0.0, 0.0, 0.0, 0.0
    for r in range(start, end):
        t = texture[r]
        if not loaded[cell[r]]:
            mean += error[r, 0]
            squared += square[r, 0]
            if t >= 0:
                for k in range(need.shape[1]):
                    wanted += need[r, k]
                    missing += need[r, k]
            continue
        drawn[cell[r]] = True
        if t < 0:
            continue
        resident = column[t]
        at = state[t] + 1 if resident > 0 else (1 if colored else 0)
        mean += error[r, at]
        squared += square[r, at]
        for k in range(need.shape[1]):
            wanted += need[r, k]
            if k >= resident:
                missing += need[r, k]
            elif need[r, k] > 0.0:
                shown[source[t], k + 1] = True
    return mean, squared, missing / wanted if wanted > 0.0 else 0.0
