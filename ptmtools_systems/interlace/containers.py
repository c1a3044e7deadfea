"""A table of the image formats of the files of interlaced images.

Any format that browsers show will do (paper §3.1: "the original image format only serves as
container format"). Samples that a format does not support are refused, never changed silently.
Files carry texels only: browsers would apply a colour profile or an orientation to some files of an
image and not to others.
"""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import InputError, LimitError
from ptmtools.texture.model import MAX_SIDE

Texels = NDArray[Any]


@dataclass(frozen=True)
class Container:
    """One format.

    Attributes
    ----------
    about: description for users.
    lossless: whether texels come back exactly.
    magic: first bytes of its files.
    side: its longest side, texels.
    components, kinds: numbers of components and types of samples that it supports.
    remedy: remedy for others.
    write: the bytes of a file, from (h, w, c) texels and the quality, for lossy formats.
    read: the stored texels, from (h, w, c) texels of `ptmtools.texture.images.load_image` and the
        number of stored components. Raises ValueError for others.
    """

    about: str
    lossless: bool
    magic: bytes
    side: int
    components: tuple[int, ...]
    kinds: tuple[str, ...]
    remedy: str
    write: Callable[[Texels, int], bytes]
    read: Callable[[Texels, int], Texels]


def check_held(name: str, width: int, height: int, components: int, kind: str) -> None:
    """Raises an error if a container does not support an image.

    InputError: PTM-I126 its samples. LimitError: PTM-L400 its sides.
    """
    container = CONTAINERS[name]
    what = {1: "grey", 2: "grey and alpha", 3: "RGB", 4: "RGB and alpha"}[components]
    if components not in container.components or kind not in container.kinds:
        raise InputError(
            "PTM-I126", f"{what} of {kind} does not fit into {name}", remedy=container.remedy
        )
    if max(width, height) > container.side:
        raise LimitError(
            "PTM-L400",
            f"a file would be {width} x {height} texels; {name} holds {container.side} a side",
            remedy="use --format png",
        )


def _write_png(texels: Texels, quality: int) -> bytes:
    from ptmtools.texture.images import png_bytes

    return png_bytes(np.ascontiguousarray(texels))


def _write_jpg(texels: Texels, quality: int) -> bytes:
    return _by_pillow(texels, "JPEG", quality=quality)


def _write_webp(texels: Texels, quality: int) -> bytes:
    colours = texels[:, :, [0, 0, 0]] if texels.shape[2] < 3 else texels[:, :, :3]
    if texels.shape[2] in (2, 4):
        colours = np.concatenate([colours, texels[:, :, -1:]], axis=2)
    # exact: colours of transparent texels are kept.
    return _by_pillow(colours, "WEBP", lossless=True, method=4, exact=True)


def _by_pillow(texels: Texels, format: str, **settings: Any) -> bytes:
    from PIL import Image

    buffer = io.BytesIO()
    flat = texels[:, :, 0] if texels.shape[2] == 1 else texels
    Image.fromarray(np.ascontiguousarray(flat)).save(buffer, format, **settings)
    return buffer.getvalue()


def _as_read(texels: Texels, components: int) -> Texels:
    if texels.shape[2] != components:
        raise ValueError(f"{texels.shape[2]} components instead of {components}")
    return texels


def _read_webp(texels: Texels, components: int) -> Texels:
    """WebP has no grey, and leaves out alpha where all is opaque."""
    if components in (2, 4) and texels.shape[2] == 3:
        texels = np.concatenate([texels, np.full_like(texels[:, :, :1], 255)], axis=2)
    if components > 2:
        return _as_read(texels, components)
    if (texels[:, :, :1] != texels[:, :, 1:3]).any():
        raise ValueError("colours instead of grey")
    return _as_read(texels[:, :, 2:], components)


#: By name, which is the suffix of the files.
CONTAINERS = {
    "png": Container(
        about="exact, 8 and 16 bits",
        lossless=True,
        magic=b"\x89PNG\r\n\x1a\n",
        side=MAX_SIDE,
        components=(1, 2, 3, 4),
        kinds=("uint8", "uint16"),
        remedy="convert it to 16 bits yourself, so that you see what that changes",
        write=_write_png,
        read=_as_read,
    ),
    "jpg": Container(
        about="small and not exact, 8 bits without alpha",
        lossless=False,
        magic=b"\xff\xd8\xff",
        side=(1 << 16) - 1,
        components=(1, 3),
        kinds=("uint8",),
        remedy="use --format png, which keeps all of it, or convert the image to 8 bits without "
        "alpha yourself",
        write=_write_jpg,
        read=_as_read,
    ),
    "webp": Container(
        about="exact, 8 bits, smaller than png and slower to write",
        lossless=True,
        magic=b"RIFF",
        side=(1 << 14) - 1,
        components=(1, 2, 3, 4),
        kinds=("uint8",),
        remedy="use --format png, which holds 16 bits",
        write=_write_webp,
        read=_read_webp,
    ),
}
