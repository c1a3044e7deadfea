"""Linear light and sRGB (IEC 61966-2-1).

How textures and colours lie on triangles.

Tried: inverting the Gram matrix of two edges. It squares what is lost to rounding on slivers, of
which one model of furniture had gradients that were off by 2e-9, and gives the same levels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats


def to_srgb(light: Floats) -> Floats:
    """Linear light, any shape, as it is encoded in sRGB, both from 0 to 1; what is outside, and
    what is no number, is brought into that."""
    held = np.clip(np.nan_to_num(light, nan=0.0), 0.0, 1.0)
    bright = np.where(held < 1, 1.055 * held ** (1 / 2.4) - 0.055, 1.0)  # 1 is 1, to the last bit
    return np.where(held <= 0.0031308, 12.92 * held, bright)


def encoded(light: Floats) -> NDArray[np.uint8]:
    """Linear light as bytes of sRGB."""
    return np.rint(255 * to_srgb(light)).astype(np.uint8)


def to_linear(encoded: Floats) -> Floats:
    """The inverse of `to_srgb`."""
    held = np.clip(encoded, 0.0, 1.0)
    return np.where(held <= 0.04045, held / 12.92, ((held + 0.055) / 1.055) ** 2.4)


def packed(colors: NDArray[np.uint8]) -> NDArray[np.int64]:
    """(...,) a number for each of (..., 3) colours."""
    red, green, blue = np.moveaxis(colors.astype(np.int64), -1, 0)
    return np.asarray(red << 16 | green << 8 | blue)


def unpacked(numbers: NDArray[np.int64]) -> NDArray[np.uint8]:
    """The inverse of `packed`."""
    return np.stack([numbers >> 16, numbers >> 8, numbers], axis=-1).astype(np.uint8)


def gradients(corners: Floats, uv: Floats) -> Floats:
    """(T, k, 3) how the texture coordinates u and v, or other values of corners, change along the
    plane of each triangle, per metre; 0 for triangles without area.

    Parameters
    ----------
    corners: (T, 3, 3) metres. uv: (T, 3, k).
    """
    ab, ac = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(ab, ac)
    square = np.maximum((normal**2).sum(axis=1), np.finfo(np.float64).tiny)[:, None]
    along_b, along_c = np.cross(ac, normal) / square, np.cross(normal, ab) / square
    b, c = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    return np.asarray(b[:, :, None] * along_b[:, None] + c[:, :, None] * along_c[:, None])
