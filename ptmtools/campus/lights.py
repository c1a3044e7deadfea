"""Where the light of a surface comes from: rays, or the lightmap of the model."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints, Singles
from ptmtools.campus.occlusion import Surroundings, light, normals, outermost
from ptmtools.scene.source import SourceWrap

#: (n,) faces, (n, 3) points on them, (n,) shares of a circle by which points differ → (n,) linear
#: light from 0 to 1.
Look = Callable[[Ints, Floats, Floats], Singles]
#: What n rays leave of grain is within this, divided by the root of n.
_GRAIN = 0.8


@dataclass(frozen=True)
class Rays:
    """The light of (T, 3, 3) faces by rays along (T, 3) unit normals; see `light`.

    Faces that are up to ``error`` metres off the surface that they stand for have its light.
    """

    around: Surroundings
    normal: Floats
    samples: int
    reach: float
    error: float = 0.0

    @staticmethod
    def of(
        around: Surroundings,
        corner: Floats,
        samples: int,
        reach: float,
        error: float = 0.0,
        side: Floats | float = 1.0,
    ) -> Rays:
        """Of faces that are lit on (T,) sides, 1 the front and -1 the back."""
        normal = normals(corner) * np.broadcast_to(side, len(corner))[:, None]
        return Rays(around, normal, samples, reach, error)

    @property
    def grain(self) -> float:
        """By how much the light found at a point may differ from that found beside it, where it is
        the same."""
        return _GRAIN / math.sqrt(self.samples)

    def __call__(self, face: Ints, point: Floats, turn: Floats) -> Singles:
        normal = self.normal[face]
        place = outermost(self.around, point, normal, self.error)
        return light(self.around, place, normal, turn, self.samples, self.reach)


@dataclass(frozen=True)
class LightImage:
    """A lightmap of the model as a material has it.

    Attributes
    ----------
    texels: (h, w) linear light in 255ths, rows from the top; materials share those of one image.
    wrap: beyond [0, 1], across and up.
    strength: how much of the light it decides, in [0, 1]; the rest is white.
    """

    texels: NDArray[np.uint8]
    wrap: tuple[SourceWrap, SourceWrap] = ("repeat", "repeat")
    strength: float = 1.0


@dataclass(frozen=True)
class Painted:
    """The light of a model's own lightmap.

    Attributes
    ----------
    corner, uv: (T, 3, 3) and (T, 3, 2), of the model's faces; uv from the lower left.
    image: (T,) index into `images`, -1 for faces without, which are white.
    images: see `LightImage`.
    source: (F,) for each face that is asked about the one of the model's that it came from.
    """

    corner: Floats
    uv: Floats
    image: NDArray[np.int32]
    images: tuple[LightImage, ...]
    source: NDArray[np.integer[Any]]

    @property
    def grain(self) -> float:
        """None: what is painted is exact."""
        return 0.0

    def __call__(self, face: Ints, point: Floats, turn: Floats) -> Singles:
        of = self.source[face]
        a, b, c = np.moveaxis(self.corner[of], 1, 0)
        u, v, w = b - a, c - a, point - a
        uu, uv, vv = (np.einsum("nk,nk->n", p, q) for p, q in ((u, u), (u, v), (v, v)))
        wu, wv = (np.einsum("nk,nk->n", w, q) for q in (u, v))
        area = np.maximum(uu * vv - uv * uv, np.finfo(float).tiny)
        share = np.stack([(vv * wu - uv * wv) / area, (uu * wv - uv * wu) / area], axis=1)
        # A coarse face may lie beyond the face that it came from.
        share = np.clip(share, 0.0, 1.0)
        share /= np.maximum(share.sum(axis=1, keepdims=True), 1.0)
        corners = self.uv[of]
        at = corners[:, 0] + share[:, :1] * (corners[:, 1] - corners[:, 0])
        at += share[:, 1:] * (corners[:, 2] - corners[:, 0])
        found = np.ones(len(point), np.float32)
        for index, image in enumerate(self.images):
            these = self.image[of] == index
            found[these] = 1 - image.strength * (1 - _bilinear(image, at[these]))
        return found


def _bilinear(image: LightImage, at: Floats) -> Singles:
    """(n,) of an image at (n, 2) coordinates from its lower left."""
    texels, (across, up) = image.texels, image.wrap
    left, right, s = _between(at[:, 0], texels.shape[1], across)
    above, below, t = _between(1 - at[:, 1], texels.shape[0], up)
    upper = texels[above, left] * (1 - s) + texels[above, right] * s
    lower = texels[below, left] * (1 - s) + texels[below, right] * s
    return np.asarray((upper * (1 - t) + lower * t) / 255, np.float32)


def _between(at: Floats, count: int, wrap: SourceWrap) -> tuple[Ints, Ints, Floats]:
    """The two of ``count`` texels in a row between whose centres coordinates lie, and the share of
    the second."""
    if wrap == "mirror":
        at = 1 - np.abs(1 - at % 2)
    place = (at % 1 if wrap == "repeat" else np.clip(at, 0, 1)) * count - 0.5
    first = np.floor(place).astype(np.int64)
    if wrap == "repeat":
        return first % count, (first + 1) % count, place - first
    return np.maximum(first, 0), np.minimum(first + 1, count - 1), place - first
