"""The Haar coder of the `fast` profile: a group's bytes around the compiled pass.

Layout of a coded group (all little endian): flags; the rank bitmaps; the predictor weights; the
frequency tables; the number of escapes and the escapes; the rANS words to the end.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coders.damage import damaged
from ptmtools.texture.coders.haar import layout
from ptmtools.texture.coders.haar.weights import fit_weights
from ptmtools.texture.coders.rans import tables
from ptmtools.texture.coders.rans.stream import encode_symbols, read_stream

if TYPE_CHECKING:
    from ptmtools.texture.coders.haar.kernels import Sink, Source

#: Flag bits: weights are sent; from bit 4 on, component i is coded by rank.
SENT_WEIGHTS = 1
RANKED = 16

Bytes = NDArray[np.uint8]


class _Ranks:
    """For each component, ranks in place of values (``ranks``) and back (``values``)."""

    def __init__(self, sets: tuple[NDArray[np.intp] | None, ...]) -> None:
        count = len(sets)
        self.ranks = np.tile(np.arange(256, dtype=np.int32), (count, 1))
        self.values = self.ranks.copy()
        self.tops = np.zeros(count, np.int64)
        for c, used in enumerate(sets):
            if used is not None:
                # A value that does not occur (below, means do) has the rank of the nearest that
                # does; the lower one where two are as near.
                self.ranks[c] = np.searchsorted((used[:-1] + used[1:]) // 2, np.arange(256))
                self.values[c, : len(used)] = used
                self.tops[c] = len(used) - 1


@cache
def _values_themselves(components: int) -> _Ranks:
    return _Ranks((None,) * components)


def _ranks(sets: tuple[NDArray[np.intp] | None, ...]) -> _Ranks:
    if all(used is None for used in sets):
        return _values_themselves(len(sets))
    return _Ranks(sets)


def _sparse_values(blocks: Bytes) -> tuple[NDArray[np.intp] | None, ...]:
    """For each component its distinct values, if they are few for their range; else None."""
    from ptmtools.texture.coders.haar import kernels

    components = blocks.shape[2]
    used = np.zeros((components, 256), np.uint8)
    kernels.mark_values(blocks, used)
    return tuple(_if_sparse(np.flatnonzero(one), blocks.size // components) for one in used)


def _if_sparse(values: NDArray[np.intp], samples: int) -> NDArray[np.intp] | None:
    if len(values) < 2 or samples < 64 * len(values):
        return None
    return values if 100 * len(values) <= 88 * (values[-1] - values[0] + 1) else None


def encode(level: Bytes, below: Bytes) -> bytes:
    """The group that refines ``below`` (h >> 1, w >> 1, c) to ``level`` (h, w, c)."""
    from ptmtools.texture.coders.haar import kernels

    components = level.shape[2]
    sets = _sparse_values(level[: 2 * below.shape[0], : 2 * below.shape[1]])
    ranks = _ranks(sets)
    sent = fit_weights(level, below, ranks.ranks)
    n = level.size - below.size
    sink = kernels.Sink(
        symbols=np.zeros(n, np.uint16),
        contexts=np.zeros(n, np.uint8),
        counts=np.zeros((layout.TABLES, 256), np.int64),
    )
    _pass(level, below, sent, ranks, sink, None)
    frequency, packed_tables = tables.choose(sink.counts, layout.EDGE_TABLE)
    flags = SENT_WEIGHTS if sent is not None else 0
    flags |= sum(RANKED << c for c in range(components) if sets[c] is not None)
    return b"".join(
        [
            bytes([flags]),
            *(_bitmap(used) for used in sets if used is not None),
            b"" if sent is None else sent[_sent_mask(components)].astype("<i2").tobytes(),
            packed_tables,
            encode_symbols(sink.symbols, sink.contexts, frequency, layout.EDGE_TABLE),
        ]
    )


def decode(
    data: bytes, below: Bytes, shape: tuple[int, int, int], version_1: bool = False
) -> Bytes:
    """The inverse of `encode`, or the decoder of files of version 1.

    Raises InputError PTM-I112 for what no encoder writes.
    """
    from ptmtools.texture.coders.haar import kernels

    components = shape[2]
    reader = _Reader(data)
    flags = reader.take(1)[0]
    if flags & ~(SENT_WEIGHTS | RANKED * ((1 << components) - 1)):
        raise damaged(f"flags {flags} are unknown")
    sets = tuple(_bits(reader.take(32)) if flags >> 4 + c & 1 else None for c in range(components))
    sent = None
    if flags & SENT_WEIGHTS:
        mask = _sent_mask(components)
        sent = np.zeros(mask.shape, np.int32)
        sent[mask] = np.frombuffer(reader.take(2 * int(mask.sum())), "<i2")
        if int(np.abs(sent).max()) > layout.WEIGHT_TOP:
            raise damaged("a weight is out of range")
    parse = tables.parse_version_1 if version_1 else tables.parse
    frequency, used = parse(reader.rest(), layout.TABLES)
    reader.take(used)
    level = np.empty(shape, np.uint8)
    edge = level.size - 4 * below.size
    stream = read_stream(reader.rest(), max(below.shape[1], edge))
    table, begins = tables.row_tables(frequency)
    classes = layout.class_of_activity()
    ranks = _ranks(sets)
    source = kernels.Source(
        words=stream.words,
        limit=stream.limit,
        escapes=stream.escapes,
        table=table,
        starts=begins[[classes, layout.CLASSES + classes, 0 * classes + layout.EDGE_TABLE]],
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
    result = _pass(level, below, sent, ranks, None, source)
    if result == kernels.TRUNCATED:
        raise damaged("its stream ends early")
    if result != kernels.OK:
        raise damaged("its stream leads to impossible texels")
    return level


def _pass(
    level: Bytes,
    below: Bytes,
    sent: NDArray[np.int32] | None,
    ranks: _Ranks,
    sink: Sink | None,
    source: Source | None,
) -> int:
    """`kernels.haar_pass`."""
    from ptmtools.texture.coders.haar import kernels

    components = level.shape[2]
    references = layout.references(components)
    return kernels.haar_pass(
        level,
        below,
        np.array(layout.plane_order(components), np.int64),
        references,
        layout.BUILT_IN_WEIGHTS[references] if sent is None else sent,
        layout.ACTIVITY_WEIGHTS[references],
        layout.class_of_activity(),
        ranks.ranks,
        sink,
        source,
        kernels.workspace(below.shape[1], components),
    )


@cache
def _sent_mask(components: int) -> NDArray[np.bool_]:
    """Which weights (c, 3, 7) are sent, in this order."""
    mask = np.zeros((components, 3, 7), np.bool_)
    for c in range(components):
        for k in range(3):
            mask[c, k, layout.features_used(k, layout.reference_count(components, c))] = True
    return mask


def _bitmap(values: NDArray[np.intp]) -> bytes:
    used = np.zeros(256, np.bool_)
    used[values] = True
    return np.packbits(used, bitorder="little").tobytes()


def _bits(bitmap: bytes) -> NDArray[np.intp]:
    values = np.flatnonzero(np.unpackbits(np.frombuffer(bitmap, np.uint8), bitorder="little"))
    if len(values) < 2:
        raise damaged("a rank bitmap has fewer than two values")
    return values


class _Reader:
    """Bytes from the front; asking for more than there are is an error of the file."""

    def __init__(self, data: bytes) -> None:
        # A view: slices of it copy nothing.
        self._data = memoryview(data)
        self._at = 0

    def take(self, n: int) -> bytes:
        if self._at + n > len(self._data):
            raise damaged("it is cut short")
        self._at += n
        return bytes(self._data[self._at - n : self._at])

    def rest(self) -> memoryview:
        return self._data[self._at :]
