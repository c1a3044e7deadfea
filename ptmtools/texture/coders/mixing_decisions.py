"""A binary decision: ten opinions, one probability, one bit of the arithmetic code.

Logistic mixing as in PAQ (Mahoney, "Adaptive weighing of context models for lossless data
compression", 2005): opinions in the logit domain, two sets of weights chosen by different
contexts, each trained on its own error, their mean refined by an adaptive probability map.
All in integers. The arithmetic coder is PAQ's carryless one with 32 bits and probabilities
of 16.

For noise (`code_even`) all blocks that have the parent as their mean are equally likely: the number
of ways to complete a block gives the exact probability of each bit of its texels, in integers.

The texel predictor's weights come from weighted recursive least squares, in batches
(``docs/formats/ptm-small.md``, "Learning"). The target is kept as the last of the 24 features: the
normal equations A = Σ ω f fᵀ, b = Σ ω f y are one matrix.

Why the bits cannot differ between machines: A holds integers below 2^53 in float64, sums and
products of which are exact in any order. The elimination rounds, in a fixed order of operations
that numba does not change (no reassociation, no fused multiply-add, no library function);
magnitudes below 2^-100 become 0, so that subnormal numbers never arise and it does not matter
whether a processor is set to flush them. The weights are then rounded to multiples of 2^-16 and
all predictions made with them are integers.

Rejected: a Cholesky factor (square roots, not smaller); updating A with every sample (twice the
time: each row of A is loaded and stored sixteen times as often).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ptmtools.jit import inlined_kernel, plain_kernel, prefetch
from ptmtools.texture.coders import mixing_tables as tables

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
#: A counter: 22 bits of probability, 10 of its count of uses, and the limit of that count.
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
#: In `chances`, the maps come first, then the hit rates of the matches.
TRUST = NODE_ROWS * CELLS
CHANCES = TRUST + MATCHES * CONFIRMED * KINDS * 2
#: `notes` describes a texel: hashed contexts, proposals of the matches (-1: none), how often each
#: was confirmed, the bit that it predicts, and its place.
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
    """Finds the slots of all contexts for a group of nodes; a slot of another context is reset."""
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
def update_counter(counter: Any, bit: int, top: int) -> Any:
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
    flat[context] = update_counter(flat[context], bit, FLAT_COUNT_TOP)
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

    target = bit << 16
    ea = i32(((target - SQUASH[za + LOGIT_TOP]) * MIX_RATE) >> 6)
    eb = i32(((target - SQUASH[zb + LOGIT_TOP]) * MIX_RATE) >> 6)
    for i in range(INPUTS):
        wa = i32(mix[node_row, i] + (i32(i32(ea * x[i]) + i32(8192)) >> 14))
        wb = i32(mix[near_row, i] + (i32(i32(eb * x[i]) + i32(8192)) >> 14))
        mix[node_row, i] = min(max(wa, i32(-MIX_TOP)), i32(MIX_TOP))
        mix[near_row, i] = min(max(wb, i32(-MIX_TOP)), i32(MIX_TOP))
    cell += share >> 7
    chances[cell] += ((bit * 65535 - chances[cell]) * 5) >> 8
    for i in range(COUNTERS):
        at = np.uint64(notes[SLOTS + i] + place)
        slots[at] = update_counter(slots[at], bit, COUNT_TOP)
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


@plain_kernel
def code_even(
    encoding: bool, height: int, width: int, place: Any, cells: Any, parents: Any, goal: Any,
    ways: Any, coder: Any, buffer: Any,
) -> None:  # fmt: skip
    """One plane: its blocks row by row, then the edge texels.

    ways: (4, 772) int64. ways[r, u + 4]: how many choices of r texels sum to v … v + 3, for all
    v <= u together.
    """
    for by in range(height >> 1):
        for bx in range(width >> 1):
            rest = 4 * parents[place.parents + by * place.across + bx]
            for k in range(4):
                t = place.texels + (2 * by + (k >> 1)) * place.stride + 2 * bx + (k & 1)
                open_texels = 3 - k
                low, high = max(rest - 255 * open_texels, 0), min(rest + 3, 255)
                while low < high:
                    d = (low + high + 1) >> 1
                    nothing = ways[open_texels, max(rest - high, -3) + 3]
                    upper = ways[open_texels, rest - d + 4] - nothing
                    total = ways[open_texels, rest - low + 4] - nothing
                    p = min(max(upper * 65536 // max(total, 1), 1), 65535)
                    bit = 1 if goal[t] >= d else 0
                    if code_bit(encoding, bit, p, coder, buffer):
                        low = d
                    else:
                        high = d - 1
                cells[t] = low
                rest -= low
    column = height & ~1 if width & 1 else 0
    for i in range(column + (width if height & 1 else 0)):
        y, x = (i, width - 1) if i < column else (height - 1, i - column)
        t = place.texels + y * place.stride + x
        value = 0
        for shift in range(7, -1, -1):
            bit = code_bit(encoding, (goal[t] >> shift) & 1, 32768, coder, buffer)
            value = 2 * value + bit
        cells[t] = value


#: Features of a sample, the last of which is its target.
FEATURES = 24
TARGET = FEATURES - 1
#: A pending sample: its features, then its weight ω.
SAMPLE = FEATURES + 1
#: Samples between two solutions.
BATCH = 16
#: The first samples are used immediately, in smaller batches and without forgetting.
EARLY, EARLY_BATCH = 64, 4
#: From this number of samples on, every other batch is solved.
OFTEN = 1024
#: Share of A that is forgotten with every batch.
FORGET = 1.0 / 32.0
#: Added to the diagonal of A.
RIDGE = 20000.0
TINY = 2.0**-100
#: Fractional bits of a weight, and its limit.
WEIGHT_BITS = 16
WEIGHT_TOP = 4 << WEIGHT_BITS


@inlined_kernel
def learn(
    normal: Any, pending: Any, weights: Any, seen: Any, k: int, features: int,
    weighted: Any, samples: Any,
) -> None:  # fmt: skip
    """One more sample of model k lies at the end of ``pending[k]``: count it; solve if it is time.

    normal: (models, 24, 24) float64; pending: (models, 16, 25) int32; weights: (models, 24) int32;
    seen: (models, 2) int64, all samples and those pending; weighted, samples: (24, 24) float64,
    scratch.
    """
    seen[k, 0] += 1
    seen[k, 1] += 1
    count = seen[k, 1]
    early = seen[k, 0] <= EARLY
    if count < (EARLY_BATCH if early else BATCH):
        return
    seen[k, 1] = 0
    _accumulate(normal[k], pending[k], count, early, features, weighted, samples)
    if seen[k, 0] < OFTEN or seen[k, 0] % (2 * BATCH) == 0:
        _solve(normal[k], weights[k], features, weighted, samples[0])


@inlined_kernel
def _accumulate(
    A: Any, pending: Any, count: int, early: bool, features: int, weighted: Any, samples: Any
) -> None:
    """A += Σ ω f fᵀ over the pending samples, on and above the diagonal."""
    for n in range(count):
        w = float(pending[n, FEATURES])
        for i in range(FEATURES):
            f = float(pending[n, i])
            samples[n, i] = f
            weighted[n, i] = f * w
    forget = 0.0 if early else FORGET
    for i in range(features):
        row = A[i]
        for j in range(FEATURES):
            row[j] -= np.floor(row[j] * forget)
        for n in range(0, count, 4):
            t0, t1 = weighted[n, i], weighted[n + 1, i]
            t2, t3 = weighted[n + 2, i], weighted[n + 3, i]
            for j in range(FEATURES):
                row[j] += (t0 * samples[n, j] + t1 * samples[n + 1, j]) + (
                    t2 * samples[n + 2, j] + t3 * samples[n + 3, j]
                )


@inlined_kernel
def _solve(A: Any, weights: Any, n: int, U: Any, inverse: Any) -> None:
    """weights[:n] = (A + ridge)⁻¹ b, rounded, by symmetric elimination without pivoting."""
    for i in range(n):
        for j in range(i & ~7, FEATURES):
            U[i, j] = A[i, j]
        U[i, i] += RIDGE
    for j in range(n):
        # At least the ridge but for rounding; at least 1 even if a file is damaged.
        inverse[j] = 1.0 / max(U[j, j], 1.0)
        for i in range(j + 1, FEATURES):
            if abs(U[j, i]) < TINY:
                U[j, i] = 0.0
        for i in range(j + 1, n):
            t = U[j, i] * inverse[j]
            if abs(t) >= TINY:
                for c in range(i & ~7, FEATURES):
                    U[i, c] -= t * U[j, c]
    for j in range(n - 1, -1, -1):
        w = U[j, TARGET] * inverse[j]
        if abs(w) < TINY:
            w = 0.0
        for i in range(j):
            U[i, TARGET] -= U[i, j] * w
        scaled = np.floor(w * float(1 << WEIGHT_BITS) + 0.5)
        weights[j] = i32(min(max(scaled, -float(WEIGHT_TOP)), float(WEIGHT_TOP)))


@inlined_kernel
def predict(pending: Any, weights: Any, k: int, at: int) -> Any:
    """Σ w f, with 16 fractional bits, in 32-bit integers: |f| < 256 and |w| <= 4 leave room."""
    total = i32(0)
    for i in range(FEATURES):
        total = i32(total + i32(weights[k, i] * pending[k, at, i]))
    return int(total)
