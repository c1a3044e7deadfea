"""Decodes buffer views compressed with meshopt (EXT_meshopt_compression, KHR_meshopt_compression).

Implemented from the texts of the extensions (appendices A and B). Of the bindings on PyPI the only
one that installs without a compiler was a month old; the format is small and stable.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.glb import natural

EXTENSIONS = ("KHR_meshopt_compression", "EXT_meshopt_compression")
_ATTRIBUTES, _TRIANGLES, _INDICES = 0xA0, 0xE1, 0xD1
#: Smallest size of the tail by version, in bytes, with the zeros before it.
_TAIL = (32, 24)


def decode(data: bytes, extension: Mapping[str, Any]) -> bytes:
    """The bytes of a buffer view.

    ``extension`` is the object of the view with mode, filter, ``count`` and ``byteStride``. Raises
    ValueError if these contradict each other or the data, and KeyError if one is missing. The
    allocated memory is bounded by the number of elements that the data can encode.
    """
    count, stride = natural(extension["count"]), natural(extension["byteStride"])
    mode, filtered = extension["mode"], extension.get("filter", "NONE")
    stream = np.frombuffer(data, np.uint8)
    if mode == "ATTRIBUTES":
        strides, restore = _FILTERS.get(filtered, ((), None))
        if restore is None or stride not in strides:
            raise ValueError(f"meshopt filter {filtered!r} with a stride of {stride}")
        return restore(_attributes(stream, count, stride)).tobytes()
    if filtered != "NONE" or stride not in (2, 4):
        raise ValueError(f"meshopt mode {mode} with filter {filtered} and a stride of {stride}")
    if mode == "TRIANGLES":
        indices = _triangles(stream, count)
    elif mode == "INDICES":
        indices = _indices(stream, count)
    else:
        raise ValueError(f"meshopt mode {mode!r}")
    return (indices.astype(np.uint16) if stride == 2 else indices).tobytes()


def _check(place: int, mode: str) -> None:
    if place >= 0:
        raise ValueError(f"meshopt {mode}: damaged at byte {place}")


def _attributes(stream: NDArray[np.uint8], count: int, stride: int) -> NDArray[np.uint8]:
    """(count, stride)"""
    from ptmtools.meshopt.decoding_kernels import BLOCK, BLOCK_BYTES, GROUP, decode_attributes

    if not len(stream) or (version := int(stream[0]) - _ATTRIBUTES) not in (0, 1):
        raise ValueError("meshopt attributes: not of version 0 or 1")
    end = len(stream) - max(_TAIL[version], stride + stride // 4 * version)
    block = min(BLOCK_BYTES // stride // GROUP * GROUP, BLOCK)
    # Smallest size of a full block: its control bytes, or two bits for every group of a byte.
    least = stride // 4 if version else stride * -(-block // (4 * GROUP))
    if end < 1 + count // block * least:
        raise ValueError(f"meshopt attributes: {len(stream)} bytes for {count} elements")
    out = np.empty((count, stride), dtype=np.uint8)
    _check(decode_attributes(stream, end, version, stride, out), "attributes")
    return out


def _triangles(stream: NDArray[np.uint8], count: int) -> NDArray[np.uint32]:
    """(count,)"""
    from ptmtools.meshopt.decoding_kernels import decode_triangles

    if count % 3 or len(stream) < 1 + count // 3 + 16 or stream[0] != _TRIANGLES:
        raise ValueError(f"meshopt triangles: {len(stream)} bytes for {count} indices")
    table = stream[-16:]
    if table[-2:].any() or (table & 15 == 15).any() or (table >> 4 == 15).any():
        raise ValueError("meshopt triangles: a damaged table")
    out = np.empty(count, dtype=np.uint32)
    _check(decode_triangles(stream, out), "triangles")
    return out


def _indices(stream: NDArray[np.uint8], count: int) -> NDArray[np.uint32]:
    """(count,)"""
    from ptmtools.meshopt.decoding_kernels import decode_indices

    if len(stream) < 1 + count + 4 or stream[0] != _INDICES:
        raise ValueError(f"meshopt indices: {len(stream)} bytes for {count} indices")
    out = np.empty(count, dtype=np.uint32)
    _check(decode_indices(stream, out), "indices")
    return out


def _signed_view(elements: NDArray[np.uint8]) -> NDArray[np.signedinteger[Any]]:
    """(count, 4) the components of elements of 4 or 8 bytes."""
    return elements.view(np.int8 if elements.shape[1] == 4 else np.int16)


def _round(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """To the nearest integer, halves away from zero."""
    return np.trunc(values + np.copysign(0.5, values))


def _octahedral(elements: NDArray[np.uint8]) -> NDArray[Any]:
    """Unit vectors of two components and the value that represents 1."""
    stored = _signed_view(elements)
    scale = np.iinfo(stored.dtype).max
    unit = np.where(stored[:, 2] == 0, 1, stored[:, 2]).astype(np.float64)
    x, y = stored[:, 0] / unit, stored[:, 1] / unit
    z = 1 - np.abs(x) - np.abs(y)
    below = np.minimum(z, 0)
    vector = np.stack([x - np.copysign(below, x), y - np.copysign(below, y), z], axis=1)
    vector /= np.maximum(np.linalg.norm(vector, axis=1), np.finfo(np.float64).tiny)[:, None]
    result = stored.copy()
    result[:, :3] = _round(vector * scale)
    return result


def _quaternion(elements: NDArray[np.uint8]) -> NDArray[Any]:
    """Unit quaternions stored without their largest component."""
    stored = elements.view(np.int16)
    unit = (stored[:, 3] | 3).astype(np.float64)
    rest = stored[:, :3] / unit[:, None] / np.sqrt(2)
    largest = np.sqrt(np.maximum(0, 1 - (rest**2).sum(axis=1)))
    result = np.empty_like(stored)
    values = np.clip(_round(np.column_stack([largest, rest]) * 32767), -32768, 32767)
    place = ((stored[:, 3] & 3)[:, None] + np.arange(4)) % 4
    np.put_along_axis(result, place.astype(np.int64), values.astype(np.int16), axis=1)
    return result


def _exponential(elements: NDArray[np.uint8]) -> NDArray[Any]:
    """float32 from an exponent of 8 bits and a mantissa of 24."""
    stored = elements.view("<i4")
    values: NDArray[Any] = np.ldexp(((stored << 8) >> 8).astype(np.float32), stored >> 24)
    return values.astype("<f4")


def _color(elements: NDArray[np.uint8]) -> NDArray[Any]:
    """Red, green, blue and alpha from luma, two chrominances and alpha with a leading 1."""
    stored = _signed_view(elements)
    kind = np.dtype(f"u{stored.dtype.itemsize}")
    orange, green = stored[:, 1].astype(np.int64), stored[:, 2].astype(np.int64)
    luma, alpha = (stored[:, k].view(kind).astype(np.int64) for k in (0, 3))
    # The highest bit of alpha marks the number of bits.
    scale = (1 << np.frexp(np.maximum(alpha, 1))[1].astype(np.int64)) - 1
    alpha &= scale >> 1
    alpha = alpha << 1 | alpha & 1
    values = np.stack([luma + orange - green, luma + green, luma - orange - green, alpha], axis=1)
    largest = np.iinfo(kind).max
    return np.clip(_round(values * (largest / scale)[:, None]), 0, largest).astype(kind)


_Filter = Callable[[NDArray[np.uint8]], NDArray[Any]]
#: Valid strides and inverse of each filter.
_FILTERS: dict[str, tuple[Sequence[int], _Filter]] = {
    "NONE": (range(4, 257, 4), lambda elements: elements),
    "OCTAHEDRAL": ((4, 8), _octahedral),
    "QUATERNION": ((8,), _quaternion),
    "EXPONENTIAL": (range(4, 257, 4), _exponential),
    "COLOR": ((4, 8), _color),
}
