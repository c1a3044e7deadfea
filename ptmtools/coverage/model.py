"""Average Coverage Hints, aligned with the potentially visible sets."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Ach:
    """Coverage hints of every cell (paper §5).

    Attributes
    ----------
    start: (C + 1,) int64 CSR over cells, equal to the PVS's.
    value: (n,) float64 share of the covered pixels, aligned with `Pvs.cell`; a row sums to 1. A
        cell none of whose pixels was covered has 1 for itself.
    pixels: (n,) int64 the pixels counted, N_j of the paper.
    missed: (C,) float64 share of the covered pixels that fell on cells outside the PVS, or on
        what belongs to no cell.
    samples: (C,) int32 sample points used.
    rejected: (C,) int32 sample points rejected: inside matter, or too near to a surface.
    backend: "gl" or "embree".
    renderer: the renderer's own name, for the record.
    """

    start: NDArray[np.int64]
    value: NDArray[np.float64]
    pixels: NDArray[np.int64]
    missed: NDArray[np.float64]
    samples: NDArray[np.int32]
    rejected: NDArray[np.int32]
    backend: str
    renderer: str

    def row(self, i: int) -> NDArray[np.float64]:
        """The hints of cell ``i``, aligned with row ``i`` of the PVS."""
        return self.value[self.start[i] : self.start[i + 1]]

    def to_arrays(self) -> dict[str, NDArray[np.generic]]:
        """The hints as plain arrays."""
        about = json.dumps({"backend": self.backend, "renderer": self.renderer}, sort_keys=True)
        return {
            "start": self.start,
            "value": self.value,
            "pixels": self.pixels,
            "missed": self.missed,
            "samples": self.samples,
            "rejected": self.rejected,
            "about": np.frombuffer(about.encode(), dtype=np.uint8),
        }

    @staticmethod
    def from_arrays(arrays: Mapping[str, NDArray[np.generic]]) -> Ach:
        """Inverse of `to_arrays`."""
        about = json.loads(bytes(np.asarray(arrays["about"], dtype=np.uint8)).decode())
        return Ach(
            start=np.asarray(arrays["start"], dtype=np.int64),
            value=np.asarray(arrays["value"], dtype=np.float64),
            pixels=np.asarray(arrays["pixels"], dtype=np.int64),
            missed=np.asarray(arrays["missed"], dtype=np.float64),
            samples=np.asarray(arrays["samples"], dtype=np.int32),
            rejected=np.asarray(arrays["rejected"], dtype=np.int32),
            backend=about["backend"],
            renderer=about["renderer"],
        )
