"""The profiles, ways of coding the levels of a file, and the table that declares them.

A profile is one value in `PROFILES` and one module, which turns a tile of a level, given the same
part of the level below, into bytes and back. The module knows nothing of files, checksums or
numbering; the container knows nothing of texels. Everything else that depends on the profile (its
entry and help on the command line, its options, the values a file may declare) is read from the
table, so a new one needs its module and a line here.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, cast

if TYPE_CHECKING:
    from ptmtools.texture.coder import Coder


@dataclass(frozen=True)
class Profile:
    """A way of coding the levels of a file.

    Attributes
    ----------
    name: on the command line and in `EncodeOptions`.
    number: its number in files; never reused for another profile.
    about: its purpose in a few words, for the help.
    lossy: whether it can make use of an allowed error.
    since: the first version of the container that may hold it.
    module: the `Coder`, if not the module of this package that has the profile's name.
    """

    name: str
    number: int
    about: str
    lossy: bool = False
    since: int = 2
    module: str = ""

    @property
    def coder(self) -> Coder:
        """The coder; imported when first used."""
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
        ),
        Profile("small", 2, "for archives; smaller, but 30 to 60 times slower", lossy=True),
        Profile("raw", 0, "uncompressed, the layout of Marvie & Bouatouch, 2003", since=1),
        Profile("paper", 3, "the layout of raw with lossless JPEG, for comparison"),
    )
}


def profile_numbered(number: int) -> Profile | None:
    """The profile with a number in files, or None."""
    return next((profile for profile in PROFILES.values() if profile.number == number), None)
