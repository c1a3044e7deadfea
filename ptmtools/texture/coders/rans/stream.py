"""Symbols as bytes and back: escapes, then the words of four rANS states.

Layout: number of escapes (4 bytes); the escapes (2 bytes each); the words (2 bytes each) to the
end, of which the first eight are the states. All little endian.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coders.damage import damaged
from ptmtools.texture.coders.rans.tables import Frequencies


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


def encode_symbols(
    symbols: NDArray[np.uint16], contexts: NDArray[np.uint8], frequency: Frequencies, plain: int
) -> bytes:
    """The stream of ``symbols`` (n,), each by the table that ``contexts`` (n,) names.

    ``frequency`` (tables, 256) comes from `tables.choose`; tables from ``plain`` on have no escape.
    """
    from ptmtools.texture.coders.rans import kernels

    words = np.empty(len(symbols) + 8, np.uint16)
    escapes = np.empty(len(symbols), np.uint16)
    work = np.empty((len(frequency), 256), np.uint64)
    first, escaped = kernels.encode(
        symbols, contexts, plain, frequency, work, np.empty(4, np.uint64), words, escapes
    )
    return b"".join(
        [
            (len(escapes) - escaped).to_bytes(4, "little"),
            escapes[escaped:].astype("<u2").tobytes(),
            words[first:].astype("<u2").tobytes(),
        ]
    )


def read_stream(data: bytes | memoryview, longest_row: int) -> Stream:
    """The stream in ``data``, to be decoded in rows of at most ``longest_row`` symbols.

    Raises InputError PTM-I112 if the bytes are none.
    """
    from ptmtools.texture.coders.rans import kernels

    escaped = int.from_bytes(data[:4], "little")
    begin = 4 + 2 * escaped
    if len(data) < begin + 16 or len(data) % 2:
        raise damaged("its stream is not a whole number of words")
    limit = (len(data) - begin) // 2
    words = np.empty(limit + longest_row + kernels.PADDING, np.uint16)
    words[limit:] = 0
    words[:limit] = np.frombuffer(data, "<u2", offset=begin)
    escapes = np.frombuffer(data, "<u2", escaped, 4).astype(np.uint16)
    return Stream(words, limit, escapes)
