"""Compiled checks: whether an edge may collapse.

It may not if the vertices that both ends know are others than those of the faces that vanish (the
link condition: edges of three faces would arise, or faces that coincide), if a line of kept edges
would end or meet itself, if a face would turn or become a line, or if a wedge of the vertex that
goes has no counterpart at the one that stays.
"""

from __future__ import annotations

from ptmtools.jit import plain_kernel as kernel
from ptmtools.simplification.state_kernels import DROP, FACES, MARKS, TOPOLOGY, State
from ptmtools.tolerance import FILE_SHARE

#: A face is a line if its height is less than this share of its longest side.
LINE_HEIGHT = 10 * FILE_SHARE
#: A face turns if the cosine between its normals before and after is less than the first number;
#: one whose height is less than the third as a share of its longest side, if less than the second.
#: What is refused carefully may be done when nothing else is left.
CAREFUL, CARELESS = (0.5, 0.95, 0.05), (0.2, 0.2, 0.0)


@kernel
def marked_around(state: State, u: int, v: int) -> int:
    """A new mark, which the vertices of v's faces have now, but for u and v."""
    near, corner = state.number[MARKS] + 1, state.head[v]
    state.number[MARKS] = near
    while corner >= 0:
        for k in range(3):
            state.mark[state.triangle[corner // 3, k]] = near
        corner = state.beyond[corner]
    state.mark[u] = state.mark[v] = 0
    return int(near)


@kernel
def is_linked(state: State, u: int, v: int, count: int) -> bool:
    """Whether the faces at an edge, ``count`` rows of ``shared``, are all that joins its ends, and
    no line of kept edges would end or meet itself."""
    triangle, mark, shared = state.triangle, state.mark, state.shared
    for i in range(count):
        if shared[i, 4] and shared[i, 5]:
            return False
    near = marked_around(state, u, v)
    common = near + 1
    state.number[MARKS] = common
    both, corner = 0, state.head[u]
    while corner >= 0:
        t = corner // 3
        for k in range(3):
            if mark[triangle[t, k]] == near:
                mark[triangle[t, k]] = common
                both += 1
        corner = state.beyond[corner]
    if both != count:
        return False
    for i in range(count):
        if mark[shared[i, 2]] != common:
            return False
    # A face of u that would become one of v.
    corner = state.head[u]
    while corner >= 0:
        t, k = corner // 3, corner % 3
        x, y = triangle[t, (k + 1) % 3], triangle[t, (k + 2) % 3]
        if mark[x] == common and mark[y] == common:
            other = state.head[v]
            while other >= 0:
                s, j = other // 3, other % 3
                p, q = triangle[s, (j + 1) % 3], triangle[s, (j + 2) % 3]
                if (p == x and q == y) or (p == y and q == x):
                    return False
                other = state.beyond[other]
        corner = state.beyond[corner]
    return True


@kernel
def faces_at(state: State, v: int) -> int:
    """How many faces a vertex has."""
    result, corner = 0, state.head[v]
    while corner >= 0:
        result += state.triangle[corner // 3, 0] >= 0
        corner = state.beyond[corner]
    return result


@kernel
def is_alone(state: State, u: int, v: int, count: int) -> bool:
    """Whether the face at an edge is the only one of all its vertices."""
    if count != 1 or faces_at(state, u) > 1 or faces_at(state, v) > 1:
        return False
    return faces_at(state, state.shared[0, 2]) == 1


@kernel
def may_close(state: State, u: int, v: int, count: int) -> bool:
    """The same where handles may be closed: what joins the ends besides their faces becomes edges
    of four faces, and faces that fall onto each other back to back are gone (`cancel`).

    No line of kept edges may fall onto anything, and no face onto one that looks the same way. A
    face by itself may vanish where parts with a border may.
    """
    triangle, kept, mark, shared = state.triangle, state.kept, state.mark, state.shared
    if faces_at(state, u) + faces_at(state, v) - count >= state.number[FACES]:
        # Nothing might be left.
        return is_linked(state, u, v, count)
    if state.number[TOPOLOGY] == DROP and is_alone(state, u, v, count):
        return True
    for i in range(count):
        if shared[i, 4] and shared[i, 5]:
            return False
    near = marked_around(state, u, v)
    third, both = near + 1, near + 2
    state.number[MARKS] = both
    for i in range(count):
        mark[shared[i, 2]] = third
    corner = state.head[u]
    while corner >= 0:
        t, k = corner // 3, corner % 3
        corner = state.beyond[corner]
        x, y = triangle[t, (k + 1) % 3], triangle[t, (k + 2) % 3]
        if mark[x] == near or mark[x] == both:
            if (kept[t] >> k) & 1:
                return False
            mark[x] = both
        if mark[y] == near or mark[y] == both:
            if (kept[t] >> ((k + 2) % 3)) & 1:
                return False
            mark[y] = both
        if mark[x] < near or mark[y] < near:
            continue
        other = state.head[v]
        while other >= 0:
            s, j = other // 3, other % 3
            if triangle[s, (j + 1) % 3] == x and triangle[s, (j + 2) % 3] == y:
                return False
            other = state.beyond[other]
    corner = state.head[v]
    while corner >= 0:
        t, k = corner // 3, corner % 3
        corner = state.beyond[corner]
        x, y = triangle[t, (k + 1) % 3], triangle[t, (k + 2) % 3]
        if mark[x] == both and (kept[t] >> k) & 1:
            return False
        if mark[y] == both and (kept[t] >> ((k + 2) % 3)) & 1:
            return False
    return True


@kernel
def has_counterparts(state: State, u: int, v: int, count: int) -> bool:
    """Whether each wedge of u goes on as one of v, by the faces in ``count`` rows of ``shared``."""
    shared, wedge = state.shared, state.wedge
    for i in range(count):
        for j in range(i):
            if shared[i, 0] == shared[j, 0] and shared[i, 1] != shared[j, 1]:
                return False
    corner = state.head[u]
    while corner >= 0:
        other = wedge[corner // 3, corner % 3]
        known = False
        for i in range(count):
            known |= shared[i, 0] == other
        if not known:
            return False
        corner = state.beyond[corner]
    return True


@kernel
def keeps_faces(state: State, u: int, v: int, px: float, py: float, pz: float) -> bool:
    """Whether the faces of u without v stay what they are when u moves there."""
    triangle, point = state.triangle, state.point
    turn, turn_of_thin, thin = state.limits[0], state.limits[1], state.limits[2]
    corner = state.head[u]
    while corner >= 0:
        t, k = corner // 3, corner % 3
        corner = state.beyond[corner]
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
        # Twice the area over the square of the longest side: how high it is for its length.
        side = ex * ex + ey * ey + ez * ez
        old_side = max(side, ox * ox + oy * oy + oz * oz)
        old_side = max(old_side, (ox - ex) ** 2 + (oy - ey) ** 2 + (oz - ez) ** 2)
        new_side = max(side, nx * nx + ny * ny + nz * nz)
        new_side = max(new_side, (nx - ex) ** 2 + (ny - ey) ** 2 + (nz - ez) ** 2)
        was_line = old <= (LINE_HEIGHT * old_side) ** 2
        if new <= (LINE_HEIGHT * new_side) ** 2:
            if not was_line or new * old_side**2 < old * new_side**2 or new == 0.0:
                return False
        elif not was_line:
            least = turn_of_thin if new < (thin * new_side) ** 2 else turn
            if ax * bx + ay * by + az * bz < least * (old * new) ** 0.5:
                return False
    return True
