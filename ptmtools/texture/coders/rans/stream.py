"""Symbols as bytes and back: escapes, then the words of four rANS states.

Layout: number of escapes (4 bytes); the escapes (2 bytes each); the words (2 bytes each) to the
end, of which the first eight are the states. All little endian.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coders.rans import tables
from ptmtools.texture.coders.rans.sizes import OK, TRUNCATED, Sink
from ptmtools.texture.coders.reading import Reader, damaged


@dataclass(frozen=True)
class Stream:
    """A stream ready for `kernels.decode_row`.

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
    """For up to n symbols by so many tables."""
    counts = np.zeros((count, 256), np.int64)
    return Sink(np.empty(n, np.uint16), np.empty(n, np.uint8), counts)


def encode_symbols(sink: Sink, plain: int, family: tables.Family) -> tuple[bytes, bytes]:
    """The tables, as `tables.choose` finds them, and the stream of a full sink."""
    from ptmtools.texture.coders.rans import kernels

    symbols, contexts, counts = sink
    frequency, packed = tables.choose(counts, plain, family)
    words = np.empty(len(symbols) + 8, np.uint16)
    escapes = np.empty(len(symbols), np.uint16)
    work = np.empty((len(frequency), 256), np.uint64)
    first, escaped = kernels.encode(
        symbols, contexts, plain, frequency, work, np.empty(4, np.uint64), words, escapes
    )
    count = (len(escapes) - escaped).to_bytes(4, "little")
    parts = (escapes[escaped:], words[first:])
    return packed, count + b"".join(part.astype("<u2").tobytes() for part in parts)


def read_stream(reader: Reader, longest_row: int) -> Stream:
    """The stream in what is left, to be decoded in rows of at most ``longest_row`` symbols.

    Raises InputError PTM-I112 if the bytes are none.
    """
    from ptmtools.texture.coders.rans import kernels

    escapes = reader.numbers("<u2", reader.number(4))
    data = reader.rest()
    limit = len(data) // 2
    if limit < 8 or len(data) % 2:
        raise damaged("its stream is not a whole number of words")
    words = np.zeros(limit + longest_row + kernels.PADDING, np.uint16)
    words[:limit] = np.frombuffer(data, "<u2")
    return Stream(words, limit, escapes)


def check_end(result: int) -> None:
    """Raise InputError PTM-I112 for what a decoding pass returns, but for OK."""
    if result != OK:
        early = result == TRUNCATED
        raise damaged("its stream " + ("ends early" if early else "leads to impossible texels"))
