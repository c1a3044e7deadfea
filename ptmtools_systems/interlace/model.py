"""Options of an interlaced image, the axes of its steps, and its manifest.

The paper halves rows and columns alternately until a side reaches the minimum (§3.1). Read as pairs
of a row and a column step, as its counts want it (512² is 5 files, 4096² is 11): a pair is made as
long as it leaves both sides at the minimum or above. So there are 2 × pairs + 1 files, and an image
smaller than twice the minimum is one.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

from ptmtools.options import option
from ptmtools_systems.interlace.containers import CONTAINERS

#: The index of a folder, and its format.
INDEX, FORMAT, SCHEMA = "interlace.json", "ptmtools interlaced image", 1
#: The lines that a file interleaves with the image before it.
Axis = Literal["rows", "columns"]
Size = tuple[int, int]


@dataclass(frozen=True)
class InterlaceOptions:
    """Options of `interlace`."""

    heading: ClassVar[str] = "Interlaced image"

    min: int = option(128, "Minimum width and height of the first file.", metavar="TEXELS")
    format: str = option("png", "Format of the files", choices=CONTAINERS)
    quality: int = option(90, "Quality of JPEG files, 1 to 100.")


@dataclass(frozen=True)
class InterlacedFile:
    """One file, and the image that all files up to it make.

    Attributes
    ----------
    name: of the file, in the folder.
    width, height: size of the image in it, texels.
    bytes, crc32: length and checksum of the file.
    axis: whether its lines become the odd rows or the odd columns; None for the first file.
    joined: (width, height) of the image that it completes.
    """

    name: str
    width: int
    height: int
    bytes: int
    crc32: int
    axis: Axis | None
    joined: Size


@dataclass(frozen=True)
class Interlaced:
    """The manifest of an interlaced image.

    Attributes
    ----------
    width, height: size of the whole stored image, powers of two, texels.
    original: (width, height) before it was scaled to powers of two.
    container: format of the files, a name in `CONTAINERS`.
    lossless: whether joined files equal the stored image.
    components: 1 grey, 2 grey and alpha, 3 RGB, 4 RGB and alpha.
    kind: type of the samples, "uint8" or "uint16".
    min: as in `InterlaceOptions`.
    parts: the files, in their order.
    """

    width: int
    height: int
    original: Size
    container: str
    lossless: bool
    components: int
    kind: str
    min: int
    parts: tuple[InterlacedFile, ...]

    @property
    def texel_bytes(self) -> int:
        """Bytes of a texel, decoded."""
        return self.components * (2 if self.kind == "uint16" else 1)

    @property
    def bytes(self) -> int:
        """Bytes of all files, without the manifest."""
        return sum(part.bytes for part in self.parts)

    def document(self) -> dict[str, Any]:
        """The manifest as JSON; `schemas/interlace.schema.json` describes it."""
        document: dict[str, Any] = {"format": FORMAT, "schema": SCHEMA, **vars(self)}
        document["original"] = _sides(self.original)
        document["files"] = [{**vars(p), "joined": _sides(p.joined)} for p in document.pop("parts")]
        return document

    @staticmethod
    def from_document(document: Mapping[str, Any]) -> Interlaced:
        """The manifest in a valid document."""
        parts = tuple(_from_row(InterlacedFile, file) for file in document["files"])
        manifest: Interlaced = _from_row(Interlaced, {**document, "parts": parts})
        return manifest


def _sides(size: Size) -> dict[str, int]:
    return {"width": size[0], "height": size[1]}


def _from_row(cls: Any, row: Mapping[str, Any]) -> Any:
    """The record of a class: members that are unknown are ignored, sizes become pairs."""
    values = {name: row[name] for name in cls.__dataclass_fields__}
    sizes = {n: (v["width"], v["height"]) for n, v in values.items() if isinstance(v, dict)}
    return cls(**values | sizes)


def axes_of(width: int, height: int, smallest: int) -> tuple[Axis, ...]:
    """Axes of the steps that join the files of an image of these sides, the first step first."""
    pairs = 0
    while min(width, height) >> (pairs + 1) >= smallest:
        pairs += 1
    return ("columns", "rows") * pairs


def sizes_of(width: int, height: int, axes: Iterable[Axis]) -> list[tuple[Size, Size]]:
    """(size of its image, size after joining) of each file, the first file first; ``axes`` as
    `axes_of` returns them."""
    sizes: list[tuple[Size, Size]] = []
    for axis in reversed(list(axes)):
        joined = width, height
        width, height = (width >> 1, height) if axis == "columns" else (width, height >> 1)
        sizes.append(((width, height), joined))
    sizes.append(((width, height), (width, height)))
    return sizes[::-1]
