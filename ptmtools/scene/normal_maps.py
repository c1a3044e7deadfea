"""Normal maps of materials: which image, at which coordinates, and normals of heights.

glTF defines the form: x to the right and y up in the image, z away from the surface, each from -1
at 0 to 1 at the largest value. ``bump`` of OBJ is an image of heights by definition, but many
exporters write normal maps there, so the colours decide: an image that is grey holds heights, one
whose texels point away from the surface normals.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats
from ptmtools.errors import LimitError, PtmError
from ptmtools.scene.baking import OpaqueBytes, emitted_wraps
from ptmtools.scene.images import ImageStore, integers
from ptmtools.scene.model import NormalImage
from ptmtools.scene.notes import Findings
from ptmtools.scene.source import NormalTexture, Texture

#: Largest difference of the components of a grey image, of 255.
_GREY = 2
#: Least mean of the third component, and largest deviation of the other means from 128, of 255, of
#: an image of normals.
_UP, _LEVEL = 160, 48
#: Texels that the way from black to white rises with ``-bm 1``.
RISE = 4.0


@dataclass(frozen=True)
class HeightBytes:
    """The bytes of a PNG with the normals of an image of heights, which repeats.

    ``rise``: texels from black to white. ``limit`` and errors as of
    `ptmtools.scene.baking.MaskedBytes`.
    """

    read: Callable[[], bytes]
    rise: float
    limit: int

    def __call__(self) -> bytes:
        from ptmtools.texture.images.png import png_bytes

        texels, _ = integers(self.read(), self.limit)
        largest = np.iinfo(texels.dtype).max
        height = texels[..., 0].astype(np.float64) * (self.rise / largest)
        return png_bytes(normals_of(height))


def normals_of(height: Floats) -> NDArray[np.uint8]:
    """(h, w, 3) normal map of (h, w) heights in texels, by central differences."""
    right = (np.roll(height, -1, axis=1) - np.roll(height, 1, axis=1)) / 2
    up = (np.roll(height, 1, axis=0) - np.roll(height, -1, axis=0)) / 2
    normal = np.stack([-right, -up, np.ones_like(height)], axis=2)
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    return np.rint(127.5 * (normal + 1)).astype(np.uint8)


class NormalMaps:
    """Adds the normal maps of materials to the images of a scene."""

    def __init__(self, store: ImageStore, findings: Findings) -> None:
        self._store, self._findings = store, findings

    def add(
        self, normal: NormalTexture, texture: Texture | None, *, moved: bool
    ) -> NormalImage | None:
        """The normal map of a material with an image ``texture``, whose coordinates are ``moved``
        if mirrored repetition was baked into them; None, and a note, if it cannot be used.

        Raises LimitError PTM-L104.
        """
        use = normal.texture
        if "mirror" in (use.wrap_s, use.wrap_t):
            self._note(use, "mirrored repetition of a normal map ignored")
        wraps = emitted_wraps(use)
        own = normal.own or moved or texture is None or wraps != emitted_wraps(texture)
        image, scale = self._normals(normal)
        if image is None or (added := self._store.add(image)) is None:
            return None
        return NormalImage(added[0], scale, *wraps, own)

    def _normals(self, normal: NormalTexture) -> tuple[Texture | None, float]:
        """The image of normals, and the scale of these."""
        use, scale = normal.texture, normal.scale
        record = self._store.record(use)
        if record is None:
            return None, scale
        if normal.height:
            kind = self._kind(use)
            if kind == "heights":
                read = HeightBytes(use.read, RISE * scale, self._store.limit)
                self._store.mark_as_input(use)
                self._note(use, f"heights converted to normals, {RISE * scale:g} texels high")
                return replace(use, read=read), 1.0
            if kind != "normals":
                self._note(use, "neither heights nor normals, left out")
                return None, scale
            self._note(use, "holds normals, used as a normal map")
        if record.alpha:
            self._store.mark_as_input(use)
            return replace(use, read=OpaqueBytes(use.read, self._store.limit)), scale
        return use, scale

    def _kind(self, use: Texture) -> str:
        """ "heights", "normals" or ""."""
        try:
            texels, _ = integers(use.read(), self._store.limit)
        except LimitError:
            raise
        except (PtmError, OSError) as fault:
            message = fault.message if isinstance(fault, PtmError) else str(fault)
            self._note(use, message)
            return ""
        return kind_of(texels)

    def _note(self, use: Texture, message: str) -> None:
        self._findings.note("PTM-N215", f"{use.what}: {message}", use.place)


def kind_of(texels: NDArray[Any]) -> str:
    """ "heights" or "normals" for the (h, w, c) texels of a bump map; "" for neither."""
    if texels.dtype != np.uint8:
        texels = (texels >> 8).astype(np.uint8)
    if texels.shape[2] < 3:
        return "heights"
    colors = texels[..., :3].astype(np.int64)
    if (colors.max(axis=2) - colors.min(axis=2)).max() <= _GREY:
        return "heights"
    red, green, blue = colors.reshape(-1, 3).mean(axis=0).tolist()
    level = max(abs(red - 128), abs(green - 128)) <= _LEVEL
    return "normals" if level and blue >= _UP else ""
