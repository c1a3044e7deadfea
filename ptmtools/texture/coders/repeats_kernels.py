"""Compiled loop of the repeats coder, which codes repeated blocks, texels and samples.

One pass serves both directions. It goes through the 2×2 blocks in row-major order. Runs of blocks
that are flat like their surroundings are one symbol. For every other block it looks up the last
block seen in the same surroundings. If none of the candidates matches, smooth blocks are coded by
their Haar differences, rough ones texel by texel: each is a neighbour, or the last texel seen in
the same surroundings, or new, and then its samples are predicted. A texel is one 32-bit number, so
that the number of components costs no time in repeated content. There is no search: encoder and
decoder take the same time, in proportion to the blocks. ``docs/formats/ptm.md`` specifies it.

Tried, in sizes relative to PNG on an atlas of an office / a page of small text in colour: asking by
the mean alone 1.35 / 3.37; by the neighbouring texels 1.31 / 1.36; by the means all around 2.22 /
2.39; by all of these, as here, 0.68 / 1.35. New blocks always by Haar differences: 0.84 / 1.61;
never: 0.67 / 1.35, but photographs 3 % larger. Samples that refer to green with a weight of 38/64,
which suits photographs, instead of 64/64: a lightmap with grey edges a sixth larger.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ptmtools.jit import inlined_kernel, plain_kernel as kernel
from ptmtools.texture.coders.group import IMPOSSIBLE, OK, TRUNCATED
from ptmtools.texture.coders.rans_kernels import STATE_LOW, start_states
from ptmtools.texture.coders.repeats_blocks import (
    ESCAPES_END,
    FIRST,
    GUESS,
    K0,
    K1,
    K2,
    K3,
    K4,
    K5,
    NEXT_ESCAPE,
    RUN,
    STRAY,
    TEXEL,
    WORD,
    block_at,
    choices,
    differences,
    edge_texel,
    guess_rank,
    minus,
    put_block,
    remainders,
    same,
    shift_block,
    slot,
    spread,
    symbol,
    texel,
    texel_slot,
)

#: Answers to "which guess": after those that name one, `TEXELS`, one by one, and `DIFFERENCES`.
GUESSES, TEXELS, DIFFERENCES = 3, 3, 4
#: A block is coded texel by texel if this many samples of p, q and r are among the guesses, or if
#: its texels differ by this much.
SMOOTH_KNOWN, ROUGH = 3, 48
#: Longest run, blocks, so that none of its symbols escapes.
LONGEST_RUN = 254
#: No block takes more symbols, so that words need to be counted once a block only.
MOST_SYMBOLS = 24

#: Positions in a block. Of one type: the helpers are compiled once for all of them.
_P, _Q, _R = np.int64(0), np.int64(1), np.int64(2)
_C0, _C1, _C2 = np.uint64(0), np.uint64(1), np.uint64(2)
_ONE, _TWO, _THREE = np.uint64(1), np.uint64(2), np.uint64(3)


@kernel
def move_rgb(packing: bool, level: Any, texels: Any) -> None:
    """(h, w, 3) uint8 to (h, w) uint32, or back: component c in bits 8 c to 8 c + 7."""
    for y in range(texels.shape[0]):
        row, packed = level[y], texels[y]
        # Written out, and with unsigned places: a loop over components took five times as long.
        for place in range(packed.size):
            x = np.uint64(place)
            if packing:
                texel = np.uint32(row[x, _C0])
                texel |= np.uint32(row[x, _C1]) << np.uint32(8)
                packed[x] = texel | np.uint32(row[x, _C2]) << np.uint32(16)
            else:
                texel = packed[x]
                row[x, _C0] = texel
                row[x, _C1] = texel >> np.uint32(8)
                row[x, _C2] = texel >> np.uint32(16)


@inlined_kernel
def _surroundings(texels: Any, below: Any, y: int, x: int, width: int) -> Any:
    """Of a block the mean, the texels w0, w1 to the left of p and r, n0, n1 above p and q, nw, ne.
    Those outside the level are replaced by ones inside, or by the mean."""
    place, wide = np.uint64(2 * (y * width + x)), np.uint64(width)
    above = place - wide
    mean = np.uint64(below[y, x])
    n0, n1, nw, ne = mean, mean, mean, mean
    w0, w1 = mean, mean
    if x > 0:
        w0, w1 = np.uint64(texels[place - _ONE]), np.uint64(texels[place + wide - _ONE])
        nw = w0
    if y > 0:
        n0, n1 = np.uint64(texels[above]), np.uint64(texels[above + _ONE])
        nw = np.uint64(texels[above - _ONE]) if x > 0 else n0
        ne = np.uint64(texels[above + _TWO]) if x + 1 < below.shape[1] else n1
    return mean, w0, w1, n0, n1, nw, ne


@inlined_kernel
def _code_run(
    texels: Any, below: Any, y: int, x: int, width: int, flat: Any, sink: Any, source: Any,
    state: Any,
) -> Any:  # fmt: skip
    """How many blocks from x on equal the mean of the first, and how many more have that mean and
    such texels above them, so that they could; of the first -1 for an impossible symbol."""
    place, wide = np.uint64(2 * (y * width + x)), np.uint64(width)
    above, mean = place - wide, flat[0]
    many = 1
    while many < LONGEST_RUN and x + many < below.shape[1]:
        at = above + np.uint64(2 * many)
        if below[y, x + many] != mean or texels[at] != mean or texels[at + _ONE] != mean:
            break
        many += 1
    size = 0
    while many >> (size + 1):
        size += 1
    plain = 0
    if sink is not None:
        while plain < many and same(flat, block_at(texels, place + np.uint64(2 * plain), wide)):
            plain += 1
    rest = symbol(many - plain, RUN + size, sink, source, state)
    if source is not None:
        if rest > many:
            return -1, rest
        plain = many - rest
        for i in range(plain):
            put_block(texels, place + np.uint64(2 * i), wide, flat)
    return plain, many - plain


@inlined_kernel
def _is_first_guess(
    block: Any, around: Any, near: Any, texels: Any, place: Any, wide: Any, slots: Any, shift: Any,
    sink: Any, source: Any, state: Any,
) -> Any:  # fmt: skip
    """Whether a block is the last one with the same texels around it; decoding, it is copied."""
    mean, w0, w1, n0, n1, _, _ = around
    a = slot(mean * K0 + n0 * K2 + n1 * K3 + w0 * K4 + w1 * K5, shift)
    entry = np.uint64(slots[0, a])
    trust = np.int64(entry & _THREE)
    guess = block_at(texels, entry >> _TWO, wide) if trust > 0 else (mean, mean, mean, mean)
    missed = 0
    if sink is not None:
        missed = 0 if same(block, guess) else 1
    hit = symbol(missed, FIRST + 3 * trust + near, sink, source, state) == 0
    if not hit or trust == 0:
        slots[0, a] = place << _TWO | _ONE
    elif trust < 3:
        slots[0, a] = entry + _ONE
    if source is not None and hit:
        put_block(texels, place, wide, guess)
    return hit


@inlined_kernel
def _block_slots(around: Any, below: Any, y: int, x: int, shift: Any) -> Any:
    """The means to the east, south, south-west and south-east of a block, and the slots of its
    guesses: by all means around it, by its mean, by its surroundings less the mean."""
    mean, w0, w1, n0, n1, _, _ = around
    up, under = max(y - 1, 0), min(y + 1, below.shape[0] - 1)
    west, right = max(x - 1, 0), min(x + 1, below.shape[1] - 1)
    east, south = np.uint64(below[y, right]), np.uint64(below[under, x])
    south_west, south_east = np.uint64(below[under, west]), np.uint64(below[under, right])
    all_around = (
        mean * K0 + east * K1 + south * K2 + below[up, x] * K3 + below[y, west] * K4
        + (south_east ^ np.uint64(0x55)) * K5
        + (south_west * K1 + below[up, right] * K4) * _THREE
        + below[up, west] * np.uint64(5)
    )  # fmt: skip
    changes = (
        minus(n0, mean) * K0 + minus(n1, mean) * K2 + minus(w0, mean) * K3
        + minus(w1, mean) * K4 + minus(east, mean) * K5 + minus(south, mean) * K1
    )  # fmt: skip
    means = (east, south, south_west, south_east)
    return means, (slot(all_around, shift), slot(mean * K0, shift), slot(changes, shift))


@inlined_kernel
def _texel_slots(block: Any, around: Any, shift: Any) -> Any:
    """The slots of the texels of a block."""
    mean, w0, w1, n0, n1, nw, ne = around
    p, q, r, _ = block
    return (
        texel_slot(mean, K0, w0, K2, n0, K3, nw, K4, n1, K5, shift),
        texel_slot(mean, K1, p, K2, n1, K3, n0, K4, ne, K5, shift),
        texel_slot(mean, K2, w1, K3, p, K4, w0, K5, q, K0, shift),
        slot(mean * K3 + p * K4 + q * K5 + r * K0, shift),
    )


@inlined_kernel
def _choose(
    block: Any, around: Any, places: Any, change: Any, keys: Any, texels: Any, wide: Any,
    seen: Any, components: Any,
) -> Any:  # fmt: skip
    """Encoding: the guess that a block equals, or how it is coded."""
    mean, w0, w1, n0, n1, nw, ne = around
    p, q, r, _ = block
    choice = DIFFERENCES
    familiar = 1 if guess_rank(p, np.uint64(seen[keys[0]]), w0, n0, nw, n1) < 5 else 0
    familiar += 1 if guess_rank(q, np.uint64(seen[keys[1]]), p, n1, n0, ne) < 5 else 0
    familiar += 1 if guess_rank(r, np.uint64(seen[keys[2]]), w1, p, w0, q) < 5 else 0
    if familiar * components >= SMOOTH_KNOWN or spread(block, components) >= ROUGH:
        choice = TEXELS
    for i in range(2, -1, -1):
        guess = (mean, mean, mean, mean)
        if places[i] > 0:
            guess = block_at(texels, places[i] - _ONE, wide)
            if i == 2:
                guess = shift_block(guess, change)
        if same(block, guess):
            choice = i
    return choice


@inlined_kernel
def _code_texels(
    block: Any, around: Any, keys: Any, near: Any, seen: Any, shift: Any, order: Any, weights: Any,
    classes: Any, sink: Any, source: Any, state: Any,
) -> Any:  # fmt: skip
    """A block texel by texel, and the slots of its texels: encoding, ``keys``."""
    mean, w0, w1, n0, n1, nw, ne = around
    p, q, r, s = block
    slot_p, slot_q, slot_r, slot_s = keys
    context = TEXEL + 4 * near
    p = texel(
        _P, p, np.uint64(seen[slot_p]), mean, w0, n0, nw, n1, context, order, weights, classes,
        sink, source, state,
    )  # fmt: skip
    if source is not None:
        slot_q = texel_slot(mean, K1, p, K2, n1, K3, n0, K4, ne, K5, shift)
    q = texel(
        _Q, q, np.uint64(seen[slot_q]), mean, p, n1, n0, ne, context + 12, order, weights, classes,
        sink, source, state,
    )  # fmt: skip
    if source is not None:
        slot_r = texel_slot(mean, K2, w1, K3, p, K4, w0, K5, q, K0, shift)
    r = texel(
        _R, r, np.uint64(seen[slot_r]), mean, w1, p, w0, q, context + 24, order, weights, classes,
        sink, source, state,
    )  # fmt: skip
    if source is not None:
        slot_s = slot(mean * K3 + p * K4 + q * K5 + r * K0, shift)
    last = np.uint64(seen[slot_s])
    possible, nth, _ = choices(mean, p, q, r, last, w1, s, np.int64(0))
    if nth < 0:
        nth = possible
    if possible > 0:
        context += 36 + min(possible - 1, 3)
        nth = symbol(nth, context, sink, source, state)
    else:
        nth = 0
    if nth >= possible:
        s = remainders(s, mean, p, q, r, order, sink, source, state)
    elif source is not None:
        _, _, s = choices(mean, p, q, r, last, w1, s, nth)
    return (p, q, r, s), (slot_p, slot_q, slot_r, slot_s)


@inlined_kernel
def _code_edges(
    texels: Any, height: int, width: int, seen: Any, shift: Any, components: Any, sink: Any,
    source: Any, state: Any,
) -> int:  # fmt: skip
    """The odd last column, then the odd last row. Returns OK or TRUNCATED."""
    wide = np.uint64(width)
    tall = height & ~1 if width & 1 else 0
    for i in range(tall + (width if height & 1 else 0)):
        y, x = (i, width - 1) if i < tall else (height - 1, i - tall)
        place = np.uint64(y * width + x)
        above = place - wide
        n = np.uint64(texels[above]) if y > 0 else np.uint64(0)
        w = np.uint64(texels[place - _ONE]) if x > 0 else n
        if y == 0:
            n = w
        nw = np.uint64(texels[above - _ONE]) if y > 0 and x > 0 else n
        key = slot(w * K4 + n * K3 + nw * K2, shift)
        value = edge_texel(
            np.uint64(texels[place]), np.uint64(seen[key]), w, n, nw, components, sink, source,
            state,
        )  # fmt: skip
        seen[key] = value
        if source is not None:
            texels[place] = value
            if state[WORD] > source.limit:
                return TRUNCATED
    return OK


@kernel
def repeats_pass(
    texels: Any, height: int, width: int, below: Any, order: Any, weights: Any, classes: Any,
    slots: Any, seen: Any, outcome: Any, errors: Any, shift: Any, sink: Any, source: Any,
    state: Any,
) -> int:  # fmt: skip
    """One group in either direction: of ``sink`` and ``source`` one is None.

    Each direction is compiled on its own, without what only the other one needs.

    Parameters
    ----------
    texels: (height * width,) uint32, with component c in bits 8 c to 8 c + 7; decoding fills it.
    below: (height >> 1, width >> 1) uint32.
    order: (c,) int64, components in coding order. weights: (3, 4) int64, of p, q and r.
    classes: (1024,) uint8, class of an activity.
    slots: (5, 2^b) and seen: (2^b,) uint32, zeros; shift: uint64, 32 - b.
    outcome: (width // 2 + 1,) int64, zeros: 1 where the block above was new.
    errors: (3,) int64, overwritten.
    sink: uint32, filled with symbol | context << 16. source: `repeats_blocks.RepeatsSource`.
    state: (9,) int64: see `repeats_blocks.COUNT`.

    Returns OK, TRUNCATED or IMPOSSIBLE.
    """
    bh, bw = below.shape
    wide = np.uint64(width)
    if source is not None:
        start_states(source.words[state[ESCAPES_END] :], state)
        state[WORD] = state[ESCAPES_END] + 8
    for y in range(bh):
        before = 0
        # The block that ends a run: it is known not to be flat.
        after = -1
        x = -1
        while x + 1 < bw:
            x += 1
            place = np.uint64(2 * (y * width + x))
            around = _surroundings(texels, below, y, x, width)
            mean, w0, w1, n0, n1, _, _ = around
            flat = (mean, mean, mean, mean)
            if y > 0 and x != after and same(flat, (n0, n1, w0, w1)):
                plain, rest = _code_run(texels, below, y, x, width, flat, sink, source, state)
                if source is not None:
                    if plain < 0:
                        return IMPOSSIBLE
                    if state[WORD] > source.limit:
                        return TRUNCATED
                for i in range(x, x + plain):
                    outcome[i] = 0
                if rest > 0:
                    after = x + plain
                if plain > 0:
                    before = 0
                    x += plain - 1
                    continue
            near = before + outcome[x]
            before = 0
            outcome[x] = 0
            block = flat
            if sink is not None:
                block = block_at(texels, place, wide)
            if _is_first_guess(
                block, around, near, texels, place, wide, slots, shift, sink, source, state
            ):
                if source is not None and state[WORD] > source.limit:
                    return TRUNCATED
                continue

            means, (b, c, d) = _block_slots(around, below, y, x, shift)
            places = (np.uint64(slots[1, b]), np.uint64(slots[2, c]), np.uint64(slots[3, d]))
            change = minus(mean, np.uint64(slots[4, d]))
            context = GUESS + 4 * near
            if places[0] > 0:
                context += 1
            if places[1] > 0:
                context += 2
            keys = _texel_slots(block, around, shift)
            choice = DIFFERENCES
            if sink is not None:
                choice = _choose(
                    block, around, places, change, keys, texels, wide, seen, order.size
                )
            choice = symbol(choice, context, sink, source, state)
            slots[1, b] = place + _ONE
            slots[2, c] = place + _ONE
            slots[3, d] = place + _ONE
            slots[4, d] = mean
            if choice < GUESSES:
                if source is not None and places[choice] > 0:
                    block = block_at(texels, places[choice] - _ONE, wide)
                    if choice == 2:
                        block = shift_block(block, change)
            else:
                before = 1
                outcome[x] = 1
                if choice == TEXELS:
                    block, keys = _code_texels(
                        block, around, keys, near, seen, shift, order, weights, classes, sink,
                        source, state,
                    )  # fmt: skip
                else:
                    east, south, south_west, south_east = means
                    block = differences(
                        block, mean, (w0, w1, n0, n1, east, south, south_west, south_east), errors,
                        order, classes, sink, source, state,
                    )  # fmt: skip
                    if source is not None:
                        keys = _texel_slots(block, around, shift)
                seen[keys[0]], seen[keys[1]] = block[0], block[1]
                seen[keys[2]], seen[keys[3]] = block[2], block[3]
            if source is not None:
                put_block(texels, place, wide, block)
                if state[WORD] > source.limit:
                    return TRUNCATED
    if _code_edges(texels, height, width, seen, shift, order.size, sink, source, state) != OK:
        return TRUNCATED
    if source is not None:
        stray = state[STRAY] != 0 or state[WORD] != source.limit
        stray |= state[NEXT_ESCAPE] != state[ESCAPES_END]
        for lane in range(4):
            stray |= state[lane] != STATE_LOW
        if stray:
            return IMPOSSIBLE
    return OK
