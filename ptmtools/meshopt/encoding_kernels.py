"""Compiled encoders of meshopt's streams of attributes and triangles (`ptmtools.meshopt.encoding`),
and the order of triangles that suits the second.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.jit import inlined_kernel, kernel, plain_kernel
from ptmtools.meshopt.decoding_kernels import BLOCK, BLOCK_BYTES, GROUP

_Bytes = NDArray[np.uint8]
#: Entries of the lists of recent edges and vertices; the first entries that a code can name.
_RECENT, _EDGES, _VERTICES = 16, 15, 13


@kernel
def encode_attributes(element: _Bytes, modes: int, out: _Bytes) -> int:
    """Mode 0, version 0, without head and tail. Returns the number of bytes.

    Parameters
    ----------
    element: (count, stride); the stride is a multiple of 4, at most 256.
    modes: which widths of deltas are used: a sum of 2 (2 bits) and 4 (4 bits); 0 and 8 bits
        always are.
    out: room for stride * (count + 16) * 5 / 4 bytes.
    """
    count, stride = element.shape
    block = min(BLOCK_BYTES // stride // GROUP * GROUP, BLOCK)
    delta = np.zeros(BLOCK, dtype=np.uint8)
    at = 0
    for first in range(0, count, block):
        n = min(block, count - first)
        groups = (n + GROUP - 1) // GROUP
        for byte in range(stride):
            last = int(np.int64(element[max(first - 1, 0), byte]))
            delta[:] = 0
            for i in range(n):
                value = int(np.int64(element[first + i, byte]))
                step = (value - last) & 0xFF
                delta[i] = ((step << 1) ^ (0xFF if step & 0x80 else 0)) & 0xFF
                last = value
            header = at
            at += (groups + 3) // 4
            out[header:at] = 0
            for group in range(groups):
                part = delta[GROUP * group : GROUP * (group + 1)]
                mode = _narrowest(part, modes)
                out[header + group // 4] |= mode << (2 * (group % 4))
                at = _put_group(part, mode, out, at)
    return at


@plain_kernel
def _narrowest(delta: _Bytes, modes: int) -> int:
    """The mode with the fewest bytes: 0, 2, 4 or 8 bits for each delta."""
    if not delta.any():
        return 0
    best, least = 3, GROUP
    for mode in range(1, 3):
        if modes & (1 << mode):
            bits = 1 << mode
            size = 2 * bits
            for d in delta:
                if d >= (1 << bits) - 1:
                    size += 1
            if size < least:
                best, least = mode, size
    return best


@plain_kernel
def _put_group(delta: _Bytes, mode: int, out: _Bytes, at: int) -> int:
    """Writes a group; returns the position behind it."""
    if mode == 0:
        return at
    if mode == 3:
        for i in range(GROUP):
            out[at + i] = delta[i]
        return at + GROUP
    bits = 1 << mode
    sentinel, more = (1 << bits) - 1, at + 2 * bits
    for i in range(at, more):
        out[i] = 0
    for i in range(GROUP):
        value = int(np.int64(delta[i]))
        if value >= sentinel:
            out[more] = value
            more += 1
            value = sentinel
        place = i * bits
        out[at + place // 8] |= value << (8 - bits - place % 8)
    return more


@kernel
def encode_triangles(
    corner: NDArray[np.int64], table: _Bytes, frequency: NDArray[np.int64], out: _Bytes
) -> int:
    """Mode 1, version 1, without head and table. Returns the number of bytes.

    Parameters
    ----------
    corner: (m, 3) corners of triangles, each below 2^32.
    table: (14,) pairs of codes of second and third corners, of which 0 is one.
    frequency: (256,) counts of the pairs that a table could hold.
    out: room for 17 * m bytes: m codes, then pairs and explicit corners.
    """
    m = len(corner)
    edge = np.full((_RECENT, 2), -1, dtype=np.int64)
    vertex = np.full(_RECENT, -1, dtype=np.int64)
    # Counts of edges and vertices, the next new vertex, the last explicit one, the next byte.
    state = np.array([0, 0, 0, 0, m])
    for t in range(m):
        place, turn = _recent_edge(corner[t], edge, state[0])
        if place < 0:
            turn = 0
            for k in range(2, -1, -1):
                if corner[t, k] == state[2]:
                    turn = k
        a, b, c = corner[t, turn], corner[t, (turn + 1) % 3], corner[t, (turn + 2) % 3]
        if place >= 0:
            out[t] = place << 4 | _third_code(c, vertex, state, out)
        else:
            is_next = a == state[2]
            if is_next:
                state[2] += 1
            code_b = _corner_code(b, vertex, state)
            code_c = _corner_code(c, vertex, state)
            pair = code_b << 4 | code_c
            listed = -1
            if is_next and code_b < 15 and code_c < 15:
                frequency[pair] += 1
                listed = _table_place(pair, table)
            if listed >= 0:
                out[t] = 0xF0 | listed
            else:
                out[t] = 0xFE if is_next else 0xFF
                out[state[4]] = pair
                state[4] += 1
            if not is_next:
                _put_index(a, state, out)
            if code_b == 15:
                _put_index(b, state, out)
            if code_c == 15:
                _put_index(c, state, out)
            _remember(vertex, a, state)
            if code_b in (0, 15):
                _remember(vertex, b, state)
            if code_c in (0, 15):
                _remember(vertex, c, state)
            edge[state[0] % _RECENT] = b, a
            state[0] += 1
        edge[state[0] % _RECENT] = c, b
        edge[(state[0] + 1) % _RECENT] = a, c
        state[0] += 2
    return int(state[4])


@inlined_kernel
def _third_code(c: int, vertex: NDArray[np.int64], state: NDArray[np.int64], out: _Bytes) -> int:
    """The code of the third corner of a triangle with a recent edge: the next new vertex, a recent
    one, a neighbour of the last explicit one, or an explicit one, which is written."""
    code = _recent_vertex(c, vertex, state[1])
    if 1 <= code < _VERTICES:
        return code
    if c == state[2]:
        code = 0
        state[2] += 1
    elif abs(c - state[3]) == 1:
        code = 13 if c < state[3] else 14
        state[3] = c
    else:
        code = 15
        _put_index(c, state, out)
    _remember(vertex, c, state)
    return code


@inlined_kernel
def _table_place(pair: int, table: _Bytes) -> int:
    """The first place of a pair in a table, -1 for none."""
    for k in range(len(table)):
        if table[k] == pair:
            return k
    return -1


@plain_kernel
def _recent_edge(corner: NDArray[np.int64], edge: NDArray[np.int64], count: int) -> tuple[int, int]:
    """How many edges ago one of a triangle's was last stored, and at which corner it begins; -1, 0
    if a code cannot name it."""
    for place in range(min(count, _EDGES)):
        a, b = edge[(count - 1 - place) % _RECENT]
        for turn in range(3):
            if corner[turn] == a and corner[(turn + 1) % 3] == b:
                return place, turn
    return -1, 0


@plain_kernel
def _recent_vertex(value: int, vertex: NDArray[np.int64], count: int) -> int:
    """How many vertices ago a vertex was last stored; -1 if it is not among the recent ones."""
    for place in range(min(count, _RECENT)):
        if vertex[(count - 1 - place) % _RECENT] == value:
            return place
    return -1


@plain_kernel
def _corner_code(value: int, vertex: NDArray[np.int64], state: NDArray[np.int64]) -> int:
    """The code of a second or third corner: a recent vertex, the next, or 15, an explicit one."""
    place = _recent_vertex(value, vertex, state[1])
    if 0 <= place < 14:
        return place + 1
    if value == state[2]:
        state[2] += 1
        return 0
    return 15


@plain_kernel
def _remember(vertex: NDArray[np.int64], value: int, state: NDArray[np.int64]) -> None:
    vertex[state[1] % _RECENT] = value
    state[1] += 1


@plain_kernel
def _put_index(value: int, state: NDArray[np.int64], out: _Bytes) -> None:
    """Writes an explicit vertex as its difference from the last one, LEB128."""
    step = value - state[3]
    rest = ((step << 1) ^ (step >> 63)) & 0xFFFFFFFF
    state[3] = value
    while rest > 0x7F:
        out[state[4]] = rest & 0x7F | 0x80
        state[4] += 1
        rest >>= 7
    out[state[4]] = rest
    state[4] += 1


@kernel
def strip_order(
    corner: NDArray[np.int64],
    start: NDArray[np.int64],
    holder: NDArray[np.int64],
    earliest: bool,
    order: NDArray[np.int64],
) -> None:
    """The order of triangles in which each shares one of the recent edges, where any is left.

    Parameters
    ----------
    corner: (m, 3) corners of triangles.
    start, holder: CSR, for each vertex the triangles that it is a corner of, ascending.
    earliest: takes the first of such triangles; else that of the latest edge.
    order: (m,) the triangles in their new order.
    """
    m = len(corner)
    edge = np.full((_RECENT, 2), -1, dtype=np.int64)
    taken = np.zeros(m, dtype=np.bool_)
    count, first = 0, 0
    for n in range(m):
        best = -1
        for place in range(min(count, _EDGES)):
            a, b = edge[(count - 1 - place) % _RECENT]
            for k in range(start[a], start[a + 1]):
                t = holder[k]
                if not taken[t] and (best < 0 or (earliest and t < best)):
                    for turn in range(3):
                        if corner[t, turn] == a and corner[t, (turn + 1) % 3] == b:
                            best = t
        place, turn = -1, 0
        if best < 0:
            while taken[first]:
                first += 1
            best = first
        else:
            place, turn = _recent_edge(corner[best], edge, count)
        taken[best] = True
        order[n] = best
        a, b, c = corner[best, turn], corner[best, (turn + 1) % 3], corner[best, (turn + 2) % 3]
        if place < 0:
            edge[count % _RECENT] = b, a
            count += 1
        edge[count % _RECENT] = c, b
        edge[(count + 1) % _RECENT] = a, c
        count += 2
