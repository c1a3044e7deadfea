"""Normal maps of materials: which image, at which coordinates, and normals of heights.

glTF defines the form: x to the right and y up in the image, z away from the surface, each from -1
at 0 to 1 at the largest value. ``bump`` of OBJ is an image of heights by definition, but many
exporters write normal maps there, so the colours decide: an image that is grey holds heights, one
whose texels point away from the surface normals.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import LimitError, PtmError
from ptmtools.scene.baking import OpaqueBytes, emitted_wraps
from ptmtools.scene.images import ImageStore, integers
from ptmtools.scene.model import NormalImage
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.source import NormalTexture, SourceTexture

#: Largest difference of the components of a grey image, of 255.
_GREY = 2
#: Least mean of the third component, and largest deviation of the other means from 128, of 255, of
#: an image of normals.
_UP, _LEVEL = 160, 48
#: Texels that the way from black to white rises with ``-bm 1``.
RISE = 4.0
#: Largest factor of x and y of normals, and of heights.
MOST = 100.0
#: Texels that are converted at a time.
_STRIP_TEXELS = 1 << 18


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

        heights = integers(self.read(), self.limit).array()[..., 0]
        return png_bytes(normals_of(heights, self.rise / np.iinfo(heights.dtype).max))


def normals_of(height: NDArray[Any], factor: float = 1.0) -> NDArray[np.uint8]:
    """(h, w, 3) normal map of (h, w) heights that repeat, in units of 1 / ``factor`` texels, by
    central differences."""
    result = np.empty((*height.shape, 3), np.uint8)
    for rows in _strips(height):
        # With a row on either side.
        around = np.arange(rows.start - 1, rows.stop + 1) % len(height)
        strip = height[around].astype(np.float32) * np.float32(factor)
        center = strip[1:-1]
        normal = np.ones((*center.shape, 3), np.float32)
        normal[..., 0] = (np.roll(center, 1, axis=1) - np.roll(center, -1, axis=1)) / 2
        normal[..., 1] = (strip[2:] - strip[:-2]) / 2
        normal /= np.linalg.norm(normal, axis=2, keepdims=True)
        result[rows] = np.rint(127.5 * (normal + 1))
    return result


def _strips(image: NDArray[Any]) -> Iterator[slice]:
    """The rows of an image in strips of about `_STRIP_TEXELS`."""
    step = max(1, _STRIP_TEXELS // image.shape[1])
    return (slice(y, min(y + step, len(image))) for y in range(0, len(image), step))


class NormalMaps:
    """Adds the normal maps of materials to the images of a scene."""

    def __init__(self, store: ImageStore, notes: IngestNotes) -> None:
        self._store, self._notes = store, notes
        self._kinds = dict[Callable[[], bytes], str]()

    def add(
        self, normal: NormalTexture, texture: SourceTexture | None, *, moved: bool
    ) -> NormalImage | None:
        """The normal map of a material with an image ``texture``, whose coordinates are ``moved``
        if mirrored repetition was baked into them; None, and a note, if it cannot be used.

        Raises LimitError PTM-L104.
        """
        use, scale = normal.texture, min(max(normal.scale, -MOST), MOST)
        if scale != normal.scale:
            self._note(use, f"scale of {normal.scale:g} changed to {scale:g}")
        if not scale:
            self._note(use, "normal map of scale 0 left out")
            return None
        if "mirror" in (use.wrap_s, use.wrap_t):
            self._note(use, "mirrored repetition of a normal map ignored")
        wraps = emitted_wraps(use)
        separate = normal.own or moved or texture is None or wraps != emitted_wraps(texture)
        image, scale = self._normals(use, scale, height=normal.height)
        if image is None or (added := self._store.add(image)) is None:
            return None
        return NormalImage(added[0], scale, *wraps, separate)

    def _normals(
        self, use: SourceTexture, scale: float, *, height: bool
    ) -> tuple[SourceTexture | None, float]:
        """The image of normals, and the scale of these."""
        if height:  # whose kind depends on its texels
            self._store.mark_as_input(use)
        if self._store.record(use) is None:
            return None, scale
        if height:
            kind = self._kind(use)
            if kind == "heights":
                read = HeightBytes(use.read, RISE * scale, self._store.limit)
                self._note(use, f"heights converted to normals, {RISE * scale:g} texels high")
                return replace(use, read=read), 1.0
            if kind != "normals":
                self._note(use, "neither heights nor normals, left out")
                return None, scale
            self._note(use, "holds normals, used as a normal map")
        use = self._store.convert(use)
        if (record := self._store.record(use)) and (record.alpha or record.derived):
            self._store.mark_as_input(use)
            return replace(use, read=OpaqueBytes(use.read, self._store.limit, exact=True)), scale
        return use, scale

    def _kind(self, use: SourceTexture) -> str:
        """ "heights", "normals" or ""."""
        if use.read not in self._kinds:
            self._kinds[use.read] = ""
            try:
                texels = integers(use.read(), self._store.limit).array()
                self._kinds[use.read] = kind_of(texels)
            except LimitError:
                raise
            except (PtmError, OSError) as fault:
                self._note(use, fault.message if isinstance(fault, PtmError) else str(fault))
        return self._kinds[use.read]

    def _note(self, use: SourceTexture, message: str) -> None:
        self._notes.note("PTM-N215", f"{use.what}: {message}", use.place)


def kind_of(texels: NDArray[Any]) -> str:
    """ "heights" or "normals" for the (h, w, c) texels of a bump map; "" for neither."""
    if texels.shape[2] < 3:
        return "heights"
    spread, sums = 0, np.zeros(3)
    for rows in _strips(texels):
        strip = texels[rows, :, :3]
        colors = (strip if strip.dtype == np.uint8 else strip >> 8).astype(np.int16)
        spread = max(spread, int((colors.max(axis=2) - colors.min(axis=2)).max()))
        sums += colors.sum(axis=(0, 1), dtype=np.int64)
    if spread <= _GREY:
        return "heights"
    red, green, blue = (sums / (texels.shape[0] * texels.shape[1])).tolist()
    level = max(abs(red - 128), abs(green - 128)) <= _LEVEL
    return "normals" if level and blue >= _UP else ""
