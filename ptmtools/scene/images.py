"""The distinct images of a scene, their names, and which of their texels are not opaque.

Each image that some face uses is read and decoded once, several at a time: a file that cannot be
decoded is found here and not hours later, and whether an alpha channel is more than 255s cannot be
known otherwise. What is kept is the digest, the means to read the bytes again, and a mask of the
texels that are not opaque where there are any, in bits. An image that declares more texels than are
allowed ends the ingest before memory is taken for it, and no format is tried but those that become
textures: Pillow would hand PostScript to an interpreter.

Images of opacities (``map_d``), which become the alpha of the image that they belong to.

Neither VRML nor the GLB cells have a second image for it."""

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
from typing import TYPE_CHECKING, Any, BinaryIO, cast

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Ints
from ptmtools.errors import InputError, LimitError, MissingComponentError, naming
from ptmtools.progress import Progress
from ptmtools.scene.model import SourceImage
from ptmtools.scene.source import FileRange, Findings, Source, SourceMaterial, Texture
from ptmtools.texture.images.picture import check_bytes, check_size
from ptmtools.texture.model import Description, Limits

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

_Bits = NDArray[np.uint8]


@dataclass(frozen=True)
class VerifiedBytes:
    """Reads an image again, and makes sure that it still is what ingest saw.

    Raises InputError if the file is gone, cannot be read, or has changed.
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
            raise InputError("PTM-I252", fault, file=self.label, remedy=remedy)
        return data


@dataclass(frozen=True)
class _Examined:
    """What was found out about an image: digest, Pillow's name for its format, whether it can be
    other than opaque, which texels are not, in bits along its rows, since a scene may have many and
    its images unfold; or the fault that keeps it from being an image."""

    sha256: str = ""
    format: str = ""
    alpha: bool = False
    width: int = 0
    bits: _Bits | None = None
    fault: str = ""

    @property
    def holes(self) -> NDArray[np.bool_] | None:
        """(H, W) bool, rows from the top, which texels are not opaque; None if all are."""
        if self.bits is None:
            return None
        return np.unpackbits(self.bits, axis=1, count=self.width).view(np.bool_)


class ImageStore:
    """Images by digest, in the order in which they were first asked for.

    ``limit`` is the most bytes that the texels of an image may take, at four for each.
    """

    def __init__(self, findings: Findings, limit: int) -> None:
        self._findings = findings
        self.limit = limit
        self._examined: dict[tuple[Callable[[], bytes], str | None], _Examined] = {}
        self._index: dict[str, int] = {}
        self._images: list[SourceImage] = []
        self._files: list[set[str]] = []
        self._parts: set[str] = set()
        self._stems: set[str] = set()

    @property
    def images(self) -> tuple[SourceImage, ...]:
        return tuple(
            replace(
                image,
                plain=image.plain and self._parts.isdisjoint(files),
                files=tuple(sorted(files)),
            )
            for image, files in zip(self._images, self._files, strict=True)
        )

    def examine(self, textures: Iterable[Texture], workers: int, progress: Progress) -> None:
        """Decodes the images of these textures, ``workers`` at a time, before they are added.

        Raises LimitError PTM-L104, PTM-L106, as do the others.
        """
        unknown = [texture for texture in textures if (texture.read, None) not in self._examined]
        wanted = {texture.read: texture for texture in reversed(unknown)}
        wanted = dict(reversed(wanted.items()))
        with _unwarned(), ThreadPoolExecutor(workers) as pool:
            examined = pool.map(lambda texture: _examine(texture, self.limit), wanted.values())
            for done, (read, found) in enumerate(zip(wanted, examined, strict=True)):
                progress(done, len(wanted), "images")
                self._examined[read, None] = found
        progress(len(wanted), len(wanted), "images")

    def add(self, texture: Texture) -> tuple[int, NDArray[np.bool_] | None] | None:
        """The number of a texture's image, and (H, W), rows from the top, which of its texels are
        not opaque, None if all are; or None (and a miss is recorded) if it cannot be decoded."""
        found = self._sound(texture)
        if found is None:
            return None
        index = self._index.setdefault(found.sha256, len(self._images))
        if index == len(self._images):
            name = self._name(texture.label, found.format)
            load = VerifiedBytes(texture.read, found.sha256, texture.label)
            self._images.append(SourceImage(name, found.sha256, load, plain=not found.alpha))
            self._files.append(set())
        if file := self._whole_file(texture):
            self._files[index].add(file)
        return index, found.holes

    def _whole_file(self, texture: Texture) -> str | None:
        """The file that an image is all of, relative to the model's folder."""
        read, folder = texture.read, self._findings.folder
        if not isinstance(read, FileRange) or read.offset or read.length is not None:
            return None
        name = Path(os.path.relpath(read.path, folder.root)).as_posix()
        return name if name in folder.sought else None

    def made_into_another(self, texture: Texture) -> None:
        """To be told of an image of whose texels another one is made."""
        if file := self._whole_file(texture):
            self._parts.add(file)

    def masks(self, mask: Texture) -> bool | None:
        """Whether some texel of a mask (``map_d``) is not opaque; None (and a miss is recorded) if
        it cannot be decoded."""
        found = self._sound(mask, mask.channel)
        return None if found is None else found.bits is not None

    def has_alpha(self, texture: Texture) -> bool | None:
        """Whether an image has an alpha channel; None (and a miss is recorded) if it cannot be
        decoded."""
        found = self._sound(texture)
        return None if found is None else found.alpha

    def holes(self, texture: Texture) -> tuple[str, NDArray[np.bool_]] | None:
        """The digest of an image, and (H, W), rows from the top, which of its texels are not
        opaque; None if all are, or (and a miss is recorded) if it cannot be decoded."""
        found = self._sound(texture)
        if found is None or (holes := found.holes) is None:
            return None
        return found.sha256, holes

    def _sound(self, texture: Texture, channel: str | None = None) -> _Examined | None:
        """What `_examine` finds, once; None (and a miss is recorded) if that is a fault."""
        key = texture.read, channel
        if key not in self._examined:
            with _unwarned():
                self._examined[key] = _examine(texture, self.limit, channel)
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


def _examine(texture: Texture, limit: int, channel: str | None = None) -> _Examined:
    """Reads and decodes an image; ``channel`` is that of a mask, see `Texture`.

    Raises LimitError PTM-L104, PTM-L106.
    """
    from ptmtools.texture.images.opening import pillow_faults

    read = texture.read
    try:
        with naming(texture.label, place=texture.place):
            if size := getattr(read, "size", None):
                check_bytes(size(), Limits(limit))
            data = read()
            opened = _decode(data, limit)
            with pillow_faults():
                bits = _holes(opened, channel)
    except LimitError:
        raise
    except InputError as error:
        return _Examined(fault=error.message)
    except OSError as error:
        return _Examined(fault=error.strerror or str(error))
    return _Examined(
        hashlib.sha256(data).hexdigest(),
        opened.format or "",
        opened.has_transparency_data,
        opened.width,
        bits,
    )


def integers(data: bytes, limit: int) -> tuple[NDArray[Any], Description]:
    """(h, w, c) texels of 8 or 16 bits, and what else an image says, to make another of it.

    ``limit`` as of `ImageStore`. Raises InputError if it cannot be decoded, or has other samples,
    LimitError PTM-L104, PTM-L106.
    """
    from ptmtools.texture.images.files import load_image

    try:
        picture = load_image(data, Limits(limit))
    except MissingComponentError as error:
        raise InputError(error.code, error.message) from None
    if picture.texels.dtype.kind != "u":
        raise InputError("PTM-I126", "its samples are floats, of which no other image is made")
    return picture.texels[0 : picture.texels.shape[0]], picture.description


def is_plain(data: bytes, name: str, limit: int) -> bool:
    """Whether an image can take the place of a plain one of this name and change nothing else of
    its scene: it can be decoded, has no alpha channel, and would have a name with that suffix.

    ``limit`` as of `ImageStore`. Raises LimitError PTM-L104, PTM-L106.
    """
    try:
        with _unwarned():
            opened = _decode(data, limit)
    except LimitError:
        raise
    except InputError:
        return False
    return not opened.has_transparency_data and name.endswith(f".{_suffix(opened.format or '')}")


@contextmanager
def _unwarned() -> Iterator[None]:
    """Pillow's warnings are not shown. For all threads, so it is entered by the first of them."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def _decode(data: bytes, limit: int) -> Image.Image:
    """Raises InputError if that cannot be, LimitError PTM-L104, PTM-L106."""
    from ptmtools.texture.images.opening import load, opened, pillow_faults

    if not data:
        raise InputError("PTM-I124", "empty file")
    limits = Limits(limit)
    with pillow_faults():
        image = opened(cast("BinaryIO", io.BytesIO(data)), limits)
        check_size(*image.size, 4, limits)
        load(image)
    return image


def _suffix(kind: str) -> str:
    return _SUFFIX.get(kind, kind.lower())


def _holes(opened: Image.Image, channel: str | None) -> _Bits | None:
    """Which texels are not opaque, a strip of rows at a time; None if all are. ``channel`` is that
    of a mask, and None for an image, of which its alpha tells."""
    mode, band = ("RGB", _MASK_BANDS[channel]) if channel in _MASK_BANDS else ("L", "L")
    if opened.has_transparency_data and channel in (None, "", "m"):
        mode, band = "RGBA", "A"
    elif channel is None:
        return None

    def clear(strip: Image.Image) -> NDArray[np.bool_]:
        if opened.mode.startswith("I"):  # 16 bits, which convert() would clip
            texels = np.asarray(strip)
            # Of an alpha there is but a colour that stands for none.
            return texels == opened.info["transparency"] if band == "A" else texels < 65535
        return np.asarray(strip.convert(mode).getchannel(band)) < 255

    width, height = opened.size
    step = max(1, _STRIP_TEXELS // width)
    tops = range(0, height, step)
    strips = (opened.crop((0, y, width, min(y + step, height))) for y in tops)
    bits = np.concatenate([np.packbits(clear(strip), axis=1) for strip in strips])
    return bits if bits.any() else None


_BANDS = {"r": 0, "g": 1, "b": 2}


@dataclass(frozen=True)
class MaskedBytes:
    """The bytes of a PNG with the colours of an image, white without one, and the opacities of a
    mask, times its own alpha; as large as the image.

    ``channel`` is that of the mask, see `Texture`, and ``limit`` as of `ImageStore`. Raises what
    reading raises, and InputError or LimitError for what cannot be decoded or has no 8 or 16 bits.
    """

    read: Callable[[], bytes] | None
    mask: Callable[[], bytes]
    channel: str
    limit: int

    def __call__(self) -> bytes:
        from ptmtools.texture.images.png import png_bytes

        opacity = _opacities(integers(self.mask(), self.limit)[0], self.channel)
        if self.read is None:
            white = np.full_like(opacity, 255)
            return png_bytes(np.stack([white, opacity], axis=2))
        texels, description = integers(self.read(), self.limit)
        alpha = _resized(opacity, texels.shape[1], texels.shape[0]) / 255
        components = texels.shape[2]
        if components in (2, 4):
            alpha *= texels[..., -1]
            components -= 1
        else:
            alpha *= np.iinfo(texels.dtype).max
        held = np.rint(alpha).astype(texels.dtype)[..., None]
        return png_bytes(np.concatenate([texels[..., :components], held], axis=2), description)


def _opacities(texels: NDArray[Any], channel: str) -> NDArray[np.uint8]:
    """(h, w) what a mask says: its matte where it has one and that is asked for, else one of its
    colours or its luminance."""
    if texels.dtype != np.uint8:
        texels = (texels >> 8).astype(np.uint8)
    matte = texels.shape[2] in (2, 4)
    if matte and channel in ("", "m"):
        return np.asarray(texels[..., -1])
    colors = texels[..., :-1] if matte else texels
    if colors.shape[2] == 1:
        return np.asarray(colors[..., 0])
    if channel in _BANDS:
        return np.asarray(colors[..., _BANDS[channel]])
    # ITU-R 601, as Pillow has it.
    return np.asarray(np.rint(colors @ np.array([0.299, 0.587, 0.114])).astype(np.uint8))


def _resized(opacity: NDArray[np.uint8], width: int, height: int) -> NDArray[np.float64]:
    from PIL import Image

    if opacity.shape != (height, width):
        image = Image.fromarray(opacity).resize((width, height), Image.Resampling.BILINEAR)
        opacity = np.asarray(image)
    return opacity.astype(np.float64)


def masked(source: Source, used: Ints, store: ImageStore, findings: Findings) -> Source:
    """The same with the masks of the materials that are ``used`` in their images.

    Raises LimitError PTM-L104, PTM-L106.
    """
    materials = list(source.materials)
    for index in used.tolist():
        materials[index] = _masked(materials[index], store, findings)
    return replace(source, materials=tuple(materials))


def _masked(given: SourceMaterial, store: ImageStore, findings: Findings) -> SourceMaterial:
    mask, texture = given.mask, given.texture
    if mask is None:
        return given
    without = replace(given, mask=None)
    through = store.masks(mask)
    if through is None:  # better see too much than too little
        return replace(without, see_through=True)
    matte = None if texture is None else store.has_alpha(texture)
    if texture is not None and texture.read == mask.read and matte and mask.channel in ("", "m"):
        return without  # it is the image's own alpha
    if not through:
        return without
    colors = None if matte is None or texture is None else texture.read
    read = MaskedBytes(colors, mask.read, mask.channel, store.limit)
    made = replace(texture or mask, read=read, what=mask.what, place=mask.place)
    for part in (texture, mask):
        if part is not None:
            store.made_into_another(part)
    if store.has_alpha(made) is None:  # which the store has said of the mask
        return replace(without, see_through=True)
    findings.say("PTM-N217", f"{mask.what}: is baked into an image as its alpha", mask.place)
    return replace(without, texture=made)
