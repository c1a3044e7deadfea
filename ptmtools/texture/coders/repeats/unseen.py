"""Blocks and texels that were not seen before: Haar differences, samples, remainders of a sum."""

from __future__ import annotations

from typing import Any

import numpy as np

from ptmtools.compiled import plain_kernel as kernel
from ptmtools.texture.coders.repeats.seen import OTHER, seen_texel
from ptmtools.texture.coders.repeats.symbols import (
    CLASSES,
    EDGE,
    HAAR,
    REMAINDER,
    SAMPLE,
    STRAY,
    TEXEL,
    symbol,
)

LARGEST_ACTIVITY = 1023


@kernel
def sample(texel: Any, at: Any) -> Any:
    """The component of a texel in the bits from ``at`` on."""
    return np.int64((texel >> at) & np.uint64(255))


@kernel
def residual(e: Any, context: Any, sink: Any, source: Any, state: Any) -> Any:
    """A `symbol` with a sign: 0, -1, 1, -2, 2 …"""
    z = symbol((e << 1) ^ (e >> 63), context, sink, source, state)
    return (z >> 1) ^ -(z & 1)


@kernel
def _index(activity: Any) -> Any:
    return np.uint64(activity if activity < LARGEST_ACTIVITY else LARGEST_ACTIVITY)


@kernel
def _samples(
    texel: Any, mean: Any, w: Any, n: Any, nw: Any, ne: Any, position: Any, order: Any,
    weights: Any, classes: Any, sink: Any, source: Any, state: Any,
) -> Any:  # fmt: skip
    """p, q or r of a block, sample by sample, each predicted from its surroundings."""
    out = np.uint64(0)
    reference = np.int64(0)
    for c in range(order.size):
        at = np.uint64(8 * order[c])
        i = sample(mean, at)
        fw, fn = sample(w, at) - i, sample(n, at) - i
        fnw, fne = sample(nw, at) - i, sample(ne, at) - i
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
        e = ((sample(texel, at) - guess + 128) & 255) - 128
        value = (guess + residual(e, context + level, sink, source, state)) & 255
        if c == 0:
            reference = value - guess
        elif c == 1:
            reference += (value - guess) >> 1
        out |= np.uint64(value) << at
    return out


@kernel
def texel(
    position: Any, wanted: Any, seen: Any, mean: Any, w: Any, n: Any, nw: Any, ne: Any,
    context: Any, order: Any, weights: Any, classes: Any, sink: Any, source: Any, state: Any,
) -> Any:  # fmt: skip
    """p, q or r of a block."""
    found = seen_texel(wanted, seen, w, n, nw, ne, context, sink, source, state)
    if found == OTHER:
        found = _samples(
            wanted, mean, w, n, nw, ne, position, order, weights, classes, sink, source, state
        )
    return found


@kernel
def remainders(
    s: Any, mean: Any, p: Any, q: Any, r: Any, order: Any, sink: Any, source: Any, state: Any,
) -> Any:  # fmt: skip
    """s of a block by the remainder of the sum in each component."""
    out = np.uint64(0)
    for c in range(order.size):
        at = np.uint64(8 * order[c])
        a, b, corner = sample(q, at), sample(r, at), sample(p, at)
        base = 4 * sample(mean, at) - a - b - corner
        guess: Any = max(min(a, b), min(max(a, b), a + b - corner)) - base
        kind = 0 if guess < 0 else 1 if guess < 4 else 2
        guess = min(max(guess, 0), 3)
        value = sample(s, at) - base
        z = symbol((value - guess) & 3, REMAINDER + kind, sink, source, state)
        value = base + ((z + guess) & 3)
        if value < 0 or value > 255:
            state[STRAY] = 1
        out |= np.uint64(value & 255) << at
    return out


@kernel
def differences(
    block: Any, mean: Any, around: Any, errors: Any, order: Any, classes: Any, sink: Any,
    source: Any, state: Any,
) -> Any:  # fmt: skip
    """A block by their Haar differences, component by component.

    around: w0, w1, n0, n1 and the means to the east, south, south-west and south-east.
    """
    out0, out1, out2, out3 = np.uint64(0), np.uint64(0), np.uint64(0), np.uint64(0)
    for c in range(order.size):
        at = np.uint64(8 * order[c])
        i = sample(mean, at)
        w0, w1 = sample(around[0], at), sample(around[1], at)
        n0, n1 = sample(around[2], at), sample(around[3], at)
        east, south = sample(around[4], at) - i, sample(around[5], at) - i
        tilt = sample(around[7], at) - sample(around[6], at)
        p, q = sample(block[0], at), sample(block[1], at)
        r, s = sample(block[2], at), sample(block[3], at)
        referring = c > 0 and c < 3 and order.size > 2
        if not referring:
            errors[0] = errors[1] = errors[2] = 0
        north, west = n0 + n1 - 2 * i, w0 + w1 - 2 * i
        across, down = n0 - n1, w0 - w1
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
            context += np.int64(classes[_index(activity)])
            e = residual(value - guess, context, sink, source, state)
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
            state[STRAY] = 1
        out0 |= np.uint64(p & 255) << at
        out1 |= np.uint64(q & 255) << at
        out2 |= np.uint64(r & 255) << at
        out3 |= np.uint64(s & 255) << at
    return out0, out1, out2, out3


@kernel
def edge_texel(
    texel: Any, seen: Any, w: Any, n: Any, nw: Any, components: Any, sink: Any, source: Any,
    state: Any,
) -> Any:  # fmt: skip
    """A texel that belongs to no block; a new one sample by sample, less the median of W, N and
    W + N - NW.
    """
    found = seen_texel(texel, seen, w, n, nw, nw, TEXEL + 48, sink, source, state)
    if found != OTHER:
        return found
    out = np.uint64(0)
    for c in range(components):
        at = np.uint64(8 * c)
        a, b = sample(w, at), sample(n, at)
        guess = max(min(a, b), min(max(a, b), a + b - sample(nw, at)))
        e = ((sample(texel, at) - guess + 128) & 255) - 128
        out |= np.uint64((guess + residual(e, EDGE, sink, source, state)) & 255) << at
    return out
