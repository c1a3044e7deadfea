"""Accessors of glTF 2.0: the numbers of a buffer, as an accessor and its buffer view describe them.

Sections 3.6.1 and 3.6.2 of the specification. Everything that a file says is held against the
bytes that are there before an array is made; nothing is copied.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Component types, and how many components an element has.
COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
ITEMS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}


def elements(
    accessor: Mapping[str, Any], view: Mapping[str, Any], data: bytes | memoryview
) -> NDArray[Any]:
    """(count, items) the elements of an accessor whose buffer view lies in ``data``, as stored.

    Raises ValueError if it has no elements or ends beyond its view or the data, and KeyError for a
    member that is missing or another component type than those of `COMPONENTS`.
    """
    kind, items = np.dtype(COMPONENTS[accessor["componentType"]]), ITEMS[accessor["type"]]
    begin, length = natural(view.get("byteOffset", 0)), natural(view["byteLength"])
    first, count = natural(accessor.get("byteOffset", 0)), natural(accessor["count"])
    size = items * kind.itemsize
    stride = natural(view.get("byteStride", size))
    if begin + length > len(data):
        raise ValueError(f"a view of {length} bytes from byte {begin} ends beyond {len(data)}")
    if count < 1 or stride < size or first + (count - 1) * stride + size > length:
        raise ValueError(f"{count} elements from byte {first} end beyond a view of {length}")
    return np.ndarray((count, items), kind, data, begin + first, (stride, kind.itemsize))


def meaning(stored: NDArray[Any], normalized: bool) -> NDArray[np.float64]:
    """What stored numbers mean: normalised integers are shares (section 3.6.2.2)."""
    values = stored.astype(np.float64)
    if normalized and stored.dtype.kind != "f":
        values = np.maximum(values / np.iinfo(stored.dtype).max, -1.0)
    return values


def natural(value: object) -> int:
    """The value, if it is an index or a size; ValueError otherwise."""
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise ValueError(f"{value!r} is not an index or a size")
    return value
