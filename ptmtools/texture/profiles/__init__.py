"""The profiles: ways of coding the levels of a file, declared in a table.

A profile is one value in `PROFILES` and one module, which turns a tile of a level, given the same
part of the level below, into bytes and back. The module knows nothing of files, checksums or
numbering; the container knows nothing of texels. Everything else that depends on the profile (what
the command line offers and says of it, which options it takes, what a file may declare) is read
from the table, so a new one needs its module and a line here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any, Protocol, cast

from ptmtools.lazy import Lazy

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Samples = NDArray[Any]
    Shape = tuple[int, int, int]


@dataclass(frozen=True)
class Profile:
    """A way of coding the levels of a file.

    Attributes
    ----------
    name: on the command line and in `EncodeOptions`.
    number: what stands for it in a file; never that of another, once files have been written.
    about: what it is for, in a few words, for the help.
    lossy: whether it can make use of an allowed error.
    since: the first version of the container that may hold it.
    ahead: what another process may compile while the coder compiles the first of its loops.
    module: the `Coder`, if not the module of this package that has the profile's name.
    """

    name: str
    number: int
    about: str
    lossy: bool = False
    since: int = 2
    ahead: Lazy[Callable[[], object]] | None = None
    module: str = ""

    @property
    def coder(self) -> Coder:
        """What codes and decodes; imported when it is first used."""
        return cast("Coder", import_module(self.module or f"{__name__}.{self.name}"))


#: All profiles, by name.
PROFILES = {
    profile.name: profile
    for profile in (
        Profile(
            "fast",
            1,
            "for streaming",
            lossy=True,
            since=1,
            ahead=Lazy(f"{__name__}.fast:compile_ahead"),
        ),
        Profile("small", 2, "for archives; smaller, but 30 to 60 times slower", lossy=True),
        Profile("raw", 0, "uncompressed, the layout of Marvie & Bouatouch, 2003", since=1),
        Profile("paper", 3, "the same with lossless JPEG, for comparison"),
    )
}


def profile_numbered(number: int) -> Profile | None:
    """The profile that a number in a file stands for, if there is one."""
    return next((profile for profile in PROFILES.values() if profile.number == number), None)


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


class Coder(Protocol):
    """What the module of a profile holds: four functions that code and decode tiles.

    All levels are C-contiguous (h, w, c) of uint8, uint16, float16 or float32. ``below`` is
    (h >> 1, w >> 1, c), the level below as a decoder has it: the mean of ``level`` unless
    ``max_error`` allows an error. Decoding raises InputError (PTM-I112) where the bytes contradict
    the sizes or themselves; it never reads or writes outside its arrays.

    A level is one tile or several; a tile is coded as if there was nothing around it. ``memory``
    is what the tile of the level below left, None at first; the tiles of a level of several all
    get what the last single tile left, and what they leave is dropped. It is never changed.
    """

    def encode_base(self, level: Samples) -> bytes:
        """The coarsest level, which has nothing below it; without error."""

    def decode_base(self, data: bytes | memoryview, shape: Shape, dtype: np.dtype[Any]) -> Samples:
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
        data: bytes | memoryview,
        below: Samples,
        shape: Shape,
        max_error: int = 0,
        memory: Any = None,
        threads: int = 1,
    ) -> Tile:
        """The inverse of `encode_tile`."""
