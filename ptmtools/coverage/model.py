"""Average Coverage Hints, aligned with the potentially visible sets."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints
from ptmtools.store.archive import Stored, texts


@dataclass(frozen=True)
class Ach:
    """Coverage hints of every cell (paper §5).

    An entry is a cell and one of its PVS; entries are aligned with `Pvs.cell`.

    Attributes
    ----------
    start: (C + 1,) int64 CSR over cells, equal to the PVS's.
    value: (n,) float64 share of the covered pixels; a row sums to 1. A cell without covered pixels
        has 1 for itself.
    pixels: (n,) float64 the pixels counted, N_j of the paper; weighted, on request, by their solid
        angle over that of a pixel in the middle of a view.
    error: (n,) float64 standard error of `value`; NaN for an entry that no point saw (see
        `unseen_below`) and where there was one sample point only.
    p95: (n,) float64 the share that is exceeded from at most 5 % of the sample points.
    seen: (n,) float64 share of the sample points from which the entry was seen.
    views: (n, 6) float64 the same as `value` for each of the six views alone: +x, -x, +y, -y, +z,
        -z.
    missed: (C,) float64 share of the covered pixels that fell on cells outside the PVS, or on
        surfaces of no cell.
    samples: (C,) int32 sample points used.
    rejected: (C,) int32 sample points rejected: inside a solid, or too near to a surface.
    uncertain: (C,) float64 bound of the total variation between the row and the truth, at about
        95 %; NaN with fewer than eight sample points.
    unseen_below: (C,) float64 an entry that no point saw is seen from less than this share of the
        cell, at 95 % (rule of three).
    floor: (C,) float64 the value that a client may assume for an entry that no point saw: half a
        pixel's share.
    texture_start, texture, texture_value: (n + 1,) int64 CSR over entries, (m,) int32 images of the
        scene, -1 for surfaces without one, ascending within an entry, and (m,) float64 their
        shares, which sum to the entry's `value`. Empty unless asked for.
    backend: the backend that drew, a name in `BACKENDS`.
    renderer: the renderer's own name, for the record.
    """

    start: Ints
    value: Floats
    pixels: Floats
    error: Floats
    p95: Floats
    seen: Floats
    views: Floats
    missed: Floats
    samples: NDArray[np.int32]
    rejected: NDArray[np.int32]
    uncertain: Floats
    unseen_below: Floats
    floor: Floats
    texture_start: Ints
    texture: NDArray[np.int32]
    texture_value: Floats
    backend: str
    renderer: str

    def row(self, i: int) -> Floats:
        """The hints of cell ``i``, aligned with row ``i`` of the PVS."""
        return self.value[self.entries(i)]

    def entries(self, i: int) -> slice:
        """The slice of the entries of cell ``i``."""
        return slice(int(self.start[i]), int(self.start[i + 1]))

    @property
    def by_texture(self) -> bool:
        """Whether shares of textures were measured."""
        return len(self.texture_start) > 0

    def to_arrays(self) -> dict[str, NDArray[np.generic]]:
        """The hints as plain arrays."""
        arrays = {f.name: getattr(self, f.name) for f in fields(self)}
        about = {"backend": arrays.pop("backend"), "renderer": arrays.pop("renderer")}
        text = json.dumps(about, sort_keys=True)
        return {**arrays, "about": np.frombuffer(text.encode(), dtype=np.uint8)}

    @staticmethod
    def from_arrays(arrays: Mapping[str, NDArray[np.generic]]) -> Ach:
        """Inverse of `to_arrays`.

        Raises KeyError, TypeError or ValueError for invalid arrays.
        """
        stored = Stored(arrays)
        about = json.loads(stored.array("about", np.uint8, None).tobytes().decode())
        backend, renderer = texts([about["backend"], about["renderer"]], "backend and renderer")
        value = stored.array("value", np.float64, None, finite=True)
        n = len(value)
        start = stored.starts("start", None, n)
        cells = len(start) - 1
        reals = {name: stored.array(name, np.float64, n) for name in ("error", "p95", "seen")}
        bounds = ("missed", "uncertain", "unseen_below", "floor")
        reals |= {name: stored.array(name, np.float64, cells) for name in bounds}
        textures = stored.indices("texture", np.int32, None, low=-1, high=1 << 31)
        texture_start = stored.array("texture_start", np.int64, None)
        if len(texture_start) or len(textures):
            stored.starts("texture_start", n, len(textures))
        return Ach(
            start=start,
            value=value,
            pixels=stored.array("pixels", np.float64, n, finite=True),
            views=stored.array("views", np.float64, n, 6),
            samples=stored.array("samples", np.int32, cells),
            rejected=stored.array("rejected", np.int32, cells),
            **reals,
            texture_start=texture_start,
            texture=textures,
            texture_value=stored.array("texture_value", np.float64, len(textures)),
            backend=backend,
            renderer=renderer,
        )
