"""Image files in and out, without ever changing a texel silently.

Reading goes through Pillow, which converts some inputs on its own: 16-bit RGB PNGs, TIFFs and PPMs
lose their low bytes when loaded. What cannot be held in 8 bits a component is therefore looked for
before loading, and refused. Not applied: EXIF orientation (rows are taken as stored, as the
loaders of model files do), gamma and colour profiles (texels are taken as numbers).
"""

from __future__ import annotations

import io
import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from ptmtools.errors import InputError, LimitError, PtmError, naming
from ptmtools.texture.container import HEAD_MAX, MAGIC, read_header
from ptmtools.texture.model import MAX_SIDE
from ptmtools.texture.sources import open_file

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from PIL import Image

#: Formats whose depth can be told before loading, under Pillow's names.
FORMATS = ("PNG", "JPEG", "TIFF", "TGA", "BMP", "GIF", "WEBP", "PPM", "PCX")
_READABLE = "PNG, JPEG, TIFF, TGA, BMP, GIF, WebP, PPM or PCX"


def read_image(source: str | os.PathLike[str] | bytes) -> NDArray[np.uint8]:
    """An image file as (h, w, c) uint8, rows from the top, texels exactly as stored.

    1 component for grey (1-bit images become 0 and 255), 2 with alpha; 3 for RGB and palettes, 4
    with alpha. A colour key (PNG tRNS) becomes an alpha of 0 or 255.

    Parameters
    ----------
    source: a path, or the bytes of a file.

    Raises
    ------
    InputError: PTM-I120 no such file, PTM-I121 a folder, PTM-I122 not readable, PTM-I123 empty,
        PTM-I124 not an image, PTM-I125 damaged or truncated, PTM-I126 a depth or colour model
        that 8-bit grey or RGB cannot hold, PTM-I127 several frames.
    LimitError: PTM-L104 more texels than are read.
    """
    file = None if isinstance(source, bytes) else os.fspath(source)
    data = source if isinstance(source, bytes) else _read_file(source)
    with naming(file):
        if not data:
            raise InputError("PTM-I123", "is empty", remedy="fetch or export it again")
        if data.startswith((MAGIC, b"PTM_1")):
            read_header(data)  # says so if it is HP's format
            raise InputError(
                "PTM-I124",
                "is a progressive texture map already, not an image",
                remedy="use ptm decode to get an image from it",
            )
        with _open(data) as image:
            _refuse_what_changes(image, data)
            return _texels(image, data)


def write_png(path: str | os.PathLike[str], image: NDArray[np.uint8], force: bool = False) -> None:
    """Write (h, w, c) uint8, 1 to 4 components, as a PNG, whole or not at all.

    Raises OutputError (see `ptmtools.files.write_bytes`).
    """
    from ptmtools.files import write_bytes

    write_bytes(path, png_bytes(image), force=force)


def png_bytes(image: NDArray[np.uint8]) -> bytes:
    """(h, w, c) uint8, 1 to 4 components, as the bytes of a PNG."""
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(image[:, :, 0] if image.shape[2] == 1 else image).save(buffer, "PNG")
    return buffer.getvalue()


def read_ptm(path: str | os.PathLike[str]) -> bytes:
    """The bytes of a `.ptm`, of which the head has been found good.

    Raises InputError: PTM-I120 to PTM-I122 as `read_image`; what `read_header` raises.
    """
    data = _read_file(path)
    with naming(path):
        read_header(data[:HEAD_MAX])
    return data


def _read_file(path: str | os.PathLike[str]) -> bytes:
    with open_file(path) as file:
        return file.read()


@contextmanager
def _open(data: bytes) -> Iterator[Image.Image]:
    """The image, its header read; whatever Pillow raises inside becomes one of our errors."""
    from PIL import Image, UnidentifiedImageError

    try:
        with warnings.catch_warnings():
            # Our own limits come from what can be stored, not from half of Pillow's.
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(io.BytesIO(data), formats=FORMATS) as image:
                yield image
    except PtmError:
        raise
    except UnidentifiedImageError:
        raise InputError(
            "PTM-I124", "is not an image that can be read", remedy=f"it must be {_READABLE}"
        ) from None
    except (Image.DecompressionBombError, MemoryError) as error:
        raise LimitError(
            "PTM-L104", f"has too many texels ({error})", remedy="scale it down first"
        ) from None
    except Exception as error:  # a damaged file can make its parsers raise nearly anything
        raise InputError(
            "PTM-I125",
            f"is damaged or cut short ({error or type(error).__name__})",
            remedy="fetch or export it again",
        ) from None


def _refuse_what_changes(image: Image.Image, data: bytes) -> None:
    """Raise for what would lose something as 8-bit grey or RGB."""
    if max(image.size) > MAX_SIDE:
        raise LimitError(
            "PTM-L104",
            f"is {image.size[0]} x {image.size[1]} texels; {MAX_SIDE} a side can be stored",
            remedy="scale it down first",
        )
    # An MPO is a photograph with others attached; the first is the one meant.
    frames = getattr(image, "n_frames", 1)
    if frames > 1 and image.format != "MPO":
        raise InputError(
            "PTM-I127",
            f"holds {frames} frames or pages; a texture is one image",
            remedy="export the one you want as PNG",
        )
    deep = _deeper_than_8_bits(image, data)
    if deep or image.mode not in ("1", "L", "LA", "P", "PA", "RGB", "RGBA"):
        what = "more than 8 bits a component" if deep else f"the colour model {image.mode}"
        raise InputError(
            "PTM-I126",
            f"has {what}; only 8-bit grey and RGB, with or without alpha, are read",
            remedy="convert it to 8-bit RGB yourself, so that you see what that changes",
        )


def _deeper_than_8_bits(image: Image.Image, data: bytes) -> bool:
    """Whether Pillow's 8-bit mode hides a deeper or differently scaled original."""
    if image.mode.startswith("I"):
        return True
    if image.format == "PNG":
        return data[24] == 16
    if image.format == "TIFF":
        bits: tuple[int, ...] = getattr(image, "tag_v2", {}).get(258, (1,))
        return max(bits) > 8
    if image.format == "PPM":
        # A maximum other than 255 is scaled to it; 1-bit files have none.
        tiles = getattr(image, "tile", [])
        arguments = tiles[0].args if tiles else ()
        maximum = arguments[1] if isinstance(arguments, tuple) and len(arguments) > 1 else 0
        return image.mode != "1" and maximum not in (0, 255)
    return False


def _texels(image: Image.Image, data: bytes) -> NDArray[np.uint8]:
    import numpy as np

    # Before loading: Pillow drops or rewrites some of it while converting.
    key = _full_scale(image.info.get("transparency"), image, data)
    if image.mode in ("P", "PA"):
        has_alpha = image.mode == "PA" or key is not None
        has_alpha |= image.palette is not None and image.palette.mode == "RGBA"
        image = image.convert("RGBA" if has_alpha else "RGB")
        key = None
    elif image.mode == "1":
        image = image.convert("L")
    texels = np.array(image, np.uint8)
    if texels.ndim == 2:
        texels = texels[:, :, None]
    if key is not None and texels.shape[2] in (1, 3):
        opaque = (texels != np.array(key)).any(axis=2)
        alpha = np.where(opaque, 255, 0).astype(np.uint8)
        texels = np.concatenate([texels, alpha[:, :, None]], axis=2)
    return texels


def _full_scale(key: object, image: Image.Image, data: bytes) -> object:
    """A colour key as texels hold it: Pillow widens grey of 2 or 4 bits, but not the key."""
    depth = data[24] if image.format == "PNG" else 8
    if isinstance(key, int) and image.mode == "L" and depth < 8:
        return key * 255 // ((1 << depth) - 1)
    return key
