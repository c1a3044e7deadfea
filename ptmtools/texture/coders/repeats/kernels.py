"""Compiled loop of the repeats coder: blocks, texels and samples that were seen before.

One pass serves both directions. It goes through the 2×2 blocks in row-major order. For each it asks
tables of the last block seen in the same surroundings; if none of these is the one, it goes through
the four texels and asks neighbours and a table of the last texel in the same surroundings; if none
of those is the one, the samples of the texel are predicted. A texel is one 32-bit number, so that
components cost nothing while something repeats. ``docs/format-ptm.md`` specifies it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ptmtools.compiled import plain_kernel as kernel
from ptmtools.texture.coders.rans.kernels import ESCAPE, STATE_LOW, TABLE_BITS

OK, TRUNCATED, IMPOSSIBLE = 0, 1, 2

#: First table of each sort of symbol: is the block the first guess; which guess is it; which guess
#: is the texel; remainder of the sum; sample.
FIRST, GUESS, TEXEL, REMAINDER, SAMPLE = 0, 16, 32, 92, 95
#: Classes of activity of samples; tables for a first texel and the others, without and with a
#: reference.
CLASSES = 8
TABLES = SAMPLE + 4 * CLASSES
#: No block takes more symbols, so that words need to be counted once a block only.
MOST_SYMBOLS = 24

_MASK32 = np.uint64(0xFFFFFFFF)
_SLOT = np.uint64((1 << TABLE_BITS) - 1)
_HIGH = np.uint64(0x80808080)
_LOW7 = np.uint64(0x7F7F7F7F)
_K0, _K1, _K2 = np.uint64(0x9E3779B1), np.uint64(0x85EBCA6B), np.uint64(0xC2B2AE35)
_K3, _K4, _K5 = np.uint64(0x27D4EB2F), np.uint64(0x165667B1), np.uint64(0xA24BAED5)


#: Where `state` holds what: the four rANS states first; then symbols so far, the next word, the
#: next escape, the index behind the last escape, nonzero once an escape was missing.
_COUNT, _WORD, _NEXT_ESCAPE, _ESCAPES_END, _STRAY = 4, 5, 6, 7, 8


@kernel
def _symbol(encoding: bool, z: Any, context: Any, numbers: Any, words: Any, state: Any) -> Any:
    """Symbol ``z`` to ``numbers`` or, decoding, the next one from ``words``."""
    n = state[_COUNT]
    state[_COUNT] = n + 1
    if encoding:
        numbers[np.uint64(n)] = z | context << 16
        return np.int64(z)
    lane = np.uint64(n & 3)
    x = np.uint64(state[lane])
    e = np.uint64(numbers[(np.uint64(context) << np.uint64(TABLE_BITS)) + (x & _SLOT)])
    x = ((e >> np.uint64(12)) & np.uint64(4095)) * (x >> np.uint64(TABLE_BITS)) + (
        e & np.uint64(4095)
    )
    if x < np.uint64(STATE_LOW):
        at = np.uint64(state[_WORD])
        x = (x << np.uint64(16)) | np.uint64(words[at])
        state[_WORD] = at + np.uint64(1)
    state[lane] = x
    z = np.int64(e >> np.uint64(24))
    if z == ESCAPE:
        at = np.uint64(state[_NEXT_ESCAPE])
        if state[_NEXT_ESCAPE] < state[_ESCAPES_END]:
            z = np.int64(words[at])
            state[_NEXT_ESCAPE] = at + np.uint64(1)
        else:
            state[_STRAY] = 1
    return z


@kernel
def _slot(h: Any, shift: Any) -> Any:
    h = (h ^ (h >> np.uint64(15))) & _MASK32
    return ((h * _K1) & _MASK32) >> shift


@kernel
def _minus(a: Any, b: Any) -> Any:
    """a - b, byte by byte."""
    return ((a | _HIGH) - (b & _LOW7)) ^ ((a ^ b ^ _HIGH) & _HIGH)


@kernel
def _plus(a: Any, b: Any) -> Any:
    """a + b, byte by byte."""
    return ((a & _LOW7) + (b & _LOW7)) ^ ((a ^ b) & _HIGH)


@kernel
def _samples(
    encoding: bool, texel: Any, mean: Any, w: Any, n: Any, nw: Any, ne: Any, east: Any, south: Any,
    position: int, order: Any, weights: Any, numbers: Any, words: Any, state: Any,
) -> Any:  # fmt: skip
    """A texel, component by component, each predicted from its surroundings less the mean."""
    out = np.uint64(0)
    reference = np.int64(0)
    k = weights[position]
    for c in range(order.size):
        shift = np.uint64(8 * order[c])
        byte = np.uint64(255)
        i = np.int64((mean >> shift) & byte)
        fw, fn = np.int64((w >> shift) & byte) - i, np.int64((n >> shift) & byte) - i
        fnw, fne = np.int64((nw >> shift) & byte) - i, np.int64((ne >> shift) & byte) - i
        fe, fs = np.int64((east >> shift) & byte) - i, np.int64((south >> shift) & byte) - i
        guess = i + (
            (k[0] * fw + k[1] * fn + k[2] * fnw + k[3] * fne + k[4] * fe + k[5] * fs + 32) >> 6
        )
        activity = abs(fw - fn) + abs(fn - fne) + abs(fw) + abs(fn)
        referring = c > 0 and c < 3 and order.size > 2
        if referring:
            guess += (k[6] * reference + 32) >> 6
            activity = (activity >> 2) + 4 * abs(reference)
        guess = min(max(guess, 0), 255)
        level = 0
        while level < CLASSES - 1 and activity >= (3 << level):
            level += 1
        context = SAMPLE + level
        if referring:
            context += 2 * CLASSES
        if position > 0:
            context += CLASSES
        e = ((np.int64((texel >> shift) & byte) - guess + 128) & 255) - 128
        z = _symbol(encoding, (e << 1) ^ (e >> 63), context, numbers, words, state)
        e = (z >> 1) ^ -(z & 1)
        value = (guess + e) & 255
        if c == 0:
            reference = value - guess
        out |= np.uint64(value) << shift
    return out


@kernel
def _fits(sum_wanted: Any, p: Any, q: Any, r: Any, s: Any, components: int) -> bool:
    """Whether p + q + r + s is the sum of a block of this mean in every component."""
    fits = True
    for c in range(components):
        shift = np.uint64(8 * c)
        byte = np.uint64(255)
        total = (
            ((p >> shift) & byte) + ((q >> shift) & byte) + ((r >> shift) & byte)
            + ((s >> shift) & byte)
        )  # fmt: skip
        fits &= (total >> np.uint64(2)) == ((sum_wanted >> shift) & byte)
    return fits


@kernel
def _texel(
    encoding: bool, texel: Any, mean: Any, w: Any, n: Any, nw: Any, ne: Any, east: Any, south: Any,
    position: int, near: int, order: Any, weights: Any, seen: Any, shift: Any, numbers: Any, words: Any, state: Any,
) -> Any:  # fmt: skip
    """One of the first three texels of a block, or (position 4) one that belongs to no block."""
    slot = _slot(mean * _K0 + w * _K2 + n * _K3 + nw * _K4 + ne * _K5 + np.uint64(position), shift)
    last = np.uint64(seen[slot])
    found = 4 if texel == ne else 5
    if texel == nw:
        found = 3
    if texel == n:
        found = 2
    if texel == w:
        found = 1
    if texel == last:
        found = 0
    context = TEXEL + 12 * position + 4 * near
    if w == n:
        context += 1
    if last == w or last == n:
        context += 2
    found = _symbol(encoding, found, context, numbers, words, state)
    if found == 0:
        texel = last
    elif found == 1:
        texel = w
    elif found == 2:
        texel = n
    elif found == 3:
        texel = nw
    elif found == 4:
        texel = ne
    else:
        texel = _samples(
            encoding, texel, mean, w, n, nw, ne, east, south, min(position, 3), order, weights,
            numbers, words,
            state,
        )  # fmt: skip
    seen[slot] = texel
    return texel


@kernel
def _last_texel(
    encoding: bool, texel: Any, mean: Any, p: Any, q: Any, r: Any, west: Any, near: int,
    order: Any, seen: Any, shift: Any, numbers: Any, words: Any, state: Any,
) -> Any:  # fmt: skip
    """The fourth texel of a block: one of five that the mean allows, or remainders of the sum."""
    components = order.size
    slot = _slot(mean * _K0 + p * _K3 + q * _K4 + r * _K5 + np.uint64(3), shift)
    last = np.uint64(seen[slot])
    index = 0
    found, chosen = -1, np.uint64(0)
    choices = (last, r, q, p, west)
    possible = 0
    for i in range(5):
        one = choices[i]
        fresh = True
        for j in range(i):
            fresh &= choices[j] != one
        if fresh and _fits(mean, p, q, r, one, components):
            possible += 1
            if found < 0 and one == texel:
                found = possible - 1
    context = TEXEL + 36 + 4 * near + min(possible, 3)
    if possible > 0:
        found = _symbol(encoding, found if found >= 0 else possible, context, numbers, words, state)
    else:
        found = 0
    if found < possible:
        for i in range(5):
            one = choices[i]
            fresh = True
            for j in range(i):
                fresh &= choices[j] != one
            if fresh and _fits(mean, p, q, r, one, components):
                if index == found:
                    chosen = one
                index += 1
    else:
        byte = np.uint64(255)
        for c in range(components):
            at = np.uint64(8 * order[c])
            a, b = np.int64((q >> at) & byte), np.int64((r >> at) & byte)
            corner = np.int64((p >> at) & byte)
            base = 4 * np.int64((mean >> at) & byte) - a - b - corner
            guess = max(min(a, b), min(max(a, b), a + b - corner)) - base
            kind = 0 if guess < 0 else 1 if guess < 4 else 2
            guess = min(max(guess, 0), 3)
            value = np.int64((texel >> at) & byte) - base
            z = _symbol(encoding, (value - guess) & 3, REMAINDER + kind, numbers, words, state)
            value = base + ((z + guess) & 3)
            if value < 0 or value > 255:
                state[_STRAY] = 1
            chosen |= np.uint64(value & 255) << at
    seen[slot] = chosen
    return chosen


@kernel
def repeats_pass(
    encoding: bool, level: Any, flat: Any, below: Any, order: Any, weights: Any, slots: Any, seen: Any,
    outcome: Any, shift: int, limit: int, numbers: Any, words: Any, state: Any,
) -> int:  # fmt: skip
    """One group in either direction.

    Parameters
    ----------
    encoding: True reads ``level`` and fills ``numbers`` with symbol | context << 16; False fills
        ``level`` from ``words``.
    level: (h, w) uint32, texels with component c in bits 8 c to 8 c + 7. below: (h >> 1, w >> 1).
    order: (c,) int64, components in coding order. weights: (4, 7) int64, by position.
    slots: (5, 2^b) and seen: (2^b,) uint32, zeros; shift: 32 - b.
    outcome: (w // 2 + 1,) int64, zeros.
    limit: index of the word behind the last.
    numbers: uint32; decoding, the flat table of `tables.decoding_table`.
    words: uint16, the escapes and behind them the words, with room for `MOST_SYMBOLS` more.
    state: (9,) int64: see `_COUNT`.

    Returns OK, TRUNCATED or IMPOSSIBLE.
    """
    bh, bw = below.shape
    height, width = level.shape
    down = np.uint64(shift)
    one, two, three = np.uint64(1), np.uint64(2), np.uint64(3)
    wide = np.uint64(width)
    if not encoding:
        for lane in range(4):
            at = state[_ESCAPES_END] + 2 * lane
            state[lane] = np.int64(words[at]) | (np.int64(words[at + 1] & 0x7FFF) << 16)
        state[_WORD] = state[_ESCAPES_END] + 8
    for y in range(bh):
        y0, y1 = 2 * y, 2 * y + 1
        before = 0
        for x in range(bw):
            x0, x1 = 2 * x, 2 * x + 1
            mean = np.uint64(below[y, x])
            n0, n1, nw, ne = mean, mean, mean, mean
            w0, w1 = mean, mean
            if x > 0:
                w0, w1 = np.uint64(level[y0, x0 - 1]), np.uint64(level[y1, x0 - 1])
                nw = w0
            if y > 0:
                n0, n1 = np.uint64(level[y0 - 1, x0]), np.uint64(level[y0 - 1, x1])
                nw = np.uint64(level[y0 - 1, x0 - 1]) if x > 0 else n0
                ne = np.uint64(level[y0 - 1, x1 + 1]) if x + 1 < bw else n1
            p, q, r, s = mean, mean, mean, mean
            if encoding:
                p, q = np.uint64(level[y0, x0]), np.uint64(level[y0, x1])
                r, s = np.uint64(level[y1, x0]), np.uint64(level[y1, x1])
            here = np.uint64(y0 * width + x0)
            near = min(before, 1) + min(outcome[x], 1)

            a = _slot(mean * _K0 + n0 * _K2 + n1 * _K3 + w0 * _K4 + w1 * _K5, down)
            entry = np.uint64(slots[0, a])
            trust = np.int64(entry & three)
            g0, g1, g2, g3 = mean, mean, mean, mean
            if trust > 0:
                g = entry >> two
                g0, g1 = np.uint64(flat[g]), np.uint64(flat[g + one])
                g2, g3 = np.uint64(flat[g + wide]), np.uint64(flat[g + wide + one])
            hit = 0 if p == g0 and q == g1 and r == g2 and s == g3 else 1
            hit = _symbol(encoding, hit, FIRST + 3 * trust + near, numbers, words, state)
            if hit == 0:
                if trust == 0:
                    slots[0, a] = here << two | one
                elif trust < 3:
                    slots[0, a] = entry + one
                before = 0
                outcome[x] = 0
                if not encoding:
                    level[y0, x0], level[y0, x1] = g0, g1
                    level[y1, x0], level[y1, x1] = g2, g3
                    if state[_WORD] > limit:
                        return TRUNCATED
                continue
            slots[0, a] = here << two | one

            up, under = max(y - 1, 0), min(y + 1, bh - 1)
            left, right = max(x - 1, 0), min(x + 1, bw - 1)
            east, south = np.uint64(below[y, right]), np.uint64(below[under, x])
            all_around = (
                mean * _K0 + east * _K1 + south * _K2 + np.uint64(below[up, x]) * _K3
                + np.uint64(below[y, left]) * _K4
                + (np.uint64(below[under, right]) ^ np.uint64(0x55)) * _K5
                + (np.uint64(below[under, left]) * _K1 + np.uint64(below[up, right]) * _K4)
                * np.uint64(3)
                + np.uint64(below[up, left]) * np.uint64(5)
            )  # fmt: skip
            b = _slot(all_around, down)
            c = _slot(mean * _K0, down)
            d = _slot(
                _minus(n0, mean) * _K0 + _minus(n1, mean) * _K2 + _minus(w0, mean) * _K3
                + _minus(w1, mean) * _K4 + _minus(east, mean) * _K5 + _minus(south, mean) * _K1,
                down,
            )  # fmt: skip
            found = 3
            context = GUESS + 4 * near
            guesses = (slots[1, b], slots[2, c], slots[3, d])
            if guesses[0] > 0:
                context += 1
            if guesses[1] > 0:
                context += 2
            change = _minus(mean, np.uint64(slots[4, d]))
            if encoding:
                for k in range(2, -1, -1):
                    g0, g1, g2, g3 = mean, mean, mean, mean
                    if guesses[k] > 0:
                        g = np.uint64(guesses[k]) - one
                        g0, g1 = np.uint64(flat[g]), np.uint64(flat[g + one])
                        g2, g3 = np.uint64(flat[g + wide]), np.uint64(flat[g + wide + one])
                        if k == 2:
                            g0, g1 = _plus(g0, change), _plus(g1, change)
                            g2, g3 = _plus(g2, change), _plus(g3, change)
                    if p == g0 and q == g1 and r == g2 and s == g3:
                        found = k
            found = _symbol(encoding, found, context, numbers, words, state)
            slots[1, b] = here + one
            slots[2, c] = here + one
            slots[3, d] = here + one
            slots[4, d] = mean
            if found < 3:
                before = 0
                outcome[x] = 0
                if not encoding and guesses[found] > 0:
                    g = np.uint64(guesses[found]) - one
                    p, q = np.uint64(flat[g]), np.uint64(flat[g + one])
                    r, s = np.uint64(flat[g + wide]), np.uint64(flat[g + wide + one])
                    if found == 2:
                        p, q = _plus(p, change), _plus(q, change)
                        r, s = _plus(r, change), _plus(s, change)
            else:
                before = 1
                outcome[x] = 1
                p = _texel(
                    encoding, p, mean, w0, n0, nw, n1, east, south, 0, near, order, weights, seen,
                    down, numbers, words,
            state,
                )  # fmt: skip
                q = _texel(
                    encoding, q, mean, p, n1, n0, ne, east, south, 1, near, order, weights, seen,
                    down, numbers, words,
            state,
                )  # fmt: skip
                r = _texel(
                    encoding, r, mean, w1, p, w0, q, east, south, 2, near, order, weights, seen,
                    down, numbers, words,
            state,
                )  # fmt: skip
                s = _last_texel(
                    encoding, s, mean, p, q, r, w1, near, order, seen, down, numbers, words, state
                )
            if not encoding:
                level[y0, x0], level[y0, x1] = p, q
                level[y1, x0], level[y1, x1] = r, s
                if state[_WORD] > limit:
                    return TRUNCATED
    tall = 2 * bh if width > 2 * bw else 0
    for i in range(tall + (width if height > 2 * bh else 0)):
        y, x = (i, width - 1) if i < tall else (height - 1, i - tall)
        texel = np.uint64(level[y, x])
        w = np.uint64(level[y, x - 1]) if x > 0 else np.uint64(level[y - 1, x] if y > 0 else 0)
        n = np.uint64(level[y - 1, x]) if y > 0 else w
        nw = np.uint64(level[y - 1, x - 1]) if y > 0 and x > 0 else n
        level[y, x] = _texel(
            encoding,
            texel,
            w,
            w,
            n,
            nw,
            nw,
            w,
            w,
            4,
            0,
            order,
            weights,
            seen,
            down,
            numbers,
            words,
            state,
        )
        if not encoding and state[_WORD] > limit:
            return TRUNCATED
    if encoding:
        return OK
    stray = state[_STRAY] != 0 or state[_WORD] != limit
    stray |= state[_NEXT_ESCAPE] != state[_ESCAPES_END]
    for lane in range(4):
        stray |= state[lane] != STATE_LOW
    return IMPOSSIBLE if stray else OK
