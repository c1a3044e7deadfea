"""Texture memory: what levels take, and which of them it should hold.

A texture of which column k is resident holds levels 0 to k − 1: column 0 is nothing. GPUs have no
texels of three bytes, so RGB counts four; the paper counts three.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ptmtools.arrays import Ints
from ptmtools.texture.model import gpu_texel_bytes


def texel_bytes(texture: Any, *, paper: bool = False) -> int:
    """Bytes of a texel of an entry of the index; with ``paper``, as the paper counts."""
    stored = int(texture["texelBytes"])
    if paper:
        return stored
    return int(texture.get("gpuTexelBytes", gpu_texel_bytes(stored, texture["components"])))


def columns_of(textures: Sequence[Any], *, paper: bool = False) -> tuple[Ints, Ints, Ints]:
    """(T,) columns beside the first, (T, K) bytes of the file that hold each column, and (T, K)
    bytes of texture memory, for entries of the index; beyond the last both repeat it."""
    count = np.array([len(t["ends"]) for t in textures], dtype=np.int64)
    wide = int(count.max(initial=0)) + 1
    ends, memory = (np.zeros((len(textures), wide), np.int64) for _ in range(2))
    for row, texture in enumerate(textures):
        n = int(count[row])
        shift = n - 1 - np.arange(n)
        sides = [np.maximum(1, texture[side] >> shift) for side in ("width", "height")]
        each = sides[0] * sides[1] * texel_bytes(texture, paper=paper)
        for table, values in ((ends, texture["ends"]), (memory, np.cumsum(each))):
            table[row, 1 : n + 1] = values
            table[row, n + 1 :] = table[row, n]
    return count, ends, memory
