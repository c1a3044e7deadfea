"""Compiled loops: growth of flat regions over a mesh (`fabric`), connected indices (`search`),
descent of whole triangles through a BSP tree (`ownership`), points above floors (`model`), shadows
near regions of floor (`places`), polygons that meet (`rooms`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.jit import plain_kernel, plain_kernel as kernel


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
    """Grows flat regions and returns their number.

    A region begins with a seed and takes in triangles beyond its edges whose new corner lies in its
    plane, the mean of its triangles so far.

    Parameters
    ----------
    point, triangle, beyond: (V, 3), (n, 3) and (n, 3), as in `Welded` and `across_edges`.
    normal: (n, 3) normals, twice as long as the triangles are large; those of one plane point to
        one side.
    seeds: (n,) the triangles in the order in which they may begin a region.
    slack: metres from the plane within which a corner lies in it.
    region: (n,) -1; receives the region of each triangle.
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
                neighbour = beyond[t, k]
                if neighbour < 0 or region[neighbour] >= 0:
                    continue
                if (
                    normal[neighbour, 0] * nx
                    + normal[neighbour, 1] * ny
                    + normal[neighbour, 2] * nz
                    <= 0.0
                ):
                    continue
                flat = True
                for c in range(3):
                    v = triangle[neighbour, c]
                    away = nx * (point[v, 0] - px) + ny * (point[v, 1] - py)
                    away += nz * (point[v, 2] - pz)
                    flat &= abs(away) <= slack * size
                if flat:
                    region[neighbour] = count
                    queue[tail] = neighbour
                    tail += 1
        count += 1
    return count


@kernel
def connect_rows(row: Ints, parent: Ints) -> None:
    """Joins the indices in each of (n, k) rows in ``parent``, (count,), at first each its own;
    afterwards each index names the least index to which rows connect it."""
    for r in range(len(row)):
        for k in range(1, row.shape[1]):
            a, b = row[r, 0], row[r, k]
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
    for v in range(len(parent)):  # the parent has a lower number, and is final
        parent[v] = parent[parent[v]]


@kernel
def sink(
    plane: Floats,
    child: NDArray[np.int32],
    corner: Floats,
    facing: Floats,
    slack: float,
    at: Ints,
    lying: Bools,
) -> None:
    """Lets triangles sink until a plane cuts them.

    Parameters
    ----------
    plane, child: (N, 4), (N, 2), the tree, as `Cells.node_plane` and `Cells.node_child`.
    corner, facing: (n, 3, 3) triangles, and (n, 3) the side to which each goes where it lies in a
        plane.
    slack: metres from a plane within which a corner lies in it.
    at: (n,) the node where each begins; receives the node that cuts it, or leaf i as -2 - i.
    lying: (n,) set for triangles in the plane of a node on the way.
    """
    for i in range(len(at)):
        node = at[i]
        while node >= 0:
            a, b, c, d = plane[node, 0], plane[node, 1], plane[node, 2], plane[node, 3]
            ahead = behind = False
            for k in range(3):
                away = corner[i, k, 0] * a + corner[i, k, 1] * b + corner[i, k, 2] * c + d
                ahead |= away > slack
                behind |= away < -slack
            if ahead and behind:
                break
            if not ahead and not behind:
                lying[i] = True
                ahead = facing[i, 0] * a + facing[i, 1] * b + facing[i, 2] * c > 0
            node = child[node, 0 if ahead else 1]
        at[i] = node


@plain_kernel
def above_floor(
    points: Floats, floor: Floats, first: Ints, end: Ints, reach: float, inside: Bools
) -> None:
    """Sets ``inside`` (n,) for those of the (n, 3) points that are over one of the (m, 3, 3)
    triangles and at most ``reach`` above it; each triangle is compared with the points from its
    ``first`` to its ``end`` (m,)."""
    for t in range(len(floor)):
        a, b, c = floor[t, 0], floor[t, 1], floor[t, 2]
        low, high = min(a[1], b[1], c[1]), max(a[1], b[1], c[1]) + reach
        for i in range(first[t], end[t]):
            p = points[i]
            if inside[i] or not low <= p[1] <= high:
                continue
            # Exactly opposite for an edge and its reverse.
            u = (b[0] - p[0]) * (c[2] - p[2]) - (b[2] - p[2]) * (c[0] - p[0])
            v = (c[0] - p[0]) * (a[2] - p[2]) - (c[2] - p[2]) * (a[0] - p[0])
            w = (a[0] - p[0]) * (b[2] - p[2]) - (a[2] - p[2]) * (b[0] - p[0])
            if (u >= 0 and v >= 0 and w >= 0) or (u <= 0 and v <= 0 and w <= 0):
                whole = u + v + w
                if whole != 0:
                    over = p[1] - (u * a[1] + v * b[1] + w * c[1]) / whole
                    inside[i] = 0 <= over <= reach


@plain_kernel
def shadows_near(
    corner: Floats,
    farthest: Floats,
    point: Floats,
    start: Ints,
    slope: Floats,
    band: tuple[float, float],
    reach: float,
    shadow: Floats,
    pairs: Ints,
) -> int:
    """The number of pairs of a region of floor and a triangle whose shadow, the part in a band of
    heights above the region in plan, is within reach of its hull: no axis square to a side of one
    of them separates them by more. As many as fit are written to ``pairs``, by regions.

    Parameters
    ----------
    corner: (n, 3, 3) triangles by their least x.
    farthest: (n,) the greatest x of each and those before it.
    point, start: (m, 2) corners in plan of the hulls, counter-clockwise, closed, and their CSR.
    slope: (r, 3) of regions whose heights are a·x + b·z + c.
    band, reach: metres.
    shadow: (9, 2) storage.
    pairs: (2, p) receives regions and triangles.
    """
    number = 0
    for r in range(len(slope)):
        hull = point[start[r] : start[r + 1]]
        x0 = z0 = np.inf
        x1 = z1 = -np.inf
        for k in range(len(hull)):
            x0, x1 = min(x0, hull[k, 0] - reach), max(x1, hull[k, 0] + reach)
            z0, z1 = min(z0, hull[k, 1] - reach), max(z1, hull[k, 1] + reach)
        for i in range(np.searchsorted(farthest, x0), len(corner)):
            a, b, c = corner[i, 0], corner[i, 1], corner[i, 2]
            if min(a[0], b[0], c[0]) > x1:
                break
            if max(a[0], b[0], c[0]) < x0:
                continue
            if max(a[2], b[2], c[2]) < z0 or min(a[2], b[2], c[2]) > z1:
                continue
            count = cast_shadow(corner[i], slope[r], band, shadow)
            if count and not sides_separate(corner[i], shadow[:count], hull, reach):
                if number < pairs.shape[1]:
                    pairs[0, number], pairs[1, number] = r, i
                number += 1
    return number


@plain_kernel
def cast_shadow(corner: Floats, slope: Floats, band: tuple[float, float], shadow: Floats) -> int:
    """The number of points written to ``shadow``, (9, 2), whose hull is the shadow of a triangle,
    (3, 3); see `shadows_near`."""
    count = 0
    for k in range(3):
        p, q = corner[k], corner[(k + 1) % 3]
        above = p[1] - (p[0] * slope[0] + p[2] * slope[1]) - slope[2]
        beyond = q[1] - (q[0] * slope[0] + q[2] * slope[1]) - slope[2]
        if band[0] <= above <= band[1]:
            shadow[count, 0], shadow[count, 1] = p[0], p[2]
            count += 1
        for level in band:
            if (above - level) * (beyond - level) < 0:
                share = (level - above) / (beyond - above)
                shadow[count, 0] = p[0] + share * (q[0] - p[0])
                shadow[count, 1] = p[2] + share * (q[2] - p[2])
                count += 1
    return count


@plain_kernel
def sides_separate(corner: Floats, shadow: Floats, hull: Floats, reach: float) -> bool:
    """Whether a side of a hull, or of a triangle, (3, 3), in plan, separates a shadow from the hull
    by more than ``reach``; see `shadows_near`."""
    for k in range(len(hull) - 1):
        x, z = hull[k + 1, 1] - hull[k, 1], hull[k, 0] - hull[k + 1, 0]
        limit = x * hull[k, 0] + z * hull[k, 1] + reach * (x * x + z * z) ** 0.5
        beside = True
        for s in range(len(shadow)):
            beside &= x * shadow[s, 0] + z * shadow[s, 1] > limit
        if beside:
            return True
    for k in range(3):
        p, q = corner[k], corner[(k + 1) % 3]
        x, z = q[2] - p[2], p[0] - q[0]
        margin = reach * (x * x + z * z) ** 0.5
        least, greatest = np.inf, -np.inf
        for s in range(len(shadow)):
            away = x * shadow[s, 0] + z * shadow[s, 1]
            least, greatest = min(least, away - margin), max(greatest, away + margin)
        before = after = True
        for s in range(len(hull)):
            away = x * hull[s, 0] + z * hull[s, 1]
            before &= away < least
            after &= away > greatest
        if before or after:
            return True
    return False


@plain_kernel
def outlines_meet(point: Floats, start: Ints, pairs: Ints, near: float, meets: Bools) -> None:
    """Sets ``meets``, (n,), for those of (n, 2) pairs of polygons, given by (p, 3) corners and
    their CSR, of which one has a corner within ``near`` of the outline of the other."""
    for i in range(len(pairs)):
        a = point[start[pairs[i, 0]] : start[pairs[i, 0] + 1]]
        b = point[start[pairs[i, 1]] : start[pairs[i, 1] + 1]]
        meets[i] = corner_near(a, b, near) or corner_near(b, a, near)


@plain_kernel
def corner_near(corner: Floats, polygon: Floats, near: float) -> bool:
    """Whether one of (n, 3) points is within ``near`` of the outline of an (m, 3) polygon."""
    for e in range(len(polygon)):
        p, q = polygon[e], polygon[(e + 1) % len(polygon)]
        x, y, z = q[0] - p[0], q[1] - p[1], q[2] - p[2]
        square = x * x + y * y + z * z
        for k in range(len(corner)):
            u, v, w = corner[k, 0] - p[0], corner[k, 1] - p[1], corner[k, 2] - p[2]
            share = (u * x + v * y + w * z) / square if square > 0.0 else 0.0
            share = min(max(share, 0.0), 1.0)
            u, v, w = u - share * x, v - share * y, w - share * z
            if u * u + v * v + w * w <= near * near:
                return True
    return False
