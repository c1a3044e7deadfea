"""numpy's `.npy`, of which the head is judged before any memory is taken for the texels."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, BinaryIO

from ptmtools.errors import InputError
from ptmtools.texture.images.picture import Picture, check_size, damaged_image, unsupported
from ptmtools.texture.model import Limits
from ptmtools.texture.samples import KINDS

if TYPE_CHECKING:
    import numpy as np

MAGIC = b"\x93NUMPY"
#: Longest head that is read, bytes, and the largest side that an array may have.
_HEAD_MAX, _SIDE_MAX = 1 << 16, (1 << 63) - 1
#: The fields of a head; old numpys wrote an L behind numbers.
_FIELDS = (
    re.compile(rb"""['"]descr['"]\s*:\s*['"]([<>=|]?[A-Za-z]\d{0,4})['"]"""),
    re.compile(rb"""['"]fortran_order['"]\s*:\s*(True|False)"""),
    re.compile(rb"""['"]shape['"]\s*:\s*\(((?:\s*\d{1,19}L?\s*,){0,9}\s*(?:\d{1,19}L?)?)\s*\)"""),
)


def read_npy(file: BinaryIO, path: str | None, limits: Limits) -> Picture:
    """An array (h, w) or (h, w, 1 to 4), mapped if it is a file.

    Raises InputError PTM-I125, PTM-I126, LimitError PTM-L104.
    """
    import numpy as np

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
    if height < 1 or width < 1:
        raise damaged_image("no texels")
    texel_bytes = components * dtype.itemsize
    check_size(width, height, texel_bytes, None if path is not None else limits)
    start, end = file.tell(), file.seek(0, 2)
    size = height * width * texel_bytes
    if end - start < size:
        raise damaged_image(f"after {end} of {start + size} bytes")
    order: Any = "F" if in_columns else "C"
    texels: np.ndarray[Any, Any]
    if path is not None:
        texels = np.memmap(path, dtype, "r", start, shape, order)
    else:
        file.seek(start)
        texels = np.ndarray(shape, dtype, file.read(size), order=order)
    return Picture(texels)


def _head(file: BinaryIO) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Shape, whether columns come first, type; the file then stands at the samples.

    The head is Python's notation of a dictionary. It is matched: numpy's reader evaluates it, which
    some heads make run out of memory.
    """
    import numpy as np

    file.seek(len(MAGIC))
    try:
        major, _ = file.read(2)
        size = int.from_bytes(file.read(2 if major == 1 else 4), "little")
        if not 1 <= major <= 3 or size > _HEAD_MAX:
            raise ValueError("a head of another version, or too long")
        text = file.read(size)
        descr, order, sides = (found[1].decode() for found in map(_field(text), _FIELDS))
        shape = tuple(int(side.rstrip("L")) for side in sides.replace(" ", "").split(",") if side)
        if len(text) < size or max(shape, default=0) > _SIDE_MAX:
            raise ValueError("an impossible shape, or the end of the file")
        return shape, order == "True", np.dtype(descr)
    except (TypeError, ValueError) as error:
        raise damaged_image(error or "in its head") from None


def _field(text: bytes) -> Callable[[re.Pattern[bytes]], re.Match[bytes]]:
    def find(field: re.Pattern[bytes]) -> re.Match[bytes]:
        if found := field.search(text):
            return found
        raise ValueError("a head that is none of an array of numbers")

    return find
