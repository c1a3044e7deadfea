"""Writes an image as an interlaced folder: scaled to powers of two, split into files."""

from __future__ import annotations

import json
import os
import re
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ptmtools.errors import InputError
from ptmtools.texture.images import Picture
from ptmtools.texture.images.picture import check_size
from ptmtools.texture.model import MAX_SIDE, Description, Limits
from ptmtools.whole_folder import FolderForm
from ptmtools_systems.interlace.containers import CONTAINERS, check_held
from ptmtools_systems.interlace.model import (
    FORMAT,
    INDEX,
    Interlaced,
    InterlacedFile,
    InterlaceOptions,
    axes_of,
    sizes_of,
)
from ptmtools_systems.interlace.steps import nearest_power, scale, split

_OPTIONS, _LIMITS = InterlaceOptions(), Limits()
#: Files of such a folder besides its index.
_OURS = re.compile(r"[1-9][0-9]?\.(" + "|".join(CONTAINERS) + ")")
FORM = FolderForm(
    INDEX, FORMAT, "ptm interlace", lambda name: name == INDEX or bool(_OURS.fullmatch(name))
)


@dataclass(frozen=True)
class Written:
    """An interlaced image, ready to be written.

    Attributes
    ----------
    interlaced: the manifest.
    files: bytes of each file, in its order.
    notes: changes of the image, one line each.
    """

    interlaced: Interlaced
    files: tuple[bytes, ...]
    notes: tuple[str, ...]

    def named_files(self) -> Iterator[tuple[str, bytes]]:
        """Name and bytes of each file of the folder, the manifest last."""
        for part, data in zip(self.interlaced.parts, self.files, strict=True):
            yield part.name, data
        yield INDEX, (json.dumps(self.interlaced.document(), indent=1) + "\n").encode()


def interlace(
    picture: Picture, options: InterlaceOptions = _OPTIONS, limits: Limits = _LIMITS
) -> Written:
    """The files of an image; they are exactly its texels if its sides are powers of two and the
    container is lossless.

    Raises
    ------
    InputError: PTM-I111 an option out of range; PTM-I126 samples that the container does not
        support.
    LimitError: PTM-L400 a side too long for it; PTM-L104 more than ``limits`` allow, scaled.
    """
    _check_options(options)
    notes = []
    if picture.description.orientation != 1:
        picture = picture.upright()
        notes.append("turned upright, as its EXIF orientation says")
    if _declares_colors(picture.description):
        notes.append("the files carry no colour profile or gamma: texels are as they were stored")
    if len(picture.texels.shape) == 2:  # an .npy of grey
        picture = replace(picture, texels=picture.array())
    old_height, old_width, components = picture.texels.shape
    kind = picture.texels.dtype.name
    width, height = nearest_power(old_width), nearest_power(old_height)
    axes = axes_of(width, height, options.min)
    sizes = sizes_of(width, height, axes)
    check_held(options.format, *sizes[-1][0], components, kind)
    check_size(width, height, components * picture.texels.dtype.itemsize, limits)
    if (width, height) == (old_width, old_height):
        image = picture.array()
    else:
        image = scale(picture.texels, width, height)
        notes.append(
            f"scaled from {old_width} x {old_height} to {width} x {height}, the nearest powers of "
            "two; the files hold the scaled image"
        )
    container = CONTAINERS[options.format]
    parts, files = [], []
    for number, texels in enumerate(split(image, axes)):
        data = container.write(np.ascontiguousarray(texels), options.quality)
        size, joined = sizes[number]
        axis = axes[number - 1] if number else None
        name = f"{number + 1}.{options.format}"
        parts.append(InterlacedFile(name, *size, len(data), zlib.crc32(data), axis, joined))
        files.append(data)
    interlaced = Interlaced(
        width,
        height,
        (old_width, old_height),
        options.format,
        container.lossless,
        components,
        kind,
        options.min,
        tuple(parts),
    )
    return Written(interlaced, tuple(files), tuple(notes))


def _declares_colors(description: Description) -> bool:
    """Whether colours are declared to be others than those of sRGB, which untagged files have."""
    described = description.gamma is not None or description.chromaticities is not None
    return description.icc is not None or (described and description.srgb is None)


def _check_options(options: InterlaceOptions) -> None:
    for name, value, greatest in (
        ("min", options.min, MAX_SIDE),
        ("quality", options.quality, 100),
    ):
        if not 1 <= value <= greatest:
            raise InputError(
                "PTM-I111", f"--{name} {value} is not possible", remedy=f"use 1 to {greatest}"
            )
    if options.format not in CONTAINERS:
        raise InputError(
            "PTM-I111",
            f"--format {options.format[:20]} is not known",
            remedy=f"use one of {', '.join(CONTAINERS)}",
        )


def write_folder(folder: str | os.PathLike[str], written: Written, *, force: bool = False) -> None:
    """Write an interlaced image to a folder, whole or not at all; raises what `FolderForm.write`
    raises."""
    FORM.write(folder, written.named_files(), force=force)
