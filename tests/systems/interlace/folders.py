"""Images for the tests of interlaced folders."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture import Picture
from ptmtools_systems.interlace import InterlaceOptions, interlace, write_folder

#: Minimum of all test folders.
SMALL = 4


def image(
    height: int = 16, width: int = 32, components: int = 3, kind: str = "uint8", seed: int = 5
) -> NDArray:
    """A smooth image with some grain, every sample of which differs from its neighbours'."""
    y, x, c = np.ogrid[0:height, 0:width, 0:components]
    grain = np.random.default_rng(seed).integers(0, 9, (height, width, components))
    texels = 7 * x + 5 * y + 40 * c + grain
    if kind == "uint16":
        texels = texels * 181 + 3
    return texels.astype(kind)


def folder_of(path: Path, texels: NDArray, format: str = "png", smallest: int = SMALL) -> Path:
    """A folder that holds an image interlaced."""
    write_folder(path, interlace(Picture(texels), InterlaceOptions(smallest, format)))
    return path
