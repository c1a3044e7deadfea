"""Options of the samples, one class for each that has any. Nothing heavy is imported."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Literal

from ptmtools.errors import InputError
from ptmtools.options import option, require, require_ranges

_SEED = "Seed of the random numbers; another value gives another model."
_SEEDS = (0, 2**63)
STATUES = ("bust", "relief", "dragon", "column")


class Ranged:
    """Refuses numbers out of range. Raises InputError: PTM-I111."""

    heading: ClassVar[str] = "Model"
    #: Field → (least, most).
    ranges: ClassVar[dict[str, tuple[float, float]]] = {}

    def __post_init__(self) -> None:
        require_ranges(
            self, self.ranges, "--{name} {value} is not possible", "use {least} to {most}"
        )


@dataclass(frozen=True)
class NoOptions:
    """A sample that is always the same."""


@dataclass(frozen=True)
class MuseumOptions(Ranged):
    """Options of `make_museum`. Raises InputError: PTM-I111 a value out of range, or ``images`` is
    no folder."""

    ranges: ClassVar = {
        "rooms": (1, 2000),
        "textures": (1, 5000),
        "size": (4, 8192),
        "seed": _SEEDS,
    }

    rooms: int = option(12, "Number of rooms, besides corridors and stairwells.")
    textures: int = option(31, "Number of textures; at most a third of them are not paintings.")
    size: int = option(1024, "Width and height of a texture in texels.")
    seed: int = option(1, "Seed; another value gives another building with other paintings.")
    windows: bool = option(True, "Windows with glass; without them the building is closed.")
    images: str | None = option(
        None, "Hang the images of this folder instead of generated paintings.", metavar="DIR"
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.images is not None and not Path(self.images).is_dir():
            raise InputError(
                "PTM-I111", "is not a folder", file=self.images, remedy="name a folder of images"
            )


@dataclass(frozen=True)
class AtriumOptions(Ranged):
    """Options of `make_atrium`."""

    ranges: ClassVar = {"size": (4, 8192), "seed": _SEEDS}

    size: int = option(1024, "Width and height of a texture in texels.")
    seed: int = option(1, _SEED)


@dataclass(frozen=True)
class StreetOptions(Ranged):
    """Options of `make_campus`; ``length`` in metres."""

    ranges: ClassVar = {
        "buildings": (1, 400),
        "length": (50, 20000),
        "seed": _SEEDS,
        "texture": (8, 8192),
    }

    buildings: int = option(
        40, "Number of buildings, on both sides; a smaller number is selected evenly from forty."
    )
    length: float = option(1000.0, "Length of the street in metres.", metavar="M")
    seed: int = option(1, _SEED)
    texture: int = option(512, "Width and height of a texture in texels.")


@dataclass(frozen=True)
class StatueOptions(Ranged):
    """Options of `make_statue` and `make_statues`; the number of triangles is met within some
    percent."""

    ranges: ClassVar = {"triangles": (400, 4_000_000), "seed": _SEEDS}

    triangles: int = option(50_000, "Approximate number of triangles of each statue.")
    seed: int = option(1, _SEED)
    colors: bool = option(False, "Vertex colours: paint on marble, glaze, scales, sandstone.")
    only: tuple[str, ...] = option(
        (), "Write this statue only; repeatable.", metavar=f"[{'|'.join(STATUES)}]"
    )
    format: Literal["ply", "obj", "glb"] = option("ply", "File format.")

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in self.only:
            require(
                (name in STATUES, f"there is no statue {name!r}", f"choose {', '.join(STATUES)}")
            )


@dataclass(frozen=True)
class StatueHallOptions(Ranged):
    """Options of `make_statue_hall`; the number of triangles is met within some percent."""

    ranges: ClassVar = {
        "statues": (1, 100),
        "triangles": (1000, 4_000_000),
        "images": (1, 100),
        "seed": _SEEDS,
    }

    statues: int = option(6, "Number of statues.")
    triangles: int = option(100_000, "Approximate number of triangles of each statue.")
    images: int = option(8, "Number of images on the walls.")
    seed: int = option(1, _SEED)


@dataclass(frozen=True)
class PhotoGalleryOptions(Ranged):
    """Options of `make_photo_gallery`."""

    ranges: ClassVar = {"images": (1, 200), "seed": _SEEDS}

    images: int = option(24, "Number of images.")
    seed: int = option(1, _SEED)


@dataclass(frozen=True)
class WebGalleryOptions(Ranged):
    """Options of `make_web_gallery`; ``scale`` of the images' sides."""

    ranges: ClassVar = {
        "rooms": (1, 200),
        "paintings": (1, 500),
        "statue_triangles": (400, 1_000_000),
        "scale": (0.01, 4),
        "seed": _SEEDS,
    }

    rooms: int = option(8, "Number of rooms, besides corridors and stairwells.")
    paintings: int = option(40, "Number of paintings.")
    statue_triangles: int = option(12_000, "Approximate number of triangles of each statue.")
    scale: float = option(1.0, "Scale of the sizes of the images.")
    seed: int = option(1, _SEED)


@dataclass(frozen=True)
class LitHallOptions(Ranged):
    """Options of `make_lit_hall`; ``scale`` of the images' sides."""

    ranges: ClassVar = {"scale": (0.01, 4), "seed": _SEEDS}

    scale: float = option(1.0, "Scale of the sizes of the images.")
    seed: int = option(1, _SEED)
