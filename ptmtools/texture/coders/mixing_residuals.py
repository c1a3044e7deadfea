"""The residual of one texel as binary decisions, in a kernel of the context mixing coder.

The decisions are those of a search: whether the residual is 0, its sign, the bucket of its
magnitude, and the bits within. Of the fourth texel of a block, whose range is short, all are a
binary search. The density that the prediction gives is the first input of each decision. See
`mixing_strips` for the prediction and the contexts, and ``docs/formats/ptm-small.md``.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ptmtools.jit import inlined_kernel, plain_kernel
from ptmtools.texture.coders import mixing_tables as tables
from ptmtools.texture.coders.mixing_decisions import (
    EXPECTED,
    FOUND,
    LOGIT_TOP,
    MATCHES,
    NODES,
    SQUASH,
    STRETCH,
    TAG,
    code_bit,
    decide,
    open_slots,
)

#: Least magnitude of every bucket: 1, 2, 3-4, 5-8, …
BUCKETS = np.array([1, 2, 3, 5, 9, 17, 33, 65, 129, 257, 513], np.int64)
#: From this bucket on, the bits within are coded by the density alone.
DEEP = 2
#: First node for the bits within a bucket.
WITHIN = np.array([0, 0, 0, 1, 4, 11, 14, 17, 20, 20], np.int64)
#: Slot in which the counters of a node lie.
GROUP = np.arange(NODES) // TAG
SOFT_PLUS = tables.soft_plus()
SURVIVAL = tables.survival()


@plain_kernel
def _soft_plus(u: int) -> Any:
    if u > LOGIT_TOP:
        return u << 4
    return SOFT_PLUS[max(u, -LOGIT_TOP) + LOGIT_TOP]


@plain_kernel
def _squash(u: int) -> Any:
    return SQUASH[min(max(u, -LOGIT_TOP), LOGIT_TOP) + LOGIT_TOP]


@plain_kernel
def _halves(length: int, boundary: int, inverse: int) -> Any:
    """Logit of the upper of two neighbouring intervals, ``length`` / 2 each, of a logistic density.

    boundary: between the two, from the centre. All in 1/256 texel, inverse scale in 1/65536.
    """
    slope = 2 * _squash((boundary * inverse) >> 16) - 65536
    x = -(((length * inverse) >> 17) * slope >> 16)
    return min(max(x, -LOGIT_TOP), LOGIT_TOP)


@inlined_kernel
def _quantise(e: int, step: int) -> Any:
    """e / step, rounded, halves away from 0 (there are none: steps are odd)."""
    if step == 1:
        return e
    half = step >> 1
    return (e + half) // step if e >= 0 else -((half - e) // step)


@inlined_kernel
def code_residual(
    encoding: bool, goal: int, m: int, mu: int, inverse: int, lo: int, hi: int, step: int,
    last: bool, deep: int, node_row: int, near_row: int, notes: Any, x: Any, mix: Any, chances: Any,
    slots: Any, mask: int, coder: Any, buffer: Any,
) -> Any:  # fmt: skip
    """Codes one texel between lo and hi: returns its value.

    m: prediction rounded; mu: prediction in 1/256; inverse: 65536 / scale. ``last``: the fourth of
    a block, found by a binary search; else 0?, sign, bucket of the magnitude, bits in the bucket.
    """
    if lo >= hi:
        return lo
    origin = lo if last else m
    g = _quantise(goal - origin, step)
    off = origin * 256 - mu
    half, span = step * 128, step * 256
    phase, kind, node, sign, d = 0, 0, 0, 1, 0
    bucket, path, limit, below, above = 0, 0, 0, 0, 0
    low, high = 0, 0
    group = 0
    open_slots(0, notes, slots, mask)
    if last:
        phase, kind, above = 4, 3, hi - lo
    while True:
        if phase == 0:
            below_p, above_p = ((half - off) * inverse) >> 16, ((half + off) * inverse) >> 16
            low, high = _soft_plus(below_p), _soft_plus(above_p)
            zero = 65536 - _squash(-below_p) - _squash(-above_p)
            x[0] = STRETCH[min(max(zero >> 4, 0), 4095)]
        elif phase == 1:
            kind, node = 1, 1
            x[0] = min(max((low - high) >> 4, -LOGIT_TOP), LOGIT_TOP)
        elif phase == 2:
            kind, node = 2, (2 if sign > 0 else 9) + min(bucket, 6)
            d = BUCKETS[bucket + 1]
            low = high
            high = _soft_plus(((d * span - half + sign * off) * inverse) >> 16)
            x[0] = SURVIVAL[min(max((high - low) >> 4, 0), LOGIT_TOP)]
        else:
            node = path
            if phase == 3:
                inside = WITHIN[bucket] + path if bucket <= 4 or path < 3 else 21
                node = (16 if sign > 0 else 40) + inside
            d = (below + above + 1) >> 1
            x[0] = _halves((above - below + 1) * span, d * span - half + sign * off, inverse)
        # Large residuals that no match predicts: contexts add nothing to the density, except often
        # in the first plane.
        if (
            phase == 3
            and deep <= bucket
            and max(notes[FOUND], notes[FOUND + 1], notes[FOUND + 2]) < 0
        ):
            p = min(max(_squash(x[0]), 1), 65535)
            bit = code_bit(encoding, _answer(phase, g, sign, d), p, coder, buffer)
            if bit:
                below = d
            else:
                above = d - 1
            path = 2 * path + 1 + bit
            if below >= above:
                return min(max(origin + sign * below * step, 0), 255)
            continue
        # Fifteen nodes share a slot.
        if GROUP[node] != group:
            group = GROUP[node]
            open_slots(group, notes, slots, mask)
        bit = _answer(phase, g, sign, d)
        for i in range(MATCHES):
            e = _quantise(notes[FOUND + i] - origin, step)
            notes[EXPECTED + i] = _answer(phase, e, sign, d)

        bit = decide(
            encoding, bit, kind, node - TAG * group, node_row + node, near_row + kind * 9, notes,
            x, mix, chances, slots, coder, buffer,
        )  # fmt: skip

        if phase >= 3:
            if bit:
                below = d
            else:
                above = d - 1
            path = 2 * path + 1 + bit
        elif phase == 2:
            bucket += bit
            if bit == 0 or BUCKETS[bucket + 1] > limit:
                phase = 3
        elif phase == 0 and bit:
            return m
        elif phase == 0 and lo < m < hi:
            phase = 1
            continue
        else:
            sign = (1 if bit else -1) if phase == 1 else (1 if m < hi else -1)
            high = high if sign > 0 else low
            limit = _quantise(hi - m if sign > 0 else m - lo, step)
            phase = 2 if BUCKETS[1] <= limit else 3
        if phase == 3 and path == 0:
            kind, below, above = 2, BUCKETS[bucket], min(BUCKETS[bucket + 1] - 1, limit)
        if phase >= 3 and below >= above:
            return min(max(origin + sign * below * step, 0), 255)


@inlined_kernel
def _answer(phase: int, e: int, sign: int, d: int) -> Any:
    """The bit of a decision if the residual is e."""
    if phase == 0:
        return 1 if e == 0 else 0
    if phase == 1:
        return 1 if e > 0 else 0
    return 1 if e * sign >= d else 0
