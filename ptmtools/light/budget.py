"""The light that a building has by default: as much as costs little beside its images.

Lightmaps are to have at most a tenth of the bytes of the model's images. Fewer texels to the metre
are tried before there is no light at all: an office with one image of 60 kB would get lightmaps of
390 kB.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ptmtools.arrays import areas
from ptmtools.light.atlas import FILLED
from ptmtools.light.cells import Piece

#: The largest share of the bytes of the images.
SHARE = 0.1
#: The least share of the texels to the metre.
LEAST = 0.5
#: Texels of the smallest lightmap: a building with fewer shows no light, but is of another scale.
_SMALLEST = 16**2
#: Bytes of a texel (0.24 in a hospital, 0.25 in an office, 0.38 in a museum).
_TEXEL_BYTES = 0.3


def rounded(images: int) -> int:
    """The bytes of images, or somewhat less: a power of two, so that light stays the same if they
    are repainted; 0 for none."""
    return 1 << images.bit_length() - 1 if images else 0


def expected_bytes(pieces: Sequence[Piece], density: float) -> float:
    """The bytes that lightmaps are expected to have; ``density``: texels to the metre."""
    flat = (each.corner[~each.dense & ~each.glass] for each in pieces)
    area = sum(float(areas(corner.astype(np.float64)).sum()) for corner in flat)
    return area / FILLED * density**2 * _TEXEL_BYTES


def affordable(pieces: Sequence[Piece], density: float, images: int) -> float:
    """The texels to the metre of lightmaps beside images of a number of bytes (`rounded`), at most
    ``density``; 0 if light would cost too much, or there is no surface for it."""
    cost = expected_bytes(pieces, density)
    if cost < _SMALLEST * _TEXEL_BYTES:
        return 0.0
    fitting = min(1.0, math.sqrt(SHARE * images / cost))
    return density * fitting if fitting >= LEAST else 0.0
