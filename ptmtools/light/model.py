"""The surfaces of a cell, and the light of a building as stored."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, Singles
from ptmtools.store.archive import Stored


@dataclass(frozen=True)
class CellSurfaces:
    """The surfaces of one cell.

    Attributes
    ----------
    corner: (n, 3, 3) float32 metres.
    object, shape: (n,) of the scene; of the cell, ascending.
    glass: (n,) whether the surface has no light of its own: it is seen through, glows, or is shown
        in its own colours.
    dense: (n,) whether its light is at vertices.
    side: (n,) 1 where the front of a face counts, -1 the back, 0 the more open of the two.
    face: (n,) the triangle of the scene that it is a piece of.
    """

    corner: Singles
    object: Ints
    shape: Ints
    glass: Bools
    dense: Bools
    side: NDArray[np.int8]
    face: Ints


#: Stops below white that the codes of lightmaps cover.
STOPS = 10.0
#: Width and height of the image of a probe, and left, top and side of the map of each roughness,
#: 0 to 1, texels.
PROBE_SIZE = 192, 128
PROBE_MAPS = ((0, 0, 128), (128, 0, 64), (128, 64, 32), (160, 64, 16))


#: Images of lightmaps have this multiple of the hue of codes: chroma of whole numbers would show as
#: patches on white walls.
HUE = 3.0
#: Shares of red, green and blue in the luma of images (ITU-R BT.601).
LUMA = np.array([0.299, 0.587, 0.114])


def scale_hue(codes: Floats | Singles, factor: float) -> Floats:
    """(..., 3) codes with the same luma and a multiple of their differences from it."""
    luma = np.asarray(codes @ LUMA)[..., None]
    return np.asarray(luma + factor * (codes - luma))


def light_codes(light: Floats | Singles, white: float) -> Singles:
    """Light of any shape as codes, 0 to 255, not rounded: white is 255, and half of it 255 /
    `STOPS` less."""
    share = np.maximum(light / white, 2.0**-STOPS)
    return np.asarray(255 * np.clip(1 + np.log2(share) / STOPS, 0, 1), np.float32)


def coded_light(code: NDArray[np.uint8] | Floats | Singles, white: float) -> Floats:
    """The inverse of `light_codes`; codes between whole numbers may be means of some."""
    return np.asarray(white * 2.0 ** (STOPS * (np.asarray(code, np.float64) / 255 - 1)))


#: Times that an image of codes is encoded, at most, and the mean error that needs no other.
_TRIES, _UNSEEN = 3, 0.25


def lossy_codes(texels: Singles, quality: Mapping[str, int]) -> tuple[str, bytes]:
    """The format and the image of (h, w, 3) codes of light, 0 to 255: AVIF, or WebP where Pillow
    cannot write it. ``quality``: of each format.

    Encoders round differences of colour down: whole rooms would turn green. So codes are dithered,
    and the image is encoded again without the mean error of the time before; the least counts.
    """
    from PIL import features

    from ptmtools.texture.previews import decode_preview, image_bytes

    name = "avif" if features.check("avif") else "webp"
    # Light is smooth, and its hue shows on white walls.
    full = {"subsampling": "4:4:4"} if name == "avif" else {}
    tries: list[tuple[float, bytes]] = []
    moved = np.zeros(3)
    row, column, channel = np.ogrid[tuple(map(slice, texels.shape))]
    # A sequence with little discrepancy in two dimensions (Roberts).
    noise = (0.7548777 * row + 0.5698403 * column + channel / 3) % 1 - 0.5
    for _ in range(_TRIES):
        rounded = np.rint(np.clip(texels + noise - moved, 0, 255)).astype(np.uint8)
        data = image_bytes(rounded, name, quality[name], **full)
        error = (decode_preview(data, 3) - texels).mean(axis=(0, 1), dtype=np.float64)
        tries.append((float(np.abs(error).max()), data))
        if tries[-1][0] <= _UNSEEN:
            break
        moved += error
    return name, min(tries, key=lambda attempt: attempt[0])[1]


@dataclass(frozen=True)
class Light:
    """The light of all cells, in the order of triangles and shapes of `output.geometry.Geometry`:
    irradiance / pi in linear colours (Rec. 709), in units in which the usual exposure is 1.

    Attributes
    ----------
    side: (C,) int32 texels, width and height of the lightmap of each cell; 0 without one.
    white: (C,) the light of each cell of which codes and `vertex` are shares.
    exposure: (C, 3) the factors with which red, green and blue light show while the eye is in the
        cell.
    lit, mapped: (S,) whether a shape has light, and whether in the lightmap of its cell; else it is
        at its vertices.
    uv: (M, 3, 2) float32 coordinates in that lightmap, in [0, 1], origin at the lower left.
    vertex: (M, 3, 3) uint8 shares of white at the corners, encoded as sRGB; 255 where it is not at
        vertices.
    horizon: (2, 3) radiance of the sky and of the ground.
    shine: (M, 3) radiance that materials send that are lamps; 0 of others.
    reflects: (S,) whether a shape shows the probe of its cell.
    probe: (C, 11) of each cell white and mean, centre and the corners of the box, see `Probe`; 0
        without one.
    toned: whether the light shows by a tone curve; else it is the model's own, of 1 at most.
    """

    side: NDArray[np.int32]
    white: Floats
    exposure: Floats
    lit: Bools
    mapped: Bools
    uv: Singles
    vertex: NDArray[np.uint8]
    horizon: Floats
    shine: Floats
    reflects: Bools
    probe: Floats
    toned: bool = True

    def display(self, tone: str) -> dict[str, Any]:
        """The member "light" of the hints, see docs/formats/hints.md, with a tone curve."""
        if not self.toned:
            return {"stops": STOPS, "tone": "plain"}
        sky, ground = np.round(self.horizon, 4).tolist()
        return {"stops": STOPS, "hue": HUE, "tone": tone, "sky": sky, "ground": ground}

    def to_arrays(self) -> dict[str, NDArray[np.generic]]:
        """The light as plain arrays."""
        return vars(self) | {"toned": np.array([self.toned])}

    @staticmethod
    def from_arrays(arrays: Mapping[str, NDArray[np.generic]]) -> Light:
        """Inverse of `to_arrays`. Raises KeyError or ValueError for other arrays."""
        stored = Stored(arrays)
        uv = stored.array("uv", np.float32, None, 3, 2, finite=True)
        if uv.size and not (uv.min() >= 0 and uv.max() <= 1):
            raise ValueError("a coordinate lies outside of its lightmap")
        side = stored.array("side", np.int32, None)
        if (side < 0).any():
            raise ValueError("a lightmap has a negative size")
        white = stored.array("white", np.float64, len(side), finite=True)
        exposure = stored.array("exposure", np.float64, len(side), 3, finite=True)
        if not ((white > 0).all() and (exposure > 0).all()):
            raise ValueError("a cell has no light of white, or no exposure")
        mapped = stored.array("mapped", np.bool_, None)
        return Light(
            side,
            white,
            exposure,
            stored.array("lit", np.bool_, len(mapped)),
            mapped,
            uv,
            stored.array("vertex", np.uint8, len(uv), 3, 3),
            stored.array("horizon", np.float64, 2, 3, finite=True),
            stored.array("shine", np.float64, None, 3, finite=True),
            stored.array("reflects", np.bool_, len(mapped)),
            stored.array("probe", np.float64, len(side), 11, finite=True),
            bool(stored.array("toned", np.bool_, 1)[0]),
        )
