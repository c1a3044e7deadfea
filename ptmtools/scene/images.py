"""The distinct images of a scene, their names, and which of their texels are not opaque.

Each image is read and decoded once, one at a time, when the first face that uses it comes up:
a file that cannot be decoded is found here and not hours later, and whether an alpha channel is
more than 255s cannot be known otherwise. What is kept is the digest, the means to read the bytes
again, and a mask of the texels that are not opaque where there are any.
"""

from __future__ import annotations

import hashlib
import io
import re
import unicodedata
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import InputError
from ptmtools.scene.model import SourceImage
from ptmtools.scene.source import Findings, Texture

if TYPE_CHECKING:
    from PIL import Image

#: Names that Windows keeps for devices, with or without a suffix.
_DEVICES = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)$", re.IGNORECASE)
#: Longest stem of a file name that is given out, in characters.
_LONGEST_STEM = 80
#: What looks like the suffix of a file, and not like the end of "wood 1.2".
_NAME_SUFFIX = re.compile(r"\.[A-Za-z][A-Za-z0-9]{1,4}$")
_SUFFIX = {"JPEG": "jpg", "TIFF": "tif", "MPO": "jpg", "JPEG2000": "jp2"}
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
                remedy="put it back, or ingest the model anew",
            ) from None
        if hashlib.sha256(data).hexdigest() != self.sha256:
            raise InputError(
                "PTM-I252",
                "has changed since the model was ingested",
                file=self.label,
                remedy="ingest the model anew",
            )
        return data


@dataclass(frozen=True)
class Decoded:
    """What ingest needs of an image: its number, and (H, W) bool, rows from the top, which
    texels are not opaque; None where all are."""

    index: int
    holes: NDArray[np.bool_] | None


class ImageStore:
    """Images by digest, in the order in which they were first asked for."""

    def __init__(self, findings: Findings) -> None:
        self._findings = findings
        self._found: dict[str, Decoded] = {}
        self._images: list[SourceImage] = []
        self._stems: set[str] = set()

    @property
    def images(self) -> tuple[SourceImage, ...]:
        return tuple(self._images)

    def add(self, texture: Texture) -> Decoded | None:
        """The image of a texture, or None (and a miss is recorded) if it cannot be decoded."""
        data = self._read(texture)
        if data is None:
            return None
        digest = hashlib.sha256(data).hexdigest()
        if digest not in self._found:
            opened = self._decode(texture, data)
            if opened is None:
                return None
            name = self._name(texture.label, opened.format or "")
            load = VerifiedBytes(texture.read, digest, texture.label)
            self._found[digest] = Decoded(len(self._images), _holes(opened))
            self._images.append(SourceImage(name, digest, load))
        return self._found[digest]

    def mask_holes(self, mask: Texture) -> NDArray[np.bool_] | None:
        """(H, W) which texels of a mask (``map_d``) are not opaque; all, if it is unreadable."""
        data = self._read(mask)
        opened = None if data is None else self._decode(mask, data)
        if opened is None:
            return np.ones((1, 1), dtype=bool)
        if mask.channel in ("", "m") and opened.has_transparency_data:
            return _holes(opened)
        band = _MASK_BANDS.get(mask.channel)
        if opened.mode.startswith("I"):  # 16 bits, which convert() would clip
            holes = np.asarray(opened) < 65535
        elif band:
            holes = np.asarray(opened.convert("RGB").getchannel(band)) < 255
        else:
            holes = np.asarray(opened.convert("L")) < 255
        return holes if holes.any() else None

    def _read(self, texture: Texture) -> bytes | None:
        try:
            return texture.read()
        except OSError as error:
            reason = error.strerror or str(error)
            self._findings.miss("PTM-N206", f"{texture.what}: {reason}", texture.place)
            return None

    def _decode(self, texture: Texture, data: bytes) -> Image.Image | None:
        from PIL import Image

        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                opened = Image.open(io.BytesIO(data))
                opened.load()
        except Image.DecompressionBombError:
            reason = "too large to be a texture"
        except Exception as error:  # Pillow's plug-ins raise whatever a damaged file provokes
            reason = "empty file" if not data else "not a readable image"
            if isinstance(error, OSError) and data and "identify" not in str(error):
                reason = f"damaged image ({error})"
        else:
            return opened
        self._findings.miss("PTM-N206", f"{texture.what}: {reason}", texture.place)
        return None

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
        return f"{unique}.{_SUFFIX.get(kind, kind.lower())}"


def _holes(opened: Image.Image) -> NDArray[np.bool_] | None:
    """(H, W) which texels have an alpha below 255, or None if none has."""
    if not opened.has_transparency_data:
        return None
    holes = np.asarray(opened.convert("RGBA").getchannel("A")) < 255
    return holes if holes.any() else None
