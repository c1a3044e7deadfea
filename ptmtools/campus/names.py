"""Names of files: safe on any system, and unique without regard to case."""

from __future__ import annotations

import re
import unicodedata

from ptmtools.campus.model import (
    ALPHA,
    DIFFUSE,
    FORMAT,
    INDEX,
    LIGHT,
    MASK,
    MESHES,
    TEXTURES,
)
from ptmtools.whole_folder import FolderForm

#: Names that Windows keeps for devices, with or without a suffix.
_DEVICES = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)$", re.IGNORECASE)
#: Longest name that is given out, in characters; a number may follow.
_LONGEST = 60
#: What a folder of ours consists of, besides its index.
_OURS = re.compile(
    rf"({MESHES}/[A-Za-z0-9_-]+_\d+\.glb|"
    rf"{TEXTURES}/[A-Za-z0-9_-]+_\d+_[{DIFFUSE}{ALPHA}{MASK}{LIGHT}]\.jpg)"
)
FORM = FolderForm(
    INDEX, FORMAT, "ptm campus", lambda name: name == INDEX or bool(_OURS.fullmatch(name))
)


class Names:
    """Gives out names."""

    def __init__(self) -> None:
        self._taken: set[str] = set()
        #: Of each name the number that was last added to it.
        self._last: dict[str, int] = {}

    def take(self, text: str, otherwise: str) -> str:
        """A name after ``text``, or ``otherwise`` if nothing of that can stand in one."""
        plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()
        stem = re.sub(r"[^A-Za-z0-9-]+", "_", plain).strip("_")[:_LONGEST].strip("_") or otherwise
        if _DEVICES.match(stem):
            stem = f"{otherwise}_{stem}"
        unique, count = stem, self._last.get(stem.lower(), 1)
        while unique.lower() in self._taken:
            count += 1
            unique = f"{stem}-{count}"
        self._taken.add(unique.lower())
        self._last[stem.lower()] = count
        return unique


def mesh_file(name: str, lod: int) -> str:
    """``meshes/library_0.glb``; 0 is the coarsest."""
    return f"{MESHES}/{name}_{lod}.glb"


def texture_file(base: str, size: int, channel: str) -> str:
    """``textures/wall_512_d.jpg``."""
    return f"{TEXTURES}/{base}_{size}_{channel}.jpg"
