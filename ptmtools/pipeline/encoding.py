"""One image as a task: the bytes of a `.ptm`, what its levels show, and of its fallback image."""

from __future__ import annotations

import io
import json
from dataclasses import asdict, replace
from typing import TYPE_CHECKING

from ptmtools.errors import naming
from ptmtools.pipeline.options import TextureOptions

if TYPE_CHECKING:
    from ptmtools.texture.detail import Detail
    from ptmtools.texture.model import PtmHeader

PNG_MAGIC = b"\x89PNG\r\n\x1a\n"


def encoded_image(options: TextureOptions, image: tuple[str, bytes, int]) -> list[bytes]:
    """An image, (name, bytes of its file, how many of its finest levels to leave out), as the bytes
    of a `.ptm`, of its `Detail` as JSON and, if there is to be one, of its fallback image.

    Raises what `encode` and `read_image` raise.
    """
    from ptmtools.texture import Limits, decode, encode_to, read_header, read_image
    from ptmtools.texture.images import png_bytes

    name, source, unresolved = image
    with naming(name):
        texels = read_image(source, Limits(options.limit << 20))
        height, width = texels.shape[:2]
        kept = without_finest(options, unresolved, width, height)
        buffer = io.BytesIO()
        detail = json.dumps(asdict(encode_to(buffer, texels, kept))).encode() + b"\n"
        data = buffer.getvalue()
    if not options.fallback:
        return [data, detail]
    header = read_header(data)
    level = fallback_level(header, options.fallback_size)
    if level < len(header.levels) - 1 or options.max_error or header.trimmed:
        # Decoding takes more than the image, which is within the limit.
        png = png_bytes(decode(data, level=level, limits=Limits(64 * texels.nbytes + (1 << 20))))
    elif source.startswith(PNG_MAGIC):
        png = bare_png(source)
    else:
        png = png_bytes(texels)
    return [data, detail, png]


def read_detail(data: bytes) -> Detail:
    """The `Detail` of which `encoded_image` made JSON; raises what damage makes of it: ValueError,
    LookupError or TypeError."""
    from ptmtools.texture.detail import Detail

    found = json.loads(data)
    red, green, blue = map(int, found["color"])
    return Detail(tuple(map(float, found["differences"])), (red, green, blue))


def without_finest(options: TextureOptions, count: int, width: int, height: int) -> TextureOptions:
    """The options that leave out so many of the finest levels of an image besides, but for the
    coarsest level that is kept without."""
    from ptmtools.texture.encoder import kept_levels
    from ptmtools.texture.pyramid import level_sizes

    if not count:
        return options
    levels, kept = len(level_sizes(width, height)), kept_levels(width, height, options)
    last = max(min(kept[-1], levels - 1 - count), kept[0])
    return replace(options, min_level=kept[0], max_level=last)


def fallback_level(header: PtmHeader, size: int) -> int:
    """The level that a fallback image of this size holds, see `TextureOptions`."""
    sides = [max(level.width, level.height) for level in header.levels]
    fitting = [n for n, side in enumerate(sides) if side <= size or not size]
    return fitting[-1] if fitting else 0


def bare_png(data: bytes) -> bytes:
    """An intact PNG reduced to what makes its texels: no gamma, colour profile, text or date.

    Deflating a megatexel again takes half a second, three times as long as encoding it, and gives
    other bytes with another zlib.
    """
    kept, at = [data[: len(PNG_MAGIC)]], len(PNG_MAGIC)
    while at < len(data):
        end = at + 12 + int.from_bytes(data[at : at + 4], "big")
        kind = data[at + 4 : at + 8]
        if kind in (b"IHDR", b"PLTE", b"tRNS", b"IDAT", b"IEND"):
            kept.append(data[at:end])
        if kind == b"IEND":
            break
        at = end
    return b"".join(kept)
