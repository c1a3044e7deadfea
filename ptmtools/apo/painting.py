"""Colours at points of the source: materials, vertices and textures, as the model multiplies them.

Not the paper's, which leaves colour for later. Texels are those of the finest level: where samples
are farther apart, what lies between is not seen.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints, Singles
from ptmtools.scene.model import Scene

_WHITE = np.full((1, 1, 3), 255, np.uint8)


@dataclass(frozen=True)
class Paint:
    """
    Attributes
    ----------
    corner: (T, 3, 3) uint8 sRGB, what the texel is multiplied with.
    uv: (T, 3, 2) float32, origin at the lower left. image: (T,) index into `images`, -1 for none.
    clamped: (T, 2) whether u and v stop at the edge of the image.
    images: (h, w, 3) uint8 each, rows from the top.
    """

    corner: NDArray[np.uint8]
    uv: Singles
    image: NDArray[np.int32]
    clamped: NDArray[np.bool_]
    images: tuple[NDArray[np.uint8], ...]

    def colors(self, triangle: Ints, weight: Floats) -> Floats:
        """(n, 3) sRGB, 0 to 1, at points of triangles; ``weight`` (n, 3) of the corners."""
        found: Floats = np.einsum("ij,ijk->ik", weight, self.corner[triangle] / 255.0)
        image = self.image[triangle]
        for number in np.unique(image[image >= 0]).tolist():
            here = np.flatnonzero(image == number)
            of, texels = triangle[here], self.images[number]
            uv = np.einsum("ij,ijk->ik", weight[here], self.uv[of].astype(np.float64))
            kept = np.where(self.clamped[of], np.clip(uv, 0, 1), uv - np.floor(uv))
            height, width = texels.shape[:2]
            column = np.minimum((kept[:, 0] * width).astype(np.int64), width - 1)
            row = np.minimum(((1 - kept[:, 1]) * height).astype(np.int64), height - 1)
            found[here] *= texels[row, column] / 255.0
        return found


def paint_of(scene: Scene, kept: Ints) -> Paint:
    """The paint of the triangles ``kept`` of a scene; decodes its images. Raises what reading an
    image raises."""
    from ptmtools.errors import naming
    from ptmtools.texture.images import load_image
    from ptmtools.texture.samples import in_eight_bits

    materials = scene.materials
    material = scene.triangle_material[kept]
    color = np.array([m.color for m in materials])[material]
    corner = np.repeat(color[:, None], 3, axis=1)
    if scene.colors is not None:
        corner = corner * (scene.colors[kept] / 255.0)
    clamped = np.array([[m.wrap_s == "clamp", m.wrap_t == "clamp"] for m in materials])
    images = []
    for image in scene.images:
        with naming(image.name):
            shown = in_eight_bits(load_image(image.load()).array())
        rgb = shown[..., :3] if shown.shape[2] >= 3 else np.repeat(shown[..., :1], 3, axis=2)
        images.append(np.ascontiguousarray(rgb) if rgb.size else _WHITE)
    return Paint(
        np.rint(corner.clip(0, 1) * 255).astype(np.uint8),
        scene.uv[kept].astype(np.float32),
        np.array([m.image for m in materials], np.int32)[material],
        clamped[material],
        tuple(images),
    )
