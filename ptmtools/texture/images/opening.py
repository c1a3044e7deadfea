"""Opens image files by Pillow, each with the one plug-in that its first bytes name, and reads those
of 8 bits a component or less.

`PIL.Image.open` would import all plug-ins for it, and refuses by a number of texels that is a
variable of the whole process; the limits here come from `ptmtools.texture.Limits`.

Pillow keeps RGB in four bytes a texel. A second copy, as numpy wants it, is made a strip at a time
only, so that an image of 16,384² RGB takes 1.3 times its raw size.
"""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Any, BinaryIO, cast

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import InputError, LimitError, PtmError
from ptmtools.texture.images.picture import (
    LossySource,
    Picture,
    Strips,
    check_file,
    check_jpeg,
    check_size,
    check_tile,
    check_webp,
    frames_error,
    image_error,
    samples_error,
)
from ptmtools.texture.model import Description, Limits

if TYPE_CHECKING:
    from PIL.Image import Exif, Image
    from PIL.ImageFile import ImageFile


PNG = b"\x89PNG\r\n\x1a\n"
TIFF = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
#: First bytes by the name of Pillow's plug-in.
_PLUGINS: dict[str, bytes | tuple[bytes, ...]] = {
    "Png": PNG,
    "Jpeg": b"\xff\xd8\xff",
    "Tiff": TIFF,
    "WebP": b"RIFF",
    "Bmp": b"BM",
    "Gif": b"GIF8",
    "Ppm": b"P",
    "Pcx": b"\n",
    # A Targa file begins with anything; its own checks decide.
    "Tga": b"",
}
#: What the first bytes of an AVIF have behind a length: a box and its brand.
_AVIF = (b"ftypavif", b"ftypavis")
#: Formats whose first bytes are too short to call a failing file damaged.
_VAGUE = ("Ppm", "Pcx", "Tga")
READABLE = "PNG, JPEG, TIFF, TGA, BMP, GIF, WebP, AVIF, PPM, PCX, Radiance, OpenEXR or .npy"
#: The tag of EXIF and TIFF.
ORIENTATION = 0x0112
#: The keyword of a text in a PNG: the bytes of the lossy image that its texels come from.
LOSSY, _SIZE = "Lossy source", re.compile("[0-9]{1,12}")
#: Tags of TIFF.
_TILE_WIDTH, _TILE_LENGTH = 322, 323
#: Pillow's names for layouts of 5 and 6 bits a sample, which it scales to 8.
_HIGH_COLOUR = re.compile(r"BGRA?;(5|1[56])Z?")


def open_image(file: BinaryIO, limits: Limits) -> ImageFile:
    """An image whose header is read, and no texel yet; its size is still to be checked.

    Raises what Pillow raises; LimitError PTM-L104 if opening or loading would take more memory than
    its size implies.
    """
    check_file(file, limits)
    file.seek(0)
    first = file.read(30)
    name = next(name for name, magic in _PLUGINS.items() if first.startswith(magic))
    if first[4:12] in _AVIF:
        name = "Avif"
    if name == "WebP":
        check_webp(first, limits)
    elif name == "Jpeg":
        check_jpeg(first + file.read())
    file.seek(0)
    try:
        with warnings.catch_warnings():
            # Its limits are not ours.
            warnings.simplefilter("ignore")
            module = import_module(f"PIL.{name}ImagePlugin")
            image = cast("ImageFile", getattr(module, f"{name}ImageFile")(file))
    except SyntaxError as error:
        if "pixel mode" in str(error) or "-bit layers" in str(error):
            raise samples_error(f"a combination of samples that is not read ({error})") from None
        if name not in _VAGUE:
            raise image_error(error) from None
        raise
    if name == "Tiff":
        tags: Any = image
        check_tile(tags.tag_v2.get(_TILE_WIDTH), tags.tag_v2.get(_TILE_LENGTH), 4, limits)
    return image


def lossy_source(file: BinaryIO, image: ImageFile) -> LossySource | None:
    """The source of the texels if its compression discards detail, as far as can be recognised."""
    if image.format == "PNG":
        size = image.info.get(LOSSY, "")
        return LossySource("lossy image in PNG", int(size)) if _SIZE.fullmatch(size) else None
    format = _lossy_format(file, image)
    return LossySource(format, file.seek(0, 2)) if format else None


def _lossy_format(file: BinaryIO, image: ImageFile) -> str | None:
    if image.format == "TIFF":
        return "JPEG in TIFF" if "jpeg" in str(image.info.get("compression")) else None
    if image.format == "JPEG":
        file.seek(0)
        common = check_jpeg(file.read()) and image.mode in ("L", "RGB")
        return "JPEG" if common else "uncommon JPEG"
    if image.format == "WEBP":
        file.seek(12)
        while len(head := file.read(8)) == 8 and head[:4] not in (b"VP8 ", b"VP8L"):
            file.seek(int.from_bytes(head[4:], "little") + 1 & ~1, 1)
        return "WebP" if head[:4] == b"VP8 " else None
    return "AVIF" if image.format == "AVIF" else None


def load(image: ImageFile) -> None:
    """Unpacks the texels. Raises what Pillow raises."""
    if image.format == "TIFF":
        # Its result is not produced, and its size not checked, a second time.
        import PIL.Image

        core: Any = PIL.Image.core  # type: ignore[attr-defined]
        image.im = core.new(image.mode, getattr(image, "_tile_size", image.size))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        image.load()


def high_colour(image: ImageFile) -> bool:
    """Whether an image that is not loaded has samples, or a palette, of 5 or 6 bits."""
    arguments = [tile.args for tile in image.tile]
    raw = [args[0] if isinstance(args, tuple) and args else args for args in arguments]
    raw.append(getattr(image.palette, "rawmode", None))
    return any(isinstance(mode, str) and _HIGH_COLOUR.fullmatch(mode) for mode in raw)


@contextmanager
def pillow_faults() -> Iterator[None]:
    """Turns every exception of Pillow in the block into one of our errors."""
    from PIL.Image import DecompressionBombError

    try:
        yield
    except PtmError:
        raise
    except SyntaxError:  # raised by a plug-in for a file of another format
        raise InputError(
            "PTM-I125", "is not an image of a supported format", remedy=f"it must be {READABLE}"
        ) from None
    except (DecompressionBombError, MemoryError) as error:
        raise LimitError(
            "PTM-L104", f"has too many texels ({error})", remedy="scale it down first"
        ) from None
    except Exception as error:  # a damaged file can make its parsers raise nearly anything
        raise image_error(str(error) or type(error).__name__) from None


def description_of(image: Image) -> Description:
    """Colour and orientation of an image that is loaded (PNG has some of it behind the texels)."""
    info = image.info
    points, gamma = info.get("chromaticity"), info.get("gamma")
    srgb = info.get("srgb")
    return Description(
        icc=info.get("icc_profile") or None,
        srgb=srgb if srgb in (0, 1, 2, 3) else None,
        gamma=None if gamma is None else round(gamma * 100_000),
        chromaticities=None if points is None else tuple(round(p * 100_000) for p in points),
        # Pillow has applied that of a TIFF.
        orientation=1 if hasattr(image, "tag_v2") else orientation_of(image.getexif),
    )


def orientation_of(exif: Callable[[], Exif]) -> int:
    """The orientation, 1 to 8, in the result of ``exif``; 1 if it is missing, impossible (some
    cameras write 0) or cannot be parsed, none of which damages the texels."""
    try:
        orientation = exif().get(ORIENTATION, 1)
        return int(orientation) if orientation in range(1, 9) else 1
    except Exception:  # a malformed block can make Pillow's parser raise nearly anything
        return 1


_COMPONENTS = {"1": 1, "L": 1, "LA": 2, "P": 3, "PA": 4, "RGB": 3, "RGBA": 4}


def check(image: ImageFile, limits: Limits) -> None:
    """Raise InputError PTM-I126, LimitError PTM-L104 if an opened image cannot be read exactly."""
    if image.mode not in _COMPONENTS:
        raise samples_error(f"the colour model {image.mode}")
    check_size(*image.size, _COMPONENTS[image.mode], limits)


def convert_texels(image: ImageFile, limits: Limits) -> tuple[str, NDArray[np.uint8]]:
    """How the first frame of an opened image becomes grey or RGB of 8 bits, and these texels.

    Inks become colours by the profile in the file, or as browsers mix them without one. Raises what
    Pillow raises, InputError PTM-I126 for what it does not convert, LimitError PTM-L104.
    """
    check_size(*image.size, 4, limits)
    load(image)
    how, mode = "scaled to 8 bits", image.mode
    if getattr(image, "is_animated", False):
        how = "of which the first is used"
    if mode == "F" or mode.startswith("I"):
        raise samples_error(f"samples of mode {mode}")
    if mode == "P":
        mode = "RGBA" if image.has_transparency_data else "RGB"
    elif mode not in _COMPONENTS:
        how, mode = "converted to 8-bit RGB", {"La": "LA", "RGBa": "RGBA"}.get(mode, "RGB")
    shown: Image | None = None
    if image.mode in ("CMYK", "LAB"):
        shown = _manage_colours(image)
        how += " by its colour profile" if shown and image.mode == "CMYK" else ""
    return how, _texels(_COMPONENTS[mode], shown or image.convert(mode))


def _manage_colours(image: Image) -> Image | None:
    """RGB by the profile of an image, or from CIE L*a*b*; None without a profile that works."""
    from PIL import ImageCms

    profile = io.BytesIO(image.info.get("icc_profile") or b"")
    try:
        source = ImageCms.createProfile("LAB") if image.mode == "LAB" else profile
        srgb = ImageCms.createProfile("sRGB")
        return ImageCms.profileToProfile(image, source, srgb, outputMode="RGB")
    except (ImageCms.PyCMSError, ImportError, OSError):
        return None


def read(image: ImageFile, depth: int, lossy: LossySource | None) -> Picture:
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
    return read_strips([image], components, "uint8", partial(_texels, components), key, lossy)


def read_strips(
    images: Sequence[Image],
    components: int,
    dtype: str,
    make: Callable[..., NDArray[Any]],
    key: object = None,
    lossy: LossySource | None = None,
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
    return Picture(Strips(shape, np.dtype(dtype), strip), description_of(images[0]), lossy)


def one_frame(image: ImageFile) -> None:
    """Raise InputError PTM-I126 for an image of several."""
    # The frames are not counted: a TIFF may be built so that counting its pages is costly.
    if getattr(image, "is_animated", False):
        raise frames_error("several frames or pages")


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
