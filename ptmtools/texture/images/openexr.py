"""OpenEXR files, through the library of that name (an optional component)."""

from __future__ import annotations

import os
from pathlib import Path
from tempfile import NamedTemporaryFile, TemporaryDirectory
from typing import IO, Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ptmtools.lazy import component
from ptmtools.texture.images.declared import check_file, check_tile
from ptmtools.texture.images.picture import (
    Picture,
    check_size,
    damaged_image,
    not_held,
    several,
    unsupported,
)
from ptmtools.texture.model import Description, Limits

MAGIC = b"v/1\x01"
#: Channels of the images that are read, in the order of the texel's components.
_CHANNELS = {1: ["Y"], 2: ["Y", "A"], 3: ["R", "G", "B"], 4: ["R", "G", "B", "A"]}


def read_exr(file: BinaryIO, path: str | None, limits: Limits) -> Picture:
    """An OpenEXR file of one part, its data window; (h, w, c) of float16 or float32.

    Raises InputError PTM-I125 to PTM-I127, LimitError PTM-L104, MissingComponentError PTM-M101.
    """
    library = _library()
    if path is None:
        return _from_memory(file, limits)
    try:
        # First the head alone: the size is checked before texels are unpacked.
        with library.File(path, header_only=True) as exr:
            head = exr.parts[0].header
            parts = len(exr.parts)
            low, high = ([int(n) for n in corner] for corner in head["dataWindow"])
            tiles = head.get("tiles")
            names = {channel.name for channel in head["channels"]}
            sampled = any((c.xSampling, c.ySampling) != (1, 1) for c in head["channels"])
    except Exception as error:  # its errors have no class in common
        raise damaged_image(error) from None
    if parts > 1:
        raise several(f"{parts} parts", "export only the one you want")
    wanted = next((order for order in _CHANNELS.values() if set(order) == names), None)
    if wanted is None or sampled:
        raise unsupported(f"the channels {', '.join(sorted(names))}")
    check_size(high[0] - low[0] + 1, high[1] - low[1] + 1, 4 * len(wanted), limits)
    if tiles is not None:
        check_tile(int(tiles.xSize), int(tiles.ySize), 4 * len(wanted), limits)
    try:
        with library.File(path, separate_channels=True) as exr:
            planes = [exr.channels()[name].pixels for name in wanted]
    except Exception as error:
        raise damaged_image(error) from None
    types = {plane.dtype.name for plane in planes}
    if len(types) != 1 or not types <= {"float16", "float32"}:
        raise unsupported(f"channels of {', '.join(sorted(types))}")
    return Picture(np.stack(planes, axis=2))


def save_openexr(file: IO[bytes], texels: NDArray[Any], description: Description) -> None:
    """(h, w, c) float16 or float32 as an OpenEXR file, ZIP-compressed, without the description.

    Raises MissingComponentError PTM-M101, OutputError PTM-O102.
    """
    if texels.dtype.kind != "f":
        raise not_held("exr", texels, ".png, .npy or .tif")
    library = _library()
    names = _CHANNELS[texels.shape[2]]
    channels = {name: np.ascontiguousarray(texels[:, :, i]) for i, name in enumerate(names)}
    head = {"compression": library.ZIP_COMPRESSION, "type": library.scanlineimage}
    with TemporaryDirectory() as folder:  # the library writes files that have a name
        path = Path(folder) / "image.exr"
        with library.File(head, channels) as exr:
            exr.write(os.fspath(path))
        file.write(path.read_bytes())


def _from_memory(file: BinaryIO, limits: Limits) -> Picture:
    """The library reads files that have a name."""
    check_file(file, limits)
    file.seek(0)
    with NamedTemporaryFile(suffix=".exr") as named:
        named.write(file.read())
        named.flush()
        return read_exr(file, named.name, limits)


def _library() -> Any:
    return component("OpenEXR", "PTM-M101", "OpenEXR files need OpenEXR", "exr")
