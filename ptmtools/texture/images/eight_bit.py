"""Images of 8 bits a component or less, through Pillow.

Pillow keeps RGB in four bytes a texel. A second copy, as numpy wants it, is made a strip at a time
only, so that an image of 16,384² RGB takes 1.3 times its raw size.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.images.opening import described, load
from ptmtools.texture.images.picture import Picture, Strips, check_size, several, unsupported
from ptmtools.texture.model import Limits

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageFile import ImageFile

_COMPONENTS = {"1": 1, "L": 1, "LA": 2, "P": 3, "PA": 4, "RGB": 3, "RGBA": 4}


def check(image: ImageFile, limits: Limits) -> None:
    """Raise InputError PTM-I126, LimitError PTM-L104 for what an opened image cannot be read as."""
    if image.mode not in _COMPONENTS:
        raise unsupported(f"the colour model {image.mode}")
    check_size(*image.size, _COMPONENTS[image.mode], limits)


def read(image: ImageFile, depth: int, lossy: str | None) -> Picture:
    """An opened image that was checked, texels exactly as stored; ``depth`` is that of its samples,
    bits, and ``lossy`` as in `Picture`.

    Raises what Pillow raises.
    """
    # Before loading: Pillow drops or rewrites some of it while converting.
    key = _full_scale(image.info.get("transparency"), image, depth)
    load(image)
    components = _COMPONENTS[image.mode]
    if image.mode == "P":
        has_alpha = key is not None
        has_alpha |= image.palette is not None and image.palette.mode == "RGBA"
        components += has_alpha
        key = None
    return stripped([image], components, "uint8", partial(_texels, components), key, lossy)


def stripped(
    images: Sequence[Image],
    components: int,
    dtype: str,
    make: Callable[..., NDArray[Any]],
    key: object = None,
    lossy: str | None = None,
) -> Picture:
    """Loaded images of the same size as one, a strip at a time.

    ``make`` gets the same rows of each and gives (n, w, components). A colour key becomes an alpha
    of 0 where the texels are the key, of all bits elsewhere.
    """
    width, height = images[0].size
    keyed = key is not None and components in (1, 3)

    def strip(y0: int, y1: int) -> NDArray[Any]:
        texels = make(*(image.crop((0, y0, width, y1)) for image in images))
        if not keyed:
            return texels
        opaque = (texels != np.array(key)).any(axis=2)
        alpha = np.where(opaque, np.iinfo(texels.dtype).max, 0).astype(texels.dtype)
        return np.concatenate([texels, alpha[:, :, None]], axis=2)

    shape = (height, width, components + keyed)
    return Picture(Strips(shape, np.dtype(dtype), strip), described(images[0]), lossy)


def one_frame(image: ImageFile) -> None:
    """Raise InputError PTM-I127 for an image of several."""
    # Not how many: the pages of a TIFF may be made to be costly to count.
    if getattr(image, "is_animated", False):
        raise several("several frames or pages")


def _texels(components: int, strip: Image) -> NDArray[Any]:
    if strip.mode in ("P", "PA"):
        strip = strip.convert("RGBA" if components == 4 else "RGB")
    elif strip.mode == "1":
        strip = strip.convert("L")
    texels = np.asarray(strip, np.uint8)
    return texels if texels.ndim == 3 else texels[:, :, None]


def _full_scale(key: object, image: ImageFile, depth: int) -> object:
    """A colour key as texels hold it: Pillow widens grey of 2 or 4 bits, but not the key."""
    if isinstance(key, int) and image.mode == "L" and depth < 8:
        return key * 255 // ((1 << depth) - 1)
    return key
