"""numpy's `.npy`, of which the head is judged before any memory is taken for the texels."""

from __future__ import annotations

import io
from typing import IO, Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import InputError
from ptmtools.texture.images.picture import (
    Picture,
    check_size,
    damaged_image,
    raster,
    unsupported,
)
from ptmtools.texture.model import Description, Limits
from ptmtools.texture.samples import KINDS

MAGIC = b"\x93NUMPY"
#: Longest head that is read, bytes: numpy evaluates it, and writes 118 for an image.
_HEAD_MAX = 1 << 12


def read_npy(file: BinaryIO, path: str | None, limits: Limits) -> Picture:
    """An array (h, w) or (h, w, 1 to 4), mapped if it is a file.

    Raises InputError PTM-I125, PTM-I126, LimitError PTM-L104.
    """
    shape, in_columns, dtype = _head(file)
    components = shape[2] if len(shape) == 3 else 1
    if len(shape) not in (2, 3) or not 1 <= components <= 4:
        raise InputError(
            "PTM-I126",
            f"holds an array of shape {shape}; an image has the shape (height, width) or "
            "(height, width, 1 to 4 components)",
            remedy="reshape it",
        )
    if dtype.name not in KINDS:
        raise unsupported(f"samples of type {dtype}")
    height, width = shape[:2]
    check_size(width, height, components * dtype.itemsize, None if path is not None else limits)
    return Picture(raster(file, path, dtype, shape, "F" if in_columns else "C"))


def save_npy(file: IO[bytes], texels: NDArray[Any], description: Description) -> None:
    """(h, w, c) of any kind as an array of that shape, without the description."""
    np.lib.format.write_array(file, np.ascontiguousarray(texels), allow_pickle=False)


def _head(file: BinaryIO) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Shape, whether columns come first, type; the file then stands at the samples."""
    from numpy.lib import format as npy

    file.seek(0)
    head = io.BytesIO(file.read(_HEAD_MAX))
    try:
        # Version 3 differs in the names of fields only, which no image has.
        readers = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
        shape, in_columns, dtype = readers[npy.read_magic(head)](head)
    except Exception as error:  # a damaged head can make Python's parser raise nearly anything
        raise damaged_image(f"in its head: {error}") from None
    file.seek(head.tell())
    return shape, in_columns, dtype
