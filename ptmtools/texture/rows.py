"""An image to encode: an array, or whatever gives its rows when asked."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import InputError, LimitError
from ptmtools.texture.model import MAX_COMPONENTS, MAX_SIDE
from ptmtools.texture.samples import KINDS

Samples = NDArray[Any]


class Rows(Protocol):
    """An image whose rows can be had: an array, a memory map, or what reads them from a file."""

    @property
    def shape(self) -> tuple[int, ...]:
        """(h, w) or (h, w, c)."""

    @property
    def dtype(self) -> np.dtype[Any]:
        """Of the samples."""

    def __getitem__(self, rows: slice, /) -> Samples:
        """Those rows, (n, w) or (n, w, c)."""


class ImageRows:
    """The image as (h, w, c) rows of a native dtype. Raises InputError PTM-I110."""

    def __init__(self, image: Rows) -> None:
        if not (hasattr(image, "shape") and hasattr(image, "dtype")):
            raise InputError(
                "PTM-I110",
                f"{type(image).__name__} is not an array",
                remedy="use numpy.asarray(image)",
            )
        self._rows = image
        shape, dtype = tuple(image.shape), np.dtype(image.dtype)
        fits = len(shape) in (2, 3) and 0 not in shape and dtype.name in KINDS
        self.height, self.width, self.components = (*shape, 1)[:3] if fits else (0, 0, 0)
        if not fits or self.components > MAX_COMPONENTS:
            raise InputError(
                "PTM-I110",
                f"an array of shape {shape} and type {dtype} is not an image",
                remedy="it must be (height, width) or (height, width, 1 to 4) of "
                f"{', '.join(KINDS)}, and not empty",
            )
        if max(self.width, self.height) > MAX_SIDE:
            raise LimitError(
                "PTM-L102",
                f"the image is {self.width} x {self.height} texels; the format allows {MAX_SIDE} "
                "a side",
                remedy="scale it down",
            )
        self.dtype = dtype.newbyteorder("=")
        self.shape = (self.height, self.width, self.components)

    def __getitem__(self, rows: slice) -> Samples:
        part = np.asarray(self._rows[rows])
        # The kernels are compiled for writable, contiguous arrays only.
        return np.require(
            part.reshape(-1, self.width, self.components), self.dtype, requirements=["C", "W"]
        )
