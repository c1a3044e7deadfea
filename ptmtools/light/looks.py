"""The light of a surface, from the lightmaps of the model; the planes that faces are parts of."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, Singles, areas, plane_areas
from ptmtools.cells.search import connect
from ptmtools.errors import naming
from ptmtools.scene.source import SourceWrap
from ptmtools.tolerance import PARALLEL_COSINE

#: (n,) faces, (n, 3) points on them, (n,) shares of a circle by which points differ → (n, 3) linear
#: light in colours, or (n, 1); NaN of points that something covers.
Look = Callable[[Ints, Floats, Floats], Singles]
#: Areas, m², and densities below this count as this.
SMALLEST = 1e-30


@dataclass(frozen=True)
class LightImage:
    """A lightmap of a material of the model.

    Attributes
    ----------
    texels: (h, w) linear light in 255ths, rows from the top; materials share those of one image.
    wrap: beyond [0, 1], across and up.
    strength: its share of the light, in [0, 1]; the rest is white.
    """

    texels: NDArray[np.uint8]
    wrap: tuple[SourceWrap, SourceWrap] = ("repeat", "repeat")
    strength: float = 1.0


def red_texels(data: bytes, limit: int, label: str) -> NDArray[np.uint8]:
    """(h, w) the red channel of an image of at most ``limit`` decoded bytes, which ``label`` names
    in errors. Raises as decoding."""
    from ptmtools.texture.images import load_image
    from ptmtools.texture.model import Limits
    from ptmtools.texture.samples import in_eight_bits

    with naming(label):
        texels = in_eight_bits(load_image(data, Limits(limit)).array())
    return np.ascontiguousarray(texels[:, :, 0])


@dataclass(frozen=True)
class PaintedLight:
    """The light of a model's own lightmap.

    Attributes
    ----------
    corner, uv: (T, 3, 3) and (T, 3, 2), of the model's faces; uv from the lower left.
    image: (T,) index into `images`, -1 for faces without, which are white.
    images: see `LightImage`.
    source: (F,) the model's face of each face.
    """

    corner: Floats
    uv: Floats
    image: NDArray[np.int32]
    images: tuple[LightImage, ...]
    source: NDArray[np.integer[Any]]

    @property
    def grain(self) -> float:
        """0: painted light is exact."""
        return 0.0

    def density(self, face: Ints, area: Floats) -> float:
        """Texels to the metre of (n,) faces, on average over parts of these of (n,) m²; 0 for those
        without."""
        source = self.source[face]
        size = np.array([image.texels.size for image in self.images] + [0])[self.image[source]]
        texels = (
            size * plane_areas(self.uv[source]) / np.maximum(areas(self.corner[source]), SMALLEST)
        )
        return math.sqrt(float((texels * area).sum() / max(area.sum(), SMALLEST)))

    def __call__(self, face: Ints, point: Floats, turn: Floats) -> Singles:
        source = self.source[face]
        a, b, c = np.moveaxis(self.corner[source], 1, 0)
        u, v, w = b - a, c - a, point - a
        uu, uv, vv = (np.einsum("nk,nk->n", p, q) for p, q in ((u, u), (u, v), (v, v)))
        wu, wv = (np.einsum("nk,nk->n", w, q) for q in (u, v))
        area = np.maximum(uu * vv - uv * uv, np.finfo(float).tiny)
        share = np.stack([(vv * wu - uv * wv) / area, (uu * wv - uv * wu) / area], axis=1)
        # A coarse face may lie beyond the face that it came from.
        share = np.clip(share, 0.0, 1.0)
        share /= np.maximum(share.sum(axis=1, keepdims=True), 1.0)
        corners = self.uv[source]
        at = corners[:, 0] + share[:, :1] * (corners[:, 1] - corners[:, 0])
        at += share[:, 1:] * (corners[:, 2] - corners[:, 0])
        result = np.ones(len(point), np.float32)
        index = self.image[source]
        for number in np.unique(index[index >= 0]).tolist():
            image, these = self.images[number], index == number
            result[these] = 1 - image.strength * (1 - lookup(image, at[these]))
        return result[:, None]


def lookup(image: LightImage, at: Floats) -> Singles:
    """(n,) light of an image at (n, 2) coordinates from its lower left."""
    texels, (across, up) = image.texels, image.wrap
    first_column, second_column, s = _texel_pairs(at[:, 0], texels.shape[1], across)
    upper_row, lower_row, t = _texel_pairs(1 - at[:, 1], texels.shape[0], up)
    upper = texels[upper_row, first_column] * (1 - s) + texels[upper_row, second_column] * s
    lower = texels[lower_row, first_column] * (1 - s) + texels[lower_row, second_column] * s
    return np.asarray((upper * (1 - t) + lower * t) / 255, np.float32)


def _texel_pairs(at: Floats, count: int, wrap: SourceWrap) -> tuple[Ints, Ints, Floats]:
    """(n,) and (n,): the two of ``count`` texels in a row with coordinates between their centres,
    and (n,) the share of the second."""
    if wrap == "mirror":
        at = 1 - np.abs(1 - at % 2)
    place = (at % 1 if wrap == "repeat" else np.clip(at, 0, 1)) * count - 0.5
    first = np.floor(place).astype(np.int64)
    if wrap == "repeat":
        return first % count, (first + 1) % count, place - first
    return np.maximum(first, 0), np.minimum(first + 1, count - 1), place - first


#: Planes are followed through edges of at most this many faces.
_AT_AN_EDGE = 4


def planes(
    corner: Floats, normal: Floats, followed: Bools, cosine: float = PARALLEL_COSINE
) -> Ints:
    """(T,) for each of (T, 3, 3) faces the first face in its plane that edges connect with it, by
    way of the (T,) ``followed`` faces. Faces whose (T, 3) normals have this dot product, of either
    sign, count as of one plane."""
    count = len(corner)
    vertex = np.unique(corner.reshape(-1, 3), axis=0, return_inverse=True)[1].reshape(-1, 3)
    edge = np.sort(np.stack([vertex, np.roll(vertex, -1, axis=1)], axis=2), axis=2).reshape(-1, 2)
    order = np.lexsort((edge[:, 1], edge[:, 0]))
    edge, face = edge[order], order // 3
    pairs = [np.zeros((0, 2), np.int64)]
    for step in range(1, _AT_AN_EDGE):
        first, second = face[:-step], face[step:]
        alike = (edge[:-step] == edge[step:]).all(axis=1) & followed[first] & followed[second]
        alike &= np.abs(np.einsum("nx,nx->n", normal[first], normal[second])) >= cosine
        pairs.append(np.stack([first[alike], second[alike]], axis=1))
    joined = np.concatenate(pairs)
    return connect(count, joined)
