"""The compiled ear clipping of `polygon`."""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.jit import kernel


@kernel
def clip_ears(flat: Floats, rounding: float, limit: int) -> tuple[Ints, bool, int]:
    """Triangles (k, 3) of an outline (n, 2), counter-clockwise, as indices of its corners; whether
    all are ears; and the number of steps. After ``limit`` steps, or without an ear, the rest
    becomes a fan. Corners whose triangle has less than the area ``rounding`` lie on an edge.
    """
    x, y = flat[:, 0].copy(), flat[:, 1].copy()
    ring = np.arange(len(flat))
    ears = np.empty((len(flat) - 2, 3), np.int64)
    size, count, at, tried, steps = len(flat), 0, 0, 0, 0
    while size > 2:
        a, b, c = ring[(at - 1) % size], ring[at], ring[(at + 1) % size]
        px, py, qx, qy = x[b] - x[a], y[b] - y[a], x[c] - x[b], y[c] - y[b]
        rx, ry = x[a] - x[c], y[a] - y[c]
        area = px * (y[c] - y[a]) - py * (x[c] - x[a])
        ear = area > rounding
        steps += 1
        if ear:
            for k in range(size):
                i = ring[k]
                if (
                    px * (y[i] - y[a]) - py * (x[i] - x[a]) >= 0
                    and qx * (y[i] - y[b]) - qy * (x[i] - x[b]) >= 0
                    and rx * (y[i] - y[c]) - ry * (x[i] - x[c]) >= 0
                    and not (x[i] == x[a] and y[i] == y[a])
                    and not (x[i] == x[b] and y[i] == y[b])
                    and not (x[i] == x[c] and y[i] == y[c])
                ):
                    ear = False
                    break
            steps += k + 1
        if ear or (tried > size and abs(area) <= rounding):
            if ear:
                ears[count] = a, b, c
                count += 1
            size -= 1
            for k in range(at, size):
                ring[k] = ring[k + 1]
            steps += (size - at) // 8
            at, tried = at % size, 0
        else:
            at, tried = (at + 1) % size, tried + 1
            if tried > 2 * size + 2 or steps > limit:
                for k in range(1, size - 1):
                    ears[count] = ring[0], ring[k], ring[k + 1]
                    count += 1
                return ears[:count], False, steps
    return ears[:count], True, steps
