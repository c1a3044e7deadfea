"""One symbol in either direction, by a table that is known only once the one before is."""

from __future__ import annotations

from typing import Any

import numpy as np

from ptmtools.compiled import plain_kernel as kernel
from ptmtools.texture.coders.rans.kernels import ESCAPE, decode_single

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


@kernel
def symbol(encoding: bool, z: Any, context: Any, numbers: Any, words: Any, state: Any) -> Any:
    """Symbol ``z`` to ``numbers`` or, decoding, the next one from ``words``."""
    n = state[COUNT]
    state[COUNT] = n + 1
    if encoding:
        numbers[np.uint64(n)] = z | context << 16
        return np.int64(z)
    at = np.uint64(state[WORD])
    z, refill = decode_single(numbers, context, state, np.uint64(n & 3), words[at])
    state[WORD] = at + (np.uint64(1) if refill else np.uint64(0))
    if z == ESCAPE:
        at = np.uint64(state[NEXT_ESCAPE])
        if state[NEXT_ESCAPE] < state[ESCAPES_END]:
            z = np.int64(words[at])
            state[NEXT_ESCAPE] = at + np.uint64(1)
        else:
            state[STRAY] = 1
    return z
