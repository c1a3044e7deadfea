"""The distinct images of a scene, their names, and which of their texels are not opaque.

Each image that some face uses is read and decoded once, several at a time: a file that cannot be
decoded is found here and not hours later, and whether an alpha channel is more than 255s cannot be
known otherwise. What is kept is the digest, the means to read the bytes again, and a mask of the
texels that are not opaque where there are any, in bits. An image that declares more texels than are
allowed ends the ingest before memory is taken for it, and no format is tried but those that become
textures: Pillow would hand PostScript to an interpreter.
"""

from __future__ import annotations

import hashlib
import io
import os
import re
import unicodedata
import warnings
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, cast

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import InputError, LimitError, naming
from ptmtools.progress import Progress
from ptmtools.scene.model import SourceImage
from ptmtools.scene.reference import Folder
from ptmtools.scene.source import FileRange, Findings, Texture
from ptmtools.texture.images.declared import check_bytes
from ptmtools.texture.images.picture import check_size
from ptmtools.texture.model import Limits

if TYPE_CHECKING:
    from PIL import Image

#: Names that Windows keeps for devices, with or without a suffix.
_DEVICES = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)$", re.IGNORECASE)
#: Longest stem of a file name that is given out, in characters.
_LONGEST_STEM = 80
#: What looks like the suffix of a file, and not like the end of "wood 1.2".
_NAME_SUFFIX = re.compile(r"\.[A-Za-z][A-Za-z0-9]{1,4}$")
_SUFFIX = {"JPEG": "jpg", "TIFF": "tif", "MPO": "jpg", "JPEG2000": "jp2"}
#: About so many texels of an image are looked at at a time.
_STRIP_TEXELS = 1 << 20
_MASK_BANDS = {"r": "R", "g": "G", "b": "B"}


@dataclass(frozen=True)
class VerifiedBytes:
    """Reads an image again, and makes sure that it still is what ingest saw.

    Raises InputError if the file is gone, cannot be read, or has changed.
    """

    read: Callable[[], bytes]
    sha256: str
    label: str

    def __call__(self) -> bytes:
        try:
            data = self.read()
        except OSError as error:
            raise InputError(
                "PTM-I252",
                f"cannot be read again ({error.strerror or error})",
                file=self.label,
                remedy="restore it, or build again",
            ) from None
        if hashlib.sha256(data).hexdigest() != self.sha256:
            raise InputError(
                "PTM-I252",
                "has changed since the model was read",
                file=self.label,
                remedy="build again",
            )
        return data


@dataclass(frozen=True)
class Decoded:
    """What ingest needs of an image: its number, and (H, W) bool, rows from the top, which
    texels are not opaque; None where all are."""

    index: int
    holes: NDArray[np.bool_] | None


@dataclass(frozen=True)
class _Mask:
    """(H, W) bool in eighths of its bytes: a scene may have many, and its images unfold."""

    bits: NDArray[np.uint8]
    shape: tuple[int, int]

    @property
    def unfolded(self) -> NDArray[np.bool_]:
        height, width = self.shape
        flat = np.unpackbits(self.bits, count=height * width)
        return flat.view(np.bool_).reshape(height, width)


@dataclass(frozen=True)
class _Examined:
    """What was found out about an image: digest, Pillow's name for its format, whether it can be
    other than opaque, which texels are not; or the fault that keeps it from being an image."""

    sha256: str = ""
    format: str = ""
    alpha: bool = False
    holes: _Mask | None = None
    fault: str = ""


class ImageStore:
    """Images by digest, in the order in which they were first asked for.

    ``folder`` is the model's, where files may have been found; ``limit`` the most bytes that the
    texels of an image may take, at four for each.
    """

    def __init__(self, findings: Findings, folder: Folder, limit: int) -> None:
        self._findings = findings
        self._folder = folder
        self._limit = limit
        self._examined: dict[tuple[Callable[[], bytes], str | None], _Examined] = {}
        self._index: dict[str, int] = {}
        self._images: list[SourceImage] = []
        self._files: list[set[str]] = []
        self._opaque: list[bool] = []
        self._masks: set[str] = set()
        self._stems: set[str] = set()

    @property
    def images(self) -> tuple[SourceImage, ...]:
        return tuple(
            replace(image, files=tuple(sorted(files)), plain=opaque and not files & self._masks)
            for image, files, opaque in zip(self._images, self._files, self._opaque, strict=True)
        )

    def examine(self, textures: Iterable[Texture], workers: int, progress: Progress) -> None:
        """Decodes the images of these textures, ``workers`` at a time, before they are added.

        Raises LimitError PTM-L104, PTM-L106, as do the others.
        """
        wanted = {texture.read: texture for texture in reversed([*textures])}
        wanted = dict(reversed(wanted.items()))
        with _unwarned(), ThreadPoolExecutor(workers) as pool:
            examined = pool.map(lambda texture: _examine(texture, self._limit), wanted.values())
            for done, (read, found) in enumerate(zip(wanted, examined, strict=True)):
                progress(done, len(wanted), "images")
                self._examined[read, None] = found
        progress(len(wanted), len(wanted), "images")

    def add(self, texture: Texture) -> Decoded | None:
        """The image of a texture, or None (and a miss is recorded) if it cannot be decoded."""
        found = self._sound(texture)
        if found is None:
            return None
        if found.sha256 not in self._index:
            self._index[found.sha256] = len(self._images)
            name = self._name(texture.label, found.format)
            load = VerifiedBytes(texture.read, found.sha256, texture.label)
            self._images.append(SourceImage(name, found.sha256, load))
            self._files.append(set())
            self._opaque.append(not found.alpha)
        index = self._index[found.sha256]
        if file := self._whole_file(texture):
            self._files[index].add(file)
        return Decoded(index, None if found.holes is None else found.holes.unfolded)

    def _whole_file(self, texture: Texture) -> str | None:
        """The file that an image is all of, relative to the model's folder."""
        read = texture.read
        if not isinstance(read, FileRange) or read.offset or read.length is not None:
            return None
        name = Path(os.path.relpath(read.path, self._folder.root)).as_posix()
        return name if name in self._folder.sought else None

    def mask_holes(self, mask: Texture) -> NDArray[np.bool_] | None:
        """(H, W) which texels of a mask (``map_d``) are not opaque; all, if it is unreadable."""
        if file := self._whole_file(mask):
            self._masks.add(file)
        found = self._sound(mask, mask.channel)
        if found is None:
            return np.ones((1, 1), dtype=bool)
        return None if found.holes is None else found.holes.unfolded

    def _sound(self, texture: Texture, channel: str | None = None) -> _Examined | None:
        """What `_examine` finds, once; None (and a miss is recorded) if that is a fault."""
        key = texture.read, channel
        if key not in self._examined:
            with _unwarned():
                self._examined[key] = _examine(texture, self._limit, channel)
        if fault := self._examined[key].fault:
            self._findings.miss("PTM-N206", f"{texture.what}: {fault}", texture.place)
            return None
        return self._examined[key]

    def _name(self, label: str, kind: str) -> str:
        """A safe name whose stem alone is unique without regard to case."""
        stem = re.split(r"[\\/]", label)[-1]
        if known := _NAME_SUFFIX.search(stem):
            stem = stem[: known.start()] or stem
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


class _FaultError(Exception):
    """What keeps a file from being an image."""


def _examine(texture: Texture, limit: int, channel: str | None = None) -> _Examined:
    """Reads and decodes an image; ``channel`` is that of a mask, see `Texture`.

    Raises LimitError PTM-L104, PTM-L106.
    """
    read = texture.read
    try:
        with naming(texture.label, place=texture.place):
            if isinstance(read, FileRange):
                check_bytes(read.size(), Limits(limit))
            data = read()
            opened = _decode(data, limit)
        with _pillow_faults():
            holes = _holes(opened) if channel is None else _mask_holes(opened, channel)
    except _FaultError as fault:
        return _Examined(fault=str(fault))
    except OSError as error:
        return _Examined(fault=error.strerror or str(error))
    return _Examined(
        hashlib.sha256(data).hexdigest(),
        opened.format or "",
        opened.has_transparency_data,
        holes,
    )


def is_plain(data: bytes, name: str, limit: int) -> bool:
    """Whether an image can take the place of a plain one of this name and change nothing else of
    its scene: it can be decoded, has no alpha channel, and would have a name with that suffix.

    ``limit`` as of `ImageStore`. Raises LimitError PTM-L104, PTM-L106.
    """
    try:
        with _unwarned():
            opened = _decode(data, limit)
    except _FaultError:
        return False
    return not opened.has_transparency_data and name.endswith(f".{_suffix(opened.format or '')}")


@contextmanager
def _unwarned() -> Iterator[None]:
    """Pillow's warnings are not shown. For all threads, so it is entered by the first of them."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def _decode(data: bytes, limit: int) -> Image.Image:
    """Raises _FaultError if that cannot be, LimitError PTM-L104, PTM-L106."""
    from ptmtools.texture.images.opening import load, opened

    if not data:
        raise _FaultError("empty file")
    limits = Limits(limit)
    with _pillow_faults():
        image = opened(cast("BinaryIO", io.BytesIO(data)), limits)
        check_size(*image.size, 4, limits)
        load(image)
    return image


@contextmanager
def _pillow_faults() -> Iterator[None]:
    """As that of textures, but a fault of the image is a _FaultError."""
    from ptmtools.texture.images.opening import pillow_faults

    try:
        with pillow_faults():
            yield
    except LimitError:
        raise
    except InputError as error:
        raise _FaultError(error.message) from None


def _suffix(kind: str) -> str:
    return _SUFFIX.get(kind, kind.lower())


def _holes(opened: Image.Image) -> _Mask | None:
    """Which texels have an alpha below 255, None if none has."""
    if not opened.has_transparency_data:
        return None
    if opened.mode.startswith("I"):  # 16 bits, with a colour that stands for none
        key = opened.info["transparency"]
        return _mask(opened, lambda strip: np.asarray(strip) == key)
    return _mask(opened, lambda strip: np.asarray(strip.convert("RGBA").getchannel("A")) < 255)


def _mask_holes(opened: Image.Image, channel: str) -> _Mask | None:
    """Which texels of a mask are not opaque, None if all are."""
    if channel in ("", "m") and opened.has_transparency_data:
        return _holes(opened)
    band = _MASK_BANDS.get(channel)
    if opened.mode.startswith("I"):  # 16 bits, which convert() would clip
        return _mask(opened, lambda strip: np.asarray(strip) < 65535)
    if band:
        return _mask(opened, lambda strip: np.asarray(strip.convert("RGB").getchannel(band)) < 255)
    return _mask(opened, lambda strip: np.asarray(strip.convert("L")) < 255)


def _mask(opened: Image.Image, test: Callable[[Image.Image], NDArray[np.bool_]]) -> _Mask | None:
    """What ``test`` says of the texels of an image, a strip of rows at a time; None if nothing."""
    width, height = opened.size
    step = 8 * max(1, _STRIP_TEXELS // (8 * width))  # so that strips end with a byte
    parts = [
        np.packbits(test(opened.crop((0, y, width, min(y + step, height)))))
        for y in range(0, height, step)
    ]
    if not any(part.any() for part in parts):
        return None
    return _Mask(np.concatenate(parts), (height, width))
