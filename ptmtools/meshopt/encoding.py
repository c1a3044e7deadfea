"""Encodes buffer views with meshopt: attributes and triangles, for EXT_meshopt_compression.

Implemented from the text of the extension (appendix A). Attributes are of version 0 and triangles
of version 1, which every decoder of EXT_meshopt_compression reads; version 1 of attributes belongs
to KHR_meshopt_compression. `reorder` gives the order of triangles and vertices that the codecs
are made for: neighbours one after the other, new vertices by number.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_ATTRIBUTES, _TRIANGLES = 0xA0, 0xE1
#: Smallest size of the tail of attributes, bytes; entries of the table of pairs, and its bytes.
_TAIL, _PAIRS, _TABLE = 32, 14, 16
#: All widths of deltas: 2 and 4 bits, apart from 0 and 8.
ALL_WIDTHS = 6


def encode_attributes(element: NDArray[np.uint8], widths: int = ALL_WIDTHS) -> bytes:
    """Mode ATTRIBUTES of (count, stride) elements; the stride is a multiple of 4, at most 256.

    ``widths``: a sum of 2 and 4, the widths of deltas in bits that are used beside 0 and 8. With
    fewer the stream is longer, and often shorter once gzip has compressed it.

    Raises ValueError for another stride or no elements.
    """
    from ptmtools.meshopt.encoding_kernels import encode_attributes as encode

    count, stride = element.shape
    if count == 0 or stride % 4 or not 4 <= stride <= 256:
        raise ValueError(f"{count} elements with a stride of {stride}")
    element = np.ascontiguousarray(element)
    # A group takes at most its 16 bytes; a block of 16 groups a head of 4.
    out = np.empty(stride * (count + 32) * 2, dtype=np.uint8)
    size = encode(element, widths, out)
    first: bytes = element[0].tobytes()
    tail = first.rjust(max(_TAIL, stride), b"\0")
    return b"".join([bytes([_ATTRIBUTES]), out[:size].tobytes(), tail])


def exponential(steps: NDArray[np.integer], exponent: NDArray[np.integer]) -> NDArray[np.uint8]:
    """Elements for the filter EXPONENTIAL: (n, k) whole numbers of 24 bits with a sign, which
    decode to float32 as ``steps`` * 2 ** ``exponent``, exactly; exponents from -126 to 127.

    Returns (n, 4 k) bytes.
    """
    high = np.asarray(exponent, dtype=np.int64) & 0xFF
    bits = (steps.astype(np.int64) & 0xFFFFFF) | high << 24
    return np.ascontiguousarray(bits.astype("<u4")).view(np.uint8).reshape(len(steps), -1)


def encode_triangles(triangle: NDArray[np.integer]) -> bytes:
    """Mode TRIANGLES of (m, 3) indices. Decoders turn each triangle: it may begin with another of
    its corners, with the same winding.

    Raises ValueError for an index that 32 bits do not hold, or no triangles.
    """
    from ptmtools.meshopt.encoding_kernels import encode_triangles as encode

    corner = np.ascontiguousarray(triangle, dtype=np.int64)
    if not corner.size or corner.min() < 0 or corner.max() >= 1 << 32:
        raise ValueError(f"{len(corner)} triangles, or an index outside 32 bits")
    out = np.empty(17 * len(corner), dtype=np.uint8)
    table, frequency = np.zeros(_PAIRS, dtype=np.uint8), np.zeros(256, dtype=np.int64)
    encode(corner, table, frequency, out)
    frequent = np.argsort(-frequency[1:], kind="stable")[: _PAIRS - 1] + 1
    table[1:] = np.where(frequency[frequent] > 1, frequent, 0)
    size = encode(corner, table, frequency, out)
    head = bytes([_TRIANGLES])
    return head + out[:size].tobytes() + table.tobytes().ljust(_TABLE, b"\0")


def reorder(triangle: NDArray[np.integer]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Reorders the triangles and vertices of a mesh.

    Each triangle shares one of the 15 latest edges, if any that is left does: the first of these in
    the mesh, which keeps the patterns of its coordinates; where that makes the stream of triangles
    a tenth longer, because neighbours are far apart in the mesh, the one at the latest edge.
    Vertices are numbered by their first use.

    Returns (k,) the old number of each vertex in use, and (m, 3) the triangles of new numbers.
    """
    from ptmtools.meshopt.encoding_kernels import strip_order

    corner = np.ascontiguousarray(triangle, dtype=np.int64)
    holder = np.argsort(corner.ravel(), kind="stable")
    vertices = int(corner.max(initial=-1)) + 1
    start = np.searchsorted(corner.ravel()[holder], np.arange(vertices + 1))
    results = []
    for earliest in (True, False):
        order = np.empty(len(corner), dtype=np.int64)
        strip_order(corner, start, holder // 3, earliest, order)
        results.append(by_first_use(corner[order]))
    sizes = [len(encode_triangles(again)) for _, again in results]
    return results[int(10 * sizes[0] > 11 * sizes[1])]


def by_first_use(corner: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The distinct values of an (m, 3) array, in the order in which they come, and (m, 3) where
    each is among them."""
    distinct, first, place = np.unique(corner.ravel(), return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return distinct[order], rank[place.ravel()].reshape(-1, 3)
