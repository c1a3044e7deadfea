"""Texture memory: what levels take, and which of them it should hold.

A texture of which column k is resident holds levels 0 to k − 1: column 0 is nothing. GPUs have no
texels of three bytes, so RGB counts four; the paper counts three.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ptmtools.arrays import Ints
from ptmtools.texture.model import gpu_texel_bytes


class Columns(NamedTuple):
    """What can be fetched of textures; beyond the last column of one all repeat it.

    Attributes
    ----------
    last: (T,) of each texture; column 0 is nothing.
    ends: (T, K) bytes that hold each column and those before it. memory: (T, K) of texture memory.
    size: (T, K, 2) width and height of the finest image that each column shows.
    """

    last: Ints
    ends: Ints
    memory: Ints
    size: Ints


def texel_bytes(texture: Any, *, paper: bool = False) -> int:
    """Bytes of a texel of an entry of the index; with ``paper``, as the paper counts."""
    stored = int(texture["texelBytes"])
    if paper:
        return stored
    return int(texture.get("gpuTexelBytes", gpu_texel_bytes(stored, texture["components"])))


def columns_of(textures: Sequence[Any], *, paper: bool = False) -> Columns:
    """Levels of `.ptm`s, for entries of the index: bytes are those of the file, and memory that of
    all levels of a column."""
    rows = []
    for texture in textures:
        shift = len(texture["ends"]) - 1 - np.arange(len(texture["ends"]))
        sides = [np.maximum(1, texture[side] >> shift) for side in ("width", "height")]
        each = np.cumsum(sides[0] * sides[1]) * texel_bytes(texture, paper=paper)
        rows.append((texture["ends"], each, np.stack(sides, axis=1)))
    return aligned(rows)


def joined(first: Columns, second: Columns) -> Columns:
    """Those of two lists of textures, one behind the other."""
    wide = max(first.ends.shape[1], second.ends.shape[1])

    def both(one: Ints, other: Ints) -> Ints:
        rest = [(0, 0)] * (one.ndim - 2)
        parts = (np.pad(a, [(0, 0), (0, wide - a.shape[1]), *rest], "edge") for a in (one, other))
        return np.concatenate(list(parts))

    tables = zip(first[1:], second[1:], strict=True)
    return Columns(np.concatenate([first.last, second.last]), *(both(*pair) for pair in tables))


def aligned(rows: Sequence[tuple[Any, Any, Any]]) -> Columns:
    """Columns of textures that have any number of them: of each its (k,) ``ends`` and ``memory``,
    and (k, 2) ``size``, without the first column."""
    last = np.array([len(row[0]) for row in rows], dtype=np.int64)
    shape = len(rows), int(last.max(initial=0)) + 1
    ends, memory, size = (np.zeros(s, np.int64) for s in (shape, shape, (*shape, 2)))
    for t, row in enumerate(rows):
        n = int(last[t])
        for table, values in zip((ends, memory, size), row, strict=True):
            table[t, 1 : n + 1] = values
            table[t, n + 1 :] = table[t, n]
    return Columns(last, ends, memory, size)
