"""Converts between linear light and sRGB (IEC 61966-2-1), and computes gradients over triangles.

Rejected for gradients: inverting the Gram matrix of two edges. It squares the rounding error on
slivers, by which gradients of one model of furniture were off by 2e-9, and gives the same levels.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints


def to_srgb(light: Floats) -> Floats:
    """Linear light of any shape, encoded in sRGB, both from 0 to 1; values are clipped, and NaN
    is 0."""
    clipped = np.clip(np.nan_to_num(light, nan=0.0), 0.0, 1.0)
    bright = np.where(clipped < 1, 1.055 * clipped ** (1 / 2.4) - 0.055, 1.0)  # exact at 1
    return np.where(clipped <= 0.0031308, 12.92 * clipped, bright)


def encode_srgb(light: Floats) -> NDArray[np.uint8]:
    """Linear light as sRGB bytes."""
    return np.rint(255 * to_srgb(light)).astype(np.uint8)


def color_bytes(colors: Floats) -> NDArray[np.uint8]:
    """Colours from 0 to 1 as bytes; values are clipped, and NaN is 0."""
    return np.rint(255 * np.clip(np.nan_to_num(colors), 0.0, 1.0)).astype(np.uint8)


def to_linear(encoded: Floats) -> Floats:
    """The inverse of `to_srgb`."""
    clipped = np.clip(encoded, 0.0, 1.0)
    return np.where(clipped <= 0.04045, clipped / 12.92, ((clipped + 0.055) / 1.055) ** 2.4)


def luminance(light: Floats) -> Floats:
    """(...,) of (..., 3) linear light (ITU-R BT.709)."""
    return np.asarray(light @ np.array([0.2126, 0.7152, 0.0722]))


def pack_colors(colors: NDArray[np.uint8]) -> Ints:
    """(...,) one number for each of (..., 3) colours."""
    red, green, blue = np.moveaxis(colors.astype(np.int64), -1, 0)
    return np.asarray(red << 16 | green << 8 | blue)


def unpack_colors(numbers: Ints) -> NDArray[np.uint8]:
    """The inverse of `pack_colors`."""
    return np.stack([numbers >> 16, numbers >> 8, numbers], axis=-1).astype(np.uint8)


def gradients(corners: Floats, uv: Floats) -> Floats:
    """(T, k, 3) gradients of texture coordinates, or other values of corners, in the plane of each
    triangle, per metre; 0 for triangles without area.

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
