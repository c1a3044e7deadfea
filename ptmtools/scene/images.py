"""Collects the distinct images of a scene, their names and transparent texels.

Ingest reads and decodes each image that some face uses once, several in parallel: damage is
reported here and not hours later, and only decoding shows whether an alpha channel contains values
below 255. The store keeps the digest, a function that reads the bytes again, and the mask of
transparent texels, packed in bits. An image that declares more texels than the limit ends the
ingest before memory is allocated. Only formats that can become textures are opened: Pillow would
start an interpreter for PostScript.
"""

from __future__ import annotations

import hashlib
import io
import os
import re
import unicodedata
import warnings
from collections.abc import Callable, Hashable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools
from ptmtools.errors import InputError, LimitError, MissingComponentError, PtmError, naming
from ptmtools.progress import Progress
from ptmtools.scene.model import SourceImage
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.source import FileRange, SourceTexture
from ptmtools.texture.images.picture import check_bytes, check_size
from ptmtools.texture.model import Limits

if TYPE_CHECKING:
    from PIL import Image

    from ptmtools.texture.images import Picture


#: Names that Windows reserves for devices, with or without a suffix.
_DEVICES = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)$", re.IGNORECASE)
#: Longest stem of an emitted file name, in characters.
_LONGEST_STEM = 80
#: The suffix of a file name, but not the end of "wood 1.2".
_NAME_SUFFIX = re.compile(r"\.[A-Za-z][A-Za-z0-9]{1,4}$")
_SUFFIX = {"JPEG": "jpg", "TIFF": "tif", "MPO": "jpg", "JPEG2000": "jp2"}
#: Approximate number of texels of a strip, the unit in which alpha is examined.
_STRIP_TEXELS = 1 << 20
_MASK_BANDS = {"r": "R", "g": "G", "b": "B"}

_Bits = NDArray[np.uint8]
T = TypeVar("T")


@dataclass(frozen=True)
class VerifiedBytes:
    """Reads an image again and compares it with its digest.

    Raises InputError PTM-I122 if the file is missing, cannot be read, or has changed.
    """

    read: Callable[[], bytes]
    sha256: str
    label: str

    def __call__(self) -> bytes:
        data, fault = b"", ""
        try:
            data = self.read()
        except OSError as error:
            fault = f"cannot be read again ({error.strerror or error})"
        if not fault and hashlib.sha256(data).hexdigest() != self.sha256:
            fault = "has changed since the model was read"
        if fault:
            remedy = "restore it, or build again"
            raise InputError("PTM-I122", fault, file=self.label, remedy=remedy)
        return data


@dataclass(frozen=True)
class ImageRecord:
    """Properties of an image: digest, Pillow's name of its format, whether it has an alpha channel,
    and its transparent texels as bits packed along rows; what has to be converted (`open_shallow`),
    or the reason why it cannot be decoded. ``derived``: whether it is a PNG made of a lossy image.
    """

    sha256: str = ""
    format: str = ""
    alpha: bool = False
    width: int = 0
    bits: _Bits | None = None
    conversion: str = ""
    fault: str = ""
    derived: bool = False

    @property
    def holes(self) -> Bools | None:
        """(H, W) bool, rows from the top, the texels that are not opaque; None if all are."""
        if self.bits is None:
            return None
        return np.unpackbits(self.bits, axis=1, count=self.width).view(np.bool_)


class ImageStore:
    """The images of a scene by digest, in the order of their addition.

    ``limit`` is the largest size of the decoded texels of an image, in bytes, at four per texel.
    """

    def __init__(self, notes: IngestNotes, limit: int) -> None:
        self._notes = notes
        self.limit = limit
        self._examined: dict[tuple[Callable[[], bytes], str | None], ImageRecord] = {}
        self._index: dict[str, int] = {}
        self._images: list[SourceImage] = []
        self._files: list[set[str]] = []
        self._inputs: set[str] = set()
        self._stems: set[str] = set()
        self._converted: set[str] = set()

    @property
    def images(self) -> tuple[SourceImage, ...]:
        return tuple(
            replace(
                image,
                plain=image.plain and self._inputs.isdisjoint(files),
                files=tuple(sorted(files)),
            )
            for image, files in zip(self._images, self._files, strict=True)
        )

    def examine(self, textures: Iterable[SourceTexture], workers: int, progress: Progress) -> None:
        """Decodes the images of these textures with ``workers`` threads, before they are added.

        Raises LimitError PTM-L104, as the other methods do.
        """
        pending: dict[Callable[[], bytes], SourceTexture] = {}
        for texture in textures:
            if (texture.read, None) not in self._examined:
                pending.setdefault(texture.read, texture)
        with warnings.catch_warnings(action="ignore"), ThreadPoolExecutor(workers) as pool:
            records = pool.map(lambda texture: _examine(texture, self.limit), pending.values())
            for done, (read, record) in enumerate(zip(pending, records, strict=True)):
                progress(done, len(pending), "images")
                self._examined[read, None] = record
        progress(len(pending), len(pending), "images")

    def convert(self, texture: SourceTexture, channel: str | None = None) -> SourceTexture:
        """A texture, or a mask with a ``channel``, whose image has 8 bits a component if it can be
        decoded; a miss if that converts it."""
        record = self._record(texture, channel)
        if not record.conversion:
            return texture
        if record.sha256 not in self._converted:
            self._converted.add(record.sha256)
            self._notes.miss("PTM-N126", f"{texture.what}: {record.conversion}", texture.place)
        self.mark_as_input(texture)
        return replace(texture, read=ConvertedBytes(texture.read, self.limit))

    def add(self, texture: SourceTexture) -> tuple[int, Bools | None] | None:
        """The number of a texture's image, and its `ImageRecord.holes`; None, and a miss, if it
        cannot be decoded."""
        record = self.record(texture)
        if record is None:
            return None
        index = self._index.setdefault(record.sha256, len(self._images))
        if index == len(self._images):
            name = self._name(texture.label, record.format)
            load = VerifiedBytes(texture.read, record.sha256, texture.label)
            self._images.append(SourceImage(name, record.sha256, load, plain=not record.alpha))
            self._files.append(set())
        if file := self._whole_file(texture):
            self._files[index].add(file)
        return index, record.holes

    def _whole_file(self, texture: SourceTexture) -> str | None:
        """The file that consists of a texture's image, relative to the model's folder."""
        read, folder = texture.read, self._notes.folder
        if not isinstance(read, FileRange) or read.offset or read.length is not None:
            return None
        name = Path(os.path.relpath(read.path, folder.root)).as_posix()
        return name if name in folder.sought else None

    def mark_as_input(self, texture: SourceTexture) -> None:
        """Records that another image is derived from this one, which is then not `plain`."""
        if file := self._whole_file(texture):
            self._inputs.add(file)

    def record(self, texture: SourceTexture, channel: str | None = None) -> ImageRecord | None:
        """The properties of an image, or with a ``channel`` (`SourceTexture`) those of a mask;
        None, and a miss, if it cannot be decoded."""
        record = self._record(texture, channel)
        if record.fault:
            self._notes.miss("PTM-N206", f"{texture.what}: {record.fault}", texture.place)
            return None
        return record

    def _record(self, texture: SourceTexture, channel: str | None) -> ImageRecord:
        key = texture.read, channel
        if key not in self._examined:
            with warnings.catch_warnings(action="ignore"):
                self._examined[key] = _examine(texture, self.limit, channel)
        return self._examined[key]

    def _name(self, label: str, kind: str) -> str:
        """A portable file name; its stem is unique regardless of case."""
        stem = re.split(r"[\\/]", label)[-1]
        if suffix := _NAME_SUFFIX.search(stem):
            stem = stem[: suffix.start()] or stem
        stem = unicodedata.normalize("NFKD", stem).encode("ascii", "ignore").decode()
        stem = re.sub(r"[^A-Za-z0-9_-]+", "_", stem).strip("_")[:_LONGEST_STEM] or "image"
        if _DEVICES.match(stem):
            stem = f"image_{stem}"
        unique, count = stem, 1
        while unique.lower() in self._stems:
            count += 1
            unique = f"{stem}_{count}"
        self._stems.add(unique.lower())
        return f"{unique}.{_suffix(kind)}"


def _examine(texture: SourceTexture, limit: int, channel: str | None = None) -> ImageRecord:
    """Reads and decodes an image; ``channel`` as in `_holes`.

    Raises LimitError PTM-L104.
    """
    from ptmtools.texture.images.opening import LOSSY, pillow_faults

    try:
        with naming(texture.label, place=texture.place):
            data = read_within(texture, limit)
            opened, conversion = _decode(data, limit)
            with pillow_faults():
                bits = _holes(opened, channel)
    except LimitError:
        raise
    except InputError as error:
        return ImageRecord(fault=error.message)
    except OSError as error:
        return ImageRecord(fault=error.strerror or str(error))
    return ImageRecord(
        hashlib.sha256(data).hexdigest(),
        opened.format or "",
        opened.has_transparency_data,
        opened.width,
        bits,
        conversion,
        derived=LOSSY in opened.info,
    )


def read_within(texture: SourceTexture, limit: int) -> bytes:
    """The bytes of an image. Raises LimitError PTM-L104, and the errors of reading."""
    if size := getattr(texture.read, "size", None):
        check_bytes(size(), Limits(limit))
    return texture.read()


def integers(data: bytes, limit: int) -> Picture:
    """An image of 8 or 16 bits, to derive another from it.

    ``limit`` as in `ImageStore`. Raises InputError if the image cannot be decoded, LimitError
    PTM-L104.
    """
    return _open(data, limit, deep=True)[1]()


def derived_png(picture: Picture, texels: NDArray[Any], more: int = 0) -> bytes:
    """A PNG of (h, w, c) texels made of a picture's, lossy if they are, in as many bytes a texel
    and ``more``."""
    from ptmtools.texture.images.png import png_bytes

    (height, width), shape = picture.texels.shape[:2], texels.shape
    lossy = picture.lossy.bytes * shape[0] * shape[1] // (height * width) if picture.lossy else 0
    return png_bytes(texels, picture.description, lossy + more if lossy else 0)


@dataclass(frozen=True)
class ConvertedBytes:
    """The bytes of a PNG of 8 bits of any image; ``limit`` and errors as of `integers`."""

    read: Callable[[], bytes]
    limit: int

    def __call__(self) -> bytes:
        picture = _open(self.read(), self.limit)[1]()
        return derived_png(picture, picture.array())


class OptionalImages:
    """Images that a model is drawn without: each is read and decoded once for each use, and damage
    is a note. A use is a function of the bytes and of the limit of the ``store``."""

    def __init__(self, store: ImageStore, notes: IngestNotes) -> None:
        self._store, self.notes = store, notes
        self._results = dict[tuple[Callable[[], bytes], Hashable], Any]()

    def read(self, texture: SourceTexture, use: Callable[[bytes, int], T]) -> T | None:
        """``use`` of an image; None, and a note, if it cannot be read or decoded."""
        self.read_all((texture,), use, 1)
        return cast("T | None", self._results[texture.read, use])

    def read_all(
        self, textures: Iterable[SourceTexture], use: Callable[[bytes, int], object], workers: int
    ) -> None:
        """Reads images with ``workers`` threads for the same ``use``."""
        pending: dict[Callable[[], bytes], SourceTexture] = {}
        for texture in textures:
            if (texture.read, use) not in self._results:
                pending.setdefault(texture.read, texture)

        def attempt(texture: SourceTexture) -> object:
            try:
                return use(read_within(texture, self._store.limit), self._store.limit)
            except (PtmError, OSError) as fault:
                return fault

        with warnings.catch_warnings(action="ignore"), ThreadPoolExecutor(workers) as pool:
            results = list(pool.map(attempt, pending.values()))
        for texture, result in zip(pending.values(), results, strict=True):
            self._store.mark_as_input(texture)
            if isinstance(result, PtmError | OSError):
                message = result.message if isinstance(result, PtmError) else str(result)
                self.notes.note("PTM-N206", f"{texture.what}: {message}", texture.place)
            self._results[texture.read, use] = None if isinstance(result, Exception) else result


def mean_values(data: bytes, limit: int) -> tuple[float, ...]:
    """The mean red, green, blue and alpha of an image as encoded, from 0 to 1; all colours of a
    grey one are alike. Raises as `integers`."""
    texels = integers(data, limit).array()
    bands = texels.shape[2]
    channels = [0, 1, 2] if bands > 2 else [0, 0, 0]
    means = [float(texels[..., channel].mean()) for channel in channels]
    largest = float(np.iinfo(texels.dtype).max)
    means.append(float(texels[..., -1].mean()) if bands in (2, 4) else largest)
    return tuple(mean / largest for mean in means)


def is_plain(data: bytes, name: str, limit: int) -> bool:
    """Whether an image can replace a plain one of this name without another change to the scene: it
    can be decoded, has no alpha channel, and its format has the suffix of the name.

    ``limit`` as in `ImageStore`. Raises LimitError PTM-L104.
    """
    try:
        with warnings.catch_warnings(action="ignore"):
            opened, conversion = _decode(data, limit)
    except LimitError:
        raise
    except InputError:
        return False
    plain = not (conversion or opened.has_transparency_data)
    return plain and name.endswith(f".{_suffix(opened.format or '')}")


def _open(data: bytes, limit: int, *, deep: bool = False) -> tuple[str, Callable[[], Picture]]:
    """As `open_shallow`; an image that needs a library that is not installed cannot be decoded."""
    from ptmtools.texture.images import open_shallow

    try:
        return open_shallow(data, Limits(limit), deep=deep)
    except MissingComponentError as error:
        raise InputError(error.code, f"{error.message}: {error.remedy}") from None


def _decode(data: bytes, limit: int) -> tuple[Image.Image, str]:
    """An image in 8 bits, and what has to be converted (`open_shallow`).

    Raises InputError if the image cannot be decoded, LimitError PTM-L104.
    """
    from PIL.Image import fromarray

    from ptmtools.texture.images.opening import load, open_image, pillow_faults

    conversion, read = _open(data, limit)
    if conversion:
        texels = read().array()
        return fromarray(texels[..., 0] if texels.shape[2] == 1 else texels), conversion
    limits = Limits(limit)
    with pillow_faults():
        image = open_image(cast("BinaryIO", io.BytesIO(data)), limits)
        check_size(*image.size, 4, limits)
        load(image)
    return image, ""


def _suffix(kind: str) -> str:
    return _SUFFIX.get(kind, kind.lower())


def _holes(opened: Image.Image, channel: str | None) -> _Bits | None:
    """The texels that are not opaque, as bits packed along rows; None if all are opaque.

    ``channel`` is that of a mask (`SourceTexture`), None for the alpha of an image.
    """
    mode, band = ("RGB", _MASK_BANDS[channel]) if channel in _MASK_BANDS else ("L", "L")
    if opened.has_transparency_data and channel in (None, "", "m"):
        mode, band = "RGBA", "A"
    elif channel is None:
        return None

    def transparent(strip: Image.Image) -> Bools:
        return np.asarray(strip.convert(mode).getchannel(band)) < 255

    width, height = opened.size
    step = max(1, _STRIP_TEXELS // width)
    tops = range(0, height, step)
    strips = (opened.crop((0, y, width, min(y + step, height))) for y in tops)
    bits = np.concatenate([np.packbits(transparent(strip), axis=1) for strip in strips])
    return bits if bits.any() else None
