"""Compiled decoders of meshopt's three bit streams (`ptmtools.meshopt.decoding`).

Each returns `DONE`, or the position in the data where these are invalid or truncated. No read or
write leaves its array for any data.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.jit import inlined_kernel, kernel, plain_kernel

DONE = -1
#: Largest number of elements of a block; elements of a group; largest size of a block in bytes.
BLOCK, GROUP, BLOCK_BYTES = 256, 16, 8192
#: Entries of the lists of recent edges and vertices.
_RECENT = 16

_Bytes = NDArray[np.uint8]


@kernel
def decode_attributes(data: _Bytes, end: int, version: int, stride: int, out: _Bytes) -> int:
    """Mode 0, of version 0 or 1.

    Parameters
    ----------
    data: the stream; ``end`` is the start of its tail (padding, baseline, channel modes).
    out: (count, stride) the elements; the stride is a multiple of 4, at most 256.
    """
    count, channels = len(out), stride // 4
    tail = len(data) - (stride + channels if version else stride)
    last = data[tail : tail + stride].copy()
    block = min(BLOCK_BYTES // stride // GROUP * GROUP, BLOCK)
    delta = np.zeros((4, BLOCK), dtype=np.uint8)
    at, first = 1, 0
    while first < count:
        n = min(block, count - first)
        control_at = at
        if version:
            at += channels
            if at > end:
                return at
        for channel in range(channels):
            for byte in range(4):
                control = (
                    int(np.int64(data[control_at + channel])) >> (2 * byte) & 3 if version else 4
                )
                at = _deltas(data, at, end, control, n, delta[byte])
                if at < 0:
                    return -at
            mode = int(np.int64(data[tail + stride + channel])) if version else 0
            if not _accumulate(delta, n, mode, last, 4 * channel, out[first : first + n]):
                return tail + stride + channel
        first += n
    return DONE if at == end else at


@plain_kernel
def _deltas(data: _Bytes, at: int, end: int, control: int, n: int, delta: _Bytes) -> int:
    """Reads the deltas of one byte of the ``n`` elements of a block. Returns the position of the
    next ones, or minus the position where the data are truncated."""
    if control == 2:
        delta[:n] = 0
        return at
    if control == 3:
        if at + n > end:
            return -end
        for i in range(n):
            delta[i] = data[at + i]
        return at + n
    groups = (n + GROUP - 1) // GROUP
    header = at
    at += (groups + 3) // 4
    if at > end:
        return -end
    for group in range(groups):
        mode = int(np.int64(data[header + group // 4])) >> (2 * (group % 4)) & 3
        # Bits for each delta: 0, 1, 2, 4; 1, 2, 4, 8; or, in version 0, 0, 2, 4, 8.
        bits = (1 << mode) >> 1
        if control == 1 or (control == 4 and mode):
            bits = 1 << mode
        first, size = GROUP * group, 2 * bits
        if at + size > end:
            return -end
        if bits == 0:
            delta[first : first + GROUP] = 0
            continue
        if bits == 8:
            for i in range(GROUP):
                delta[first + i] = data[at + i]
            at += GROUP
            continue
        sentinel, more = (1 << bits) - 1, at + size
        for i in range(GROUP):
            place = i * bits
            shift = place % 8 if bits == 1 else 8 - bits - place % 8
            value = int(np.int64(data[at + place // 8])) >> shift & sentinel
            if value == sentinel:
                if more >= end:
                    return -end
                value = int(np.int64(data[more]))
                more += 1
            delta[first + i] = value
        at = more
    return at


@plain_kernel
def _accumulate(delta: _Bytes, n: int, mode: int, last: _Bytes, at: int, out: _Bytes) -> bool:
    """Adds up the deltas of a channel, bytes ``at`` to ``at`` + 4 of elements; False for an invalid
    channel mode. ``last`` is the previous element, and afterwards the last of these."""
    if mode == 0:
        for byte in range(4):
            value = int(np.int64(last[at + byte]))
            for i in range(n):
                d = int(np.int64(delta[byte, i]))
                value = (value + ((d >> 1) ^ -(d & 1))) & 0xFF
                out[i, at + byte] = value
            last[at + byte] = value
        return True
    if mode == 1:
        for half in range(0, 4, 2):
            value = int(np.int64(last[at + half])) | int(np.int64(last[at + half + 1])) << 8
            for i in range(n):
                d = int(np.int64(delta[half, i])) | int(np.int64(delta[half + 1, i])) << 8
                value = (value + ((d >> 1) ^ -(d & 1))) & 0xFFFF
                out[i, at + half] = value & 0xFF
                out[i, at + half + 1] = value >> 8
            last[at + half], last[at + half + 1] = value & 0xFF, value >> 8
        return True
    if mode & 15 != 2:
        return False
    turn = mode >> 4
    value = 0
    for byte in range(4):
        value |= int(np.int64(last[at + byte])) << (8 * byte)
    for i in range(n):
        d = 0
        for byte in range(4):
            d |= int(np.int64(delta[byte, i])) << (8 * byte)
        value ^= (d >> turn | d << (32 - turn)) & 0xFFFFFFFF
        for byte in range(4):
            out[i, at + byte] = (value >> (8 * byte)) & 0xFF
    for byte in range(4):
        last[at + byte] = (value >> (8 * byte)) & 0xFF
    return True


@kernel
def decode_triangles(data: _Bytes, out: NDArray[np.uint32]) -> int:
    """Mode 1; ``out``: (count,) the corners of triangles. The data are long enough for their codes
    and their tail."""
    triangles, end = len(out) // 3, len(data) - 16
    edge = np.zeros((_RECENT, 2), dtype=np.uint32)
    vertex = np.zeros(_RECENT, dtype=np.uint32)
    # Counts of edges and vertices, the next new vertex, the last explicit vertex, and the position
    # of the next explicit one.
    state = np.array([0, 0, 0, 0, 1 + triangles])
    for t in range(triangles):
        code = int(np.int64(data[1 + t]))
        high, low = code >> 4, code & 15
        if high < 15:
            if high >= state[0]:
                return 1 + t
            a, b = edge[(state[0] - 1 - high) % _RECENT]
            if low == 0:
                c = _next(state)
            elif low < 13:
                if low >= state[1]:
                    return 1 + t
                c = int(np.int64(vertex[(state[1] - 1 - low) % _RECENT]))
            elif low < 15:
                c = state[3] = (state[3] + 2 * (low - 13) - 1) & 0xFFFFFFFF
            elif not _explicit(data, end, state):
                return end
            else:
                c = state[3]
            if low == 0 or low > 12:
                _remember(vertex, c, state)
        else:
            pair = _pair(data, end, low, state)
            if pair < 0:
                return end
            explicit_a = low == 15
            if explicit_a and not _explicit(data, end, state):
                return end
            a = state[3] if explicit_a else _next(state)
            b = c = 0
            for corner in range(2):
                code = (pair >> 4) if corner == 0 else pair & 15
                value = _pair_corner(data, end, low, code, vertex, state)
                if value < 0:
                    return end if value == _NO_VALUE else 1 + t
                if corner == 0:
                    b = value
                else:
                    c = value
            _remember(vertex, a, state)
            if pair >> 4 in (0, 15):
                _remember(vertex, b, state)
            if pair & 15 in (0, 15):
                _remember(vertex, c, state)
            edge[state[0] % _RECENT] = b, a
            state[0] += 1
        edge[state[0] % _RECENT] = c, b
        edge[(state[0] + 1) % _RECENT] = a, c
        state[0] += 2
        out[3 * t], out[3 * t + 1], out[3 * t + 2] = a, b, c
    return DONE if state[4] == end else int(np.int64(state[4]))


@inlined_kernel
def _pair(data: _Bytes, end: int, low: int, state: NDArray[np.int64]) -> int:
    """The codes of the second and third corners of a triangle without a recent edge: of the table
    at the end of the data, or the next byte, where 0 begins again with the first vertex. -1 without
    one."""
    if low < 14:
        return int(np.int64(data[end + low]))
    if state[4] >= end:
        return -1
    pair = int(np.int64(data[state[4]]))
    state[4] += 1
    if pair == 0:
        state[2] = 0
    return pair


#: No corner: the data end, or it refers to a vertex before the first.
_NO_VALUE, _NO_VERTEX = -1, -2


@inlined_kernel
def _pair_corner(
    data: _Bytes,
    end: int,
    low: int,
    code: int,
    vertex: NDArray[np.uint32],
    state: NDArray[np.int64],
) -> int:
    """The corner that a code of a pair names: the next new vertex, a recent one, or an explicit
    one."""
    if code == 0:
        return _next(state)
    if code < 15:
        if code > state[1]:
            return _NO_VERTEX
        return int(np.int64(vertex[(state[1] - code) % _RECENT]))
    if low < 14 or not _explicit(data, end, state):
        return _NO_VALUE
    return int(state[3])


@plain_kernel
def _next(state: NDArray[np.int64]) -> int:
    value = state[2]
    state[2] = (value + 1) & 0xFFFFFFFF
    return int(value)


@plain_kernel
def _remember(vertex: NDArray[np.uint32], value: int, state: NDArray[np.int64]) -> None:
    vertex[state[1] % _RECENT] = value
    state[1] += 1


@plain_kernel
def _explicit(data: _Bytes, end: int, state: NDArray[np.int64]) -> bool:
    """Reads an explicit vertex, a difference from the last one."""
    value, state[4] = _number(data, state[4], end)
    if state[4] < 0:
        return False
    state[3] = (state[3] + ((value >> 1) ^ -(value & 1))) & 0xFFFFFFFF
    return True


@plain_kernel
def _number(data: _Bytes, at: int, end: int) -> tuple[int, int]:
    """An unsigned LEB128 of at most five bytes, and the position of the next; -1 if invalid."""
    value = 0
    for k in range(5):
        if at + k >= end:
            break
        byte = int(np.int64(data[at + k]))
        value |= (byte & 0x7F) << (7 * k)
        if byte < 128:
            return value & 0xFFFFFFFF, at + k + 1
    return 0, -1


@kernel
def decode_indices(data: _Bytes, out: NDArray[np.uint32]) -> int:
    """Mode 2; ``out``: (count,) indices."""
    end = len(data) - 4
    last = np.zeros(2, dtype=np.int64)
    at = 1
    for i in range(len(out)):
        value, at = _number(data, at, end)
        if at < 0:
            return end
        baseline, value = value & 1, value >> 1
        last[baseline] = (last[baseline] + ((value >> 1) ^ -(value & 1))) & 0xFFFFFFFF
        out[i] = last[baseline]
    return DONE if at == end else at
