"""The ways of coding a group: one small interface, one file for each profile.

A profile turns a tile of a level, given the same part of the level below, into bytes and back. It
knows nothing of files, checksums or numbering; the container knows nothing of texels. A profile is
a frozen value: what a decoder has to know about it (its number) stands in the file.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Samples = NDArray[Any]
    Shape = tuple[int, int, int]

#: Profiles by name, with the number that stands for each in a file.
PROFILE_NUMBERS = {"raw": 0, "fast": 1, "small": 2, "paper": 3}

#: Those that cannot make use of an allowed error.
EXACT_PROFILES = ("raw", "paper")


@dataclass(frozen=True)
class Tile:
    """One tile, coded or decoded.

    Attributes
    ----------
    data: its bytes (empty after decoding).
    texels: (h, w, c), as a decoder has them. They are those of the image unless an error was
        allowed.
    memory: what an adaptive profile has learned from this tile and those before it; else None.
    """

    data: bytes
    texels: Samples
    memory: Any = None


class Profile(Protocol):
    """How the groups of a file are coded.

    All levels are C-contiguous (h, w, c) of uint8, uint16, float16 or float32. ``below`` is
    (h >> 1, w >> 1, c), the level below as a decoder has it: the mean of ``level`` unless
    ``max_error`` allows an error. Decoding raises InputError (PTM-I112) where the bytes contradict
    the sizes or themselves; it never reads or writes outside its arrays.

    A level is one tile or several; a tile is coded as if there was nothing around it. ``memory``
    is what the tile of the level below left, None at first; the tiles of a level of several all
    get what the last single tile left, and what they leave is dropped. It is never changed.
    """

    @property
    def name(self) -> str:
        """As in `PROFILE_NUMBERS`."""

    def encode_base(self, level: Samples) -> bytes:
        """The coarsest level, which has nothing below it; without error."""

    def decode_base(self, data: bytes, shape: Shape, dtype: np.dtype[Any]) -> Samples:
        """The inverse of `encode_base`."""

    def encode_tile(
        self,
        level: Samples,
        below: Samples,
        max_error: int = 0,
        memory: Any = None,
        threads: int = 1,
    ) -> Tile:
        """What refines ``below`` to ``level``, or to within ``max_error`` of it."""

    def decode_tile(
        self,
        data: bytes,
        below: Samples,
        shape: Shape,
        max_error: int = 0,
        memory: Any = None,
        threads: int = 1,
    ) -> Tile:
        """The inverse of `encode_tile`."""


def profile_named(name: str) -> Profile:
    """The profile of that name, one of `PROFILE_NUMBERS`."""
    module = import_module(f"{__name__}.{name}")
    profile: Profile = getattr(module, f"{name.capitalize()}Profile")()
    return profile
