"""Reads and writes image files.

The first bytes of a file choose its reader. The suffix chooses the writer, and a format that cannot
hold the texels exactly is refused.
"""

from __future__ import annotations

import io
import os
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import PurePath
from typing import IO, Any, BinaryIO, cast

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import InputError, OutputError, naming
from ptmtools.texture.container import HEAD_MAX, MAGIC, read_header
from ptmtools.texture.images import deep, floats, opening
from ptmtools.texture.images.opening import PNG, TIFF, pillow_faults
from ptmtools.texture.images.picture import Picture, Strips, samples_error
from ptmtools.texture.images.png import check_chunks, save_png
from ptmtools.texture.model import Description, Limits
from ptmtools.texture.samples import round_to_eight_bits
from ptmtools.texture.sources import open_file

#: Suffixes of the files that count as images when a folder is given.
SUFFIXES = (
    *(".png", ".jpg", ".jpeg", ".tif", ".tiff", ".tga", ".bmp", ".gif", ".webp", ".avif", ".pcx"),
    *(".ppm", ".pgm", ".pbm", ".pnm", ".hdr", ".exr", ".npy"),
)
_LIMITS = Limits()
_PPM = (b"P2", b"P3", b"P5", b"P6")


def load_image(source: str | os.PathLike[str] | bytes, limits: Limits = _LIMITS) -> Picture:
    """Loads an image file to encode: texels exactly as stored, and their description.

    8 bits: PNG, JPEG (as it decodes), TIFF, TGA, BMP, GIF, WebP, AVIF, PPM, PCX. 16 bits: PNG,
    TIFF, PPM and PGM, .npy. Floats: TIFF, Radiance .hdr (float32), OpenEXR, .npy. TIFFs of several
    components deeper than 8 bits need imagecodecs, OpenEXR files need OpenEXR.

    1 component for grey (1-bit images become 0 and 255), 2 with alpha; 3 for RGB and palettes, 4
    with alpha. A colour key (PNG tRNS) becomes an alpha of 0 or all bits. An .npy is (h, w) or
    (h, w, c) of a type that a `.ptm` holds; it and binary 16-bit PPMs are mapped, not read, but
    from a pipe, which is read whole.

    Parameters
    ----------
    source: a path, or the bytes of a file.
    limits: ``decoded_bytes`` is the most memory that the texels may take, judged by the size that
        the head of the file declares.

    Raises
    ------
    InputError: PTM-I120 no such file; PTM-I122 a folder, or not readable; PTM-I125 empty, not an
        image, damaged or truncated; PTM-I126 samples or a colour model that cannot be held
        exactly, or several frames.
    LimitError: PTM-L104 more texels than are read.
    MissingComponentError: PTM-M100 a library that is not installed is needed.
    """
    if isinstance(source, bytes):
        return _load(cast("BinaryIO", io.BytesIO(source)), None, limits)
    path = os.fspath(source)
    with open_file(path) as file, naming(path):
        # A pipe cannot be opened or mapped by its name a second time.
        return _load(file, None if isinstance(file, io.BytesIO) else path, limits)


def read_image(
    source: str | os.PathLike[str] | bytes, limits: Limits = _LIMITS
) -> NDArray[np.uint8]:
    """The texels of an image file of 8 bits a component: (h, w, c) uint8, rows from the top.

    Raises what `load_image` raises; InputError PTM-I126 also for deeper samples.
    """
    picture = load_image(source, limits)
    with naming(None if isinstance(source, bytes) else source):
        check_depth(picture)
        return picture.array()


def open_shallow(
    source: bytes, limits: Limits = _LIMITS, *, deep: bool = False
) -> tuple[str, Callable[[], Picture]]:
    """What has to be converted to read an image of any samples, colours and frames in 8 bits, "" if
    nothing; and a function that reads it so. ``deep``: 16 bits need not be converted either.

    Raises what `load_image` raises; PTM-I126 only for what Pillow does not read either.
    """
    file = cast("BinaryIO", io.BytesIO(source))
    picture: Picture | None = None
    try:
        opened = _open(file, None, limits)
        if not isinstance(opened, Picture):
            return "", partial(_unpack, opened)
        picture = opened
        if not (deep and picture.texels.dtype.name == "uint16"):
            check_depth(picture)
        return "", lambda: opened
    except InputError as fault:
        if fault.code != "PTM-I126":
            raise
        what = fault.message.partition(";")[0]
    if picture is not None:
        texels, (height, width, *more) = picture.texels, picture.texels.shape
        shape = (height, width, more[0] if more else 1)

        def strip(y0: int, y1: int) -> Samples:
            return round_to_eight_bits(texels[y0:y1]).reshape(y1 - y0, *shape[1:])

        shallow = replace(picture, texels=Strips(shape, np.dtype(np.uint8), strip))
        return f"{what}, converted to 8 bits", lambda: shallow
    with pillow_faults():
        image = opening.open_image(file, limits)
        how, texels = opening.convert_texels(image, limits)
        result = Picture(texels, lossy=opening.lossy_source(file, image))
    return f"{what}, {how}", lambda: result


def check_depth(picture: Picture) -> None:
    """Raises InputError PTM-I126 for samples of more than 8 bits."""
    if picture.texels.dtype.name != "uint8":
        raise InputError(
            "PTM-I126",
            f"has {picture.texels.dtype.name} samples; only 8-bit images are used here",
            remedy="convert it to 8-bit RGB yourself, so that you see what that changes",
        )


def read_ptm(path: str | os.PathLike[str]) -> bytes:
    """The bytes of a `.ptm` whose head is valid.

    Raises InputError: PTM-I120, PTM-I122 as `load_image`; what `read_header` raises.
    """
    with open_file(path) as file:
        data = file.read()
    with naming(path):
        read_header(data[:HEAD_MAX])
    return data


def _load(file: BinaryIO, path: str | None, limits: Limits) -> Picture:
    result = _open(file, path, limits)
    return result if isinstance(result, Picture) else _unpack(result)


def _unpack(unpacked: Callable[[], Picture]) -> Picture:
    with pillow_faults():
        return unpacked()


def _open(file: BinaryIO, path: str | None, limits: Limits) -> Picture | Callable[[], Picture]:
    """A loaded image; for one of 8 bits, which Pillow has opened and accepted, a function that
    unpacks it."""
    first = file.read(HEAD_MAX)
    if not first:
        raise InputError("PTM-I125", "is empty", remedy="download or export it again")
    if first.startswith((MAGIC, b"PTM_1")):
        read_header(first)  # says so if it is HP's format
        raise InputError(
            "PTM-I125",
            "is a progressive texture map already, not an image",
            remedy="use ptm decode to get an image from it",
        )
    if first.startswith(floats.NPY_MAGIC):
        return floats.read_npy(file, path, limits)
    if first.startswith(floats.MAGIC):
        return floats.read_hdr(file, limits)
    if first.startswith(floats.OPENEXR_MAGIC):
        return floats.read_exr(file, path, limits)
    return _open_by_pillow(file, path, first, limits)


def _open_by_pillow(
    file: BinaryIO, path: str | None, first: bytes, limits: Limits
) -> Picture | Callable[[], Picture]:
    with pillow_faults():
        if first.startswith(_PPM) and (picture := deep.read_ppm(file, path, limits)):
            return picture
        if first.startswith(PNG):
            check_chunks(file)
        if first.startswith(TIFF) and deep.is_deep(tags := deep.tiff_tags(file)):
            return deep.read_tiff(file, tags, limits)
        image = opening.open_image(file, limits)
        opening.one_frame(image)
        depth = 8
        if first.startswith(PNG):
            depth, colour = first[24], first[25]
            if depth == 16:
                return deep.read_png(file, image, colour, limits)
        elif image.format == "PPM" and _is_rescaled(image.tile):
            raise samples_error("samples that do not fill their bits")
        elif opening.high_colour(image):
            raise samples_error("samples of 5 or 6 bits")
        opening.check(image, limits)
        return partial(opening.read, image, depth, opening.lossy_source(file, image))


def _is_rescaled(tiles: list[Any]) -> bool:
    """Whether Pillow scales the samples of a PPM: a maximum of other than 255 and 1."""
    arguments = tiles[0].args if tiles else ()
    maximum = arguments[1] if isinstance(arguments, tuple) and len(arguments) > 1 else 0
    return maximum not in (0, 255)


Samples = NDArray[Any]
_PLAIN = Description()
#: Suffixes of formats that would change texels, or might.
LOSSY = (".jpg", ".jpeg", ".jxl", ".webp", ".avif", ".heic", ".gif")


def write_image(
    path: str | os.PathLike[str],
    texels: Samples,
    description: Description = _PLAIN,
    force: bool = False,
) -> None:
    """Write (h, w, c) texels, 1 to 4 components, as an image file, whole or not at all.

    By suffix: .png uint8 and uint16; .npy and .tif anything; .hdr and .exr floats, .hdr only what
    it holds exactly (levels of a Radiance picture below the finest are seldom that). PNG and TIFF
    keep the description, the others keep none of it.

    Raises
    ------
    OutputError: PTM-O101 another suffix, or a format that does not hold these samples, and
        those of `ptmtools.files.write_with`.
    MissingComponentError: PTM-M100 OpenEXR is not installed.
    """
    from ptmtools.files import refuse_existing, write_with

    suffix = PurePath(path).suffix
    with naming(path):
        writer(suffix)
        if not force:
            refuse_existing(path)
        write_with(path, lambda file: write_to(file, suffix, texels, description), force=force)


def write_to(
    file: IO[bytes], suffix: str, texels: Samples, description: Description = _PLAIN
) -> None:
    """As `write_image`, into an open file."""
    writer(suffix)(file, texels, description)


Writer = Callable[[IO[bytes], Samples, Description], object]


def writer(suffix: str) -> Writer:
    """The function that writes files of that suffix. Raises OutputError PTM-O101."""
    writer = WRITTEN.get(suffix.lower())
    if writer is None:
        lossy = suffix.lower() in LOSSY
        why = "is lossy and would change the texels" if lossy else "is not written"
        raise OutputError(
            "PTM-O101",
            f"the suffix {suffix!r} {why}",
            remedy=f"use one of {', '.join(WRITTEN)}",
        )
    return writer


#: Suffix → the function that writes such files.
WRITTEN: dict[str, Writer] = {
    ".png": save_png,
    ".npy": floats.save_npy,
    ".tif": deep.save_tiff,
    ".tiff": deep.save_tiff,
    ".hdr": floats.save_radiance,
    ".exr": floats.save_openexr,
}
