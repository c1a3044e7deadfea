"""Compiled legality tests of edge collapses.

A collapse is illegal if it violates the link condition (the common neighbours of both ends are
exactly the third vertices of the faces at the edge; otherwise edges of three faces or coincident
faces arise), if a line of constrained edges would end or touch itself, if a face would flip or
degenerate, or if a wedge of the removed vertex has no counterpart at the remaining one.
"""

from __future__ import annotations

from ptmtools.jit import plain_kernel as kernel
from ptmtools.simplification.state_kernels import DROP_PARTS, FACES, MARKS, TOPOLOGY, CollapseState
from ptmtools.tolerance import FILE_SHARE

#: A face is degenerate if its height is less than this share of its longest side.
DEGENERATE_HEIGHT = 10 * FILE_SHARE
#: Limits of a face's turn: the least cosine between its old and new normal; the same for a thin
#: face; the ratio of height to longest side below which a face is thin. The relaxed limits apply
#: when no collapse within the strict ones remains.
STRICT_LIMITS, RELAXED_LIMITS = (0.5, 0.95, 0.05), (0.2, 0.2, 0.0)


@kernel
def mark_neighbours(state: CollapseState, u: int, v: int) -> int:
    """Marks the vertices of the faces of v, except u and v, and returns the new mark."""
    neighbour, corner = state.counters[MARKS] + 1, state.head[v]
    state.counters[MARKS] = neighbour
    while corner >= 0:
        for k in range(3):
            state.mark[state.triangle[corner // 3, k]] = neighbour
        corner = state.next_corner[corner]
    state.mark[u] = state.mark[v] = 0
    return int(neighbour)


@kernel
def satisfies_link_condition(state: CollapseState, u: int, v: int, count: int) -> bool:
    """Tests the link condition of an edge whose faces are the first ``count`` rows of ``shared``.

    False also if a line of constrained edges would end or touch itself.
    """
    triangle, mark, shared = state.triangle, state.mark, state.shared
    for i in range(count):
        if shared[i, 4] and shared[i, 5]:
            return False
    neighbour = mark_neighbours(state, u, v)
    common = neighbour + 1
    state.counters[MARKS] = common
    common_count, corner = 0, state.head[u]
    while corner >= 0:
        t = corner // 3
        for k in range(3):
            if mark[triangle[t, k]] == neighbour:
                mark[triangle[t, k]] = common
                common_count += 1
        corner = state.next_corner[corner]
    if common_count != count:
        return False
    for i in range(count):
        if mark[shared[i, 2]] != common:
            return False
    # A face of u must not coincide with a face of v after the collapse.
    corner = state.head[u]
    while corner >= 0:
        t, k = corner // 3, corner % 3
        x, y = triangle[t, (k + 1) % 3], triangle[t, (k + 2) % 3]
        if mark[x] == common and mark[y] == common:
            candidate = state.head[v]
            while candidate >= 0:
                s, j = candidate // 3, candidate % 3
                p, q = triangle[s, (j + 1) % 3], triangle[s, (j + 2) % 3]
                if (p == x and q == y) or (p == y and q == x):
                    return False
                candidate = state.next_corner[candidate]
        corner = state.next_corner[corner]
    return True


@kernel
def valence(state: CollapseState, v: int) -> int:
    """Returns the number of faces of a vertex."""
    result, corner = 0, state.head[v]
    while corner >= 0:
        result += state.triangle[corner // 3, 0] >= 0
        corner = state.next_corner[corner]
    return result


@kernel
def is_isolated_face(state: CollapseState, u: int, v: int, count: int) -> bool:
    """Whether the face at an edge is the only face of each of its vertices."""
    if count != 1 or valence(state, u) > 1 or valence(state, v) > 1:
        return False
    return valence(state, state.shared[0, 2]) == 1


@kernel
def may_change_topology(state: CollapseState, u: int, v: int, count: int) -> bool:
    """Tests an edge where collapses may close handles.

    Further connections between the ends become edges of four faces, and faces that coincide with
    opposite orientation are removed (`collapse_kernels.remove_opposite_faces`). False if a line of
    constrained edges would touch another edge, or a face coincide with one of the same orientation.
    An isolated face may vanish with `DROP_PARTS`.
    """
    triangle, constraint, mark, shared = state.triangle, state.constraint, state.mark, state.shared
    if valence(state, u) + valence(state, v) - count >= state.counters[FACES]:
        # The collapse might remove the last faces.
        return satisfies_link_condition(state, u, v, count)
    if state.counters[TOPOLOGY] == DROP_PARTS and is_isolated_face(state, u, v, count):
        return True
    for i in range(count):
        if shared[i, 4] and shared[i, 5]:
            return False
    neighbour = mark_neighbours(state, u, v)
    third, common = neighbour + 1, neighbour + 2
    state.counters[MARKS] = common
    for i in range(count):
        mark[shared[i, 2]] = third
    corner = state.head[u]
    while corner >= 0:
        t, k = corner // 3, corner % 3
        corner = state.next_corner[corner]
        x, y = triangle[t, (k + 1) % 3], triangle[t, (k + 2) % 3]
        if mark[x] == neighbour or mark[x] == common:
            if (constraint[t] >> k) & 1:
                return False
            mark[x] = common
        if mark[y] == neighbour or mark[y] == common:
            if (constraint[t] >> ((k + 2) % 3)) & 1:
                return False
            mark[y] = common
        if mark[x] < neighbour or mark[y] < neighbour:
            continue
        candidate = state.head[v]
        while candidate >= 0:
            s, j = candidate // 3, candidate % 3
            if triangle[s, (j + 1) % 3] == x and triangle[s, (j + 2) % 3] == y:
                return False
            candidate = state.next_corner[candidate]
    corner = state.head[v]
    while corner >= 0:
        t, k = corner // 3, corner % 3
        corner = state.next_corner[corner]
        x, y = triangle[t, (k + 1) % 3], triangle[t, (k + 2) % 3]
        if mark[x] == common and (constraint[t] >> k) & 1:
            return False
        if mark[y] == common and (constraint[t] >> ((k + 2) % 3)) & 1:
            return False
    return True


@kernel
def has_counterpart_wedges(state: CollapseState, u: int, v: int, count: int) -> bool:
    """Whether each wedge of u maps to one wedge of v across the faces of the edge, the first
    ``count`` rows of ``shared``."""
    shared, wedge = state.shared, state.wedge
    for i in range(count):
        for j in range(i):
            if shared[i, 0] == shared[j, 0] and shared[i, 1] != shared[j, 1]:
                return False
    corner = state.head[u]
    while corner >= 0:
        counterpart = wedge[corner // 3, corner % 3]
        mapped = False
        for i in range(count):
            mapped |= shared[i, 0] == counterpart
        if not mapped:
            return False
        corner = state.next_corner[corner]
    return True


@kernel
def preserves_faces(state: CollapseState, u: int, v: int, px: float, py: float, pz: float) -> bool:
    """Whether no face of u without v flips or degenerates when u moves to (px, py, pz)."""
    triangle, point = state.triangle, state.point
    regular_cosine, thin_cosine, thin_height = (
        state.turn_limits[0],
        state.turn_limits[1],
        state.turn_limits[2],
    )
    corner = state.head[u]
    while corner >= 0:
        t, k = corner // 3, corner % 3
        corner = state.next_corner[corner]
        a, b = triangle[t, (k + 1) % 3], triangle[t, (k + 2) % 3]
        if a == v or b == v:
            continue
        ex, ey, ez = (
            point[b, 0] - point[a, 0],
            point[b, 1] - point[a, 1],
            point[b, 2] - point[a, 2],
        )
        ox, oy, oz = (
            point[u, 0] - point[a, 0],
            point[u, 1] - point[a, 1],
            point[u, 2] - point[a, 2],
        )
        nx, ny, nz = px - point[a, 0], py - point[a, 1], pz - point[a, 2]
        bx, by, bz = ey * oz - ez * oy, ez * ox - ex * oz, ex * oy - ey * ox
        ax, ay, az = ey * nz - ez * ny, ez * nx - ex * nz, ex * ny - ey * nx
        old, new = bx * bx + by * by + bz * bz, ax * ax + ay * ay + az * az
        # Ratio of height to longest side: twice the area over the square of the longest side.
        side = ex * ex + ey * ey + ez * ez
        old_side = max(side, ox * ox + oy * oy + oz * oz)
        old_side = max(old_side, (ox - ex) ** 2 + (oy - ey) ** 2 + (oz - ez) ** 2)
        new_side = max(side, nx * nx + ny * ny + nz * nz)
        new_side = max(new_side, (nx - ex) ** 2 + (ny - ey) ** 2 + (nz - ez) ** 2)
        was_degenerate = old <= (DEGENERATE_HEIGHT * old_side) ** 2
        if new <= (DEGENERATE_HEIGHT * new_side) ** 2:
            if not was_degenerate or new * old_side**2 < old * new_side**2 or new == 0.0:
                return False
        elif not was_degenerate:
            min_cosine = thin_cosine if new < (thin_height * new_side) ** 2 else regular_cosine
            if ax * bx + ay * by + az * bz < min_cosine * (old * new) ** 0.5:
                return False
    return True
