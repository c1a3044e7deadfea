"""The table of samples: each is a model that `ptm sample` writes."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from ptmtools.lazy import Lazy
from ptmtools_samples.options import (
    AtriumOptions,
    LitHallOptions,
    MuseumOptions,
    NoOptions,
    PhotoGalleryOptions,
    StatueHallOptions,
    StatueOptions,
    StreetOptions,
    WebGalleryOptions,
)

#: Returns the files of a sample with these options, each a path in the output folder and a function
#: that returns the bytes; the model comes last. The second argument gets a line about each file of
#: the user that is left out.
Maker = Callable[[Any, Callable[[str], object]], Iterable[tuple[str, Callable[[], bytes]]]]


@dataclass(frozen=True)
class Sample:
    """A model to try ptmtools on.

    Attributes
    ----------
    about: its line in ``ptm sample --help``.
    details: what ``ptm sample MODEL --help`` adds.
    options: the class of its options; the same options give the same bytes.
    make: the function that returns its files.
    """

    about: str
    details: str
    options: type
    make: Lazy[Maker]


_HERE = "ptmtools_samples"
SAMPLES: dict[str, Sample] = {
    "museum": Sample(
        "A building with pictures, statues and stairs.",
        "OBJ, MTL and PNG files.",
        MuseumOptions,
        Lazy(f"{_HERE}.museum:make_museum"),
    ),
    "two-rooms": Sample(
        "Two rooms and a doorway, small enough to check by hand.",
        "OBJ, MTL and PNG files.",
        NoOptions,
        Lazy(f"{_HERE}.two_rooms:make_two_rooms"),
    ),
    "atrium": Sample(
        "One open hall of 250,000 triangles and 25 textures.",
        "Two storeys of arcades around a court, with columns, drapes, vases, balustrades and "
        "frescoes: OBJ, MTL and PNG files.",
        AtriumOptions,
        Lazy(f"{_HERE}.atrium.model:make_atrium"),
    ),
    "photo-gallery": Sample(
        "A hall whose walls are full of large, distinct images.",
        "Images of 1024, 2048 and 4096 texels a side, which take minutes: OBJ, MTL and PNG files.",
        PhotoGalleryOptions,
        Lazy(f"{_HERE}.photo_gallery:make_photo_gallery"),
    ),
    "web-gallery": Sample(
        "A gallery as on the web: one GLB with Draco and JPEG.",
        "Rooms of the museum without windows, with paintings of many sizes and fine statues.",
        WebGalleryOptions,
        Lazy(f"{_HERE}.web_gallery:make_web_gallery"),
    ),
    "lit-hall": Sample(
        "Three rooms with lamps, daylight, polish, metal and glass.",
        "One GLB with the sun, spots, glowing panels, and metallic and roughness factors.",
        LitHallOptions,
        Lazy(f"{_HERE}.lit_hall:make_lit_hall"),
    ),
    "campus": Sample(
        "Buildings along a street, for `ptm campus`.",
        "OBJ, MTL and PNG files, and a walk along the street at 11 km/h, campus_way.json. OBJ does "
        "not record the unit: use --unit m.",
        StreetOptions,
        Lazy(f"{_HERE}.campus.model:make_campus"),
    ),
    "statues": Sample(
        "Closed surfaces with fine relief, for `ptm apo`.",
        "A bust, a relief, a dragon and the capital of a column. PLY does not record the up axis: "
        "use --up y --unit m.",
        StatueOptions,
        Lazy(f"{_HERE}.statues.model:make_statues"),
    ),
    "statue-hall": Sample(
        "A hall of heavy statues, for `ptm build-scene --apo`.",
        "Statues along its axis, images on its walls: OBJ, MTL and PNG files.",
        StatueHallOptions,
        Lazy(f"{_HERE}.statue_hall:make_statue_hall"),
    ),
}
