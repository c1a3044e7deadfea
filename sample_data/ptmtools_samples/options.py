"""Options of the sample museum."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from ptmtools.errors import InputError
from ptmtools.options import option

#: Field → (least, most).
RANGES: dict[str, tuple[int, int]] = {
    "rooms": (1, 2000),
    "textures": (1, 5000),
    "size": (4, 8192),
    "seed": (0, 2**63),
}


@dataclass(frozen=True)
class MuseumOptions:
    """Options of `make_museum`. Raises InputError: PTM-I111 a value out of range, or ``images`` is
    no folder."""

    heading: ClassVar[str] = "Museum"

    rooms: int = option(12, "Number of rooms, besides corridors and stairwells.")
    textures: int = option(31, "Number of textures; at most a third of them are not paintings.")
    size: int = option(1024, "Width and height of a texture in texels.")
    seed: int = option(1, "Seed; another value gives another building with other paintings.")
    windows: bool = option(True, "Windows with glass; without them the building is closed.")
    images: str | None = option(
        None, "Hang the images of this folder instead of generated paintings.", metavar="DIR"
    )

    def __post_init__(self) -> None:
        for name, (least, most) in RANGES.items():
            if not least <= (value := getattr(self, name)) <= most:
                raise InputError(
                    "PTM-I111", f"--{name} {value} is not possible", remedy=f"use {least} to {most}"
                )
        if self.images is not None and not Path(self.images).is_dir():
            raise InputError(
                "PTM-I111", "is not a folder", file=self.images, remedy="name a folder of images"
            )
