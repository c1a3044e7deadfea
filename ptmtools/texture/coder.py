"""The contract between the files of a `.ptm` and the coders of its tiles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Data = bytes | memoryview
Samples = NDArray[Any]
Shape = tuple[int, int, int]


@dataclass(frozen=True)
class Tile:
    """One tile, coded or decoded.

    Attributes
    ----------
    data: its bytes (empty after decoding).
    texels: (h, w, c), as a decoder has them. They equal the image's unless an error was allowed.
    memory: the state that an adaptive profile has learned from this tile and the ones before it;
        else None.
    """

    data: bytes
    texels: Samples
    memory: Any = None


@dataclass(frozen=True)
class Coding:
    """The conditions under which a tile is coded.

    Attributes
    ----------
    max_error: the largest error allowed; 0 is exact.
    memory: the state left by the tile of the level below; None at first.
    threads: how many work at once; the bytes do not depend on it.
    """

    max_error: int = 0
    memory: Any = None
    threads: int = 1


#: Exact, without a state.
PLAIN = Coding()


class Coder(Protocol):
    """The four functions of a profile's module, which code and decode tiles.

    All levels are C-contiguous (h, w, c) of uint8, uint16, float16 or float32. ``below`` is
    (h >> 1, w >> 1, c), the level below as a decoder has it: the mean of ``level`` unless an error
    is allowed. Decoding raises InputError (PTM-I112) where the bytes contradict the sizes or
    themselves; it never reads or writes outside its arrays.

    A level is one tile or several; a tile is coded as if there was nothing around it. The tiles of
    a level of several all start from the state of the last single tile, and their own states are
    dropped. A state is never changed in place.
    """

    def encode_base(self, level: Samples) -> bytes:
        """Codes the coarsest level, which has no level below, without error."""

    def decode_base(self, data: Data, shape: Shape, dtype: np.dtype[Any]) -> Samples:
        """The inverse of `encode_base`."""

    def encode_tile(self, level: Samples, below: Samples, coding: Coding = PLAIN) -> Tile:
        """Codes the refinement of ``below`` to ``level``, or to within the error of it."""

    def decode_tile(self, data: Data, below: Samples, shape: Shape, coding: Coding = PLAIN) -> Tile:
        """The inverse of `encode_tile`."""
