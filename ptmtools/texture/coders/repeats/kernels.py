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
from ptmtools.texture.coders.rans.kernels import STATE_LOW
from ptmtools.texture.coders.repeats.seen import (
    K0,
    K1,
    K2,
    K3,
    K4,
    K5,
    OTHER,
    choices,
    kept_block,
    known,
    minus,
    plus,
    seen_texel,
    slot,
    spread,
)
from ptmtools.texture.coders.repeats.symbols import (
    ESCAPES_END,
    FIRST,
    GUESS,
    NEXT_ESCAPE,
    RUN,
    STRAY,
    TEXEL,
    WORD,
    symbol,
)
from ptmtools.texture.coders.repeats.unseen import (
    differences,
    edge_samples,
    remainders,
    samples,
)

OK, TRUNCATED, IMPOSSIBLE = 0, 1, 2

#: Answers to "which guess": after those that name one, `TEXELS`, one by one, and `DIFFERENCES`.
GUESSES, TEXELS, DIFFERENCES = 3, 3, 4
#: A block is coded texel by texel if so many samples of p, q and r are among the guesses, or if its
#: texels differ so much.
SMOOTH_KNOWN, ROUGH = 3, 48
#: A run is of at most so many blocks, so that no symbol of it escapes.
LONGEST_RUN = 254
#: No block takes more symbols, so that words need to be counted once a block only.
MOST_SYMBOLS = 24

_C0, _C1, _C2, _C3 = np.uint64(0), np.uint64(1), np.uint64(2), np.uint64(3)


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
    state: (9,) int64: see `COUNT`.

    Returns OK, TRUNCATED or IMPOSSIBLE.
    """
    bh, bw = below.shape
    height, width = level.shape
    down = np.uint64(shift)
    one, two, three = np.uint64(1), np.uint64(2), np.uint64(3)
    wide = np.uint64(width)
    if not encoding:
        for lane in range(4):
            at = state[ESCAPES_END] + 2 * lane
            state[lane] = np.int64(words[at]) | (np.int64(words[at + 1] & 0x7FFF) << 16)
        state[WORD] = state[ESCAPES_END] + 8
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
                rest = symbol(encoding, many - plain, RUN + size, numbers, words, state)
                if rest > many:
                    return IMPOSSIBLE
                if not encoding:
                    plain = many - rest
                    for j in range(x0, x0 + 2 * plain):
                        level[y0, j] = mean
                        level[y1, j] = mean
                    if state[WORD] > limit:
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

            a = slot(mean * K0 + n0 * K2 + n1 * K3 + w0 * K4 + w1 * K5, down)
            entry = np.uint64(slots[0, a])
            trust = np.int64(entry & three)
            source = entry >> two
            hit = 0
            if encoding:
                g0, g1, g2, g3 = kept_block(flat, source, wide, mean, trust > 0)
                hit = 0 if p == g0 and q == g1 and r == g2 and s == g3 else 1
            hit = symbol(encoding, hit, FIRST + 3 * trust + near, numbers, words, state)
            if hit == 0:
                if trust == 0:
                    slots[0, a] = here << two | one
                elif trust < 3:
                    slots[0, a] = entry + one
                before = 0
                outcome[x] = 0
                if not encoding:
                    g0, g1, g2, g3 = kept_block(flat, source, wide, mean, trust > 0)
                    level[y0, x0], level[y0, x1] = g0, g1
                    level[y1, x0], level[y1, x1] = g2, g3
                    if state[WORD] > limit:
                        return TRUNCATED
                continue
            slots[0, a] = here << two | one

            up, under = max(y - 1, 0), min(y + 1, bh - 1)
            left, right = max(x - 1, 0), min(x + 1, bw - 1)
            east, south = np.uint64(below[y, right]), np.uint64(below[under, x])
            all_around = (
                mean * K0 + east * K1 + south * K2 + np.uint64(below[up, x]) * K3
                + np.uint64(below[y, left]) * K4
                + (np.uint64(below[under, right]) ^ np.uint64(0x55)) * K5
                + (np.uint64(below[under, left]) * K1 + np.uint64(below[up, right]) * K4)
                * np.uint64(3)
                + np.uint64(below[up, left]) * np.uint64(5)
            )  # fmt: skip
            b = slot(all_around, down)
            c = slot(mean * K0, down)
            d = slot(
                minus(n0, mean) * K0 + minus(n1, mean) * K2 + minus(w0, mean) * K3
                + minus(w1, mean) * K4 + minus(east, mean) * K5 + minus(south, mean) * K1,
                down,
            )  # fmt: skip
            found = DIFFERENCES
            context = GUESS + 4 * near
            guesses = (slots[1, b], slots[2, c], slots[3, d])
            if guesses[0] > 0:
                context += 1
            if guesses[1] > 0:
                context += 2
            change = minus(mean, np.uint64(slots[4, d]))
            slot_p = slot(mean * K0 + w0 * K2 + n0 * K3 + nw * K4 + n1 * K5, down)
            slot_q, slot_r, slot_s = slot_p, slot_p, slot_p
            if encoding:
                slot_q = slot(mean * K1 + p * K2 + n1 * K3 + n0 * K4 + ne * K5, down)
                slot_r = slot(mean * K2 + w1 * K3 + p * K4 + w0 * K5 + q * K0, down)
                slot_s = slot(mean * K3 + p * K4 + q * K5 + r * K0, down)
                familiar = 1 if known(p, np.uint64(seen[slot_p]), w0, n0, nw, n1) < 5 else 0
                familiar += 1 if known(q, np.uint64(seen[slot_q]), p, n1, n0, ne) < 5 else 0
                familiar += 1 if known(r, np.uint64(seen[slot_r]), w1, p, w0, q) < 5 else 0
                if familiar * order.size >= SMOOTH_KNOWN or spread(p, q, r, s, order.size) >= ROUGH:
                    found = TEXELS
            if encoding:
                for k in range(2, -1, -1):
                    kept = np.uint64(guesses[k])
                    g0, g1, g2, g3 = kept_block(flat, kept - one, wide, mean, kept > 0)
                    if kept > 0 and k == 2:
                        g0, g1 = plus(g0, change), plus(g1, change)
                        g2, g3 = plus(g2, change), plus(g3, change)
                    if p == g0 and q == g1 and r == g2 and s == g3:
                        found = k
            found = symbol(encoding, found, context, numbers, words, state)
            slots[1, b] = here + one
            slots[2, c] = here + one
            slots[3, d] = here + one
            slots[4, d] = mean
            if found < GUESSES:
                before = 0
                outcome[x] = 0
                if not encoding and guesses[found] > 0:
                    p, q, r, s = kept_block(flat, np.uint64(guesses[found]) - one, wide, mean, True)
                    if found == 2:
                        p, q = plus(p, change), plus(q, change)
                        r, s = plus(r, change), plus(s, change)
            else:
                before = 1
                outcome[x] = 1
                if found == TEXELS:
                    context = TEXEL + 4 * near
                    block[0], block[1], block[2], block[3] = p, q, r, s
                    for j in range(3):
                        west, north, corner, other = w0, n0, nw, n1
                        key = mean * K0 + w0 * K2 + n0 * K3 + nw * K4 + n1 * K5
                        if j == 1:
                            west, north, corner, other = block[0], n1, n0, ne
                            key = mean * K1 + block[0] * K2 + n1 * K3 + n0 * K4 + ne * K5
                        if j == 2:
                            west, north, corner, other = w1, block[0], w0, block[1]
                            key = mean * K2 + w1 * K3 + block[0] * K4 + w0 * K5 + block[1] * K0
                        last = np.uint64(seen[slot(key, down)])
                        texel = seen_texel(
                            encoding, block[j], last, west, north, corner, other, context + 12 * j,
                            numbers, words, state,
                        )  # fmt: skip
                        if texel == OTHER:
                            texel = samples(
                                encoding, block[j], mean, west, north, corner, other, j, order,
                                weights, classes, numbers, words, state,
                            )  # fmt: skip
                        block[j] = texel
                    p, q, r = block[0], block[1], block[2]
                    slot_s = slot(mean * K3 + p * K4 + q * K5 + r * K0, down)
                    last = np.uint64(seen[slot_s])
                    possible, place, _ = choices(mean, p, q, r, last, w1, s, 0)
                    if place < 0:
                        place = possible
                    if possible > 0:
                        context += 36 + min(possible - 1, 3)
                        place = symbol(encoding, place, context, numbers, words, state)
                    else:
                        place = 0
                    if place >= possible:
                        s = remainders(encoding, s, mean, p, q, r, order, numbers, words, state)
                    elif not encoding:
                        _, _, s = choices(mean, p, q, r, last, w1, s, place)
                else:
                    block[0], block[1], block[2], block[3] = p, q, r, s
                    around[0], around[1], around[2], around[3] = w0, w1, n0, n1
                    around[4], around[5] = east, south
                    around[6] = np.uint64(below[under, left])
                    around[7] = np.uint64(below[under, right])
                    differences(
                        encoding, block, mean, around, errors, order, classes, numbers, words, state
                    )
                    p, q, r, s = block[0], block[1], block[2], block[3]
                slot_q = slot(mean * K1 + p * K2 + n1 * K3 + n0 * K4 + ne * K5, down)
                slot_r = slot(mean * K2 + w1 * K3 + p * K4 + w0 * K5 + q * K0, down)
                slot_s = slot(mean * K3 + p * K4 + q * K5 + r * K0, down)
                seen[slot_p], seen[slot_q], seen[slot_r], seen[slot_s] = p, q, r, s
            if not encoding:
                level[y0, x0], level[y0, x1] = p, q
                level[y1, x0], level[y1, x1] = r, s
                if state[WORD] > limit:
                    return TRUNCATED
    tall = 2 * bh if width > 2 * bw else 0
    for i in range(tall + (width if height > 2 * bh else 0)):
        y, x = (i, width - 1) if i < tall else (height - 1, i - tall)
        texel = np.uint64(level[y, x])
        w = np.uint64(level[y, x - 1]) if x > 0 else np.uint64(level[y - 1, x] if y > 0 else 0)
        n = np.uint64(level[y - 1, x]) if y > 0 else w
        nw = np.uint64(level[y - 1, x - 1]) if y > 0 and x > 0 else n
        slot_p = slot(w * K4 + n * K3 + nw * K2, down)
        last = np.uint64(seen[slot_p])
        kept = texel
        texel = seen_texel(encoding, texel, last, w, n, nw, nw, TEXEL + 48, numbers, words, state)
        if texel == OTHER:
            texel = edge_samples(encoding, kept, w, n, nw, order.size, numbers, words, state)
        seen[slot_p] = texel
        level[y, x] = texel
        if not encoding and state[WORD] > limit:
            return TRUNCATED
    if encoding:
        return OK
    stray = state[STRAY] != 0 or state[WORD] != limit
    stray |= state[NEXT_ESCAPE] != state[ESCAPES_END]
    for lane in range(4):
        stray |= state[lane] != STATE_LOW
    return IMPOSSIBLE if stray else OK
