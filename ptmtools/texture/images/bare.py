"""Image files without the parts that do not change their texels: profile, orientation, text, date.

Compressing a megatexel of PNG again takes half a second, three times as long as encoding it, and
gives other bytes with another zlib; a lossy file compressed again has other texels. So the parts
are cut out of the file. Without its orientation, every reader shows the rows as they are stored.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from ptmtools.texture.images.opening import PNG

#: Chunks of a PNG that hold its texels.
_CHUNKS = (b"IHDR", b"PLTE", b"tRNS", b"IDAT", b"IEND")
#: Markers of JPEG: start of scan; markers without a length; APP0 (JFIF) and APP14 (Adobe, which
#: says how colours are coded) are kept of the APP segments.
_SOS, _BARE_MARKERS, _APP, _KEPT_APP, _COMMENT = (
    0xDA,
    (0x01, *range(0xD0, 0xD9)),
    0xE0,
    (0, 14),
    0xFE,
)
#: Chunks of a WebP without texels, and their flags in VP8X.
_WEBP_CHUNKS = {b"ICCP": 0x20, b"EXIF": 0x08, b"XMP ": 0x04}


def bare(data: bytes, format: str) -> bytes:
    """An intact file of a format, "PNG", "JPEG", "WebP" or "AVIF", without the parts; an AVIF as it
    is."""
    cut = _CUT.get(format)
    return data if cut is None else b"".join(cut(data))


def _png(data: bytes) -> Iterator[bytes]:
    yield PNG
    at = len(PNG)
    while at < len(data):
        end = at + 12 + int.from_bytes(data[at : at + 4], "big")
        kind = data[at + 4 : at + 8]
        if kind in _CHUNKS:
            yield data[at:end]
        if kind == b"IEND":
            break
        at = end


def _jpeg(data: bytes) -> Iterator[bytes]:
    yield data[:2]
    at = 2
    while at + 4 <= len(data) and data[at] == 0xFF:
        marker = data[at + 1]
        if marker == _SOS:
            break
        if marker == 0xFF or marker in _BARE_MARKERS:  # filling, or a marker alone
            at += 1 if marker == 0xFF else 2
            continue
        end = at + 2 + int.from_bytes(data[at + 2 : at + 4], "big")
        if marker != _COMMENT and not (
            _APP <= marker < _APP + 16 and marker - _APP not in _KEPT_APP
        ):
            yield data[at:end]
        at = end
    yield data[at:]


def _webp(data: bytes, cut: Mapping[bytes, int] = _WEBP_CHUNKS) -> Iterator[bytes]:
    chunks, at = [], 12
    while at + 8 <= len(data):
        end = at + 8 + (int.from_bytes(data[at + 4 : at + 8], "little") + 1 & ~1)
        chunks.append(data[at:end])
        at = end
    kept = [chunk for chunk in chunks if chunk[:4] not in cut]
    for i, chunk in enumerate(kept):
        if chunk[:4] == b"VP8X":
            flags = chunk[8] & ~sum(cut.values())
            kept[i] = chunk[:8] + bytes([flags]) + chunk[9:]
    body = b"WEBP" + b"".join(kept)
    yield b"RIFF" + len(body).to_bytes(4, "little") + body


_ALPHA_URN = b"urn:mpeg:mpegB:cicp:systems:auxiliary:alpha\0"


def drop_alpha(data: bytes, format: str) -> bytes:
    """A lossy WebP or AVIF without its alpha; other files as they are.

    That of an AVIF becomes an auxiliary image of an unknown type, which readers leave alone, so
    that no offset in the file changes.
    """
    if format == "AVIF":
        return data.replace(_ALPHA_URN, _ALPHA_URN.replace(b"alpha", b"other"))
    cut = {**_WEBP_CHUNKS, b"ALPH": 0x10}
    return b"".join(_webp(data, cut)) if format == "WebP" else data


_CUT: Mapping[str, Callable[[bytes], Iterator[bytes]]] = {
    "PNG": _png,
    "JPEG": _jpeg,
    "WebP": _webp,
}
