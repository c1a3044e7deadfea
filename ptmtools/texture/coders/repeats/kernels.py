"""Compiled loop of the repeats coder: blocks, texels and samples that were seen before.

One pass serves both directions. It goes through the 2×2 blocks in row-major order. Runs of blocks
that are flat like all around them are one symbol. For each other block it asks
tables of the last block seen in the same surroundings. If none of these is the one, smooth blocks
are coded by their Haar differences, rough ones texel by texel: each is a neighbour, or the last
texel seen in the same surroundings, or new, and then its samples are predicted. A texel is one
32-bit number, so that components cost nothing while something repeats. There is no search: encoder
and decoder take the same time, in proportion to the blocks. ``docs/format-ptm.md`` specifies it.

Tried, in sizes relative to PNG on an atlas of an office / a page of small text in colour: asking by
the mean alone 1.35 / 3.37; by the neighbouring texels 1.31 / 1.36; by the means all around 2.22 /
2.39; by all of these, as here, 0.68 / 1.35. New blocks always by Haar differences: 0.84 / 1.61;
never: 0.67 / 1.35, but photographs 3 % larger. Samples that refer to green with a weight of 38/64,
which suits photographs, instead of 64/64: a lightmap with grey edges a sixth larger.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ptmtools.compiled import plain_kernel as kernel
from ptmtools.texture.coders.rans.kernels import ESCAPE, STATE_LOW, decode_single

OK, TRUNCATED, IMPOSSIBLE = 0, 1, 2

#: First table of each sort of symbol: is the block the first guess; which guess it is; which guess
#: a texel is, by position; the samples of texels that belong to no block; Haar differences; samples
#: of other texels; remainders of the sum; how much of a run is not flat.
FIRST, GUESS, TEXEL, EDGE, HAAR, SAMPLE, REMAINDER, RUN = 0, 12, 24, 84, 85, 145, 185, 188
#: Answers to "which guess": after those that name one, `TEXELS`, one by one, and `DIFFERENCES`.
GUESSES, TEXELS, DIFFERENCES = 3, 3, 4
#: A block is coded texel by texel if so many samples of p, q and r are among the guesses, or if its
#: texels differ so much.
SMOOTH_KNOWN, ROUGH = 3, 48
#: Classes of activity of Haar differences; tables for V, h and g, without and with a reference.
CLASSES = 10
LARGEST_ACTIVITY = 1023
TABLES = RUN + 8
#: A run is of at most so many blocks, so that no symbol of it escapes.
LONGEST_RUN = 254
#: No block takes more symbols, so that words need to be counted once a block only.
MOST_SYMBOLS = 24

_MASK32 = np.uint64(0xFFFFFFFF)
#: Stands for a texel that is none of the guesses.
_OTHER = np.uint64(1 << 32)
_HIGH = np.uint64(0x80808080)
_LOW7 = np.uint64(0x7F7F7F7F)
_K0, _K1, _K2 = np.uint64(0x9E3779B1), np.uint64(0x85EBCA6B), np.uint64(0xC2B2AE35)
_C0, _C1, _C2, _C3 = np.uint64(0), np.uint64(1), np.uint64(2), np.uint64(3)
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
    at = np.uint64(state[_WORD])
    z, refill = decode_single(numbers, context, state, np.uint64(n & 3), words[at])
    state[_WORD] = at + (np.uint64(1) if refill else np.uint64(0))
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
    h &= _MASK32
    h ^= h >> np.uint64(15)
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
def _index(activity: Any) -> Any:
    return np.uint64(activity if activity < LARGEST_ACTIVITY else LARGEST_ACTIVITY)


@kernel
def _samples(
    encoding: bool, texel: Any, mean: Any, w: Any, n: Any, nw: Any, ne: Any, position: int,
    order: Any, weights: Any, classes: Any, numbers: Any, words: Any, state: Any,
) -> Any:  # fmt: skip
    """p, q or r of a block, sample by sample, each predicted from its surroundings."""
    out = np.uint64(0)
    reference = np.int64(0)
    byte = np.uint64(255)
    for c in range(order.size):
        at = np.uint64(8 * order[c])
        i = np.int64((mean >> at) & byte)
        fw, fn = np.int64((w >> at) & byte) - i, np.int64((n >> at) & byte) - i
        fnw, fne = np.int64((nw >> at) & byte) - i, np.int64((ne >> at) & byte) - i
        guess = i + (
            (weights[position, 0] * fw + weights[position, 1] * fn + weights[position, 2] * fnw
             + weights[position, 3] * fne + 32) >> 6
        )  # fmt: skip
        activity = abs(fw - fn) + abs(fn - fne) + abs(fw) + abs(fn)
        context = SAMPLE
        if position > 0:
            context += CLASSES
        if c > 0 and c < 3 and order.size > 2:
            guess += reference
            activity = (activity >> 2) + 4 * abs(reference)
            context += 2 * CLASSES
        guess = min(max(guess, 0), 255)
        level = np.int64(classes[_index(activity)])
        e = ((np.int64((texel >> at) & byte) - guess + 128) & 255) - 128
        z = _symbol(encoding, (e << 1) ^ (e >> 63), context + level, numbers, words, state)
        value = (guess + ((z >> 1) ^ -(z & 1))) & 255
        if c == 0:
            reference = value - guess
        elif c == 1:
            reference += (value - guess) >> 1
        out |= np.uint64(value) << at
    return out


@kernel
def _remainders(
    encoding: bool, s: Any, mean: Any, p: Any, q: Any, r: Any, order: Any, numbers: Any,
    words: Any, state: Any,
) -> Any:  # fmt: skip
    """s of a block by the remainder of the sum in each component."""
    out = np.uint64(0)
    byte = np.uint64(255)
    for c in range(order.size):
        at = np.uint64(8 * order[c])
        a, b = np.int64((q >> at) & byte), np.int64((r >> at) & byte)
        corner = np.int64((p >> at) & byte)
        base = 4 * np.int64((mean >> at) & byte) - a - b - corner
        guess: Any = max(min(a, b), min(max(a, b), a + b - corner)) - base
        kind = 0 if guess < 0 else 1 if guess < 4 else 2
        guess = min(max(guess, 0), 3)
        value = np.int64((s >> at) & byte) - base
        z = _symbol(encoding, (value - guess) & 3, REMAINDER + kind, numbers, words, state)
        value = base + ((z + guess) & 3)
        if value < 0 or value > 255:
            state[_STRAY] = 1
        out |= np.uint64(value & 255) << at
    return out


@kernel
def _known(texel: Any, seen: Any, w: Any, n: Any, nw: Any, ne: Any) -> int:
    """Number of the first guess that is the texel; 5 for none."""
    found = 4 if texel == ne else 5
    if texel == nw:
        found = 3
    if texel == n:
        found = 2
    if texel == w:
        found = 1
    return 0 if texel == seen else found


@kernel
def _range(p: Any, q: Any, r: Any, s: Any, components: int) -> Any:
    """The largest difference between texels of a block, over the components."""
    most: Any = 0
    for c in range(components):
        at = np.uint64(8 * c)
        byte = np.uint64(255)
        a, b = np.int64((p >> at) & byte), np.int64((q >> at) & byte)
        d, e = np.int64((r >> at) & byte), np.int64((s >> at) & byte)
        most = max(most, max(max(a, b), max(d, e)) - min(min(a, b), min(d, e)))
    return most


@kernel
def _texel(
    encoding: bool, texel: Any, seen: Any, w: Any, n: Any, nw: Any, ne: Any, context: int,
    numbers: Any, words: Any, state: Any,
) -> Any:  # fmt: skip
    """A texel that is one of five guesses, or `_OTHER`."""
    found = _known(texel, seen, w, n, nw, ne)
    if w == n:
        context += 1
    if seen in (w, n):
        context += 2
    found = _symbol(encoding, found, context, numbers, words, state)
    if found == 0:
        texel = seen
    elif found == 1:
        texel = w
    elif found == 2:
        texel = n
    elif found == 3:
        texel = nw
    elif found == 4:
        texel = ne
    else:
        texel = _OTHER
    return texel


@kernel
def _fits(mean: Any, p: Any, q: Any, r: Any, s: Any) -> Any:
    """Whether a block has this mean in every component."""
    even = np.uint64(0x00FF00FF)
    eight = np.uint64(8)
    low = (p & even) + (q & even) + (r & even) + (s & even)
    high = (
        ((p >> eight) & even) + ((q >> eight) & even) + ((r >> eight) & even)
        + ((s >> eight) & even)
    )  # fmt: skip
    return ((low >> np.uint64(2)) & even) == (mean & even) and ((high >> np.uint64(2)) & even) == (
        (mean >> eight) & even
    )


@kernel
def _choices(mean: Any, p: Any, q: Any, r: Any, seen: Any, west: Any, wanted: Any, nth: int) -> Any:
    """Fourth texels that the mean allows: their number, the place of ``wanted``, the ``nth``."""
    choices = (seen, r, q, p, west)
    possible, place, chosen = 0, -1, seen
    for i in range(5):
        one = choices[i]
        fresh = True
        for j in range(i):
            fresh &= choices[j] != one
        if fresh and _fits(mean, p, q, r, one):
            if one == wanted:
                place = possible
            if possible == nth:
                chosen = one
            possible += 1
    return possible, place, chosen


@kernel
def _differences(
    encoding: bool, block: Any, mean: Any, around: Any, errors: Any, order: Any, classes: Any,
    numbers: Any, words: Any, state: Any,
) -> None:  # fmt: skip
    """The four texels of ``block`` by their Haar differences, component by component.

    around: w0, w1, n0, n1 and the means to the east, south, south-west and south-east.
    """
    byte = np.uint64(255)
    out0, out1, out2, out3 = np.uint64(0), np.uint64(0), np.uint64(0), np.uint64(0)
    for c in range(order.size):
        at = np.uint64(8 * order[c])
        i = np.int64((mean >> at) & byte)
        w0, w1 = np.int64((around[0] >> at) & byte), np.int64((around[1] >> at) & byte)
        n0, n1 = np.int64((around[2] >> at) & byte), np.int64((around[3] >> at) & byte)
        east, south = np.int64((around[4] >> at) & byte), np.int64((around[5] >> at) & byte)
        tilt = np.int64((around[7] >> at) & byte) - np.int64((around[6] >> at) & byte)
        p, q = np.int64((block[0] >> at) & byte), np.int64((block[1] >> at) & byte)
        r, s = np.int64((block[2] >> at) & byte), np.int64((block[3] >> at) & byte)
        referring = c > 0 and c < 3 and order.size > 2
        if not referring:
            errors[0] = errors[1] = errors[2] = 0
        north, west = n0 + n1 - 2 * i, w0 + w1 - 2 * i
        across, down = n0 - n1, w0 - w1
        east -= i
        south -= i
        calm = abs(north) + abs(west) + abs(across) + abs(down)

        v, h, g = np.int64(0), np.int64(0), np.int64(0)
        for kind in range(3):
            if kind == 0:
                value, reference, activity = p + q - r - s, errors[0], calm + abs(south)
                guess = 88 * north - 50 * south + 176 * down + 220 * reference
            elif kind == 1:
                value, reference, activity = p - q, errors[1], calm + abs(east)
                guess = 46 * west - 22 * east + 93 * across + 240 * reference
            else:
                value, reference, activity = (r - s) >> 1, errors[2], calm + abs(tilt)
                guess = 20 * west - 8 * east - 2 * tilt + 47 * h + 235 * reference
            guess = np.int64((guess + 128) >> 8)
            context: Any = HAAR + kind * CLASSES
            if referring:
                context += 3 * CLASSES
                activity = (activity >> 2) + 3 * abs(reference)
            e = value - guess
            context += np.int64(classes[_index(activity)])
            z = _symbol(encoding, (e << 1) ^ (e >> 63), context, numbers, words, state)
            e = (z >> 1) ^ -(z & 1)
            if kind == 0:
                v = guess + e
            elif kind == 1:
                h = guess + e
            else:
                g = guess + e
            if c == 0:
                errors[kind] = e

        half = (v + (v & 1)) >> 1
        top = 2 * i + ((h ^ half) & 1) + half
        bottom = top - v
        p = (top + h) >> 1
        q = p - h
        d = 2 * g + (bottom & 1)
        r = (bottom + d) >> 1
        s = r - d
        if (p | q | r | s) & ~255:
            state[_STRAY] = 1
        out0 |= np.uint64(p & 255) << at
        out1 |= np.uint64(q & 255) << at
        out2 |= np.uint64(r & 255) << at
        out3 |= np.uint64(s & 255) << at
    block[0], block[1], block[2], block[3] = out0, out1, out2, out3


@kernel
def _edge_samples(
    encoding: bool, texel: Any, w: Any, n: Any, nw: Any, components: int, numbers: Any, words: Any,
    state: Any,
) -> Any:  # fmt: skip
    """A texel that belongs to no block, sample by sample, less the median of W, N, W + N - NW."""
    out = np.uint64(0)
    byte = np.uint64(255)
    for c in range(components):
        at = np.uint64(8 * c)
        a, b = np.int64((w >> at) & byte), np.int64((n >> at) & byte)
        guess = max(min(a, b), min(max(a, b), a + b - np.int64((nw >> at) & byte)))
        e = ((np.int64((texel >> at) & byte) - guess + 128) & 255) - 128
        z = _symbol(encoding, (e << 1) ^ (e >> 63), EDGE, numbers, words, state)
        out |= np.uint64((guess + ((z >> 1) ^ -(z & 1))) & 255) << at
    return out


@kernel
def _block(flat: Any, place: Any, wide: Any, mean: Any, kept: Any) -> Any:
    """The block that begins at ``place``, if one is kept, else four times the mean."""
    p, q, r, s = mean, mean, mean, mean
    if kept:
        p, q = np.uint64(flat[place]), np.uint64(flat[place + _C1])
        r, s = np.uint64(flat[place + wide]), np.uint64(flat[place + wide + _C1])
    return p, q, r, s


@kernel
def move_texels(packing: bool, level: Any, texels: Any) -> None:
    """(h, w, c) uint8 to (h, w) uint32, or back: component c in bits 8 c to 8 c + 7."""
    components = level.shape[2]
    for y in range(texels.shape[0]):
        row, packed = level[y], texels[y]
        # Written out, and with unsigned places: a loop over components took five times as long.
        for place in range(packed.size):
            x = np.uint64(place)
            if packing:
                texel = np.uint32(row[x, _C0])
                if components > 1:
                    texel |= np.uint32(row[x, _C1]) << np.uint32(8)
                if components > 2:
                    texel |= np.uint32(row[x, _C2]) << np.uint32(16)
                if components > 3:
                    texel |= np.uint32(row[x, _C3]) << np.uint32(24)
                packed[x] = texel
            else:
                texel = packed[x]
                row[x, _C0] = texel
                if components > 1:
                    row[x, _C1] = texel >> np.uint32(8)
                if components > 2:
                    row[x, _C2] = texel >> np.uint32(16)
                if components > 3:
                    row[x, _C3] = texel >> np.uint32(24)


@kernel
def repeats_pass(
    encoding: bool, level: Any, flat: Any, below: Any, order: Any, weights: Any, classes: Any,
    slots: Any, seen: Any, outcome: Any, block: Any, around: Any, errors: Any, shift: int,
    limit: int, numbers: Any, words: Any, state: Any,
) -> int:  # fmt: skip
    """One group in either direction.

    Parameters
    ----------
    encoding: True reads ``level`` and fills ``numbers`` with symbol | context << 16; False fills
        ``level`` from ``words``.
    level: (h, w) uint32, texels with component c in bits 8 c to 8 c + 7. below: (h >> 1, w >> 1).
    order: (c,) int64, components in coding order. weights: (3, 4) int64, of p, q and r.
    classes: (1024,) uint8, class of an activity.
    slots: (5, 2^b) and seen: (2^b,) uint32, zeros; shift: 32 - b.
    outcome: (w // 2 + 1,) int64, zeros. block: (4,), around: (8,) uint64 and errors: (3,)
        int64, overwritten.
    limit: index of the word behind the last.
    numbers: uint32; decoding, of `tables.single_tables`.
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
        # The block that ends a run: it is known not to be flat.
        after = -1
        x = -1
        while x + 1 < bw:
            x += 1
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
            even = n0 == mean and n1 == mean and w0 == mean and w1 == mean
            if y > 0 and x != after and even:
                many = 1
                while (
                    many < LONGEST_RUN and x + many < bw and np.uint64(below[y, x + many]) == mean
                    and np.uint64(level[y0 - 1, x0 + 2 * many]) == mean
                    and np.uint64(level[y0 - 1, x1 + 2 * many]) == mean
                ):  # fmt: skip
                    many += 1
                size = 0
                while many >> (size + 1):
                    size += 1
                plain = 0
                if encoding:
                    while plain < many and (
                        np.uint64(level[y0, x0 + 2 * plain]) == mean
                        and np.uint64(level[y0, x1 + 2 * plain]) == mean
                        and np.uint64(level[y1, x0 + 2 * plain]) == mean
                        and np.uint64(level[y1, x1 + 2 * plain]) == mean
                    ):
                        plain += 1
                rest = _symbol(encoding, many - plain, RUN + size, numbers, words, state)
                if rest > many:
                    return IMPOSSIBLE
                if not encoding:
                    plain = many - rest
                    for j in range(x0, x0 + 2 * plain):
                        level[y0, j] = mean
                        level[y1, j] = mean
                    if state[_WORD] > limit:
                        return TRUNCATED
                for j in range(x, x + plain):
                    outcome[j] = 0
                if rest > 0:
                    after = x + plain
                if plain > 0:
                    before = 0
                    x += plain - 1
                    continue
            p, q, r, s = mean, mean, mean, mean
            if encoding:
                p, q = np.uint64(level[y0, x0]), np.uint64(level[y0, x1])
                r, s = np.uint64(level[y1, x0]), np.uint64(level[y1, x1])
            here = np.uint64(y0 * width + x0)
            near = min(before, 1) + min(outcome[x], 1)

            a = _slot(mean * _K0 + n0 * _K2 + n1 * _K3 + w0 * _K4 + w1 * _K5, down)
            entry = np.uint64(slots[0, a])
            trust = np.int64(entry & three)
            source = entry >> two
            hit = 0
            if encoding:
                g0, g1, g2, g3 = _block(flat, source, wide, mean, trust > 0)
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
                    g0, g1, g2, g3 = _block(flat, source, wide, mean, trust > 0)
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
            found = DIFFERENCES
            context = GUESS + 4 * near
            guesses = (slots[1, b], slots[2, c], slots[3, d])
            if guesses[0] > 0:
                context += 1
            if guesses[1] > 0:
                context += 2
            change = _minus(mean, np.uint64(slots[4, d]))
            slot_p = _slot(mean * _K0 + w0 * _K2 + n0 * _K3 + nw * _K4 + n1 * _K5, down)
            slot_q, slot_r, slot_s = slot_p, slot_p, slot_p
            if encoding:
                slot_q = _slot(mean * _K1 + p * _K2 + n1 * _K3 + n0 * _K4 + ne * _K5, down)
                slot_r = _slot(mean * _K2 + w1 * _K3 + p * _K4 + w0 * _K5 + q * _K0, down)
                slot_s = _slot(mean * _K3 + p * _K4 + q * _K5 + r * _K0, down)
                known = 1 if _known(p, np.uint64(seen[slot_p]), w0, n0, nw, n1) < 5 else 0
                known += 1 if _known(q, np.uint64(seen[slot_q]), p, n1, n0, ne) < 5 else 0
                known += 1 if _known(r, np.uint64(seen[slot_r]), w1, p, w0, q) < 5 else 0
                if known * order.size >= SMOOTH_KNOWN or _range(p, q, r, s, order.size) >= ROUGH:
                    found = TEXELS
            if encoding:
                for k in range(2, -1, -1):
                    kept = np.uint64(guesses[k])
                    g0, g1, g2, g3 = _block(flat, kept - one, wide, mean, kept > 0)
                    if kept > 0 and k == 2:
                        g0, g1 = _plus(g0, change), _plus(g1, change)
                        g2, g3 = _plus(g2, change), _plus(g3, change)
                    if p == g0 and q == g1 and r == g2 and s == g3:
                        found = k
            found = _symbol(encoding, found, context, numbers, words, state)
            slots[1, b] = here + one
            slots[2, c] = here + one
            slots[3, d] = here + one
            slots[4, d] = mean
            if found < GUESSES:
                before = 0
                outcome[x] = 0
                if not encoding and guesses[found] > 0:
                    p, q, r, s = _block(flat, np.uint64(guesses[found]) - one, wide, mean, True)
                    if found == 2:
                        p, q = _plus(p, change), _plus(q, change)
                        r, s = _plus(r, change), _plus(s, change)
            else:
                before = 1
                outcome[x] = 1
                if found == TEXELS:
                    context = TEXEL + 4 * near
                    block[0], block[1], block[2], block[3] = p, q, r, s
                    for j in range(3):
                        west, north, corner, other = w0, n0, nw, n1
                        key = mean * _K0 + w0 * _K2 + n0 * _K3 + nw * _K4 + n1 * _K5
                        if j == 1:
                            west, north, corner, other = block[0], n1, n0, ne
                            key = mean * _K1 + block[0] * _K2 + n1 * _K3 + n0 * _K4 + ne * _K5
                        if j == 2:
                            west, north, corner, other = w1, block[0], w0, block[1]
                            key = mean * _K2 + w1 * _K3 + block[0] * _K4 + w0 * _K5 + block[1] * _K0
                        last = np.uint64(seen[_slot(key, down)])
                        texel = _texel(
                            encoding, block[j], last, west, north, corner, other, context + 12 * j,
                            numbers, words, state,
                        )  # fmt: skip
                        if texel == _OTHER:
                            texel = _samples(
                                encoding, block[j], mean, west, north, corner, other, j, order,
                                weights, classes, numbers, words, state,
                            )  # fmt: skip
                        block[j] = texel
                    p, q, r = block[0], block[1], block[2]
                    slot_s = _slot(mean * _K3 + p * _K4 + q * _K5 + r * _K0, down)
                    last = np.uint64(seen[slot_s])
                    possible, place, _ = _choices(mean, p, q, r, last, w1, s, 0)
                    if place < 0:
                        place = possible
                    if possible > 0:
                        context += 36 + min(possible - 1, 3)
                        place = _symbol(encoding, place, context, numbers, words, state)
                    else:
                        place = 0
                    if place >= possible:
                        s = _remainders(encoding, s, mean, p, q, r, order, numbers, words, state)
                    elif not encoding:
                        _, _, s = _choices(mean, p, q, r, last, w1, s, place)
                else:
                    block[0], block[1], block[2], block[3] = p, q, r, s
                    around[0], around[1], around[2], around[3] = w0, w1, n0, n1
                    around[4], around[5] = east, south
                    around[6] = np.uint64(below[under, left])
                    around[7] = np.uint64(below[under, right])
                    _differences(
                        encoding, block, mean, around, errors, order, classes, numbers, words, state
                    )
                    p, q, r, s = block[0], block[1], block[2], block[3]
                slot_q = _slot(mean * _K1 + p * _K2 + n1 * _K3 + n0 * _K4 + ne * _K5, down)
                slot_r = _slot(mean * _K2 + w1 * _K3 + p * _K4 + w0 * _K5 + q * _K0, down)
                slot_s = _slot(mean * _K3 + p * _K4 + q * _K5 + r * _K0, down)
                seen[slot_p], seen[slot_q], seen[slot_r], seen[slot_s] = p, q, r, s
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
        slot_p = _slot(w * _K4 + n * _K3 + nw * _K2, down)
        last = np.uint64(seen[slot_p])
        kept = texel
        texel = _texel(encoding, texel, last, w, n, nw, nw, TEXEL + 48, numbers, words, state)
        if texel == _OTHER:
            texel = _edge_samples(encoding, kept, w, n, nw, order.size, numbers, words, state)
        seen[slot_p] = texel
        level[y, x] = texel
        if not encoding and state[_WORD] > limit:
            return TRUNCATED
    if encoding:
        return OK
    stray = state[_STRAY] != 0 or state[_WORD] != limit
    stray |= state[_NEXT_ESCAPE] != state[_ESCAPES_END]
    for lane in range(4):
        stray |= state[lane] != STATE_LOW
    return IMPOSSIBLE if stray else OK
