"""Compiled growth of flat regions over a mesh, and of what hangs together (see `facets`)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints
from ptmtools.compiled import plain_kernel as kernel


@kernel
def grow_regions(
    point: Floats,
    triangle: NDArray[np.int32],
    beyond: NDArray[np.int32],
    normal: Floats,
    seeds: Ints,
    slack: float,
    region: Ints,
    queue: Ints,
) -> int:
    """Grows flat regions and returns how many there are.

    A region begins with a seed and takes in what lies beyond its edges as long as the corner that
    is new lies in its plane, the mean of what it consists of so far.

    Parameters
    ----------
    point, triangle, beyond: (V, 3), (n, 3) and (n, 3), as `Welded` and `across_edges` have them.
    normal: (n, 3) normals, twice as long as the triangles are large; those of one plane point to
        one side.
    seeds: (n,) the triangles in the order in which they may begin a region.
    slack: metres from the plane at which a corner still lies in it.
    region: (n,) -1, where the number of each one's region is left.
    queue: (n,) storage.
    """
    count = 0
    for s in range(len(seeds)):
        if region[seeds[s]] >= 0:
            continue
        region[seeds[s]] = count
        queue[0] = seeds[s]
        head, tail = 0, 1
        # The region's mean normal, and its middle as seen from a corner of the seed.
        base = triangle[seeds[s], 0]
        nx = ny = nz = mx = my = mz = weight = 0.0
        while head < tail:
            t = queue[head]
            head += 1
            a = (normal[t, 0] ** 2 + normal[t, 1] ** 2 + normal[t, 2] ** 2) ** 0.5
            nx, ny, nz = nx + normal[t, 0], ny + normal[t, 1], nz + normal[t, 2]
            for k in range(3):
                v = triangle[t, k]
                mx += a * (point[v, 0] - point[base, 0])
                my += a * (point[v, 1] - point[base, 1])
                mz += a * (point[v, 2] - point[base, 2])
            weight += 3.0 * a
            size = (nx * nx + ny * ny + nz * nz) ** 0.5
            if weight == 0.0 or size == 0.0:
                break
            px = point[base, 0] + mx / weight
            py = point[base, 1] + my / weight
            pz = point[base, 2] + mz / weight
            for k in range(3):
                other = beyond[t, k]
                if other < 0 or region[other] >= 0:
                    continue
                if normal[other, 0] * nx + normal[other, 1] * ny + normal[other, 2] * nz <= 0.0:
                    continue
                flat = True
                for c in range(3):
                    v = triangle[other, c]
                    away = nx * (point[v, 0] - px) + ny * (point[v, 1] - py)
                    away += nz * (point[v, 2] - pz)
                    flat &= abs(away) <= slack * size
                if flat:
                    region[other] = count
                    queue[tail] = other
                    tail += 1
        count += 1
    return count


@kernel
def hang_together(triangle: NDArray[np.int32], parent: Ints) -> None:
    """Joins the corners of each of (n, 3) triangles in ``parent``, (V,) at first each its own, in
    which each point then names, over others or at once, the least that it hangs together with."""
    for t in range(len(triangle)):
        for k in range(1, 3):
            a, b = triangle[t, 0], triangle[t, k]
            while parent[a] != a:
                parent[a] = parent[parent[a]]
                a = parent[a]
            while parent[b] != b:
                parent[b] = parent[parent[b]]
                b = parent[b]
            if a < b:
                parent[b] = a
            else:
                parent[a] = b
    for v in range(len(parent)):  # whoever it names has a lower number, and is done
        parent[v] = parent[parent[v]]
