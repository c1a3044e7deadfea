"""Size and speed of the profiles and of other lossless formats, on the same texels in one run.

A `.ptm` holds all levels. The other formats hold one image, so two sizes are given for them: the
finest level alone, and one file for each level, which is what a client that streams mipmaps would
fetch. Speeds are in raw bytes of the finest level per second, though a `.ptm` codes all levels in
that time. Decoded texels are compared with the originals. Timings mean something only as ratios
within one run.
"""

from __future__ import annotations

import io
import struct
import time
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import PtmError
from ptmtools.texture.model import EncodeOptions
from ptmtools.texture.profiles import PROFILES
from ptmtools.texture.samples import KINDS

Samples = NDArray[Any]
_PILLOW = "pip install --force-reinstall pillow"
_CODECS = "pip install 'ptmtools[codecs]'"
#: Side, texels, of the corner that a codec codes before it is timed (our profiles also code noise
#: and a plain image of that size), so that no compiling or loading is counted.
_CORNER = 256
_LENGTH = struct.Struct("<I")
_KINDS = tuple(KINDS)
_INTEGERS = ("uint8", "uint16")


@dataclass(frozen=True)
class Codec:
    """A codec of images.

    Attributes
    ----------
    name: its name in tables.
    encode, decode: take or return (h, w, c) texels. Either may raise anything for unsupported
        texels.
    kinds: the supported kinds of samples.
    pyramid: whether one byte string holds all levels.
    remedy: how to install it; None if it is installed.
    """

    name: str
    encode: Callable[[Samples], bytes]
    decode: Callable[[bytes, tuple[int, ...]], Samples]
    kinds: Collection[str] = _KINDS
    pyramid: bool = False
    remedy: str | None = None


@dataclass(frozen=True)
class CodecFigures:
    """The result of one codec on one image or several.

    Attributes
    ----------
    codec: its name.
    finest_bytes: of the finest level alone; None for a `.ptm`, which has all of them.
    all_bytes: of all levels.
    raw_bytes: of the finest level, decoded.
    encode_seconds, decode_seconds: of the finest level; for a `.ptm` of all levels.
    problem: why there are no figures, if there are none.
    """

    codec: str
    finest_bytes: int | None = None
    all_bytes: int = 0
    raw_bytes: int = 0
    encode_seconds: float = 0.0
    decode_seconds: float = 0.0
    problem: str | None = None


def codecs(profiles: Iterable[str] = PROFILES) -> list[Codec]:
    """The profiles, then PNG, WebP, JPEG XL, JPEG 2000 and JPEG-LS."""
    return [*map(_profile, profiles), *_rivals()]


def measure(image: Samples, contenders: Sequence[Codec], repeat: int = 1) -> list[CodecFigures]:
    """Measures each codec on (h, w, c) texels; times are the best of ``repeat``."""
    from ptmtools.texture.pyramid import build_pyramid

    levels = [np.ascontiguousarray(level) for level in build_pyramid(image)]
    return [_measure(levels, codec, repeat) for codec in contenders]


def total(measured: Sequence[Sequence[CodecFigures]]) -> list[CodecFigures]:
    """Sums over images; a codec that failed on one has no figures."""
    sums = []
    for column in zip(*measured, strict=True):
        bad = next((figures for figures in column if figures.problem), None)
        finest = [figures.finest_bytes for figures in column if figures.finest_bytes is not None]
        sums.append(
            bad
            or CodecFigures(
                column[0].codec,
                sum(finest) if finest else None,
                sum(figures.all_bytes for figures in column),
                sum(figures.raw_bytes for figures in column),
                sum(figures.encode_seconds for figures in column),
                sum(figures.decode_seconds for figures in column),
            )
        )
    return sums


def _measure(levels: list[Samples], codec: Codec, repeat: int) -> CodecFigures:
    image = levels[-1]
    none = CodecFigures(codec.name)
    if codec.remedy:
        return replace(none, problem=f"not installed: {codec.remedy}")
    try:
        if image.dtype.name not in codec.kinds:
            raise ValueError("only " + " and ".join(codec.kinds))
        first = [np.ascontiguousarray(image[:_CORNER, :_CORNER])]
        if codec.pyramid:
            size = (_CORNER, _CORNER, image.shape[2])
            grain = np.random.default_rng(0).integers(0, 64, size)
            first += [grain.astype(image.dtype), np.zeros(size, image.dtype)]
        for sample in first:
            codec.decode(codec.encode(sample), sample.shape)
        encoding, data = time_best(lambda: codec.encode(image), repeat)
        decoding, back = time_best(lambda: codec.decode(data, image.shape), repeat)
        if back.dtype != image.dtype or back.tobytes() != image.tobytes():
            return replace(none, problem=f"does not give back {image.dtype} texels exactly")
        rest = 0 if codec.pyramid else sum(len(codec.encode(level)) for level in levels[:-1])
    except PtmError as error:
        return replace(none, problem=str(error))
    except Exception as error:  # other libraries raise exceptions of any class
        reason = " ".join(str(error).split()) or type(error).__name__
        height, width, components = image.shape
        what = f"{width} x {height}, {components} components of {image.dtype}"
        return replace(none, problem=f"does not hold {what} ({reason})")
    return CodecFigures(
        codec.name,
        None if codec.pyramid else len(data),
        len(data) + rest,
        image.nbytes,
        encoding,
        decoding,
    )


def time_best(action: Callable[[], Any], repeat: int) -> tuple[float, Any]:
    """Shortest time of some repetitions, seconds, and the last result."""
    shortest, result = float("inf"), None
    for _ in range(repeat):
        start = time.perf_counter()
        result = action()
        shortest = min(shortest, time.perf_counter() - start)
    return shortest, result


def _profile(name: str) -> Codec:
    from ptmtools.texture.encoder import encode
    from ptmtools.texture.reader import decode

    options = EncodeOptions(name)
    return Codec(
        f"ptm {name}",
        lambda image: encode(image, options),
        lambda data, shape: decode(data),
        pyramid=True,
    )


def _rivals() -> list[Codec]:
    from PIL import features

    from ptmtools.texture.images import png_bytes

    webp = None if features.check("webp") else _PILLOW
    jpeg_xl = [
        _by_imagecodecs(f"JPEG XL effort {effort}", "jpegxl", lossless=True, effort=effort)
        for effort in (1, 3, 7)
    ]
    jpeg_2000 = _by_imagecodecs("JPEG 2000", "jpeg2k", level=0, reversible=True, codecformat="j2k")
    jpeg_ls = _by_imagecodecs("JPEG-LS, green subtracted", "jpegls")
    return [
        Codec("PNG", png_bytes, _by_pillow, _INTEGERS),
        Codec("WebP lossless", _webp, _by_pillow, ("uint8",), remedy=webp),
        *jpeg_xl,
        replace(jpeg_2000, kinds=_INTEGERS),
        replace(jpeg_ls, encode=_jpeg_ls, decode=_from_jpeg_ls, kinds=_INTEGERS),
    ]


def _by_imagecodecs(name: str, function: str, **settings: Any) -> Codec:
    """A codec of imagecodecs: ``function``_encode and ``function``_decode."""
    imagecodecs: Any
    try:
        import imagecodecs
    except ImportError:
        imagecodecs = None

    def encode(image: Samples) -> bytes:
        if function == "jpeg2k":
            settings["mct"] = image.shape[2] > 2
        return bytes(getattr(imagecodecs, f"{function}_encode")(_plain(image), **settings))

    def decode(data: bytes, shape: tuple[int, ...]) -> Samples:
        texels: Samples = getattr(imagecodecs, f"{function}_decode")(data)
        return texels.reshape(shape)

    available = imagecodecs is not None and getattr(imagecodecs, function.upper()).available
    return Codec(name, encode, decode, remedy=None if available else _CODECS)


def _plain(image: Samples) -> Samples:
    """Drops the axis of components if there is only one."""
    return image[:, :, 0] if image.shape[2] == 1 else image


def _webp(image: Samples) -> bytes:
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(_plain(image)).save(buffer, "WEBP", lossless=True, method=4, exact=True)
    return buffer.getvalue()


def _by_pillow(data: bytes, shape: tuple[int, ...]) -> Samples:
    """Decodes by Pillow, or by `load_image` for PNGs of 16 bits."""
    from PIL import Image

    if data[1:4] == b"PNG" and data[24] == 16:
        from ptmtools.texture.images import load_image

        return load_image(data).array()
    with Image.open(io.BytesIO(data), formats=("PNG", "WEBP")) as image:
        # WebP leaves out alpha where all is opaque.
        opaque = image.mode == "RGB" and shape[2] in (2, 4)
        texels = np.asarray(image.convert("RGBA") if opaque else image)
    if texels.ndim == 3 and texels.shape[2] > shape[2]:
        # WebP has no grey: all three are the same.
        texels = texels[:, :, [0, -1]] if shape[2] == 2 else texels[:, :, : shape[2]]
    return texels.reshape(shape)


def _jpeg_ls(image: Samples) -> bytes:
    """Each plane by itself, with green subtracted from red and blue: JPEG-LS has no colour
    transform."""
    import imagecodecs

    planes = [np.ascontiguousarray(image[:, :, c]) for c in range(image.shape[2])]
    if len(planes) > 2:
        planes[0], planes[2] = planes[0] - planes[1], planes[2] - planes[1]
    coded = [imagecodecs.jpegls_encode(plane) for plane in planes]
    return b"".join(_LENGTH.pack(len(part)) + part for part in coded)


def _from_jpeg_ls(data: bytes, shape: tuple[int, ...]) -> Samples:
    import imagecodecs

    planes, at = [], 0
    while at < len(data):
        (length,) = _LENGTH.unpack_from(data, at)
        at += _LENGTH.size + length
        planes.append(imagecodecs.jpegls_decode(data[at - length : at]))
    if len(planes) > 2:
        planes[0], planes[2] = planes[0] + planes[1], planes[2] + planes[1]
    return np.stack(planes, axis=2)
