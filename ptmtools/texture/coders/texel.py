"""The texel coder: samples of 16 bits, floats, and any integers with an error allowed.

A group is one byte that names its form (raw, plain, coded with built-in or with sent weights), then
the data of that form. ``texel_kernels`` has the pass, ``docs/formats/ptm-kinds.md`` the format.

Whole pyramids over what zstd -19 makes of the finest level alone: photographs of 16 bits 0.82, as
float32 0.90, half-float environment maps 0.66 … 0.80, Radiance files 0.68 … 0.83, 8 bits widened to
16 or divided by 255 0.69 … 0.80, heights as float32 0.69. Repetitions that are not flat are not
detected: a pattern of 16² random floats costs 90 times what zstd needs. With an error of 1, 2, 4,
8, 12 Kodak images of 8 bits take 0.74, 0.58, 0.41, 0.25 of their lossless size; JPEG-LS 0.87, 0.69,
0.50, 0.34 for the finest level alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coder import Data, Samples, Shape
from ptmtools.texture.coders import (
    rans as tables,
    texel_kernels as kernels,
    texel_layout as layout,
)
from ptmtools.texture.coders.group import (
    OK,
    GroupReader,
    group_error,
    plane_order,
    reference_counts,
)
from ptmtools.texture.coders.rans import Sink, check_end, empty_sink, encode_symbols, read_stream
from ptmtools.texture.coders.texel_layout import (
    Numbering,
    fit_weights,
    number_planes,
    read_numbering,
)
from ptmtools.texture.profiles import raw
from ptmtools.texture.profiles.raw import sample_bytes
from ptmtools.texture.samples import SampleKind, from_ordered, kind_of, to_ordered

#: Forms of a group.
RAW, PLAIN, CODED, CODED_WITH_WEIGHTS = 0, 1, 2, 3
#: Groups of fewer blocks use the built-in weights: sending others would not pay.
FEWEST_BLOCKS = 24 * 24
#: Groups shorter than this multiple of their weights are also tried without them.
LIGHT = 8

#: Class of the usual activity; the highest window; rows examined.
WINDOW_USUAL, WINDOW_TOP, WINDOW_ROWS = 12, 40, 64

Numbers = NDArray[np.uint32]
Weights = NDArray[np.int64]
#: Form and bytes of a group, and the texels that a decoder will have.
Coded = tuple[int, bytes, "Samples"]


def encode(level: Samples, below: Samples, max_error: int = 0) -> tuple[bytes, Samples]:
    """The group that refines ``below`` to ``level``, and the texels that a decoder will have.

    Parameters
    ----------
    level: (h, w, c) of any kind; below: (h >> 1, w >> 1, c), its mean exactly if no error is
        allowed, else anything.
    max_error: how far each sample may be off; for integers only.
    """
    candidates: list[Coded] = [(PLAIN, sample_bytes(level), level)]
    if below.size:
        candidates += _coded_forms(level, below, max_error)
    # The raw form takes no less than three quarters of the plain one.
    if not max_error and 4 * min(len(body) for _, body, _ in candidates) > 3 * level.nbytes:
        candidates.append((RAW, raw.encode_tile(level, below).data, level))
    form, body, texels = min(candidates, key=lambda coded: len(coded[1]))
    return bytes([form]) + body, texels


def decode(data: Data, below: Samples, shape: Shape, max_error: int = 0) -> Samples:
    """The inverse of `encode`. Raises InputError PTM-I112 for what no encoder writes."""
    reader = GroupReader(data)
    form = reader.number(1)
    if form == PLAIN:
        level = reader.texels(shape, below.dtype)
        reader.end()
        return level
    if form == RAW and not max_error:
        return raw.decode_tile(reader.rest(), below, shape).texels
    if form in (CODED, CODED_WITH_WEIGHTS) and below.size:
        return _decode(reader, below, shape, max_error, form == CODED_WITH_WEIGHTS)
    raise group_error(f"form {form} is unknown")


@dataclass(frozen=True)
class _Group:
    """The arrays of a pass, in either direction.

    Attributes
    ----------
    kind: of the samples.
    means: (h >> 1, w >> 1, c), ordered values of the level below.
    numbering: of the values of the level.
    work: (c, rows, columns), numbers of the level below at twice its size, with a frame.
    max_error: the error allowed.
    """

    kind: SampleKind
    means: Numbers
    numbering: Numbering
    work: Numbers
    max_error: int

    def code(
        self,
        numbers: Numbers,
        weights: Weights | None,
        window: int,
        plain: Numbers,
        limits: NDArray[np.int64],
        sink: Sink | None = None,
        source: kernels.TexelSource | None = None,
    ) -> int:
        """Calls `texel_kernels.texel_pass`, with empty arrays for the direction that it does not
        take."""
        components = numbers.shape[2]
        others = reference_counts(components)
        exact = {"float16": kernels.HALF, "float32": kernels.SINGLE}
        rule = kernels.FREE if self.max_error else exact.get(self.kind.name, kernels.WHOLE)
        none = np.zeros(0, np.uint16)
        stride = self.work.shape[2]
        result = kernels.texel_pass(
            sink is not None, numbers, self.means, self.work.copy().reshape(-1), stride,
            self.max_error, rule, plane_order(components), others,
            (layout.BUILT_IN_WEIGHTS[others] if weights is None else weights).reshape(-1),
            layout.offsets(stride).reshape(-1), self.numbering.arrays, window,
            sink or empty_sink(0, 0),
            source or kernels.TexelSource(none, none, np.zeros(0, np.uint32)), plain, limits,
            kernels.workspace(numbers.shape[1], components),
        )  # fmt: skip
        return int(result)


def _coded_forms(level: Samples, below: Samples, max_error: int) -> list[Coded]:
    """The coded group, in one or two ways; none if the level below is not its mean."""
    kind = kind_of(level.dtype)
    values, means = (to_ordered(candidate).astype(np.uint32) for candidate in (level, below))
    numbering = number_planes(values, kind.top, max_error)
    numbers = numbering.nearest(values)
    work = _enlarge(numbering.nearest(means), level.shape)
    group = _Group(kind, means, numbering, work, max_error)
    blocks = below.shape[:2]
    codings: list[Coded | None] = []
    # Where all tops are 0 there is nothing to predict.
    many = blocks[0] * blocks[1] >= FEWEST_BLOCKS and min(blocks) >= 4
    if many and numbering.arrays.tops.any():
        weights = fit_weights(work, numbers, max_error)
        codings.append(_encode_coded(group, level, numbers, weights))
    light = LIGHT * 2 * int(layout.sent_mask(level.shape[2]).sum())
    if not codings or (codings[0] and len(codings[0][1]) < light):
        codings.append(_encode_coded(group, level, numbers, None))
    return [candidate for candidate in codings if candidate]


def _encode_coded(
    group: _Group, level: Samples, numbers: Numbers, weights: Weights | None
) -> Coded | None:
    sink = empty_sink(level.size * group.numbering.symbols, kernels.TABLES)
    plain, limits = np.zeros(level.size + 2, np.uint32), np.zeros(2, np.int64)
    window = _window(group, numbers)
    if group.max_error:
        numbers = numbers.copy()
    if group.code(numbers, weights, window, plain, limits, sink=sink) != OK:
        return None
    used, bits = limits.tolist()
    size = (bits + 7) // 8
    sink = sink._replace(symbols=sink.symbols[:used], contexts=sink.contexts[:used])
    packed, stream = encode_symbols(sink, kernels.TABLES, layout.table_family())
    body = b"".join(
        [
            group.numbering.pack(),
            bytes([window]),
            b"" if weights is None
            else weights[layout.sent_mask(level.shape[2])].astype("<i2").tobytes(),
            packed,
            size.to_bytes(4, "little"),
            plain.astype("<u4", copy=False).tobytes()[:size],
            stream,
        ]
    )  # fmt: skip
    texels = numbers.astype(level.dtype) if group.max_error else level
    return CODED if weights is None else CODED_WITH_WEIGHTS, body, texels


def _window(group: _Group, numbers: Numbers) -> int:
    """Number of doublings of activity in the lowest class, so that usual ones have their own."""
    step = max(1, numbers.shape[0] // WINDOW_ROWS)
    rows = numbers[::step].astype(np.int64)
    if rows.shape[1] < 2:
        return 0
    changes = np.abs(np.diff(rows, axis=1)) >> group.numbering.arrays.grids
    usual: int = 96 * int(changes.sum()) // changes.size // (2 * group.max_error + 1)
    return min(max(usual.bit_length() - WINDOW_USUAL, 0), WINDOW_TOP)


def _decode(
    reader: GroupReader, below: Samples, shape: Shape, max_error: int, sent: bool
) -> Samples:
    kind = kind_of(below.dtype)
    means = to_ordered(below).astype(np.uint32)
    numbering = read_numbering(reader, shape[2], kind.top)
    if max_error and not numbering.plain:
        raise group_error("values are numbered although an error is allowed")
    window = reader.number(1)
    if window > WINDOW_TOP:
        raise group_error("its window is impossible")
    weights = _read_weights(reader, shape[2]) if sent else None
    frequency = tables.parse(reader, kernels.TABLES, layout.table_family())
    bits = reader.numbers("u1", reader.number(4))
    # A row of blocks is decoded before the length of the stream is checked.
    row = 4 * (shape[1] + 1 >> 1) * shape[2] * numbering.symbols
    plain = np.zeros(-(-len(bits) // 4) + row + 2, "<u4")
    plain.view(np.uint8)[: len(bits)] = bits
    stream = read_stream(reader, row)
    numbers = np.zeros(shape, np.uint32)
    work = _enlarge(numbering.nearest(means), shape)
    limits = np.array([stream.limit, 8 * len(bits)], np.int64)
    source = kernels.TexelSource(stream.words, stream.escapes, tables.single_tables(frequency))
    group = _Group(kind, means, numbering, work, max_error)
    check_end(
        group.code(
            numbers, weights, window, plain.astype(np.uint32, copy=False), limits, source=source
        )
    )
    return from_ordered(numbering.values(numbers).astype(f"u{kind.size}"), below.dtype)


def _read_weights(reader: GroupReader, components: int) -> Weights:
    mask = layout.sent_mask(components)
    weights = np.zeros(mask.shape, np.int64)
    weights[mask] = reader.numbers("<i2", int(mask.sum()))
    if int(np.abs(weights).sum(axis=2).max()) > layout.WEIGHT_SUM:
        raise group_error("a weight is out of range")
    return weights


def _enlarge(numbers: Numbers, shape: tuple[int, ...]) -> Numbers:
    """The level below at twice its size, planes apart, with a frame."""
    sides = []
    for side, half in zip(shape[:2], numbers.shape[:2], strict=True):
        at = np.arange(-kernels.BEFORE, side + (side & 1) + kernels.BEHIND) >> 1
        sides.append(np.clip(at, 0, half - 1))
    rows, columns = sides
    # Columns first: there are fewer rows then, and whole rows are copied quickly.
    wide = np.ascontiguousarray(numbers.transpose(2, 0, 1))[:, :, columns]
    return wide[:, rows]
