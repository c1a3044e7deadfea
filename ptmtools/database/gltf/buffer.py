"""The accessors of one GLB and the bytes behind them.

One buffer view for each kind of data: positions, texture coordinates, colours, wide indices,
narrow ones.
An array that was there before gets no second accessor. Vertices are in the order of their first
use, so rectangles of all sizes share their six indices, and often their texture coordinates: the
sample museum's files are 9 % smaller for it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

_FLOAT, _SHORT, _INT = 5126, 5123, 5125
_VERTICES, _INDICES = 34962, 34963
#: Narrow indices end before 65535, which restarts a primitive.
_NARROW = 65535
#: In the order of the views: component type, type, bytes of an element, target.
_KINDS = (
    (_FLOAT, "VEC3", 12, _VERTICES),
    (_FLOAT, "VEC2", 8, _VERTICES),
    (_SHORT, "VEC4", 8, _VERTICES),
    (_INT, "SCALAR", 4, _INDICES),
    (_SHORT, "SCALAR", 2, _INDICES),
)
_POSITION, _COORDINATE, _COLOR, _WIDE, _THIN = range(5)
#: Whole numbers below this are written without the ".0" that Python gives them.
_WHOLE = 1e15


class BufferWriter:
    """Gathers arrays; each method returns the index of the array's accessor."""

    def __init__(self) -> None:
        self._bytes: tuple[list[bytes], ...] = ([], [], [], [], [])
        self._size = [0, 0, 0, 0, 0]
        self._accessors: list[dict[str, Any]] = []
        self._known: dict[tuple[int, bytes], int] = {}

    def positions(self, point: NDArray[np.float32]) -> int:
        """(n, 3), with the bounds that glTF wants of them."""
        bounds = {
            "min": _numbers(point.min(axis=0)),
            "max": _numbers(point.max(axis=0)),
        }
        return self._add(_POSITION, point.astype("<f4").tobytes(), bounds)

    def coordinates(self, uv: NDArray[np.float32]) -> int:
        """(n, 2)."""
        return self._add(_COORDINATE, uv.astype("<f4").tobytes(), {})

    def colors(self, light: NDArray[np.float64]) -> int:
        """(n, 3) linear light from 0 to 1; 16 bits, as 8 would be too few in the dark."""
        held = np.full((len(light), 4), 65535, "<u2")
        held[:, :3] = np.rint(65535 * light)
        return self._add(_COLOR, held.tobytes(), {"normalized": True})

    def indices(self, triangle: NDArray[np.int64], vertices: int) -> int:
        """(m, 3) indices into so many vertices."""
        kind, form = (_THIN, "<u2") if vertices <= _NARROW else (_WIDE, "<u4")
        return self._add(kind, triangle.astype(form).tobytes(), {})

    def _add(self, kind: int, data: bytes, more: dict[str, Any]) -> int:
        place = self._known.setdefault((kind, data), len(self._accessors))
        if place == len(self._accessors):
            component, form, size, _ = _KINDS[kind]
            accessor: dict[str, Any] = {"bufferView": kind}
            if self._size[kind]:
                accessor["byteOffset"] = self._size[kind]
            accessor |= {"componentType": component, "count": len(data) // size, "type": form}
            self._accessors.append(accessor | more)
            self._bytes[kind].append(data)
            self._size[kind] += len(data)
        return place

    def finish(self) -> tuple[dict[str, Any], bytes]:
        """The members "accessors", "bufferViews" and "buffers" of the document, and the bytes."""
        if not self._accessors:
            return {}, b""
        views: list[dict[str, Any]] = []
        place: dict[int, int] = {}
        at = 0
        for kind, (_, _, size, target) in enumerate(_KINDS):
            if not self._size[kind]:
                continue
            place[kind] = len(views)
            view: dict[str, Any] = {"buffer": 0}
            if at:
                view["byteOffset"] = at
            view["byteLength"] = self._size[kind]
            # Vertex data that several accessors share must have it, indices must not.
            if target == _VERTICES and len(self._bytes[kind]) > 1:
                view["byteStride"] = size
            views.append(view | {"target": target})
            at += self._size[kind]
        members = {
            "accessors": [a | {"bufferView": place[a["bufferView"]]} for a in self._accessors],
            "bufferViews": views,
            "buffers": [{"byteLength": at}],
        }
        return members, b"".join(part for parts in self._bytes for part in parts)


def _numbers(values: NDArray[np.float32]) -> list[float]:
    """As the shortest decimals that read back to the same float32."""
    shortest = [float(str(v)) for v in values]
    return [int(v) if v.is_integer() and abs(v) < _WHOLE else v for v in shortest]
