"""The ways of coding a group: one small interface, two profiles.

A profile turns a level, given the level below, into bytes and back. It knows nothing of files,
checksums or numbering; the container knows nothing of texels. A profile is a frozen value: what a
decoder has to know about it (its number) stands in the file.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

#: Profiles by name, with the number that stands for each in a file.
PROFILE_NUMBERS = {"raw": 0, "fast": 1}


class Profile(Protocol):
    """How the groups of a file are coded.

    All levels are C-contiguous (h, w, c) uint8. Decoding raises InputError (PTM-I112) where the
    bytes contradict the sizes or themselves; it never reads or writes outside its arrays.
    """

    @property
    def name(self) -> str:
        """As in `PROFILE_NUMBERS`."""

    def encode_base(self, level: NDArray[np.uint8]) -> bytes:
        """The coarsest level, which has nothing below it."""

    def decode_base(self, data: bytes, shape: tuple[int, int, int]) -> NDArray[np.uint8]:
        """The inverse of `encode_base`."""

    def encode_group(self, level: NDArray[np.uint8], below: NDArray[np.uint8]) -> bytes:
        """What refines ``below`` (h >> 1, w >> 1, c) to ``level`` (h, w, c)."""

    def decode_group(
        self, data: bytes, below: NDArray[np.uint8], shape: tuple[int, int, int]
    ) -> NDArray[np.uint8]:
        """The inverse of `encode_group`."""


def profile_named(name: str) -> Profile:
    """The profile of that name, one of `PROFILE_NUMBERS`."""
    if name == "raw":
        from ptmtools.texture.profiles.raw import RawProfile

        return RawProfile()
    from ptmtools.texture.profiles.fast import FastProfile

    return FastProfile()
