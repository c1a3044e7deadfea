"""The texel coder: samples of 16 bits, floats, and any integers with an error allowed.

A group is one byte that names its form, then what that form needs:

- *raw*: as in profile `raw`; only without error.
- *plain*: all texels of the level, whatever is below: nothing takes more than this and one byte.
- *coded*, with built-in or with sent weights: every texel predicted from the level below and the
  texels before it, the residual as a token (coded with rANS by the activity around it) and plain
  bits. ``kernels`` has the pass, ``docs/format-kinds.md`` the format.

Whole pyramids over what zstd -19 makes of the finest level alone: photographs of 16 bits 0.82, as
float32 0.90, half-float environment maps 0.66 … 0.80, Radiance files 0.68 … 0.83, 8 bits widened to
16 or divided by 255 0.69 … 0.80, heights as float32 0.69; over OpenEXR (the shorter of ZIP and PIZ)
0.64 … 0.93. What repeats without being flat is not found: a pattern of 16² random floats costs 90
times what zstd needs. With an error of 1, 2, 4, 8, 12 Kodak images of 8 bits take 0.74, 0.58, 0.41,
0.25 of their lossless size; JPEG-LS 0.87, 0.69, 0.50, 0.34 for the finest level alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coders.damage import damaged
from ptmtools.texture.coders.rans import stream, tables
from ptmtools.texture.coders.texel import layout
from ptmtools.texture.coders.texel.fit import fit_weights
from ptmtools.texture.coders.texel.numbering import Numbering, number_planes, read_numbering
from ptmtools.texture.profiles import raw
from ptmtools.texture.profiles.raw import expect_length, sample_bytes, samples_from
from ptmtools.texture.samples import SampleKind, from_ordered, kind_of, to_ordered

if TYPE_CHECKING:
    from ptmtools.texture.profiles import Samples, Shape

#: Forms of a group.
RAW, PLAIN, CODED, CODED_WITH_WEIGHTS = 0, 1, 2, 3
#: Groups of fewer blocks use the built-in weights: sending others would not pay.
FEWEST_BLOCKS = 24 * 24
#: Groups shorter than so many times their weights are tried without them too.
LIGHT = 8

#: The activity where texels differ as they mostly do has this class; the highest window; rows
#: looked at.
WINDOW_USUAL, WINDOW_TOP, WINDOW_ROWS = 12, 40, 64

Numbers = NDArray[np.uint32]
Weights = NDArray[np.int64]


def encode(level: Samples, below: Samples, max_error: int = 0) -> tuple[bytes, Samples]:
    """The group that refines ``below`` to ``level``, and the texels that a decoder will have.

    Parameters
    ----------
    level: (h, w, c) of any kind; below: (h >> 1, w >> 1, c), its mean exactly if no error is
        allowed, else anything.
    max_error: how far each sample may be off; for integers only.
    """
    candidates = [_Coded(PLAIN, sample_bytes(level), level)]
    if below.size:
        candidates += _codings(_Group.of(level, below, max_error))
    # The raw form takes no less than three quarters of the plain one.
    if not max_error and 4 * min(len(one.body) for one in candidates) > 3 * level.nbytes:
        candidates.append(_Coded(RAW, raw.encode_tile(level, below).data, level))
    best = min(candidates, key=lambda one: len(one.body))
    return bytes([best.form]) + best.body, best.texels


def decode(
    data: bytes, below: Samples, shape: Shape, dtype: np.dtype[Any], max_error: int = 0
) -> Samples:
    """The inverse of `encode`. Raises InputError PTM-I112 for what no encoder writes."""
    if not data:
        raise damaged("it is empty")
    form, body = data[0], data[1:]
    if form == PLAIN:
        expect_length(body, shape[0] * shape[1] * shape[2] * dtype.itemsize)
        return samples_from(body, dtype).reshape(shape).copy()
    if form == RAW and not max_error:
        return raw.decode_tile(body, below, shape).texels
    if form in (CODED, CODED_WITH_WEIGHTS) and below.size:
        return _decode(body, below, shape, max_error, form == CODED_WITH_WEIGHTS)
    raise damaged(f"form {form} is unknown")


@dataclass(frozen=True)
class _Coded:
    form: int
    body: bytes
    texels: Samples


@dataclass(frozen=True)
class _Group:
    """A group in numbers: what the pass works on, in either direction.

    Attributes
    ----------
    level: (h, w, c) of any kind.
    means: (h >> 1, w >> 1, c), ordered values of the level below.
    numbering: of the values of the level.
    numbers: (h, w, c), of the level's values.
    work: (c, rows, columns), numbers of the level below at twice its size, with a frame.
    max_error: the error allowed.
    """

    level: Samples
    means: Numbers
    numbering: Numbering
    numbers: Numbers
    work: Numbers
    max_error: int

    @classmethod
    def of(cls, level: Samples, below: Samples, max_error: int) -> _Group:
        values = to_ordered(level).astype(np.uint32)
        means = to_ordered(below).astype(np.uint32)
        numbering = number_planes(values, kind_of(level.dtype).top, max_error)
        work = _enlarged(numbering.nearest(means), level.shape)
        return cls(level, means, numbering, numbering.nearest(values), work, max_error)


def _codings(group: _Group) -> list[_Coded]:
    """The group as it is coded, in one or two ways; none if the level below is not its mean."""
    blocks = group.means.shape[:2]
    codings: list[_Coded | None] = []
    # Where all tops are 0 there is nothing to predict.
    if blocks[0] * blocks[1] >= FEWEST_BLOCKS and min(blocks) >= 4 and group.numbering.tops.any():
        codings.append(_coding(group, fit_weights(group.work, group.numbers, group.max_error)))
    light = LIGHT * 2 * int(layout.sent_mask(group.level.shape[2]).sum())
    if not codings or (codings[0] and len(codings[0].body) < light):
        codings.append(_coding(group, None))
    return [one for one in codings if one is not None]


def _coding(group: _Group, weights: Weights | None) -> _Coded | None:
    from ptmtools.texture.coders.texel import kernels

    n, components = group.level.size, group.level.shape[2]
    most = n * group.numbering.symbols
    symbols, contexts = np.empty(most, np.uint16), np.empty(most, np.uint8)
    counts = np.zeros((kernels.TABLES, 256), np.int64)
    plain, limits = np.zeros(n + 2, np.uint32), np.zeros(2, np.int64)
    numbers = group.numbers.copy() if group.max_error else group.numbers
    window = _window(group)
    result = _pass(
        True, numbers, group.means, group.work.copy(), group.max_error, kind_of(group.level.dtype),
        group.numbering, weights, window, plain, limits, symbols=symbols, contexts=contexts,
        counts=counts,
    )  # fmt: skip
    if result != kernels.OK:
        return None
    used, bits = limits.tolist()
    size = (bits + 7) // 8
    frequency, packed = tables.choose(counts, kernels.TABLES, layout.table_family())
    sent = b"" if weights is None else weights[layout.sent_mask(components)].astype("<i2").tobytes()
    body = b"".join(
        [
            group.numbering.packed(),
            bytes([window]),
            sent,
            packed,
            size.to_bytes(4, "little"),
            plain.astype("<u4", copy=False).tobytes()[:size],
            stream.encode_symbols(symbols[:used], contexts[:used], frequency, kernels.TABLES),
        ]
    )
    texels = numbers.astype(group.level.dtype) if group.max_error else group.level
    return _Coded(CODED if weights is None else CODED_WITH_WEIGHTS, body, texels)


def _window(group: _Group) -> int:
    """How many doublings of activity are one class, so that usual ones have their own."""
    step = max(1, group.numbers.shape[0] // WINDOW_ROWS)
    rows = group.numbers[::step].astype(np.int64)
    if rows.shape[1] < 2:
        return 0
    changes = np.abs(np.diff(rows, axis=1)) >> group.numbering.grids
    usual = 96 * int(changes.sum()) // changes.size // (2 * group.max_error + 1)
    return min(max(usual.bit_length() - WINDOW_USUAL, 0), WINDOW_TOP)


def _decode(data: bytes, below: Samples, shape: Shape, max_error: int, sent: bool) -> Samples:
    from ptmtools.texture.coders.texel import kernels

    kind = kind_of(below.dtype)
    means = to_ordered(below).astype(np.uint32)
    numbering, at = read_numbering(data, shape[2], kind.top)
    if max_error and not numbering.plain:
        raise damaged("values are numbered although an error is allowed")
    window = int.from_bytes(data[at : at + 1], "little")
    if not at < len(data) or window > WINDOW_TOP:
        raise damaged("its window is impossible")
    at += 1
    weights = None
    if sent:
        weights, at = _read_weights(data, at, shape[2])
    frequency, used = tables.parse(data[at:], kernels.TABLES, layout.table_family())
    at += used + 4
    size = int.from_bytes(data[at - 4 : at], "little")
    if len(data) < at + size:
        raise damaged("it is cut short")
    # A row of blocks is decoded before it is looked whether the stream was long enough.
    row = 4 * (shape[1] + 1 >> 1) * shape[2] * numbering.symbols
    plain = np.zeros(-(-size // 4) + row + 2, np.uint32)
    plain[: -(-size // 4)] = np.frombuffer(data[at : at + size] + bytes(-size % 4), "<u4")
    read = stream.read_stream(data[at + size :], row)
    numbers = np.zeros(shape, np.uint32)
    work = _enlarged(numbering.nearest(means), shape)
    result = _pass(
        False, numbers, means, work, max_error, kind, numbering, weights, window, plain,
        np.array([read.limit, 8 * size], np.int64), words=read.words, escapes=read.escapes,
        table=tables.single_tables(frequency),
    )  # fmt: skip
    if result == kernels.TRUNCATED:
        raise damaged("its stream ends early")
    if result != kernels.OK:
        raise damaged("its stream leads to impossible texels")
    return from_ordered(numbering.values(numbers).astype(f"u{kind.size}"), below.dtype)


def _read_weights(data: bytes, at: int, components: int) -> tuple[Weights, int]:
    mask = layout.sent_mask(components)
    end = at + 2 * int(mask.sum())
    if len(data) < end:
        raise damaged("it is cut short")
    weights = np.zeros(mask.shape, np.int64)
    weights[mask] = np.frombuffer(data[at:end], "<i2")
    if int(np.abs(weights).sum(axis=2).max()) > layout.WEIGHT_SUM:
        raise damaged("a weight is out of range")
    return weights, end


def _enlarged(numbers: Numbers, shape: tuple[int, ...]) -> Numbers:
    """The level below at twice its size, planes apart, with a frame."""
    from ptmtools.texture.coders.texel.kernels import BEFORE, BEHIND

    sides = []
    for side, half in zip(shape[:2], numbers.shape[:2], strict=True):
        at = np.arange(-BEFORE, side + (side & 1) + BEHIND) >> 1
        sides.append(np.clip(at, 0, half - 1))
    rows, columns = sides
    # Columns first: there are fewer rows then, and whole rows are copied quickly.
    wide = np.ascontiguousarray(numbers.transpose(2, 0, 1))[:, :, columns]
    return wide[:, rows]


def _pass(
    encoding: bool,
    numbers: Numbers,
    means: Numbers,
    work: Numbers,
    max_error: int,
    kind: SampleKind,
    numbering: Numbering,
    weights: Weights | None,
    window: int,
    plain: Numbers,
    limits: NDArray[np.int64],
    symbols: NDArray[np.uint16] | None = None,
    contexts: NDArray[np.uint8] | None = None,
    counts: NDArray[np.int64] | None = None,
    words: NDArray[np.uint16] | None = None,
    escapes: NDArray[np.uint16] | None = None,
    table: Numbers | None = None,
) -> int:
    """`kernels.texel_pass`, with empty arrays for what a direction does not use."""
    from ptmtools.texture.coders.texel import kernels

    components = numbers.shape[2]
    references = layout.references(components)
    exact = {"float16": kernels.HALF, "float32": kernels.SINGLE}.get(kind.name, kernels.WHOLE)
    none = np.zeros(0, np.uint16)
    return int(
        kernels.texel_pass(
            encoding,
            numbers,
            means,
            work.reshape(-1),
            work.shape[2],
            max_error,
            kernels.FREE if max_error else exact,
            kind.top,
            np.array(layout.plane_order(components), np.int64),
            references,
            (layout.BUILT_IN_WEIGHTS[references] if weights is None else weights).reshape(-1),
            layout.offsets(work.shape[2]).reshape(-1),
            numbering.steps,
            numbering.offsets,
            numbering.lists,
            numbering.tops,
            numbering.grids,
            window,
            none if symbols is None else symbols,
            np.zeros(0, np.uint8) if contexts is None else contexts,
            np.zeros((0, 256), np.int64) if counts is None else counts,
            plain,
            limits,
            none if words is None else words,
            none if escapes is None else escapes,
            np.zeros(0, np.uint32) if table is None else table,
            kernels.workspace(numbers.shape[1], components),
        )
    )
