"""The profiles, ways of coding the levels of a file, and the table that declares them.

A profile is one value in `PROFILES` and one module, which turns a tile of a level, given the same
part of the level below, into bytes and back. The module knows nothing of files, checksums or
numbering; the container knows nothing of texels. Everything else that depends on the profile (its
entry and help on the command line, its options, the values a file may declare) is read from the
table, so a new one needs its module and a line here, or an entry point of the group
``ptmtools.profiles`` in another package (`ptmtools.plugins`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, cast

from ptmtools import plugins
from ptmtools.errors import MissingComponentError

if TYPE_CHECKING:
    from ptmtools.texture.coder import Coder


@dataclass(frozen=True)
class Profile:
    """A way of coding the levels of a file.

    Attributes
    ----------
    name: on the command line, in `EncodeOptions` and of the entry point, if it has one.
    number: its number in files, 0 to 255; never reused for another profile. Those from 128 on are
        left to other packages.
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
        """The coder; imported when first used. Raises MissingComponentError PTM-M110 where it
        cannot be imported."""
        try:
            return cast("Coder", import_module(self.module or f"{__name__}.{self.name}"))
        except ImportError as fault:
            raise MissingComponentError(
                "PTM-M110",
                f"the coder of the texture profile {self.name!r} cannot be imported ({fault})",
                remedy="update or uninstall the package that declares the profile",
            ) from fault


class Profiles(Mapping[str, Profile]):
    """Profiles by name: those of ptmtools, then those of the entry points.

    Entry points are read when all names are asked for, or one that ptmtools does not have. All
    methods that read them raise MissingComponentError PTM-M110 for a plug-in that cannot be used or
    whose profile has the name or number of another.
    """

    def __init__(self, *profiles: Profile) -> None:
        self.built_in: Mapping[str, Profile] = {profile.name: profile for profile in profiles}

    def __getitem__(self, name: str) -> Profile:
        return self.built_in.get(name) or self._plugins()[name]

    def __iter__(self) -> Iterator[str]:
        yield from self.built_in
        yield from self._plugins()

    def __len__(self) -> int:
        return len(self.built_in) + len(self._plugins())

    def by_number(self, number: int) -> Profile | None:
        """The profile with a number in files, or None."""

        def find(profiles: Mapping[str, Profile]) -> Profile | None:
            return next(
                (profile for profile in profiles.values() if profile.number == number), None
            )

        return find(self.built_in) or find(self._plugins())

    def _plugins(self) -> Mapping[str, Profile]:
        declarations = plugins.declarations("profiles", Profile)
        owners = {profile.number: name for name, profile in self.built_in.items()}
        for name, profile in declarations.items():
            if profile.name != name:
                fault = f"declares the profile {profile.name!r}"
            elif name in self.built_in:
                fault = "has the name of a profile of ptmtools"
            elif not 0 <= profile.number <= 255:
                fault = f"has the number {profile.number}; 0 to 255 are possible"
            elif (owner := owners.setdefault(profile.number, name)) != name:
                fault = f"has the number {profile.number} of the profile {owner!r}"
            else:
                continue
            raise MissingComponentError(
                "PTM-M110",
                f"the plug-in {name!r} (ptmtools.profiles) {fault}",
                remedy="update or uninstall the package that declares it",
            )
        return declarations


#: All profiles, by name.
PROFILES = Profiles(
    Profile("fast", 1, "for streaming", lossy=True, since=1),
    Profile("small", 2, "for archives; smaller, but 30 to 60 times slower", lossy=True),
    Profile("raw", 0, "uncompressed, the layout of Marvie & Bouatouch, 2003", since=1),
    Profile("paper", 3, "the layout of raw with lossless JPEG, for comparison"),
)
