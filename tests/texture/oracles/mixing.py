"""Decodes the context mixing coder in plain Python; written from ``docs/formats/ptm-small.md``.

It shares nothing with the compiled decoder but the numeric tables and the order of planes. The
tests compare the two; whoever ports the format can step through it. Thousands of times slower; no
damage is looked for.
"""

from __future__ import annotations

from collections.abc import Callable
from math import floor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coders import mixing_tables as tables
from ptmtools.texture.coders.group import plane_order
from tests.texture.oracles.haar import edge

SQUASH: list[int] = tables.squash().tolist()
STRETCH: list[int] = tables.stretch(tables.squash()).tolist()
SOFT_PLUS: list[int] = tables.soft_plus().tolist()
SURVIVAL: list[int] = tables.survival().tolist()
LEVEL: list[int] = tables.magnitude().tolist()
RATE = [655360 // (10 * n + 16) for n in range(1024)]
BUCKETS = [1, 2, 3, 5, 9, 17, 33, 65, 129, 257, 513]
WITHIN = [0, 0, 0, 1, 4, 11, 14, 17, 20, 20]
W, N, NW, NE = (0, -1), (-1, 0), (-1, -1), (-1, 1)
TEXELS = [
    [W, N, NW, NE, (1, -1), (0, -2), (-2, 0), (-1, 2)],
    [W, N, NW, NE, (0, -2), (-1, 2), (-2, 0), (1, -2)],
    [W, N, NW, NE, (-2, 0), (0, -2), (1, -1), (-2, 1)],
    [N, NW, NE, (0, -2), (-2, 0)],
    [W, N, NW, NE, (0, -2), (-2, 0)],
]
PARENTS = [
    [(0, 1), (1, 0), (1, 1), (1, -1), (-1, 1)],
    [(0, 1), (1, 0), (1, 1), (-1, 1), (1, -1)],
    [(0, 1), (1, 0), (1, 1), (1, -1)],
    [(0, 1), (1, 0), (1, 1)],
    [],
]
COLOUR = [[(0, 0), W, N, (0, 1), (1, 0)]] * 3 + [[(0, 0), (1, 0), N, (0, 1)], [(0, 0), W, N]]

Grid = dict[tuple[int, int], int]


def near(values: Grid, y: int, x: int) -> Callable[[int, int], int]:
    """What stands so many rows and columns from a place."""
    return lambda dy, dx: values[y + dy, x + dx]


def clamp(a: int, low: int, high: int) -> int:
    return min(max(a, low), high)


def level_of(a: int) -> int:
    return LEVEL[min(a, 1023)]


def class_of(e: int) -> int:
    a = abs(e)
    return 0 if a == 0 else (1 if e > 0 else 2) + 2 * ((a > 1) + (a > 3) + (a > 8))


def hashed(a: int, b: int, c: int, d: int) -> int:
    h = (a * 0x2F0B4C47 + b * 0x9E3779B1 + c * 0x85EBCA77 + d * 0xC2B2AE3D) % (1 << 32)
    h ^= h >> 15
    h = h * 0x2C1B3C6D % (1 << 32)
    return h ^ (h >> 13)


def squash(u: int) -> int:
    return SQUASH[clamp(u, -3072, 3072) + 3072]


def soft_plus(u: int) -> int:
    return u * 16 if u > 3072 else SOFT_PLUS[max(u, -3072) + 3072]


class ReferenceState:
    """What a plane has learned: kept from level to level."""

    def __init__(self) -> None:
        self.A = [[[0] * 24 for _ in range(24)] for _ in range(5)]
        self.pending: list[list[tuple[list[int], int]]] = [[] for _ in range(5)]
        self.weights = [[0] * 24 for _ in range(5)]
        self.seen = [0] * 5
        self.bias = [0] * (5 * 729)
        first = [int(low) * 16384 + 41500 for low in np.searchsorted(LEVEL, range(24))]
        self.scale = [[first[i // 12 % 24], 0] for i in range(5 * 24 * 12)]
        mix = [42600, 19661, 9830, 3277, 3277, 3277, 3277, 13107, 13107, 13107, 0]
        self.mix = [list(mix) for _ in range(320 + 24 * 36)]
        self.map = [[SQUASH[min(i * 256, 6144)] for i in range(26)] for _ in range(320)]
        self.trust = [49152] * (3 * 32 * 4 * 2)
        self.flat = [(1 << 31)] * 432

    def learn(self, k: int, sample: list[int], importance: int, features: int) -> None:
        self.seen[k] += 1
        self.pending[k].append((sample, importance))
        early = self.seen[k] <= 64
        if len(self.pending[k]) < (4 if early else 16):
            return
        A = self.A[k]
        for i in range(24):
            for j in range(i, 24):
                A[i][j] -= 0 if early else A[i][j] >> 5
                A[i][j] += sum(w * f[i] * f[j] for f, w in self.pending[k])
        self.pending[k] = []
        if self.seen[k] < 1024 or self.seen[k] % 32 == 0:
            self.weights[k][:features] = solved(A, features)


def solved(A: list[list[int]], n: int) -> list[int]:
    """In float64; every operation is rounded, in this order."""
    U = [[float(a) for a in row] for row in A]
    inverse = [0.0] * n
    for j in range(n):
        U[j][j] += 20000.0
    for j in range(n):
        inverse[j] = 1.0 / max(U[j][j], 1.0)
        U[j][j + 1 :] = [0.0 if abs(u) < 2.0**-100 else u for u in U[j][j + 1 :]]
        for i in range(j + 1, n):
            t = U[j][i] * inverse[j]
            if abs(t) >= 2.0**-100:
                for c in range(i, 24):
                    U[i][c] -= t * U[j][c]
    weights = [0] * n
    for j in range(n - 1, -1, -1):
        w = U[j][23] * inverse[j]
        if abs(w) < 2.0**-100:
            w = 0.0
        for i in range(j):
            U[i][23] -= U[i][j] * w
        weights[j] = clamp(floor(w * 65536.0 + 0.5), -262144, 262144)
    return weights


class _Bits:
    """The arithmetic decoder."""

    def __init__(self, data: bytes) -> None:
        self.data, self.at = data, 4
        self.low, self.high = 0, 0xFFFFFFFF
        self.window = int.from_bytes(data[:4].ljust(4, b"\0"), "big")

    def bit(self, p: int) -> int:
        middle = self.low + ((self.high - self.low) * p >> 16)
        bit = int(self.window <= middle)
        if bit:
            self.high = middle
        else:
            self.low = middle + 1
        while self.low >> 24 == self.high >> 24:
            byte = self.data[self.at] if self.at < len(self.data) else 0
            self.at += 1
            self.window = (self.window << 8) % (1 << 32) | byte
            self.low = (self.low << 8) % (1 << 32)
            self.high = (self.high << 8) % (1 << 32) | 255
        return bit


def counted(counter: int, bit: int, top: int) -> int:
    p, n = counter >> 10, counter & 1023
    p += ((bit << 22) - p) * RATE[n] >> 16
    return min(p, (1 << 22) - 1) << 10 | min(n + 1, top)


class _Plane:
    def __init__(
        self, below: NDArray[np.uint8], height: int, width: int, state: ReferenceState, bits: _Bits
    ) -> None:
        self.parent: Grid = {}
        bh, bw = below.shape
        for y in range(-2, (height >> 1) + 3):
            for x in range(-2, (width >> 1) + 3):
                inside = clamp(y, 0, bh - 1), clamp(x, 0, bw - 1)
                self.parent[y, x] = int(below[inside]) if bh and bw else 128
        self.texel: Grid = {}
        for (y, x), mean in self.parent.items():
            for t in range(4):
                self.texel[2 * y + (t >> 1), 2 * x + (t & 1)] = mean
        self.error = dict.fromkeys(self.texel, 0)
        self.flat = dict.fromkeys(self.parent, 0)
        self.state, self.bits = state, bits
        bit_count = max(height * width - 1, 0).bit_length()
        self.slot_mask = (1 << clamp(bit_count - 1, 8, 16)) - 1
        self.value_mask = (1 << clamp(bit_count, 8, 18)) - 1
        self.slots: dict[tuple[int, int], list[int]] = {}
        self.values: dict[tuple[int, int], tuple[int, int]] = {}


def decode_reference(
    streams: list[bytes],
    below: NDArray[np.uint8],
    shape: tuple[int, int, int],
    max_error: int,
    states: list[ReferenceState],
) -> NDArray[np.uint8]:
    """The level (h, w, c); one state for each plane, changed in place."""
    height, width, components = shape
    bits = [_Bits(stream) for stream in streams]
    planes: list[_Plane] = []
    level = np.zeros(shape, np.uint8)
    for c, component in enumerate(plane_order(components)):
        coder = bits[min(c, len(bits) - 1)]
        plane = _Plane(below[:, :, component], height, width, states[c], coder)
        _decode_plane(plane, planes[: min(c, 2)], height, width, 2 * max_error + 1)
        planes.append(plane)
        for y in range(height):
            for x in range(width):
                level[y, x, component] = plane.texel[y, x]
    return level


def _decode_plane(own: _Plane, refs: list[_Plane], height: int, width: int, step: int) -> None:
    for first in range(0, max(width >> 1, 1), 32):
        for by in range(height >> 1):
            for bx in range(first, min(first + 32, width >> 1)):
                if not _flat(own, refs, by, bx):
                    for k in range(4):
                        _texel(own, refs, k, 2 * by + (k >> 1), 2 * bx + (k & 1), (by, bx), step)
    for y, x in edge(height, width):
        _texel(own, refs, 4, y, x, (0, 0), step)


def _flat(own: _Plane, refs: list[_Plane], y: int, x: int) -> int:
    around = [own.parent[y + dy, x + dx] for dy in (-1, 0, 1) for dx in (-1, 0, 1)]
    same = around.count(own.parent[y, x])
    near = own.flat[y, x - 1] + 2 * own.flat[y - 1, x]
    if near == 0 and same < 6:
        return 0
    diagonal = own.flat[y - 1, x - 1] + 2 * own.flat[y - 1, x + 1]
    reference = 1 + refs[0].flat[y, x] if refs else 0
    i = ((near + 4 * diagonal) * 3 + reference) * 9 + same - 1
    bit = own.bits.bit(clamp(own.state.flat[i] >> 16, 1, 65535))
    own.state.flat[i] = counted(own.state.flat[i], bit, 250)
    own.flat[y, x] = bit
    return bit


def _texel(
    own: _Plane, refs: list[_Plane], k: int, y: int, x: int, block: tuple[int, int], step: int
) -> None:
    state = own.state
    by, bx = block

    T, E, P = near(own.texel, y, x), near(own.error, y, x), near(own.parent, by, bx)
    R, ER = [near(ref.texel, y, x) for ref in refs], [near(ref.error, y, x) for ref in refs]

    mean, w, n, nw, ne = P(0, 0), T(0, -1), T(-1, 0), T(-1, -1), T(-1, 1)
    base = mean if k < 3 else w
    sample = [T(*d) - base for d in TEXELS[k]] + [P(*d) - base for d in PARENTS[k]]
    for ref in refs:
        if k < 3:
            here = sum(ref.texel[2 * by + i, 2 * bx + j] for i in (0, 1) for j in (0, 1)) >> 2
        else:
            here = ref.texel[y, x - 1]
        sample += [near(ref.texel, y, x)(*d) - here for d in COLOUR[k]]
    features = len(sample)
    sample += [0] * (24 - features)

    lo, hi, known = 0, 255, 0
    last = k == 3 and step == 1
    if step == 1 and k < 4:
        known = [0, w, n + ne, nw + n + w][k]
        rest = 4 * mean - known
        lo, hi = max(rest - 255 * (3 - k), 0), min(rest + 3, 255)

    beyond = [(0, -2), (-2, 0)]
    more = ([(1, -1), (-2, 0)], [(0, -2), (-1, 2)], beyond, [(-1, -1)], beyond)
    activity = 2 * (abs(E(-1, 0)) + abs(E(0, -1))) + abs(E(-1, -1)) + abs(E(-1, 1))
    activity += sum(abs(E(*d)) for d in more[k])
    e1, e2, *_ = [error(0, 0) for error in ER] + [0, 0]
    v1, v2, *_ = [value(0, 0) for value in R] + [0, 0]
    if not refs:
        slope = sum(abs(P(*d) - mean) for d in ((0, 1), (1, 0), (0, -1), (-1, 0)))
        s1, s2 = level_of(activity), level_of(2 * slope) >> 1
    else:
        own_error = abs(e1) + abs(e2) if len(refs) > 1 else 2 * abs(e1)
        around = sum(abs(ER[0](*d)) for d in ((0, -1), (-1, 0), (1, 0), (0, 1)))
        s1, s2 = level_of((activity + around) >> 1), level_of(2 * own_error) >> 1

    scale = state.scale[(k * 24 + s1) * 12 + s2]
    mean_error = scale[0]
    third = class_of(e1) if refs else class_of(E(-1, -1))
    tilt = ((k * 9 + class_of(E(0, -1))) * 9 + class_of(E(-1, 0))) * 9 + third
    predicted = sum(a * b for a, b in zip(state.weights[k], sample, strict=True))
    mu = clamp(((predicted + state.bias[tilt]) >> 8) + base * 256, -32768, 98304)
    rounded = (mu + 128) >> 8
    m = clamp(rounded, lo, hi)
    inverse = (1 << 32) // ((mean_error * 47186 >> 16) + 1311)
    fraction = clamp((mu - m * 256 + 128) >> 6, 0, 3)
    size = level_of(mean_error * 6 >> 16)
    guess = lo if last else m

    context = [hashed(k, size, fraction, 1)]
    if last:
        context.append(hashed(20 + k, clamp((mu - lo * 256 + 2560) >> 6, 0, 99), s1 >> 1, 0))
    else:
        context.append(hashed(20 + k, tilt, fraction, s1 >> 2))
    left, over, far_w, far_n = w - guess, n - guess, nw - guess, ne - guess
    if refs:
        other = class_of(e2) if len(refs) > 1 else class_of(E(0, -1))
        context.append(hashed(60 + last, guess, v1, v2))
        context.append(hashed(40 + k, class_of(e1) * 9 + other, s1 >> 2, fraction))
        left, over = left + v1 - R[0](0, -1), over + v1 - R[0](-1, 0)
        far_w, far_n = far_w + v1 - R[0](-1, -1), far_n + v1 - R[0](-1, 1)
    else:
        bend = class_of(w - nw) * 9 + class_of(n - nw)
        bend = bend * 9 + class_of(ne - n if k == 1 else P(0, 1) - mean)
        context.append(hashed(80 + last, guess, w, size >> 3))
        context.append(hashed(40 + k, bend, size >> 1, fraction))
    if len(refs) > 1:
        far_w, far_n = w + v2 - R[1](0, -1) - guess, n + v2 - R[1](-1, 0) - guess
    left, over, far_w, far_n = (clamp(d, -20, 20) for d in (left, over, far_w, far_n))
    context.append(hashed(90 + k, left * 41 + over, size >> 2, 0))
    context.append(hashed(110 + k, far_w * 41 + far_n, left * 41 + over, 0))

    where = [hashed(7, (w * 256 + n) * 256 + ne, (nw * 256 + v1) * 256 + v2, 0)]
    if refs:
        where.append(hashed(17, v1 * 256 + v2, R[0](0, -1) * 256 + w, 0))
        where.append(hashed(27, v1 * 256 + v2, 0, 0))
    else:
        cy, cx = y - (k >> 1), x - (k & 1)
        sides = own.texel[cy, cx - 1] * 256 + own.texel[cy - 1, cx]
        where.append(hashed(17, mean * 65536 + sides, P(0, 1) * 256 + P(1, 0), k * 131 + known * 4))
        where.append(hashed(27, w * 256 + n, ne, k))
    places = [(i, h & own.value_mask) for i, h in enumerate(where)]
    matches = [own.values.get(place, (0, 0)) for place in places]
    actual = [v if times and lo <= v <= hi else -1 for v, times in matches]
    matched = 0
    for i in (0, 1):
        if actual[i] >= 0:
            matched += (1, 3)[i] * (2 if matches[i][1] > 3 else 1)

    times = [t for _, t in matches]
    near_row = 320 + s1 * 36 + matched
    decide = _decider(own, context, actual, times, k * 64, near_row, bool(refs))
    v = _value(decide, m, mu, inverse, lo, hi, step, last)

    own.texel[y, x] = v
    own.error[y, x] = v - (rounded if k == 3 else m)
    rate = RATE[scale[1]] if scale[1] < 99 else 655
    scale[0] += (abs(v * 256 - mu) * 256 - mean_error) * rate >> 16
    scale[1] = min(scale[1] + 1, 99)
    if k != 3:
        state.bias[tilt] += (v * 256 - mu) * 655 >> 8
    for place, (value, t) in zip(places, matches, strict=True):
        if value == v and t:
            own.values[place] = v, min(t + 1, 31)
        else:
            own.values[place] = v, 1 if t < 2 else t >> 2
    sample[23] = v - base
    importance = (1 << 19) // (16 + min(mean_error >> 13, 2047))
    state.learn(k, sample, importance, features)


def _value(
    decide: Any, m: int, mu: int, inverse: int, lo: int, hi: int, step: int, last: bool
) -> int:
    """The texel, by decisions: ``decide(kind, node, opinion, answer, plain)`` returns a bit."""
    if lo >= hi:
        return lo
    origin = lo if last else m
    bucket = 0
    off, half, span = origin * 256 - mu, step * 128, step * 256

    def steps(v: int) -> int:
        e = v - origin
        return (abs(e) + (step >> 1)) // step * (1 if e >= 0 else -1)

    def at(d: int, sign: int) -> int:
        return (d * span - half + sign * off) * inverse >> 16

    def search(below: int, above: int, sign: int, kind: int, node: Any) -> int:
        path = 0
        while below < above:
            d = (below + above + 1) >> 1
            slope = 2 * squash(at(d, sign)) - 65536
            x = -(((above - below + 1) * span * inverse >> 17) * slope >> 16)
            bit = decide(
                kind,
                node(path),
                clamp(x, -3072, 3072),
                lambda v, d=d: int(steps(v) * sign >= d),
                kind == 2 and bucket >= 2,
            )
            below, above = (d, above) if bit else (below, d - 1)
            path = 2 * path + 1 + bit
        return clamp(origin + sign * below * step, 0, 255)

    if last:
        return search(0, hi - lo, 1, 3, lambda path: path)
    down, up = (half - off) * inverse >> 16, (half + off) * inverse >> 16
    zero = 65536 - squash(-down) - squash(-up)
    x = STRETCH[clamp(zero >> 4, 0, 4095)]
    if decide(0, 0, x, lambda v: int(steps(v) == 0)):
        return m
    if lo < m < hi:
        x = clamp((soft_plus(down) - soft_plus(up)) >> 4, -3072, 3072)
        sign = 1 if decide(1, 1, x, lambda v: int(steps(v) > 0)) else -1
    else:
        sign = 1 if m < hi else -1
    beyond = soft_plus(up if sign > 0 else down)
    most = ((hi - m if sign > 0 else m - lo) + (step >> 1)) // step
    while BUCKETS[bucket + 1] <= most:
        d = BUCKETS[bucket + 1]
        further = soft_plus(at(d, sign))
        x = SURVIVAL[clamp((further - beyond) >> 4, 0, 3072)]
        beyond = further
        node = (2 if sign > 0 else 9) + min(bucket, 6)
        if not decide(2, node, x, lambda v, d=d: int(steps(v) * sign >= d)):
            break
        bucket += 1

    def node_within(path: int) -> int:
        inside = WITHIN[bucket] + path if bucket <= 4 or path < 3 else 21
        return (16 if sign > 0 else 40) + inside

    return search(BUCKETS[bucket], min(BUCKETS[bucket + 1] - 1, most), sign, 2, node_within)


def _decider(
    own: _Plane,
    context: list[int],
    found: list[int],
    times: list[int],
    row: int,
    near_row: int,
    deep: bool,
) -> Any:
    state = own.state

    def decide(
        kind: int, node: int, opinion: int, answer: Callable[[int], int], plain: bool = False
    ) -> int:
        if plain and deep and max(found) < 0:
            return own.bits.bit(clamp(squash(opinion), 1, 65535))
        group, place = node // 15, node % 15
        slots = []
        for i, h in enumerate(context):
            key = i, (h ^ group * 0x5D4D) & own.slot_mask
            slot = own.slots.get(key)
            if slot is None or slot[15] != h >> 8:
                slot = own.slots[key] = [1 << 31] * 15 + [h >> 8]
            slots.append(slot)
        x = [opinion] + [STRETCH[slot[place] >> 20] for slot in slots]
        trusted = []
        for i in range(3):
            if found[i] < 0:
                x.append(0)
                continue
            e = answer(found[i])
            t = ((i * 32 + times[i]) * 4 + kind) * 2 + e
            trusted.append((i, e, t))
            x.append(STRETCH[state.trust[t] >> 4] * (1 if e else -1))
        x.append(77)
        a, b, cells = state.mix[row + node], state.mix[near_row + kind * 9], state.map[row + node]
        za, zb = (
            clamp(sum(w * i >> 8 for w, i in zip(weights, x, strict=True)) >> 8, -3072, 3071)
            for weights in (a, b)
        )
        z = ((za + zb) >> 1) + 3072
        cell, share = z >> 8, z & 255
        refined = (cells[cell] * (256 - share) + cells[cell + 1] * share) >> 8
        bit = own.bits.bit(clamp((SQUASH[z] + refined) >> 1, 1, 65535))
        for weights, one in ((a, za), (b, zb)):
            error = ((bit << 16) - squash(one)) * 100 >> 6
            for i in range(len(x)):
                weights[i] = clamp(weights[i] + (error * x[i] + 8192 >> 14), -524287, 524287)
        cell += share >> 7
        cells[cell] += (bit * 65535 - cells[cell]) * 5 >> 8
        for slot in slots:
            slot[place] = counted(slot[place], bit, 120)
        for i, e, t in trusted:
            if e == bit:
                state.trust[t] += (65535 - state.trust[t]) * 82 >> 13
            else:
                state.trust[t] -= state.trust[t] * 82 >> 13
                found[i] = -1
        return bit

    return decide
