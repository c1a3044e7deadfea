"""The output of a reader: triangles, materials and textures in the units and axes of the file.

A reader resolves the names of textures to files but opens no image: only the cleaning of the faces
(`faces`) shows which images some face uses.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import LimitError
from ptmtools.files import open_regular
from ptmtools.scene.model import Camera, Kind, Shine, Storey, Wrap

SourceWrap = Literal[Wrap, "mirror"]
#: `Scene.triangles` is int32: more vertices cannot be numbered.
MAX_VERTICES = 2**31 - 1


def decode(raw: bytes) -> str:
    """The text of a model file: UTF-8 with or without a byte order mark, otherwise Latin-1."""
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def too_many_triangles(limit: int, file: Path) -> LimitError:
    """The error for a model of more triangles than the limit, PTM-L203."""
    return LimitError(
        "PTM-L203",
        f"has more than {limit:,} triangles",
        file=file,
        remedy="raise the limit (--max-triangles), or split the model",
    )


@dataclass(frozen=True)
class FileRange:
    """Reads a file from ``offset``: ``length`` bytes, or to its end."""

    path: Path
    offset: int = 0
    length: int | None = None

    def __call__(self) -> bytes:
        with open_regular(self.path) as stream:
            stream.seek(self.offset)
            return stream.read() if self.length is None else stream.read(self.length)

    def size(self) -> int:
        """The size of the range in bytes, without reading it. Raises OSError."""
        rest = max(0, os.stat(self.path).st_size - self.offset)
        return rest if self.length is None else min(rest, self.length)


@dataclass(frozen=True)
class HeldBytes:
    """Bytes without a file of their own (a data URI)."""

    data: bytes

    def __call__(self) -> bytes:
        return self.data


@dataclass(frozen=True)
class Texture:
    """A reference of a material to an image.

    Attributes
    ----------
    read: returns the bytes of the image file.
    label: the emitted file is named after it.
    what: the reference as written in the model ("map_Kd bricks.png"), for notes.
    place: location of the reference ("museum.mtl:12").
    wrap_s, wrap_t: wrap modes beyond [0, 1]; "mirror" mirrors every second repetition.
    channel: the channel that contains the values of a mask: "m" (matte), "l" (luminance), "r",
        "g", "b", or "": matte if the image has one, otherwise luminance.
    strength: weight in [0, 1] (glTF's occlusionTexture).
    """

    read: Callable[[], bytes]
    label: str
    what: str
    place: str
    wrap_s: SourceWrap = "repeat"
    wrap_t: SourceWrap = "repeat"
    channel: str = ""
    strength: float = 1.0


@dataclass(frozen=True)
class SourceMaterial:
    """A material of the model.

    Attributes
    ----------
    color: tint in [0, 1], sRGB; None if the model defines none.
    opacity: in [0, 1].
    see_through: the material is blended, alpha-tested or transmitting by its own definition.
    ignores_alpha: the alpha of its texture has no effect, by the mode of the material (glTF, USD).
    cutoff: alpha testing: texels of less alpha are not drawn, all others are opaque; None if
        texels are blended.
    two_sided: whether both sides of its faces are drawn.
    texture, mask: colours, and a separate image of opacities (``map_d``).
    shine: its reflection map.
    """

    name: str
    color: tuple[float, float, float] | None = None
    opacity: float = 1.0
    see_through: bool = False
    ignores_alpha: bool = False
    cutoff: float | None = None
    two_sided: bool = True
    texture: Texture | None = None
    mask: Texture | None = None
    shine: Shine | None = None


@dataclass(frozen=True)
class Source:
    """Triangles in the units and axes of the file.

    Fields that a format does not define keep their defaults.

    Attributes
    ----------
    points: (P, 3) float64, may be non-finite, unused or repeated.
    triangles: (T, 3) int64 into `points`, in the order of the file.
    uv: (T, 3, 2) float64 per corner, origin at the lower left of the image.
    triangle_object, triangle_material: (T,) int64.
    objects, materials, cameras: see `ptmtools.scene.model`; cameras in the space of the file.
    metres, up: unit and up axis if the format defines them, otherwise None.
    colors: (T, 3, 3) uint8 sRGB per corner, multiplied with the material's; None if no corner has
        a colour.
    step: step of the coarsest grid of coordinates, in units of the file; 0 for float32.
    kinds: the kind of each object by its class (IFC); empty for formats without classes.
    storeys: named by the file; heights along its up axis, in its units.
    """

    points: NDArray[np.float64]
    triangles: NDArray[np.int64]
    uv: NDArray[np.float64]
    triangle_object: NDArray[np.int64]
    triangle_material: NDArray[np.int64]
    objects: tuple[str, ...]
    materials: tuple[SourceMaterial, ...]
    cameras: tuple[Camera, ...] = ()
    metres: float | None = None
    up: Literal["y", "z"] | None = None
    colors: NDArray[np.uint8] | None = None
    step: float = 0.0
    kinds: tuple[Kind, ...] = ()
    storeys: tuple[Storey, ...] = ()
