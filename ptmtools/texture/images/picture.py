"""An image as read, its rows and description, and the size that its file declares.

The declared size is checked before a decoder takes memory or time.

Pillow's plug-ins give the size of most formats before they unpack anything. The exceptions:

- All: a file may itself be larger than any image of its declared size, and be sparse on the disk.
- WebP: its decoder takes two canvases of the declared size as it is opened (RIFF container, RFC
  9649, sections 2.5 to 2.7).
- JPEG: every scan of a progressive file goes over the whole image, and an empty scan takes a few
  bytes (ITU T.81, B.2.1): a file of 1 MB can hold scans that take days to decode.
- TIFF: a tile has a size of its own, and a buffer is taken for it (TIFF 6.0, section 15).
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from ptmtools.errors import InputError, LimitError, OutputError
from ptmtools.texture.model import MAX_SIDE, Description, Limits
from ptmtools.texture.sources import RowSource, Samples

#: Texels taken from an image at a time, about.
_STRIP_TEXELS = 1 << 18


class LossySource(NamedTuple):
    """The image file that texels were lossy in: the name of its format, and its bytes."""

    format: str
    bytes: int


@dataclass(frozen=True)
class Picture:
    """An image that can be encoded.

    Attributes
    ----------
    texels: rows from the top, (h, w, c) of uint8, uint16, float16 or float32: an array, or an
        object that returns one when sliced.
    description: colour and orientation, as the file has them.
    lossy: the source of the texels if its format discards detail, as JPEG does; else None.
    """

    texels: RowSource
    description: Description = Description()  # noqa: RUF009  # frozen
    lossy: LossySource | None = None

    def array(self) -> Samples:
        """All texels, (h, w, c)."""
        height, width, *components = self.texels.shape
        whole = self.texels[0:height]
        return whole if components else whole.reshape(height, width, 1)

    def upright(self) -> Picture:
        """The orientation applied to the texels; they are then all in memory."""
        if self.description.orientation == 1:
            return self
        texels = orient(self.array(), self.description.orientation)
        return replace(self, texels=texels, description=replace(self.description, orientation=1))


def orient(texels: Samples, orientation: int) -> Samples:
    """Texels in display order, given EXIF's orientation, 1 to 8; a view."""
    if orientation in (5, 6, 7, 8):
        texels = texels.swapaxes(0, 1)
    if orientation in (2, 3, 6, 7):
        texels = texels[:, ::-1]
    if orientation in (3, 4, 7, 8):
        texels = texels[::-1]
    return texels


@dataclass(frozen=True)
class Strips:
    """Rows that are produced on demand, a strip at a time.

    Attributes
    ----------
    shape, dtype: of the whole.
    make: ``make(y0, y1)`` gives those rows, (y1 - y0, w, c).
    """

    shape: tuple[int, int, int]
    dtype: np.dtype[Any]
    make: Callable[[int, int], Samples]

    def __getitem__(self, rows: slice) -> Samples:
        height, width, components = self.shape
        start, stop, _ = rows.indices(height)
        result = np.empty((max(0, stop - start), width, components), self.dtype)
        step = max(1, _STRIP_TEXELS // width)
        for y in range(start, stop, step):
            end = min(y + step, stop)
            result[y - start : end - start] = self.make(y, end)
        return result


def raster(
    file: BinaryIO, path: str | None, dtype: np.dtype[Any], shape: tuple[int, ...], order: Any = "C"
) -> Samples:
    """Samples from where ``file`` stands on, mapped if it is the file at ``path``.

    Raises InputError PTM-I125.
    """
    start, end = file.tell(), file.seek(0, 2)
    size = math.prod(shape) * dtype.itemsize
    if end - start < size:
        raise image_error(f"after {end} of {start + size} bytes")
    if path is not None:
        return np.memmap(path, dtype, "r", start, shape, order)
    file.seek(start)
    return np.ndarray(shape, dtype, file.read(size), order=order)


def check_size(width: int, height: int, texel_bytes: int, limits: Limits | None) -> None:
    """Raise LimitError PTM-L104 for a size that cannot be stored or exceeds the limits of decoding.

    limits: None if no memory is taken. Raises InputError PTM-I125 for no texels at all.
    """
    if min(width, height) < 1:
        raise image_error("no texels")
    if max(width, height) > MAX_SIDE:
        raise LimitError(
            "PTM-L104",
            f"is {width} x {height} texels; {MAX_SIDE} a side can be stored",
            remedy="scale it down first",
        )
    if limits and width * height * texel_bytes > limits.decoded_bytes:
        raise LimitError(
            "PTM-L104",
            f"is {width} x {height} texels of {texel_bytes} bytes, more than the limit of "
            f"{limits.decoded_bytes} bytes",
            remedy="raise the limit (--limit), or scale it down",
        )


def image_error(what: object) -> InputError:
    """The error for a file that ends too early or contradicts itself."""
    return InputError(
        "PTM-I125",
        f"is damaged or cut short ({what})",
        remedy="download or export it again",
    )


def frames_error(what: str, remedy: str = "export the one you want as PNG") -> InputError:
    """The error for a file of more than one image."""
    return InputError("PTM-I126", f"holds {what}; a texture is one image", remedy=remedy)


def samples_error(what: str) -> InputError:
    """The error for samples that no kind holds exactly."""
    return InputError(
        "PTM-I126",
        f"has {what}; supported are grey and RGB of 8 or 16 bits or 16- or 32-bit floats, with or "
        "without alpha",
        remedy="convert it yourself, so that you see what that changes",
    )


def format_error(suffix: str, texels: Samples, others: str) -> OutputError:
    """The error for an image format without such samples; ``others`` have them."""
    return OutputError(
        "PTM-O101",
        f"a .{suffix} does not hold {texels.dtype} samples",
        remedy=f"name the output {others}",
    )


#: Most bytes of a file for each byte of its texels, and most bytes besides: plain PPMs have four,
#: descriptions some megabytes.
_BYTES, _BYTES_BESIDES = 8, 1 << 24
#: Encoders make 10 scans, some for an image of four components 20.
MOST_SCANS = 100
#: A marker of JPEG that is none of those between and within the data of a scan.
_MARKER = re.compile(rb"\xff+([^\x00\xd0-\xd7\xff])", re.DOTALL)
_SCAN, _END = 0xDA, 0xD9
#: Markers of frames, the first three of those that browsers read, and the others in their range.
_FRAMES, _SENT, _NO_FRAMES = range(0xC0, 0xD0), (0xC0, 0xC1, 0xC2), (0xC4, 0xC8, 0xCC)
#: Markers without a length: the one of the beginning, and an unused one.
_BARE = (0xD8, 0x01)


def check_file(file: BinaryIO, limits: Limits) -> None:
    """Raise LimitError PTM-L104 for a file larger than one of as many texels as are allowed."""
    check_bytes(file.seek(0, 2), limits)


def check_bytes(size: int, limits: Limits) -> None:
    """As `check_file`, for a file of ``size`` bytes."""
    if size > _BYTES * limits.decoded_bytes + _BYTES_BESIDES:
        raise LimitError(
            "PTM-L104",
            f"has {size} bytes, too many for an image within the limit of "
            f"{limits.decoded_bytes} bytes of texels",
            remedy="raise the limit (--limit), or save it in another format",
        )


def check_webp(head: bytes, limits: Limits) -> None:
    """Raise LimitError PTM-L104 if a WebP file, of which ``head`` are the first 30 bytes or more,
    says that its texels, at four bytes, are more than the limit."""
    kind = head[12:16]
    if len(head) < 30:
        return
    if kind == b"VP8 ":
        width, height = (int.from_bytes(head[at : at + 2], "little") & 0x3FFF for at in (26, 28))
    elif kind == b"VP8L":
        bits = int.from_bytes(head[21:25], "little")
        width, height = 1 + (bits & 0x3FFF), 1 + (bits >> 14 & 0x3FFF)
    else:
        width, height = (1 + int.from_bytes(head[at : at + 3], "little") for at in (24, 27))
    check_size(width, height, 4, limits)


def check_jpeg(data: bytes) -> bool:
    """Whether browsers read the process of a JPEG: not arithmetic coding, and not its lossless and
    hierarchical forms (B.2.2). Raises LimitError PTM-L104 for more than `MOST_SCANS` scans."""
    scans = at = 0
    is_sent = True
    while marker := _MARKER.search(data, at):
        kind, at = marker[1][0], marker.end()
        if kind == _END:
            break
        scans += kind == _SCAN
        is_sent &= kind not in _FRAMES or kind in (*_SENT, *_NO_FRAMES)
        if scans > MOST_SCANS:
            raise LimitError(
                "PTM-L104",
                f"is a JPEG of more than {MOST_SCANS} scans",
                remedy="save it again, or as PNG",
            )
        if kind not in _BARE:
            at += max(2, int.from_bytes(data[at : at + 2], "big"))
    return is_sent


def check_tile(width: object, height: object, texel_bytes: int, limits: Limits) -> None:
    """Raise LimitError PTM-L104 if a tile of a TIFF is larger than all of an image may be; an image
    without tiles has None for their size. Raise InputError PTM-I125 for invalid sizes."""
    if width is None and height is None:
        return
    if not (isinstance(width, int) and isinstance(height, int)):
        raise image_error("in the size of its tiles")
    check_size(width, height, texel_bytes, limits)
