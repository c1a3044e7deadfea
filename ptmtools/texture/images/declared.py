"""What an image file declares of its size, read before a decoder takes memory or time for it.

Pillow's plug-ins give the size of most formats before they unpack anything. The exceptions:

- All: a file may itself be larger than any image of so many texels, and take no room on the disk.
- WebP: its decoder takes two canvases of the declared size as it is opened (RIFF container, RFC
  9649, sections 2.5 to 2.7).
- JPEG: every scan of a progressive file goes over the whole image, and may take a few bytes to say
  nothing (ITU T.81, B.2.1): a file of 1 MB can hold days of them.
- TIFF: a tile has a size of its own, and a buffer is taken for it (TIFF 6.0, section 15).
"""

from __future__ import annotations

import re
from typing import BinaryIO

from ptmtools.errors import LimitError
from ptmtools.texture.images.picture import check_size, damaged_image
from ptmtools.texture.model import Limits

#: A file may have so many bytes for each byte of its texels, and so many besides: plain PPMs have
#: four, descriptions some megabytes.
_BYTES, _BYTES_BESIDES = 8, 1 << 24
#: Encoders make 10 scans, some for an image of four components 20.
MOST_SCANS = 100
#: A marker of JPEG that is none of those between and within the data of a scan.
_MARKER = re.compile(rb"\xff+([^\x00\xd0-\xd7\xff])", re.DOTALL)
_SCAN, _END = 0xDA, 0xD9
#: Markers without a length: of the beginning, and one that nobody uses.
_BARE = (0xD8, 0x01)


def check_file(file: BinaryIO, limits: Limits) -> None:
    """Raise LimitError PTM-L104 for a file larger than one of as many texels as are allowed."""
    check_bytes(file.seek(0, 2), limits)


def check_bytes(size: int, limits: Limits) -> None:
    """As `check_file`, for a file of ``size`` bytes."""
    if size > _BYTES * limits.decoded_bytes + _BYTES_BESIDES:
        raise LimitError(
            "PTM-L104",
            f"has {size} bytes, too many for an image within the limit of "
            f"{limits.decoded_bytes} bytes of texels",
            remedy="raise the limit (--limit), or save it in another format",
        )


def check_webp(head: bytes, limits: Limits) -> None:
    """Raise LimitError PTM-L104 if a WebP file, of which ``head`` are the first 30 bytes or more,
    says that its texels, at four bytes, are more than the limit."""
    kind = head[12:16]
    if len(head) < 30:
        return
    if kind == b"VP8 ":
        width, height = (int.from_bytes(head[at : at + 2], "little") & 0x3FFF for at in (26, 28))
    elif kind == b"VP8L":
        bits = int.from_bytes(head[21:25], "little")
        width, height = 1 + (bits & 0x3FFF), 1 + (bits >> 14 & 0x3FFF)
    else:
        width, height = (1 + int.from_bytes(head[at : at + 3], "little") for at in (24, 27))
    check_size(width, height, 4, limits)


def check_jpeg(data: bytes) -> None:
    """Raise LimitError PTM-L106 for a JPEG of more than `MOST_SCANS` scans."""
    scans = at = 0
    while marker := _MARKER.search(data, at):
        kind, at = marker[1][0], marker.end()
        if kind == _END:
            break
        scans += kind == _SCAN
        if scans > MOST_SCANS:
            raise LimitError(
                "PTM-L106",
                f"is a JPEG of more than {MOST_SCANS} scans",
                remedy="save it again, or as PNG",
            )
        if kind not in _BARE:
            at += max(2, int.from_bytes(data[at : at + 2], "big"))


def check_tile(width: object, height: object, texel_bytes: int, limits: Limits) -> None:
    """Raise LimitError PTM-L104 if a tile of a TIFF is larger than all of an image may be; tiles
    that it has not have None for their size. Raise InputError PTM-I125 for sizes that are none."""
    if width is None and height is None:
        return
    if not (isinstance(width, int) and isinstance(height, int)):
        raise damaged_image("in the size of its tiles")
    check_size(width, height, texel_bytes, limits)
