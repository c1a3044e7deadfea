"""Texture lookup as OpenGL and WebGL define it: a box-filtered pyramid, trilinear, isotropic.

A pixel that covers several texels of a repeated or finely drawn texture shows their mean in a
browser and one of them in a bilinear lookup of the full image, so pictures to be held against a
browser's are looked up as it does (OpenGL 4.6, §8.14): the level is log2 of the longer of the two
footprint sides in texels, levels are 2 × 2 means rounded to 8 bits, and two of them are blended.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.scene.model import Material


@dataclass(frozen=True)
class Pyramid:
    """An image and its smaller levels.

    Attributes
    ----------
    levels: (h, w, 4) uint8 each, rows from the top, the full image first, 1 × 1 last.
    """

    levels: tuple[NDArray[np.uint8], ...]

    @staticmethod
    def of(image: NDArray[np.uint8], floored: bool = False) -> Pyramid:
        """The pyramid of an (h, w, 4) image; an odd last row or column is left out of the mean.

        ``floored``: means are rounded down, as those of a `.ptm` are.
        """
        levels = [image]
        while max(levels[-1].shape[:2]) > 1:
            h, w = levels[-1].shape[:2]
            rows, columns = max(h // 2, 1), max(w // 2, 1)
            even = levels[-1][: rows * min(h, 2), : columns * min(w, 2)].astype(np.uint16)
            blocks = even.reshape(rows, min(h, 2), columns, min(w, 2), 4)
            total = blocks.sum(axis=(1, 3))
            count = blocks.shape[1] * blocks.shape[3]
            half = 0 if floored else count // 2
            levels.append(((total + half) // count).astype(np.uint8))
        return Pyramid(tuple(levels))

    def reduced(self, side: int) -> Pyramid:
        """Without the levels whose longer side is above this, texels; 0 keeps all."""
        levels = [x for x in self.levels if not side or max(x.shape[:2]) <= side]
        return Pyramid(tuple(levels) or self.levels[-1:])

    def bilinear(
        self, level: int, uv: NDArray[np.float64], material: Material
    ) -> NDArray[np.float32]:
        """(n, 4) samples of one level at (n, 2) texture coordinates, v upwards, in 0…1."""
        image = self.levels[level]
        h, w = image.shape[:2]
        corners = []
        for t, n, wrap in ((uv[:, 0], w, material.wrap_s), (1 - uv[:, 1], h, material.wrap_t)):
            x = t * n - 0.5
            low = np.floor(x)
            pair = [low.astype(np.int64), low.astype(np.int64) + 1]
            pair = [i % n if wrap == "repeat" else np.clip(i, 0, n - 1) for i in pair]
            corners.append((*pair, (x - low).astype(np.float32)[:, None]))
        (x0, x1, fx), (y0, y1, fy) = corners
        top = image[y0, x0] * (1 - fx) + image[y0, x1] * fx
        bottom = image[y1, x0] * (1 - fx) + image[y1, x1] * fx
        return np.asarray((top * (1 - fy) + bottom * fy) / np.float32(255), dtype=np.float32)

    def trilinear(
        self, uv: NDArray[np.float64], footprint: NDArray[np.float64], material: Material
    ) -> NDArray[np.float32]:
        """(n, 4) samples; ``footprint`` (n, 2, 2): how uv changes to the next pixel right, up."""
        h, w = self.levels[0].shape[:2]
        sides = np.linalg.norm(footprint * [w, h], axis=2).max(axis=1)
        level = np.clip(np.log2(np.maximum(sides, 1e-9)), 0, len(self.levels) - 1)
        whole = np.floor(level).astype(np.int64)
        part = (level - whole).astype(np.float32)[:, None]
        out = np.empty((len(uv), 4), dtype=np.float32)
        for k in np.unique(whole):
            chosen = whole == k
            fine = self.bilinear(k, uv[chosen], material)
            coarse = self.bilinear(min(k + 1, len(self.levels) - 1), uv[chosen], material)
            out[chosen] = fine + (coarse - fine) * part[chosen]
        return out
