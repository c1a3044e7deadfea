"""What the context mixing coder learns, plane by plane: how it begins, and how it is copied."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ptmtools.texture.coders.mixing import tables

if TYPE_CHECKING:
    from ptmtools.texture.coders.mixing.kernels import State, Tables

#: Slots of a hashed context, entries of a match: powers of two, by the number of texels.
SLOT_BITS = (8, 16)
VALUE_BITS = (8, 18)


#: The state of all planes behind a level. Coding changes it in place: give it a copy.
Memory = tuple["State", ...]


def copied(memory: Memory) -> Memory:
    return tuple(type(state)(*(array.copy() for array in state)) for state in memory)


def fresh_state() -> State:
    """Of a plane, before anything was coded."""
    from ptmtools.texture.coders.mixing import decisions
    from ptmtools.texture.coders.mixing.kernels import POSITIONS, SECOND, State
    from ptmtools.texture.coders.mixing.squares import BATCH, FEATURES, SAMPLE

    # A context's level of magnitude is that of a sum of nine residuals: its lowest, and a bit more.
    lowest = np.searchsorted(tables.magnitude(), np.arange(tables.MAGNITUDES))
    scale = np.zeros((POSITIONS, tables.MAGNITUDES, SECOND, 2), np.int32)
    scale[..., 0] = (lowest * 16384 + 41500)[None, :, None]
    weights = np.zeros(decisions.INPUTS, np.int32)
    weights[: decisions.CONSTANT] = 42600, 19661, 9830, 3277, 3277, 3277, 3277, 13107, 13107, 13107
    cells = tables.squash()[np.minimum(np.arange(decisions.CELLS) * 256, 2 * tables.LOGIT_TOP)]
    chances = np.full(decisions.CHANCES, 49152, np.int32)
    chances[: decisions.TRUST] = np.tile(cells, decisions.NODE_ROWS)
    return State(
        normal=np.zeros((POSITIONS, FEATURES, FEATURES)),
        pending=np.zeros((POSITIONS, BATCH, SAMPLE), np.int32),
        weights=np.zeros((POSITIONS, FEATURES), np.int32),
        seen=np.zeros((POSITIONS, 2), np.int64),
        bias=np.zeros(POSITIONS * 729, np.int32),
        scale=scale.reshape(-1, 2),
        mix=np.tile(weights, (decisions.NODE_ROWS + decisions.NEAR_ROWS, 1)),
        chances=chances,
        flat=np.full(16 * 3 * 9, decisions.FRESH, np.uint32),
    )


def level_tables(texels: int) -> Tables:
    """What is learned of one plane of a level of so many ``texels``, and forgotten behind it."""
    from ptmtools.texture.coders.mixing import decisions
    from ptmtools.texture.coders.mixing.kernels import Tables
    from ptmtools.texture.coders.mixing.squares import FEATURES

    bits = max(texels - 1, 0).bit_length()
    slots = min(max(bits - 1, SLOT_BITS[0]), SLOT_BITS[1])
    values = min(max(bits, VALUE_BITS[0]), VALUE_BITS[1])
    return Tables(
        slots=np.zeros((decisions.COUNTERS << slots) * decisions.SLOT, np.uint32),
        values=np.zeros(decisions.MATCHES << values, np.int32),
        notes=np.zeros(decisions.NOTES, np.int64),
        x=np.zeros(decisions.INPUTS, np.int32),
        left=np.zeros((FEATURES, FEATURES)),
        right=np.zeros((FEATURES, FEATURES)),
    )
