"""The colours of images where faces show them, from levels of at most `SIDE` texels: what surfaces
reflect, and what is seen in reflections.

A face that shows half of an image or more has the mean of all of it. One that shows a part, as of
an atlas, has the mean of that part, by as many points as it has texels, up to `_POINTS`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints, Singles
from ptmtools.scene.colors import to_linear
from ptmtools.scene.model import Scene

#: Texels of the longer side of an image, at most.
SIDE = 64
#: Points of a face, at most; and the share of an image from which on it has the colour of all.
_POINTS, _WHOLE = 32, 0.45


@dataclass(frozen=True)
class SmallImages:
    """Images of few texels, which repeat.

    Attributes
    ----------
    colors, first, size: (n, 3) float32 linear texels of all images, rows from the top; (I,) the
        first of each; (I, 2) width and height.
    """

    colors: Singles
    first: Ints
    size: Ints

    @staticmethod
    def of_texels(images: Sequence[NDArray[np.uint8]]) -> SmallImages:
        """``images``: (h, w, 3) sRGB."""
        colors = [to_linear(texels / 255).astype(np.float32).reshape(-1, 3) for texels in images]
        size = np.array([texels.shape[1::-1] for texels in images], np.int64).reshape(-1, 2)
        first = np.cumsum([0, *map(len, colors)])[:-1]
        return SmallImages(np.concatenate([np.zeros((0, 3), np.float32), *colors]), first, size)

    def texels(self, image: Ints, at: Floats) -> Singles:
        """(n, 3) the texels of (n,) images that are nearest to (n, 2) places."""
        size = self.size[image]
        place = np.stack([at[:, 0] % 1.0, (1 - at[:, 1]) % 1.0], axis=1) * size
        column, row = np.minimum(place.astype(np.int64), size - 1).T
        return np.asarray(self.colors[self.first[image] + row * size[:, 0] + column])


def image_colors(scene: Scene, images: SmallImages, mean: Floats) -> Floats:
    """(T, 3) mean linear colours of what faces show of their images, white without one. ``mean``:
    (I, 3) of all of each image, with the variance that its small form lacks."""
    image = np.array([m.image for m in scene.materials], np.int64)[scene.triangle_material]
    result = np.ones((len(image), 3))
    rows = np.flatnonzero(image >= 0)
    size = images.size[image[rows]]
    a, b, c = np.moveaxis(scene.uv[rows], 1, 0)
    along, across = (b - a) * size, (c - a) * size
    area = np.abs(along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0]) / 2
    count = np.clip(np.ceil(area), 1, _POINTS)
    whole = area > _WHOLE * size.prod(axis=1)
    result[rows[whole]] = mean[image[rows[whole]]]
    total, lost = np.zeros((len(rows), 3)), np.ones((len(mean), 3))
    for number, (first, texels) in enumerate(zip(images.first, images.size.prod(1), strict=True)):
        small = images.colors[first : first + texels].mean(axis=0, dtype=np.float64)
        np.divide(mean[number], small, out=lost[number], where=small > 0)
    for k in range(_POINTS):
        more = np.flatnonzero(~whole & (count > k))
        # Points of a triangle with little discrepancy, those of a square, folded: first its middle.
        u, v = (1 / 3 + k * 0.7548777) % 1, (1 / 3 + k * 0.5698403) % 1
        u, v = (u, v) if u + v <= 1 else (1 - u, 1 - v)
        at = a[more] + u * (b[more] - a[more]) + v * (c[more] - a[more])
        total[more] += images.texels(image[rows[more]], at)
    part = total[~whole] / count[~whole, None]
    result[rows[~whole]] = np.clip(part * lost[image[rows[~whole]]], 0, 1)
    return result
