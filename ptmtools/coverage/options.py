"""The knobs of the coverage hints."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, get_args

from ptmtools.errors import InputError

Backend = Literal["auto", "gl", "embree"]

#: The widest view in pixels a side: six of them side by side are within what OpenGL 4 guarantees
#: for a render target (16384).
MAX_FACE = 2048
#: Sample points a cell: their cloud stays within a few hundred megabytes.
MAX_SAMPLES = 2**14


@dataclass(frozen=True)
class AchOptions:
    """How coverage is sampled.

    Attributes
    ----------
    samples: sample points a cell; the paper uses 8.
    face: pixels a side of each of the six views. Positions matter far more: ask for more samples
        before a larger face.
    backend: "gl" (OpenGL), "embree" (rays on the processor), or "auto": whichever is there and
        expected to be faster.
    clearance: metres that a sample point keeps from every surface; if not given, a quarter of
        the least thickness that a cell may have.
    seed: which stretch of the sequence of sample points is taken.
    workers: threads of the embree backend, None for one per processor; never changes the result.
    """

    samples: int = 8
    face: int = 64
    backend: Backend = "auto"
    clearance: float | None = None
    seed: int = 0
    workers: int | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        """Raises `InputError` PTM-I500 for a value that makes no sense."""
        self._within("samples", self.samples, 1, MAX_SAMPLES)
        self._within("face", self.face, 1, MAX_FACE)
        self._within("seed", self.seed, 0, 2**32 - 1)
        self._within("workers", 1 if self.workers is None else self.workers, 1, 1024)
        if self.backend not in get_args(Backend):
            known = ", ".join(get_args(Backend))
            raise InputError("PTM-I500", f"no backend '{self.backend}'", remedy=f"one of {known}")
        if self.clearance is not None and not 0 < self.clearance < float("inf"):
            raise InputError(
                "PTM-I500",
                f"a clearance of {self.clearance} m makes no sense",
                remedy="give a distance above 0",
            )

    @staticmethod
    def _within(name: str, value: int, low: int, high: int) -> None:
        if not low <= value <= high:
            raise InputError(
                "PTM-I500", f"{name} is {value}", remedy=f"give a number from {low} to {high}"
            )
