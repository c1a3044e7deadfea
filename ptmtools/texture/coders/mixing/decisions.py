"""A binary decision: ten opinions, one probability, one bit of the arithmetic code.

Logistic mixing as in PAQ (Mahoney, "Adaptive weighing of context models for lossless data
compression", 2005): opinions in the logit domain, two sets of weights chosen by different
contexts, each trained on its own error, their mean refined by an adaptive probability map.
All of it in integers. The arithmetic coder is PAQ's carryless one with 32 bits and probabilities
of 16.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ptmtools.compiled import inlined_kernel, plain_kernel, prefetch
from ptmtools.texture.coders.mixing import tables

i32 = np.int32
#: Before arithmetic that 32 bits do not hold.
wide: Any = np.int64

SQUASH = tables.squash()
STRETCH = tables.stretch(SQUASH)
RATE = tables.rates()

LOGIT_TOP = tables.LOGIT_TOP
#: Opinions: the predicted distribution, counters by context, matches, a constant; the rest is 0.
INPUTS = 16
COUNTERS = 6
MATCHES = 3
FIRST_COUNTER = 1
FIRST_MATCH = FIRST_COUNTER + COUNTERS
CONSTANT = FIRST_MATCH + MATCHES
CONSTANT_INPUT = 77
#: A slot: 15 counters and the tag of their context in 64 bytes, one line of a processor's cache.
SLOT = 16
TAG = 15
#: A counter: 22 bits of probability, 10 of how often it has been used, at most so often.
FRESH = np.uint32(1 << 31)
COUNT_TOP = 120
FLAT_COUNT_TOP = 250
#: Weights of the mixer, 16 fractional bits: their limit; the learning rate in units of 2^-20.
MIX_TOP = (8 << 16) - 1
MIX_RATE = 100
#: Kinds of decisions: is the residual 0; its sign; its magnitude; the last texel's search.
KINDS = 4
#: How far a match may have been confirmed.
CONFIRMED = 32
#: Nodes of a position, and how many positions there are: rows of the first set of weights.
NODES = 64
NODE_ROWS = 5 * NODES
#: Neighbourhoods × kinds × states of the matches: rows of the second set, behind the first.
NEAR_ROWS = 24 * KINDS * 9
#: Adaptive probability map: cells of a node's row, at logits -12 … 12 and beyond.
CELLS = 26
#: In `chances`, the maps come first, then how often a match is right.
TRUST = NODE_ROWS * CELLS
CHANCES = TRUST + MATCHES * CONFIRMED * KINDS * 2
#: In `notes`, what is known about a texel: hashed contexts, proposals of the matches (-1: none),
#: how often each was confirmed, the bit that follows from it, where it is kept.
FOUND = COUNTERS
SURE = FOUND + MATCHES
EXPECTED = SURE + MATCHES
WHERE = EXPECTED + MATCHES
#: Where the slots of the contexts begin, those with the counters of the current nodes.
SLOTS = WHERE + MATCHES
NOTES = SLOTS + COUNTERS


@inlined_kernel
def look_up(notes: Any, slots: Any, mask: int) -> None:
    """Where the slots of the first nodes lie, of all contexts of a texel."""
    for i in range(COUNTERS):
        at = (i * (mask + 1) + (notes[i] & mask)) * SLOT
        notes[SLOTS + i] = at
        prefetch(slots, at)


@plain_kernel
def open_slots(group: int, notes: Any, slots: Any, mask: int) -> None:
    """Finds the slots of all contexts for a group of nodes; those of other contexts begin anew."""
    for i in range(COUNTERS):
        notes[SLOTS + i] = (i * (mask + 1) + ((notes[i] ^ (group * 0x5D4D)) & mask)) * SLOT
    for i in range(COUNTERS):
        at = np.uint64(notes[SLOTS + i])
        # Never 0, the tag of a slot that was never used.
        tag = np.uint32((notes[i] >> 8) | (1 << 24))
        if slots[at + np.uint64(TAG)] != tag:
            for j in range(TAG):
                slots[at + np.uint64(j)] = FRESH
            slots[at + np.uint64(TAG)] = tag


@plain_kernel
def code_bit(encoding: bool, bit: int, p: int, coder: Any, buffer: Any) -> Any:
    """One bit, 1 with probability p / 65536; returns it.

    coder: (4,) int64: low, high, the decoder's window, bytes written or read.
    """
    low, high = coder[0], coder[1]
    r = high - low
    middle = low + (r >> 16) * p + (((r & 0xFFFF) * p) >> 16)
    if not encoding:
        bit = 1 if coder[2] <= middle else 0
    if bit:
        high = middle
    else:
        low = middle + 1
    while (low ^ high) & 0xFF000000 == 0:
        at = coder[3]
        if encoding:
            if at < buffer.size:
                buffer[at] = high >> 24
        else:
            following = wide(buffer[at]) if at < buffer.size else wide(0)
            coder[2] = ((coder[2] << 8) & 0xFFFFFFFF) | following
        coder[3] = at + 1
        low = (low << 8) & 0xFFFFFFFF
        high = ((high << 8) & 0xFFFFFFFF) | 255
    coder[0], coder[1] = low, high
    return bit


@plain_kernel
def counted(counter: Any, bit: int, top: int) -> Any:
    """The counter after ``bit``."""
    n = wide(counter) & 1023
    p = wide(counter) >> 10
    p += (((bit << 22) - p) * RATE[n]) >> 16
    p = min(p, 4194303)
    return np.uint32((p << 10) | min(n + 1, top))


@plain_kernel
def decide_flat(encoding: bool, bit: int, flat: Any, context: int, coder: Any, buffer: Any) -> Any:
    """Whether a block equals its parent: a counter of its own, no mixing."""
    p = min(max(wide(flat[context]) >> 16, 1), 65535)
    bit = code_bit(encoding, bit, p, coder, buffer)
    flat[context] = counted(flat[context], bit, FLAT_COUNT_TOP)
    return bit


@inlined_kernel
def decide(
    encoding: bool, bit: int, kind: int, place: int, node_row: int, near_row: int,
    notes: Any, x: Any, mix: Any, chances: Any, slots: Any, coder: Any, buffer: Any,
) -> Any:  # fmt: skip
    """One decision; returns the bit.

    place: of the counters in their slots; node_row, near_row: in the two sets of weights.
    notes: (23,) int64, see above; a proposal that turns out wrong is withdrawn. x: (16,) int32,
    of which x[0], the distribution's opinion, is given. mix: (rows, 16) int32; chances: (n,) int32;
    slots: (6 * 2^n * 16,) uint32.
    """
    for i in range(COUNTERS):
        counter = slots[np.uint64(notes[SLOTS + i] + place)]
        x[FIRST_COUNTER + i] = STRETCH[counter >> np.uint32(20)]
    for i in range(MATCHES):
        opinion = i32(0)
        if notes[FOUND + i] >= 0:
            e = notes[EXPECTED + i]
            t = STRETCH[chances[_trust(i, notes[SURE + i], kind, e)] >> 4]
            opinion = t if e else i32(-t)
        x[FIRST_MATCH + i] = opinion
    x[CONSTANT] = CONSTANT_INPUT

    sum_a, sum_b = i32(0), i32(0)
    for i in range(INPUTS):
        sum_a = i32(sum_a + (i32(mix[node_row, i] * x[i]) >> 8))
        sum_b = i32(sum_b + (i32(mix[near_row, i] * x[i]) >> 8))
    za = min(max(wide(sum_a) >> 8, -LOGIT_TOP), LOGIT_TOP - 1)
    zb = min(max(wide(sum_b) >> 8, -LOGIT_TOP), LOGIT_TOP - 1)
    z = ((za + zb) >> 1) + LOGIT_TOP
    share = z & 255
    cell = node_row * CELLS + (z >> 8)
    refined = (chances[cell] * (256 - share) + chances[cell + 1] * share) >> 8
    p = min(max((SQUASH[z] + refined) >> 1, 1), 65535)

    bit = code_bit(encoding, bit, p, coder, buffer)

    one = bit << 16
    ea = i32(((one - SQUASH[za + LOGIT_TOP]) * MIX_RATE) >> 6)
    eb = i32(((one - SQUASH[zb + LOGIT_TOP]) * MIX_RATE) >> 6)
    for i in range(INPUTS):
        wa = i32(mix[node_row, i] + (i32(i32(ea * x[i]) + i32(8192)) >> 14))
        wb = i32(mix[near_row, i] + (i32(i32(eb * x[i]) + i32(8192)) >> 14))
        mix[node_row, i] = min(max(wa, i32(-MIX_TOP)), i32(MIX_TOP))
        mix[near_row, i] = min(max(wb, i32(-MIX_TOP)), i32(MIX_TOP))
    cell += share >> 7
    chances[cell] += ((bit * 65535 - chances[cell]) * 5) >> 8
    for i in range(COUNTERS):
        at = np.uint64(notes[SLOTS + i] + place)
        slots[at] = counted(slots[at], bit, COUNT_TOP)
    for i in range(MATCHES):
        if notes[FOUND + i] >= 0:
            e = notes[EXPECTED + i]
            t = _trust(i, notes[SURE + i], kind, e)
            if e == bit:
                chances[t] += (65535 - chances[t]) * 82 >> 13
            else:
                chances[t] -= chances[t] * 82 >> 13
                notes[FOUND + i] = -1
    return bit


@plain_kernel
def _trust(match: int, sure: int, kind: int, expected: int) -> Any:
    return TRUST + ((match * CONFIRMED + sure) * KINDS + kind) * 2 + expected
