"""Static entropy coding: symbols as bytes and back, and the frequency tables of their contexts.

Layout of a stream: number of escapes (4 bytes); the escapes (2 bytes each); the words of four rANS
states (2 bytes each) to the end, of which the first eight are the states. All little endian.

Each table of a group is either one of a family of two-sided geometric distributions, named by its
number, or the frequencies counted. The first kind suits small groups, the second large ones;
the encoder takes whichever is shorter, table by table. Tables are written as numbers of groups of
three bits, so that the tables of a nearly empty group take a few bytes.

Deflating the frequencies was rejected: the bytes of a file would depend on the zlib that wrote it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coders import rans_kernels as kernels
from ptmtools.texture.coders.group import (
    ESCAPE,
    OK,
    TABLE_BITS,
    TABLE_SIZE,
    TRUNCATED,
    GroupReader,
    group_error,
)


class Sink(NamedTuple):
    """Symbols that a pass collects."""

    symbols: Any  # (n,) uint16
    contexts: Any  # (n,) uint8, the table of each
    counts: Any  # (tables, 256) int64: how often each occurs; all above 254 count as 255


#: Mean magnitudes, in sixteenths, of the built-in distributions 1, 2, …
BUILT_IN_MEANS = (
    1, 2, 3, 4, 5, 6, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40, 48, 56, 64, 80, 96, 112, 128, 160,
    192, 224, 256, 320, 384, 448, 512, 640, 768, 1024,
)  # fmt: skip
UNUSED = 0
SENT = 255
#: The first kind is coded as the change from this one.
_FIRST_KIND = 4
#: Faults that `rans_kernels.read_tables` reports.
_ERRORS = {
    1: "its tables are cut short or hold a number above 4095",
    2: "a table is of an unknown kind",
    3: "it has too many tables",
    4: f"a table does not sum to {TABLE_SIZE}",
}

Frequencies = NDArray[np.int64]


def normalise(counts: NDArray[np.int64]) -> Frequencies:
    """Frequencies (t, 256) of the rows of ``counts`` (t, 256): see `rans_kernels.normalise`."""
    frequency = np.zeros_like(counts)
    kernels.normalise(counts, frequency, np.empty(256, np.int64))
    return frequency


class Family(NamedTuple):
    """Built-in tables.

    Attributes
    ----------
    tables: (1 + n, 256) int64; row 0 is empty.
    lengths: (n, 256) int64, of every symbol under every table but the empty one, in 1/256 bits.
    """

    tables: Frequencies
    lengths: NDArray[np.int64]


def family(rows: Iterable[Sequence[int]]) -> Family:
    """Tables from the weights of their first symbols.

    Weights are scaled to a sum of 2^24. Those below 2^12 then have frequency 0: they escape. The
    escape has 1/1024 of the sum.
    """
    weights = [[0] * 256]
    for row in rows:
        total = sum(row)
        kept = [0 if w << 12 < total else (w << 24) // total for w in row]
        weights.append([*kept, *[0] * (ESCAPE - len(kept)), sum(kept) >> 10])
    tables = normalise(np.array(weights, np.int64))
    lengths = _log_table()[tables[1:]]
    escaped = lengths[:, ESCAPE, None] + 16 * 256
    return Family(tables, np.where(tables[1:] > 0, lengths, escaped))


@cache
def built_in_family() -> Family:
    """The built-in tables of the coders of 8 bits.

    Weight of magnitude m: 2^24 at 0, then each times ρ = mean / (16 + mean) in 16 bits.
    """
    rows = []
    for mean in BUILT_IN_MEANS:
        row = [1 << 24]
        for symbol in range(1, ESCAPE):
            ratio = 65536 * mean // (16 + mean)
            row.append(row[-1] * ratio >> 16 if symbol % 2 else row[-1])
        rows.append(row)
    return family(rows)


@cache
def _log_table() -> NDArray[np.int64]:
    """-log2(f / 2048) in 1/256 bits for f = 0 … 2048 (0 for f = 0), by repeated squaring.

    In integers: the choice of a table must not depend on a machine's logarithm.
    """
    table = np.zeros(TABLE_SIZE + 1, np.int64)
    for f in range(1, TABLE_SIZE + 1):
        whole = f.bit_length() - 1
        mantissa = f << (30 - whole)
        fraction = 0
        for _ in range(8):
            mantissa = mantissa * mantissa >> 30
            fraction <<= 1
            if mantissa >= 1 << 31:
                mantissa >>= 1
                fraction |= 1
        table[f] = (TABLE_BITS - whole) * 256 - fraction
    return table


def choose(counts: NDArray[np.int64], plain: int, family: Family) -> tuple[Frequencies, bytes]:
    """Tables (t, 256) for the symbol counts (t, 256) of a group, and their serialised form.

    Tables from number ``plain`` on have no escape: one that is built in is used only where it holds
    every symbol that occurs.
    """
    exact = normalise(counts)
    kinds = np.zeros(len(counts), np.int64)
    kernels.choose_kinds(
        counts, exact, *family, _log_table(), plain, SENT, kinds, np.empty(256, np.int64)
    )
    frequency = exact.copy()
    named = (kinds != UNUSED) & (kinds != SENT)
    frequency[named] = family.tables[kinds[named]]
    # Numbers take four nibbles at most.
    room = 2 * (2 * len(kinds) + 257 * int(np.count_nonzero(kinds == SENT)))
    packed = np.zeros(room, np.uint8)
    size = kernels.write_tables(kinds, _FIRST_KIND, SENT, exact, packed)
    return frequency, size.to_bytes(2, "little") + packed[:size].tobytes()


def parse(reader: GroupReader, tables: int, family: Family, version_1: bool = False) -> Frequencies:
    """The inverse of `choose`: frequencies (tables, 256).

    Files of version 1 have a byte for each table first, which names its kind.

    Raises InputError PTM-I112 for tables that no encoder writes.
    """
    kinds = np.zeros(tables, np.int64)
    if version_1:
        kinds[:] = reader.numbers("u1", tables)
    packed = reader.numbers("u1", reader.number(2))
    frequency = np.zeros((tables, 256), np.int64)
    error = kernels.read_tables(
        packed, version_1, kinds, _FIRST_KIND, SENT, family.tables, frequency, np.zeros(2, np.int64)
    )
    if error:
        raise group_error(_ERRORS[error])
    return frequency


def row_tables(frequency: Frequencies) -> tuple[NDArray[np.uint32], NDArray[np.uint64]]:
    """For `rans_kernels.decode_row`: entries symbol << 24 | frequency << 12 | offset of all tables
    in use, one after the other, and where each table (t,) begins. Those not in use share one of
    zeros, which only a damaged stream asks for.
    """
    used = frequency.any(axis=1)
    begins = np.where(used, np.cumsum(used) * TABLE_SIZE, 0).astype(np.uint64)
    table = np.empty((1 + int(used.sum())) * TABLE_SIZE, np.uint32)
    table[:TABLE_SIZE] = 0
    kernels.fill_row_tables(frequency, begins, table)
    return table, begins


def single_tables(frequency: Frequencies) -> NDArray[np.uint32]:
    """For `rans_kernels.decode_single`: a third of the size; zeros where not in use."""
    table = np.zeros((len(frequency), kernels.SINGLE_SIZE), np.uint32)
    slots = table[:, : TABLE_SIZE // 4].view(np.uint8)
    kernels.fill_single_tables(frequency, slots, table[:, TABLE_SIZE // 4 :])
    return table.reshape(-1)


@dataclass(frozen=True)
class Stream:
    """A stream ready for `rans_kernels.decode_row`.

    Attributes
    ----------
    words: uint16, with padding behind ``limit``; reading starts at 8.
    limit: number of words of the stream: all have to be used.
    escapes: uint16; all have to be used.
    """

    words: NDArray[np.uint16]
    limit: int
    escapes: NDArray[np.uint16]


def empty_sink(n: int, count: int) -> Sink:
    """An empty sink for up to n symbols by ``count`` tables."""
    counts = np.zeros((count, 256), np.int64)
    return Sink(np.empty(n, np.uint16), np.empty(n, np.uint8), counts)


def encode_symbols(sink: Sink, plain: int, family: Family) -> tuple[bytes, bytes]:
    """The tables, chosen by `choose`, and the stream of a full sink."""
    symbols, contexts, counts = sink
    frequency, packed = choose(counts, plain, family)
    words = np.empty(len(symbols) + 8, np.uint16)
    escapes = np.empty(len(symbols), np.uint16)
    work = np.empty((len(frequency), 256), np.uint64)
    first, escaped = kernels.encode(
        symbols, contexts, plain, frequency, work, np.empty(4, np.uint64), words, escapes
    )
    count = (len(escapes) - escaped).to_bytes(4, "little")
    parts = (escapes[escaped:], words[first:])
    return packed, count + b"".join(part.astype("<u2").tobytes() for part in parts)


def read_stream(reader: GroupReader, longest_row: int) -> Stream:
    """The stream in the remaining bytes, to be decoded in rows of at most ``longest_row`` symbols.

    Raises InputError PTM-I112 if the bytes are none.
    """
    escapes = reader.numbers("<u2", reader.number(4))
    data = reader.rest()
    limit = len(data) // 2
    if limit < 8 or len(data) % 2:
        raise group_error("its stream is not a whole number of words")
    words = np.zeros(limit + longest_row + kernels.PADDING, np.uint16)
    words[:limit] = np.frombuffer(data, "<u2")
    return Stream(words, limit, escapes)


def check_end(result: int) -> None:
    """Raise InputError PTM-I112 for what a decoding pass returns, but for OK."""
    if result != OK:
        early = result == TRUNCATED
        raise group_error("its stream " + ("ends early" if early else "leads to impossible texels"))
