"""The Haar coder of the `fast` profile: a group's bytes around the compiled pass.

Layout of a coded group (all little endian): flags; the rank bitmaps; the predictor weights; the
frequency tables; the number of escapes and the escapes; the rANS words to the end.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coder import Data, Shape
from ptmtools.texture.coders import haar_kernels as kernels, rans as tables
from ptmtools.texture.coders.group import GroupReader, group_error, plane_order, reference_counts
from ptmtools.texture.coders.haar_layout import (
    ACTIVITY_WEIGHTS,
    BUILT_IN_WEIGHTS,
    CLASSES,
    EDGE_TABLE,
    TABLES,
    WEIGHT_TOP,
    class_of_activity,
    fit_weights,
    sent_mask,
)
from ptmtools.texture.coders.rans import Sink, check_end, empty_sink, encode_symbols, read_stream

#: Flag bits: weights are sent; from bit 4 on, component i is coded by rank.
SENT_WEIGHTS = 1
RANKED = 16

Bytes = NDArray[np.uint8]
#: For each component coded by rank, its distinct values, rising; else None.
Sets = list[NDArray[np.intp]]


def encode(level: Bytes, below: Bytes) -> bytes:
    """The group that refines ``below`` (h >> 1, w >> 1, c) to ``level`` (h, w, c)."""
    components = level.shape[2]
    sets = _sparse_values(level[: 2 * below.shape[0], : 2 * below.shape[1]])
    ranks = _Ranks(sets)
    sent = fit_weights(level, below, ranks.ranks)
    sink = empty_sink(level.size - below.size, TABLES)
    _pass(level, below, sent, ranks, sink, None)
    flags = SENT_WEIGHTS if sent is not None else 0
    flags |= sum(RANKED << c for c, used in enumerate(sets) if used.size)
    bitmaps = [np.isin(np.arange(256), used) for used in sets if used.size]
    return b"".join(
        [
            bytes([flags]),
            *(np.packbits(bitmap, bitorder="little").tobytes() for bitmap in bitmaps),
            b"" if sent is None else sent[sent_mask(components)].astype("<i2").tobytes(),
            *encode_symbols(sink, EDGE_TABLE, tables.built_in_family()),
        ]
    )


def decode(data: Data, below: Bytes, shape: Shape, version_1: bool = False) -> Bytes:
    """The inverse of `encode`, or the decoder of files of version 1.

    Raises InputError PTM-I112 for what no encoder writes.
    """
    components = shape[2]
    reader = GroupReader(data)
    flags = reader.number(1)
    if flags & ~(SENT_WEIGHTS | RANKED * ((1 << components) - 1)):
        raise group_error(f"flags {flags} are unknown")
    sets = []
    for c in range(components):
        bitmap = reader.numbers("u1", 32 if flags & RANKED << c else 0)
        sets.append(np.flatnonzero(np.unpackbits(bitmap, bitorder="little")))
        if bitmap.size and len(sets[c]) < 2:
            raise group_error("a rank bitmap has fewer than two values")
    sent = None
    if flags & SENT_WEIGHTS:
        mask = sent_mask(components)
        sent = np.zeros(mask.shape, np.int32)
        sent[mask] = reader.numbers("<i2", int(mask.sum()))
        if int(np.abs(sent).max()) > WEIGHT_TOP:
            raise group_error("a weight is out of range")
    frequency = tables.parse(reader, TABLES, tables.built_in_family(), version_1)
    level = np.empty(shape, np.uint8)
    edge = level.size - 4 * below.size
    stream = read_stream(reader, max(below.shape[1], edge))
    table, begins = tables.row_tables(frequency)
    classes = class_of_activity()
    ranks = _Ranks(sets)
    source = kernels.HaarSource(
        words=stream.words,
        limit=stream.limit,
        escapes=stream.escapes,
        table=table,
        starts=begins[[classes, CLASSES + classes, 0 * classes + EDGE_TABLE]],
        turning=not version_1,
        values=ranks.values,
        tops=ranks.tops,
        flat=level.reshape(-1),
        state=np.zeros(4, np.uint64),
        decoded=np.zeros(max(below.shape[1], edge), np.int32),
        zeros=np.zeros(edge, np.int32),
        pairs=np.zeros((2, components, below.shape[1]), np.uint16),
        mixed=np.zeros(components * below.shape[1], np.uint16),
    )
    check_end(_pass(level, below, sent, ranks, None, source))
    return level


class _Ranks:
    """For each component, ranks in place of values (``ranks``) and back (``values``)."""

    def __init__(self, sets: Sets) -> None:
        self.ranks = np.tile(np.arange(256, dtype=np.int32), (len(sets), 1))
        self.values = self.ranks.copy()
        self.tops = np.array([max(len(used) - 1, 0) for used in sets])
        for c, used in enumerate(sets):
            if used.size:
                # A value that does not occur (below, means do) has the rank of the nearest that
                # does; the lower one where two are as near.
                self.ranks[c] = np.searchsorted((used[:-1] + used[1:]) // 2, np.arange(256))
                self.values[c, : len(used)] = used


def _sparse_values(blocks: Bytes) -> Sets:
    """For each component, its distinct values if they are few for their range; else None."""
    components = blocks.shape[2]
    used = np.zeros((components, 256), np.uint8)
    kernels.mark_values(blocks, used)
    sets = [np.flatnonzero(occurs) for occurs in used]
    samples = blocks.size // components
    for c, values in enumerate(sets):
        few = 2 <= len(values) <= samples // 64
        if not few or 100 * len(values) > 88 * (values[-1] - values[0] + 1):
            sets[c] = values[:0]
    return sets


def _pass(
    level: Bytes,
    below: Bytes,
    sent: NDArray[np.int32] | None,
    ranks: _Ranks,
    sink: Sink | None,
    source: kernels.HaarSource | None,
) -> int:
    """Calls `haar_kernels.haar_pass`."""
    components = level.shape[2]
    others = reference_counts(components)
    return kernels.haar_pass(
        level, below, plane_order(components), others,
        BUILT_IN_WEIGHTS[others] if sent is None else sent, ACTIVITY_WEIGHTS[others],
        class_of_activity(), ranks.ranks, sink, source,
        kernels.workspace(below.shape[1], components),
    )  # fmt: skip
