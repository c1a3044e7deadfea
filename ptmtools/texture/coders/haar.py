"""The Haar coder of the `fast` profile: a group's bytes around the compiled pass.

Layout of a coded group (all little endian): flags; the rank bitmaps; the predictor weights; the
frequency tables; the number of escapes and the escapes; the rANS words to the end.

What encoder and decoder of the `fast` profile agree on without sending it.

The built-in weights and the classes of activity. The numbers were fitted once to photographs (12 of
the Kodak images and 7 textures) and are part of the format.

Weights of the `fast` profile's predictors, fitted to one group in whole numbers.

Weighted least squares over a sample of block rows, one system of at most seven unknowns for each
plane and Haar difference, solved exactly (`coders.equations`); the decoder only reads the weights.

With the built-in weights alone, photographs grow by 1.5 % and other textures by 10.7 % (normal maps
most: their components are related in ways of their own)."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coders import rans as tables
from ptmtools.texture.coders.group import Reader, damaged, fitted, plane_order, references
from ptmtools.texture.coders.rans import Sink, check_end, empty_sink, encode_symbols, read_stream

if TYPE_CHECKING:
    from ptmtools.texture.coders.haar_kernels import Source


#: Weights are in 1/256 and stay within ± this, so that predictions fit in 32 bits.
WEIGHT_TOP = 2047
#: Activity below which lies class 0, 1, 2 …: in sixteenths of the expected residual.
CLASS_BOUNDS = (1, 3, 7, 12, 20, 32, 50, 76, 115, 170, 250, 370, 560)
CLASSES = len(CLASS_BOUNDS) + 1
#: One table for each class of V and h1, one for each class of h2', one for the edge texels.
TABLES = 2 * CLASSES + 1
#: The table of the edge texels, which alone has no escape.
EDGE_TABLE = TABLES - 1

#: Weights in 1/256 for a plane with 0, 1, 2 references: V, h1, h2' by seven features.
BUILT_IN_WEIGHTS = np.array(
    [
        [[-158, -5, 31, 29, 0, 0, 0], [-79, 5, 6, -18, 0, 0, 0], [-22, 10, 44, 44, 10, 0, 0]],
        [[-167, -2, 32, 32, 0, 241, 0], [-78, 1, 4, -18, 0, 241, 0], [-19, 10, 47, 49, 9, 235, 0]],
        [
            [-152, -7, 25, 22, 0, 236, 35],
            [-78, 0, 3, -18, 0, 236, 28],
            [-19, 9, 46, 46, 10, 228, 70],
        ],
    ],
    np.int32,
)  # fmt: skip
#: Activity weights in 1/64 of a sixteenth, likewise.
ACTIVITY_WEIGHTS = np.array(
    [
        [[154, 139, 0, 0, 0, 0, 0], [61, 153, 0, 0, 25, 0, 0], [11, 67, 0, 0, 22, 66, 88]],
        [[9, 98, 36, 0, 0, 0, 0], [3, 99, 51, 0, 60, 0, 0], [1, 27, 57, 0, 17, 50, 49]],
        [[8, 74, 31, 128, 0, 0, 0], [3, 88, 23, 131, 38, 0, 0], [1, 24, 20, 61, 25, 39, 55]],
    ],
    np.int32,
)  # fmt: skip


@cache
def sent_mask(components: int) -> NDArray[np.bool_]:
    """Which weights (c, 3, 7) are sent, in this order."""
    mask = np.zeros((components, 3, 7), np.bool_)
    mask[:, :, :4] = mask[:, 2, 4] = True
    for c, others in enumerate(references(components)):
        mask[c, :, 5 : 5 + others] = True
    return mask


@cache
def class_of_activity() -> NDArray[np.int64]:
    """Class of each activity 0 … 1023."""
    return np.searchsorted(np.array(CLASS_BOUNDS), np.arange(1024), side="right")


#: Groups of fewer blocks use the built-in weights: sending others would not pay.
FEWEST_BLOCKS = 96 * 96
#: About so many block rows are sampled.
SAMPLED_ROWS = 12
Ranks = NDArray[np.int32]

#: Weight of a block by the magnitude of its first feature: steep ones say less.
_SLOPE_WEIGHTS = 4096 // (4 + np.arange(256))


def fit_weights(
    level: NDArray[np.uint8], below: NDArray[np.uint8], ranks: NDArray[np.int32]
) -> NDArray[np.int32] | None:
    """Weights (c, 3, 7), or None where the built-in ones will do.

    Parameters
    ----------
    level: (h, w, c) uint8. below: (h >> 1, w >> 1, c) uint8, the level below.
    ranks: (c, 256) int32, what stands for each value of each component.
    """
    bh, bw, nc = below.shape
    if bh * bw < FEWEST_BLOCKS or min(bh, bw) < 4:
        return None
    step = max(1, bh // SAMPLED_ROWS)
    y = np.arange(step // 2, bh, step)
    around = np.clip(y + np.arange(-2, 3)[:, None], 0, bh - 1)
    rows = below[around], level[np.stack([2 * y, 2 * y + 1, 2 * around[3]]), : 2 * bw]
    weights, sent = np.zeros((nc, 3, 7), np.int32), sent_mask(nc)
    residuals = np.zeros((nc, 3, len(y), bw), np.int32)
    for c, (plane, others) in enumerate(zip(plane_order(nc), references(nc), strict=True)):
        means, texels = (ranks[plane].take(one[..., plane]) for one in rows)
        for k, (coefficient, found) in enumerate(_coefficients(means, texels)):
            samples = np.stack([*found, *residuals[:others, k], coefficient], dtype=np.float64)
            samples = samples.reshape(-1, coefficient.size)
            features = samples[:-1]
            # Whole numbers, the sums of their products below 2^50.
            weighted = features * _SLOPE_WEIGHTS.take(np.abs(found[0])).reshape(-1)
            own = fitted(weighted @ samples.T, 8, WEIGHT_TOP, ridge=4096, share=16)
            weights[c, k, sent[c, k]] = own
            predicted = np.floor((own @ features + 128) / 256)
            residuals[c, k] = coefficient - predicted.reshape(coefficient.shape)
    return weights


def _coefficients(means: Ranks, texels: Ranks) -> list[tuple[Ranks, list[Ranks]]]:
    """V, h1 and h2' of the blocks of some rows, each with its first features.

    means: (5, n, w), the rows two above to two below. texels: (3, n, 2 w), the two rows of the
    blocks and the one under them.
    """
    wide = np.pad(means, ((0, 0), (0, 0), (1, 1)), "edge")
    across = wide[..., 2:] - wide[..., :-2]
    down = wide[3] - wide[1]
    h = texels[..., ::2] - texels[..., 1::2]
    v = texels[0, :, ::2] + texels[0, :, 1::2] - texels[1, :, ::2] - texels[1, :, 1::2]
    slope = np.pad(v, ((0, 0), (1, 1)))
    slope = slope[:, 2:] - slope[:, :-2]
    vertical = [
        down[:, 1:-1], down[:, :-2] + down[:, 2:], means[4] - means[2], means[2] - means[0]
    ]  # fmt: skip
    return [
        (v, vertical),
        (h[0], [across[2], across[1], across[3], slope]),
        (h[1] >> 1, [across[2], across[3], h[0], h[2], slope]),
    ]


#: Flag bits: weights are sent; from bit 4 on, component i is coded by rank.
SENT_WEIGHTS = 1
RANKED = 16

Bytes = NDArray[np.uint8]
#: For each component its distinct values, rising, if it is coded by rank; else none.
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
            *encode_symbols(sink, EDGE_TABLE, tables.built_in()),
        ]
    )


def decode(
    data: bytes | memoryview, below: Bytes, shape: tuple[int, int, int], version_1: bool = False
) -> Bytes:
    """The inverse of `encode`, or the decoder of files of version 1.

    Raises InputError PTM-I112 for what no encoder writes.
    """
    from ptmtools.texture.coders import haar_kernels as kernels

    components = shape[2]
    reader = Reader(data)
    flags = reader.number(1)
    if flags & ~(SENT_WEIGHTS | RANKED * ((1 << components) - 1)):
        raise damaged(f"flags {flags} are unknown")
    sets = []
    for c in range(components):
        bitmap = reader.numbers("u1", 32 if flags & RANKED << c else 0)
        sets.append(np.flatnonzero(np.unpackbits(bitmap, bitorder="little")))
        if bitmap.size and len(sets[c]) < 2:
            raise damaged("a rank bitmap has fewer than two values")
    sent = None
    if flags & SENT_WEIGHTS:
        mask = sent_mask(components)
        sent = np.zeros(mask.shape, np.int32)
        sent[mask] = reader.numbers("<i2", int(mask.sum()))
        if int(np.abs(sent).max()) > WEIGHT_TOP:
            raise damaged("a weight is out of range")
    frequency = tables.parse(reader, TABLES, tables.built_in(), version_1)
    level = np.empty(shape, np.uint8)
    edge = level.size - 4 * below.size
    stream = read_stream(reader, max(below.shape[1], edge))
    table, begins = tables.row_tables(frequency)
    classes = class_of_activity()
    ranks = _Ranks(sets)
    source = kernels.Source(
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
    """For each component its distinct values, if they are few for their range; else none."""
    from ptmtools.texture.coders import haar_kernels as kernels

    components = blocks.shape[2]
    used = np.zeros((components, 256), np.uint8)
    kernels.mark_values(blocks, used)
    sets = [np.flatnonzero(one) for one in used]
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
    source: Source | None,
) -> int:
    """`kernels.haar_pass`."""
    from ptmtools.texture.coders import haar_kernels as kernels

    components = level.shape[2]
    others = references(components)
    return kernels.haar_pass(
        level,
        below,
        plane_order(components),
        others,
        BUILT_IN_WEIGHTS[others] if sent is None else sent,
        ACTIVITY_WEIGHTS[others],
        class_of_activity(),
        ranks.ranks,
        sink,
        source,
        kernels.workspace(below.shape[1], components),
    )
