"""Images of opacities (``map_d``), which become the alpha of the image that they belong to.

Neither VRML nor the GLB cells have a second image for it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Ints
from ptmtools.scene.images import ImageStore, integers
from ptmtools.scene.source import Findings, Source, SourceMaterial

_BANDS = {"r": 0, "g": 1, "b": 2}


@dataclass(frozen=True)
class MaskedBytes:
    """The bytes of a PNG with the colours of an image, white without one, and the opacities of a
    mask, times its own alpha; as large as the image.

    ``channel`` is that of the mask, see `Texture`, and ``limit`` as of `ImageStore`. Raises what
    reading raises, and InputError or LimitError for what cannot be decoded or has no 8 or 16 bits.
    """

    read: Callable[[], bytes] | None
    mask: Callable[[], bytes]
    channel: str
    limit: int

    def __call__(self) -> bytes:
        from ptmtools.texture.images.png import png_bytes

        opacity = _opacities(integers(self.mask(), self.limit)[0], self.channel)
        if self.read is None:
            white = np.full_like(opacity, 255)
            return png_bytes(np.stack([white, opacity], axis=2))
        texels, description = integers(self.read(), self.limit)
        alpha = _resized(opacity, texels.shape[1], texels.shape[0]) / 255
        components = texels.shape[2]
        if components in (2, 4):
            alpha *= texels[..., -1]
            components -= 1
        else:
            alpha *= np.iinfo(texels.dtype).max
        held = np.rint(alpha).astype(texels.dtype)[..., None]
        return png_bytes(np.concatenate([texels[..., :components], held], axis=2), description)


def _opacities(texels: NDArray[Any], channel: str) -> NDArray[np.uint8]:
    """(h, w) what a mask says: its matte where it has one and that is asked for, else one of its
    colours or its luminance."""
    if texels.dtype != np.uint8:
        texels = (texels >> 8).astype(np.uint8)
    matte = texels.shape[2] in (2, 4)
    if matte and channel in ("", "m"):
        return np.asarray(texels[..., -1])
    colors = texels[..., :-1] if matte else texels
    if colors.shape[2] == 1:
        return np.asarray(colors[..., 0])
    if channel in _BANDS:
        return np.asarray(colors[..., _BANDS[channel]])
    # ITU-R 601, as Pillow has it.
    return np.asarray(np.rint(colors @ np.array([0.299, 0.587, 0.114])).astype(np.uint8))


def _resized(opacity: NDArray[np.uint8], width: int, height: int) -> NDArray[np.float64]:
    from PIL import Image

    if opacity.shape != (height, width):
        image = Image.fromarray(opacity).resize((width, height), Image.Resampling.BILINEAR)
        opacity = np.asarray(image)
    return opacity.astype(np.float64)


def masked(source: Source, used: Ints, store: ImageStore, findings: Findings) -> Source:
    """The same with the masks of the materials that are ``used`` in their images.

    Raises LimitError PTM-L104, PTM-L106.
    """
    materials = list(source.materials)
    for index in used.tolist():
        materials[index] = _masked(materials[index], store, findings)
    return replace(source, materials=tuple(materials))


def _masked(given: SourceMaterial, store: ImageStore, findings: Findings) -> SourceMaterial:
    mask, texture = given.mask, given.texture
    if mask is None:
        return given
    without = replace(given, mask=None)
    through = store.masks(mask)
    if through is None:  # better see too much than too little
        return replace(without, see_through=True)
    matte = None if texture is None else store.has_alpha(texture)
    if texture is not None and texture.read == mask.read and matte and mask.channel in ("", "m"):
        return without  # it is the image's own alpha
    if not through:
        return without
    colors = None if matte is None or texture is None else texture.read
    read = MaskedBytes(colors, mask.read, mask.channel, store.limit)
    made = replace(texture or mask, read=read, what=mask.what, place=mask.place)
    for part in (texture, mask):
        if part is not None:
            store.made_into_another(part)
    if store.has_alpha(made) is None:  # which the store has said of the mask
        return replace(without, see_through=True)
    findings.say("PTM-N217", f"{mask.what}: is baked into an image as its alpha", mask.place)
    return replace(without, texture=made)
