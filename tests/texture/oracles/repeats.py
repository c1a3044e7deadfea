"""A decoder of the repeats coder in plain Python, written from ``docs/formats/ptm.md``.

It shares nothing with the compiled decoder but the order of planes and how bytes are read. The
tests compare the two; whoever ports the format can step through it. No damage is looked for.
"""

from __future__ import annotations

from collections import defaultdict

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coders.group import GroupReader, plane_order
from tests.texture.oracles.haar import by_value, edge
from tests.texture.oracles.rans import Symbols, read_tables

#: A texel: one integer for each component.
Texel = tuple[int, ...]
Block = tuple[Texel, Texel, Texel, Texel]

WEIGHTS = [[20, 24, -10, -7], [2, 27, -12, -2], [13, -7, -6, -39]]
CLASS_BOUNDS = [2, 4, 8, 16, 32, 64, 128, 256, 512]
K = [0x9E3779B1, 0x85EBCA6B, 0xC2B2AE35, 0x27D4EB2F, 0x165667B1, 0xA24BAED5]


def decode_repeats(
    group: bytes, below: NDArray[np.uint8], shape: tuple[int, int, int]
) -> NDArray[np.uint8]:
    """The level (h, w, c) that a group (without its first byte) refines ``below`` to."""
    reader = GroupReader(group)
    return _Level(below, shape, Symbols(reader, read_tables(reader, 196))).decode()


class _Level:
    def __init__(
        self, below: NDArray[np.uint8], shape: tuple[int, int, int], symbols: Symbols
    ) -> None:
        self.height, self.width, self.components = shape
        self.bh, self.bw = self.height >> 1, self.width >> 1
        self.below: list[list[Texel]] = [[tuple(map(int, texel)) for texel in row] for row in below]
        zero: Texel = (0,) * self.components
        self.texels: list[list[Texel]] = [[zero] * self.width for _ in range(self.height)]
        self.symbols = symbols
        self.order = plane_order(self.components).tolist()
        self.bits: int = min(max((self.bh * self.bw).bit_length(), 6), 13)
        # Where in the level the last block with a key was; how often it was right.
        self.first: dict[int, tuple[int, int, int]] = {}
        self.guesses: list[dict[int, tuple[int, int]]] = [{}, {}, {}]
        self.seen: defaultdict[int, Texel] = defaultdict(lambda: zero)

    def decode(self) -> NDArray[np.uint8]:
        missed_above = [0] * self.bw
        for y in range(self.bh):
            missed = x = 0
            ended = False
            while x < self.bw:
                run = 0 if ended else self.run(y, x)
                flat = run - self.symbols.next(188 + run.bit_length() - 1) if run else 0
                ended = flat < run
                if flat:
                    for i in range(x, x + flat):
                        self.put(y, i, (self.below[y][i],) * 4)
                        missed_above[i] = 0
                    missed = 0
                    x += flat
                else:
                    missed = self.block(y, x, missed + missed_above[x])
                    missed_above[x] = missed
                    ended = False
                    x += 1
        for y, x in edge(self.height, self.width):
            self.edge_texel(y, x)
        return np.array(self.texels, np.uint8).reshape(self.height, self.width, self.components)

    def run(self, y: int, x: int) -> int:
        """How many blocks from here on, 254 at most, would be flat if they were like all around."""
        mean = self.below[y][x]
        if y == 0 or set(self.around(y, x, mean)[:4]) != {mean}:
            return 0
        many = 1
        while (
            many < min(254, self.bw - x)
            and self.below[y][x + many] == mean
            and set(self.texels[2 * y - 1][2 * (x + many) : 2 * (x + many) + 2]) == {mean}
        ):
            many += 1
        return many

    def block(self, y: int, x: int, near: int) -> int:
        """Decodes a block; 1 if it was not found as a whole, else 0."""
        mean = self.below[y][x]
        w0, w1, n0, n1, nw, ne = self.around(y, x, mean)
        east, south = self.mean(y, x + 1), self.mean(y + 1, x)

        key = self.key([(mean, 0), (n0, 2), (n1, 3), (w0, 4), (w1, 5)])
        at_y, at_x, trust = self.first.get(key, (-1, -1, 0))
        if self.symbols.next(3 * trust + near) == 0:
            if trust == 0:
                self.first[key] = (2 * y, 2 * x, 1)
                self.put(y, x, (mean,) * 4)
            else:
                self.first[key] = (at_y, at_x, min(trust + 1, 3))
                self.put(y, x, self.at(at_y, at_x))
            return 0
        self.first[key] = (2 * y, 2 * x, 1)

        keys = [
            self.surroundings_key(y, x),
            self.key([(mean, 0)]),
            self.key([(_minus(t, mean), k) for t, k in
                      ((n0, 0), (n1, 2), (w0, 3), (w1, 4), (east, 5), (south, 1))]),
        ]  # fmt: skip
        sources = [self.guesses[i].get(keys[i]) for i in range(3)]
        context = 12 + 4 * near + (sources[0] is not None) + 2 * (sources[1] is not None)
        actual = self.symbols.next(context)
        for i in range(3):
            self.guesses[i][keys[i]] = (2 * y, 2 * x)
        if actual < 3:
            source = sources[actual]
            block = (mean,) * 4 if source is None else self.at(*source)
            if actual == 2 and source is not None:
                change = _minus(mean, self.below[source[0] // 2][source[1] // 2])
                p, q, r, s = (_plus(texel, change) for texel in block)
                block = (p, q, r, s)
            self.put(y, x, block)
            return 0
        if actual == 3:
            self.put(y, x, self.texel_by_texel(mean, w0, w1, n0, n1, nw, ne, near))
        else:
            diagonal = (self.mean(y + 1, x - 1), self.mean(y + 1, x + 1))
            self.put(y, x, self.differences(mean, w0, w1, n0, n1, east, south, *diagonal))
        p, q, r, s = self.at(2 * y, 2 * x)
        self.seen[self.key([(mean, 0), (w0, 2), (n0, 3), (nw, 4), (n1, 5)])] = p
        self.seen[self.key([(mean, 1), (p, 2), (n1, 3), (n0, 4), (ne, 5)])] = q
        self.seen[self.key([(mean, 2), (w1, 3), (p, 4), (w0, 5), (q, 0)])] = r
        self.seen[self.key([(mean, 3), (p, 4), (q, 5), (r, 0)])] = s
        return 1

    def texel_by_texel(
        self, i: Texel, w0: Texel, w1: Texel, n0: Texel, n1: Texel, nw: Texel, ne: Texel, near: int
    ) -> Block:
        p = self.texel(0, i, [(i, 0), (w0, 2), (n0, 3), (nw, 4), (n1, 5)], near)
        q = self.texel(1, i, [(i, 1), (p, 2), (n1, 3), (n0, 4), (ne, 5)], near)
        r = self.texel(2, i, [(i, 2), (w1, 3), (p, 4), (w0, 5), (q, 0)], near)
        last = self.seen[self.key([(i, 3), (p, 4), (q, 5), (r, 0)])]
        choices: list[Texel] = []
        for one in (last, r, q, p, w1):
            sums = [a + b + c + d for a, b, c, d in zip(p, q, r, one, strict=True)]
            if one not in choices and [total >> 2 for total in sums] == list(i):
                choices.append(one)
        place = 0
        if choices:
            place = self.symbols.next(60 + 4 * near + min(len(choices) - 1, 3))
        if place < len(choices):
            return p, q, r, choices[place]
        s = [0] * self.components
        for c in self.order:
            base = 4 * i[c] - p[c] - q[c] - r[c]
            guess = sorted((q[c], r[c], q[c] + r[c] - p[c]))[1] - base
            kind = 0 if guess < 0 else 1 if guess < 4 else 2
            remainder = self.symbols.next(185 + kind) + min(max(guess, 0), 3)
            s[c] = base + (remainder & 3)
        return p, q, r, tuple(s)

    def texel(self, position: int, i: Texel, key: list[tuple[Texel, int]], near: int) -> Texel:
        """p, q or r: what its key is made of, but for the mean, are W, N, NW, NE."""
        w, n, nw, ne = (texel for texel, _ in key[1:])
        seen = self.seen[self.key(key)]
        context = 24 + 12 * position + 4 * near + (w == n) + 2 * (seen in (w, n))
        actual = self.symbols.next(context)
        if actual < 5:
            return (seen, w, n, nw, ne)[actual]
        out = [0] * self.components
        reference = 0
        for j, c in enumerate(self.order):
            f = [w[c] - i[c], n[c] - i[c], nw[c] - i[c], ne[c] - i[c]]
            guess = sum(a * b for a, b in zip(WEIGHTS[position], f, strict=True))
            guess = i[c] + ((guess + 32) >> 6)
            activity = abs(f[0] - f[1]) + abs(f[1] - f[3]) + abs(f[0]) + abs(f[1])
            context = 145 + 10 * (position > 0)
            if self.refers(j):
                guess += reference
                activity = (activity >> 2) + 4 * abs(reference)
                context += 20
            guess = min(max(guess, 0), 255)
            out[c] = (guess + self.symbols.signed(context + _class(activity))) & 255
            if j == 0:
                reference = out[c] - guess
            elif j == 1:
                reference += (out[c] - guess) >> 1
        return tuple(out)

    def differences(
        self, i: Texel, w0: Texel, w1: Texel, n0: Texel, n1: Texel, e: Texel, s: Texel, sw: Texel,
        se: Texel,
    ) -> Block:  # fmt: skip
        corners = np.zeros((4, self.components), int)
        ev = eh = eg = 0
        for j, c in enumerate(self.order):
            refers = self.refers(j)
            if not refers:
                ev = eh = eg = 0
            north, west = n0[c] + n1[c] - 2 * i[c], w0[c] + w1[c] - 2 * i[c]
            across, down = n0[c] - n1[c], w0[c] - w1[c]
            east, south, tilt = e[c] - i[c], s[c] - i[c], se[c] - sw[c]
            calm = abs(north) + abs(west) + abs(across) + abs(down)

            def residual(kind: int, activity: int, reference: int, refers: bool = refers) -> int:
                context = 85 + 10 * kind + 30 * refers
                if refers:
                    activity = (activity >> 2) + 3 * abs(reference)
                return self.symbols.signed(context + _class(activity))

            v_error = residual(0, calm + abs(south), ev)
            v = v_error + ((88 * north - 50 * south + 176 * down + 220 * ev + 128) >> 8)
            h_error = residual(1, calm + abs(east), eh)
            h = h_error + ((46 * west - 22 * east + 93 * across + 240 * eh + 128) >> 8)
            g_error = residual(2, calm + abs(tilt), eg)
            g = g_error + ((20 * west - 8 * east - 2 * tilt + 47 * h + 235 * eg + 128) >> 8)
            if j == 0:
                ev, eh, eg = v_error, h_error, g_error
            corners[:, c] = by_value(v, h, g, i[c])
        p, q, r, last = (tuple(corner) for corner in corners.tolist())
        return p, q, r, last

    def edge_texel(self, y: int, x: int) -> None:
        zero = (0,) * self.components
        w = self.texels[y][x - 1] if x else self.texels[y - 1][x] if y else zero
        n = self.texels[y - 1][x] if y else w
        nw = self.texels[y - 1][x - 1] if y and x else n
        key = self.key([(w, 4), (n, 3), (nw, 2)])
        seen = self.seen[key]
        actual = self.symbols.next(72 + (w == n) + 2 * (seen in (w, n)))
        texel = (seen, w, n, nw, nw)[actual] if actual < 5 else ()
        if actual >= 5:
            for a, b, c in zip(w, n, nw, strict=True):
                guess = sorted((a, b, a + b - c))[1]
                texel += ((guess + self.symbols.signed(84)) & 255,)
        self.seen[key] = self.texels[y][x] = texel

    def around(self, y: int, x: int, mean: Texel) -> list[Texel]:
        """w0, w1, n0, n1, nw, ne."""
        t = self.texels
        w0, w1 = (t[2 * y][2 * x - 1], t[2 * y + 1][2 * x - 1]) if x else (mean, mean)
        if not y:
            return [w0, w1, mean, mean, w0, mean]
        n0, n1 = t[2 * y - 1][2 * x], t[2 * y - 1][2 * x + 1]
        nw = t[2 * y - 1][2 * x - 1] if x else n0
        ne = t[2 * y - 1][2 * x + 2] if x + 1 < self.bw else n1
        return [w0, w1, n0, n1, nw, ne]

    def mean(self, y: int, x: int) -> Texel:
        return self.below[min(max(y, 0), self.bh - 1)][min(max(x, 0), self.bw - 1)]

    def at(self, y: int, x: int) -> Block:
        t = self.texels
        return t[y][x], t[y][x + 1], t[y + 1][x], t[y + 1][x + 1]

    def put(self, y: int, x: int, block: Block) -> None:
        t = self.texels
        t[2 * y][2 * x], t[2 * y][2 * x + 1] = block[:2]
        t[2 * y + 1][2 * x], t[2 * y + 1][2 * x + 1] = block[2:]

    def refers(self, j: int) -> bool:
        return 0 < j < 3 and self.components > 2

    def key(self, parts: list[tuple[Texel, int]]) -> int:
        return self.hashed(sum(_number(texel) * K[k] for texel, k in parts))

    def surroundings_key(self, y: int, x: int) -> int:
        def at(dy: int, dx: int) -> int:
            return _number(self.mean(y + dy, x + dx))

        return self.hashed(
            at(0, 0) * K[0] + at(0, 1) * K[1] + at(1, 0) * K[2] + at(-1, 0) * K[3]
            + at(0, -1) * K[4] + (at(1, 1) ^ 0x55) * K[5]
            + 3 * (at(1, -1) * K[1] + at(-1, 1) * K[4]) + 5 * at(-1, -1)
        )  # fmt: skip

    def hashed(self, total: int) -> int:
        h = total & 0xFFFFFFFF
        h ^= h >> 15
        return int(((h * K[1]) & 0xFFFFFFFF) >> (32 - self.bits))


def _number(texel: Texel) -> int:
    return sum(value << (8 * c) for c, value in enumerate(texel))


def _minus(one: Texel, other: Texel) -> Texel:
    return tuple((a - b) & 255 for a, b in zip(one, other, strict=True))


def _plus(one: Texel, other: Texel) -> Texel:
    return tuple((a + b) & 255 for a, b in zip(one, other, strict=True))


def _class(activity: int) -> int:
    return sum(bound <= activity for bound in CLASS_BOUNDS)
