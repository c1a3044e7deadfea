"""Profile `paper`: the layout of the paper with each partial level in lossless JPEG (§4.3).

For comparison. The residuals stay as they are in `raw`; the texels p of all blocks, those of q and
those of r are three images of half the size, each in lossless JPEG (ITU-T T.81, process 14) as
libjpeg-turbo writes it; edge texels are stored. Predictor 7, and 4 for 16 bits, where libjpeg-turbo
3.1 does not decode what it has written with predictors 5, 6 and 7.

The bytes depend on the libjpeg-turbo in use; the decoded texels do not. Integers only, and
always exact. All functions raise MissingComponentError (PTM-M100) where imagecodecs is not
installed, and InputError (PTM-I111) for floats.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ptmtools.errors import InputError
from ptmtools.lazy import component
from ptmtools.texture.coder import PLAIN, Coding, Data, Samples, Shape, Tile
from ptmtools.texture.coders.group import GroupReader, group_error
from ptmtools.texture.profiles import raw
from ptmtools.texture.profiles.raw import (
    corners,
    pack_pairs,
    place_last,
    read_pairs,
    residuals,
    sample_bytes,
)

#: Forms of a group: as in `raw`, where JPEG is longer or there are no blocks; with JPEGs.
RAW, JPEG = 0, 1
#: Predictors by bytes of a sample.
PREDICTORS = {1: 7, 2: 4}
#: Bytes of the length of a JPEG.
_LENGTH = 4


def encode_base(level: Samples) -> bytes:
    """All texels, row by row."""
    _codecs(level.dtype)
    return raw.encode_base(level)


def decode_base(data: Data, shape: Shape, dtype: np.dtype[Any]) -> Samples:
    """The inverse of `encode_base`. Raises InputError PTM-I112."""
    _codecs(dtype)
    return raw.decode_base(data, shape, dtype)


def encode_tile(level: Samples, below: Samples, coding: Coding = PLAIN) -> Tile:
    """One byte that names the form; residual array, edge texels, three JPEGs."""
    codecs = _codecs(level.dtype)
    plain = bytes([RAW]) + raw.encode_tile(level, below).data
    if not below.size:
        return Tile(plain, level)
    codes, _ = residuals(level, below)
    parts = [bytes([JPEG]), pack_pairs(codes), sample_bytes(*_edges(level))]
    for texels in corners(level, below)[:3]:
        jpeg = codecs.jpeg8_encode(
            _plain(texels),
            lossless=True,
            predictor=PREDICTORS[level.dtype.itemsize],
            bitspersample=8 * level.dtype.itemsize,
        )
        decoded = codecs.jpeg8_decode(jpeg).reshape(texels.shape)
        if not np.array_equal(decoded, texels):
            return Tile(plain, level)
        parts += [len(jpeg).to_bytes(_LENGTH, "little"), bytes(jpeg)]
    coded = b"".join(parts)
    return Tile(min(plain, coded, key=len), level)


def decode_tile(data: Data, below: Samples, shape: Shape, coding: Coding = PLAIN) -> Tile:
    """The inverse of `encode_tile`. Raises InputError PTM-I112."""
    codecs = _codecs(below.dtype)
    reader = GroupReader(data)
    form = reader.number(1)
    if form == RAW:
        return raw.decode_tile(reader.rest(), below, shape)
    if form != JPEG or not below.size:
        raise group_error("its form is unknown")
    level = np.empty(shape, below.dtype)
    codes = read_pairs(reader, below)
    for edge in _edges(level):
        edge[:] = reader.texels(edge.shape, below.dtype)
    for texels in corners(level, below)[:3]:
        jpeg = bytes(reader.take(reader.number(_LENGTH)))
        texels[:] = _decode_jpeg(codecs, jpeg, texels)
    reader.end()
    place_last(level, below, codes, b"")
    return Tile(b"", level)


def _codecs(dtype: np.dtype[Any]) -> Any:
    """imagecodecs, for samples that lossless JPEG supports."""
    if dtype.kind != "u":
        raise InputError(
            "PTM-I111",
            f"profile paper has no samples of type {dtype.name}",
            remedy="use another profile; this one is for integers of 8 and 16 bits",
        )
    return component("imagecodecs", "PTM-M100", "profile paper needs imagecodecs", "codecs")


def _edges(level: Samples) -> tuple[Samples, Samples]:
    """The texels of no block: the odd last column down to the last block, the odd last row."""
    height, width = level.shape[0] & ~1, level.shape[1] & ~1
    return level[:height, width:], level[height:]


def _plain(texels: Samples) -> Samples:
    """A copy as the JPEG encoder takes it: without an axis of one component."""
    copy: Samples = texels.copy(order="C")
    return copy[:, :, 0] if copy.shape[2] == 1 else copy


def _decode_jpeg(codecs: Any, jpeg: bytes, like: Samples) -> Samples:
    """Decodes a JPEG, which must have this size and type. Raises InputError PTM-I112."""
    _check_frame(jpeg, like)
    try:
        decoded: Samples = codecs.jpeg8_decode(jpeg)
    except (RuntimeError, ValueError) as error:
        raise group_error(f"its JPEG is damaged ({error})") from None
    if decoded.dtype != like.dtype or decoded.size != like.size:
        raise group_error("its JPEG is of another size")
    return decoded.reshape(like.shape)


def _check_frame(jpeg: bytes, like: Samples) -> None:
    """Checks before decoding that a JPEG has one lossless frame of one scan and the right size."""
    height, width, components = like.shape
    at = 2
    while jpeg[:2] == b"\xff\xd8" and jpeg[at : at + 1] == b"\xff":
        marker = jpeg[at + 1 : at + 2]
        size = int.from_bytes(jpeg[at + 2 : at + 4], "big")
        if marker == b"\xc3":
            frame = jpeg[at + 4 : at + 10]
            sides = height.to_bytes(2, "big") + width.to_bytes(2, "big")
            wanted = bytes([8 * like.dtype.itemsize]) + sides + bytes([components])
            # Every further scan would go through the whole image again.
            if frame != wanted or jpeg.count(b"\xff\xda") != 1 or jpeg.count(b"\xff\xc3") != 1:
                break
            return
        # Tables and application data may come before the frame.
        if marker != b"\xc4" and not b"\xe0" <= marker <= b"\xef":
            break
        at += 2 + size
    raise group_error("its JPEG is not the one that was expected")
