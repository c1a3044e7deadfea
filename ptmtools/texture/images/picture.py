"""An image as it was read: its rows, and what its file says of them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, BinaryIO

import numpy as np

from ptmtools.errors import InputError, LimitError, OutputError
from ptmtools.texture.model import MAX_SIDE, Description, Limits
from ptmtools.texture.rows import Rows, Samples

#: About so many texels are taken from an image at a time.
_STRIP_TEXELS = 1 << 18


@dataclass(frozen=True)
class Picture:
    """An image that can be encoded.

    Attributes
    ----------
    texels: rows from the top, (h, w, c) of uint8, uint16, float16 or float32: an array, or what
        makes one when it is sliced.
    description: colour and orientation, as the file has them.
    lossy: the name of the file's format where that had discarded detail, as JPEG does; else None.
    """

    texels: Rows
    description: Description = Description()  # noqa: RUF009  # frozen
    lossy: str | None = None

    def array(self) -> Samples:
        """All texels, (h, w, c)."""
        height, width, *components = self.texels.shape
        whole = self.texels[0:height]
        return whole if components else whole.reshape(height, width, 1)

    def upright(self) -> Picture:
        """The orientation applied to the texels; they are then all in memory."""
        if self.description.orientation == 1:
            return self
        texels = oriented(self.array(), self.description.orientation)
        return replace(self, texels=texels, description=replace(self.description, orientation=1))


def oriented(texels: Samples, orientation: int) -> Samples:
    """Texels as they are to be shown, given EXIF's orientation, 1 to 8; a view."""
    if orientation in (5, 6, 7, 8):
        texels = texels.swapaxes(0, 1)
    if orientation in (2, 3, 6, 7):
        texels = texels[:, ::-1]
    if orientation in (3, 4, 7, 8):
        texels = texels[::-1]
    return texels


@dataclass(frozen=True)
class Strips:
    """Rows that are made when they are asked for, a strip at a time.

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
        found = np.empty((max(0, stop - start), width, components), self.dtype)
        step = max(1, _STRIP_TEXELS // width)
        for y in range(start, stop, step):
            end = min(y + step, stop)
            found[y - start : end - start] = self.make(y, end)
        return found


def raster(
    file: BinaryIO, path: str | None, dtype: np.dtype[Any], shape: tuple[int, ...], order: Any = "C"
) -> Samples:
    """Samples from where ``file`` stands on, mapped if it is the file at ``path``.

    Raises InputError PTM-I125.
    """
    start, end = file.tell(), file.seek(0, 2)
    size = math.prod(shape) * dtype.itemsize
    if end - start < size:
        raise damaged_image(f"after {end} of {start + size} bytes")
    if path is not None:
        return np.memmap(path, dtype, "r", start, shape, order)
    file.seek(start)
    return np.ndarray(shape, dtype, file.read(size), order=order)


def check_size(width: int, height: int, texel_bytes: int, limits: Limits | None) -> None:
    """Raise LimitError PTM-L104 for what cannot be stored or is more than may be decoded.

    limits: None for what takes no memory. Raises InputError PTM-I125 for no texels at all.
    """
    if min(width, height) < 1:
        raise damaged_image("no texels")
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


def damaged_image(what: object) -> InputError:
    """The error for a file that ends too early or contradicts itself."""
    return InputError(
        "PTM-I125",
        f"is damaged or cut short ({what})",
        remedy="download or export it again",
    )


def several(what: str, remedy: str = "export the one you want as PNG") -> InputError:
    """The error for a file of more than one image."""
    return InputError("PTM-I127", f"holds {what}; a texture is one image", remedy=remedy)


def unsupported(what: str) -> InputError:
    """The error for what no kind of sample holds exactly."""
    return InputError(
        "PTM-I126",
        f"has {what}; supported are grey and RGB of 8 or 16 bits or 16- or 32-bit floats, with or "
        "without alpha",
        remedy="convert it yourself, so that you see what that changes",
    )


def not_held(suffix: str, texels: Samples, others: str) -> OutputError:
    """The error for an image format without such samples; ``others`` have them."""
    return OutputError(
        "PTM-O102",
        f"a .{suffix} does not hold {texels.dtype} samples",
        remedy=f"name the output {others}",
    )
