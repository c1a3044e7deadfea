"""A value as one block of bytes in which its arrays lie whole and aligned.

So a process that maps the block, or has received it, uses the arrays where they lie. (Pickle's
out-of-band buffers, PEP 574.) Layout: 8 bytes with the length of the index, the index (a pickled
list of lengths), then a pickle and the buffers it refers to, each from a multiple of 64.
"""

from __future__ import annotations

import pickle
from collections.abc import Iterator, Sequence
from typing import Any

ALIGNMENT = 64
#: Smaller buffers stay in the pickle.
LEAST = 1 << 12

Piece = bytes | memoryview


def packed(value: object) -> list[Piece]:
    """The block in pieces, to be written one after the other; they share memory with ``value``."""
    buffers: list[memoryview] = []

    def taken(buffer: pickle.PickleBuffer) -> bool:
        raw = buffer.raw()
        if raw.nbytes < LEAST:
            return True
        buffers.append(raw)
        return False

    stream = pickle.dumps(value, protocol=5, buffer_callback=taken)
    index = pickle.dumps([len(stream), *(b.nbytes for b in buffers)])
    parts: list[Piece] = [len(index).to_bytes(8, "little") + index, stream, *buffers]
    return [piece for part in parts for piece in (part, bytes(-_size(part) % ALIGNMENT)) if piece]


def size(pieces: Sequence[Piece]) -> int:
    """Bytes of a block."""
    return sum(map(_size, pieces))


def unpacked(block: memoryview) -> Any:
    """The value. Its arrays are those in the ``block``, to be changed if that can be written."""
    end = 8 + int.from_bytes(block[:8], "little")
    stream, *buffers = _parts(block, end, pickle.loads(block[8:end]))
    return pickle.loads(stream, buffers=buffers)


def _parts(block: memoryview, at: int, lengths: Sequence[int]) -> Iterator[memoryview]:
    for length in lengths:
        at += -at % ALIGNMENT
        yield block[at : at + length]
        at += length


def _size(piece: Piece) -> int:
    return piece.nbytes if isinstance(piece, memoryview) else len(piece)
