"""One symbol in either direction, by a table that is known only once the one before is."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ptmtools.compiled import plain_kernel as kernel
from ptmtools.texture.coders.rans.kernels import decode_single
from ptmtools.texture.coders.rans.sizes import ESCAPE

#: First table of each sort of symbol: is the block the first guess; which guess it is; which guess
#: a texel is, by position; the samples of texels that belong to no block; Haar differences; samples
#: of other texels; remainders of the sum; how much of a run is not flat.
FIRST, GUESS, TEXEL, EDGE, HAAR, SAMPLE, REMAINDER, RUN = 0, 12, 24, 84, 85, 145, 185, 188
#: Classes of activity of Haar differences; tables for V, h and g, without and with a reference.
CLASSES = 10
TABLES = RUN + 8
#: Where `state` holds what: the four rANS states first; then symbols so far, the next word, the
#: next escape, the index behind the last escape, nonzero once something was impossible.
COUNT, WORD, NEXT_ESCAPE, ESCAPES_END, STRAY = 4, 5, 6, 7, 8


class Source(NamedTuple):
    """Where a decoder's symbols come from."""

    table: Any  # uint32 of `rans.tables.single_tables`
    words: Any  # uint16, the escapes and behind them the words, with room for a block's more
    limit: Any  # index of the word behind the last


@kernel
def symbol(z: Any, context: Any, sink: Any, source: Any, state: Any) -> Any:
    """Symbol ``z`` to ``sink`` as symbol | context << 16 or, decoding, the next of ``source``."""
    n = state[COUNT]
    state[COUNT] = n + 1
    if sink is not None:
        sink[np.uint64(n)] = z | context << 16
    if source is not None:
        at = np.uint64(state[WORD])
        z, refill = decode_single(source.table, context, state, np.uint64(n & 3), source.words[at])
        state[WORD] = at + (np.uint64(1) if refill else np.uint64(0))
        if z == ESCAPE:
            at = np.uint64(state[NEXT_ESCAPE])
            if state[NEXT_ESCAPE] < state[ESCAPES_END]:
                z = np.int64(source.words[at])
                state[NEXT_ESCAPE] = at + np.uint64(1)
            else:
                state[STRAY] = 1
    return np.int64(z)
