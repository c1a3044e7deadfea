"""Images that declare more than they are: refused by what they declare, before memory is taken.

Every case is loaded in one process of its own, whose address space is a quarter of what each
declares and whose memory is measured.
"""

from __future__ import annotations

import json
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ptmtools.errors import LimitError, PtmError
from ptmtools.texture import Limits
from ptmtools.texture.images import load_image, picture as declared
from tests.texture import files
from tests.texture.files import chunk

SIDE = 40_000
#: Loads the files that are named and tells of each its error and by how much the process grew.
CHILD = """
import json, resource, sys, warnings
import ptmtools.texture.images.deep, ptmtools.texture.images.floats, numpy, numpy.lib.format
from PIL import (BmpImagePlugin, GifImagePlugin, JpegImagePlugin, PcxImagePlugin, PngImagePlugin,
    PpmImagePlugin, TgaImagePlugin, TiffImagePlugin, WebPImagePlugin)
from ptmtools.errors import PtmError
from ptmtools.texture.images import load_image
try:
    import imagecodecs, OpenEXR
except ImportError:
    pass
taken = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (taken + (1 << 30),) * 2)
outcomes = {}
for name in sys.argv[1:]:
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    try:
        load_image(name).array()
        what = "loaded"
    except PtmError as error:
        what = str(error)
    except BaseException as error:
        what = "crash: " + repr(error)
    outcomes[name] = what, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
print(json.dumps(outcomes))
"""


def saved(kind: str, mode: str = "RGB", side: int = 16, **settings: object) -> bytes:
    noise = np.random.default_rng(1).integers(0, 255, (side, side, 4), np.uint8)
    return files.saved(Image.fromarray(noise).convert(mode), kind, **settings)


def png(width: int, height: int, depth: int = 8, colour: int = 2, *more: bytes) -> bytes:
    return files.png(width, [bytes(63)], depth, colour, *more, height=height)


def zeros(count: int) -> bytes:
    """``count`` MiB as zlib compresses them, of which it compresses one."""
    stream = zlib.compressobj(wbits=-15)
    block = stream.compress(bytes(1 << 20)) + stream.flush(zlib.Z_FULL_FLUSH)
    sums = (count << 20) % 65521 << 16 | 1
    return b"\x78\x9c" + count * block + b"\x03\0" + struct.pack(">I", sums)


def patched(data: bytes, at: int, packed: bytes) -> bytes:
    return data[:at] + packed + data[at + len(packed) :]


def jpeg(width: int, height: int, **settings: object) -> bytes:
    data = saved("JPEG", **settings)
    at = next(data.find(marker) for marker in (b"\xff\xc0", b"\xff\xc2") if marker in data)
    return patched(data, at + 5, struct.pack(">HH", height, width))


def scans(count: int) -> bytes:
    """A progressive JPEG whose last scan stands there so often."""
    data = saved("JPEG", progressive=True)
    last = data.rindex(b"\xff\xda")
    return data[:last] + data[last:-2] * count + b"\xff\xd9"


def tiff(tags: dict[int, tuple[int, int]], **settings: object) -> bytes:
    """A TIFF whose entries have other values: tag → (type, value)."""
    data = bytearray(saved("TIFF", **settings))
    (at,) = struct.unpack_from("<I", data, 4)
    (count,) = struct.unpack_from("<H", data, at)
    entries = [bytes(data[at + 2 + 12 * i :][:12]) for i in range(count)]
    entries = [e for e in entries if struct.unpack("<H", e[:2])[0] not in tags]
    entries += [struct.pack("<HHII", tag, kind, 1, value) for tag, (kind, value) in tags.items()]
    directory = struct.pack("<H", len(entries)) + b"".join(sorted(entries)) + bytes(4)
    struct.pack_into("<I", data, 4, len(data))
    return bytes(data) + directory


def pages(count: int) -> bytes:
    """A TIFF of directories that overlap, each of thousands of entries."""
    data = bytearray(saved("TIFF"))
    (at,) = struct.unpack_from("<I", data, 4)
    (entries,) = struct.unpack_from("<H", data, at)
    struct.pack_into("<I", data, at + 2 + 12 * entries, len(data))
    tail = bytearray(12 * 6000 + 8 * count)
    for i in range(count):
        struct.pack_into("<H", tail, 4 * i, 5000)
    start = len(data)
    for i in range(count):
        struct.pack_into("<I", tail, 4 * i + 2 + 12 * 5000, start + 4 * (i + 1))
    return bytes(data + tail)


def webp(kind: bytes) -> bytes:
    side = 16_383
    if kind == b"VP8 ":
        body = bytes(3) + b"\x9d\x01\x2a" + struct.pack("<HH", side, side)
    elif kind == b"VP8L":
        body = b"\x2f" + struct.pack("<I", side - 1 | (side - 1) << 14)
    else:
        side = 1 << 16
        body = bytes(4) + 2 * struct.pack("<I", side - 1)[:3]
    body += bytes(64)
    return b"RIFF" + struct.pack("<I4s4sI", 12 + len(body), b"WEBP", kind, len(body)) + body


def npy(head: str, length: int | None = None, version: bytes = b"\1\0") -> bytes:
    text = head.encode() + b"\n"
    size = struct.pack("<H" if version == b"\1\0" else "<I", length or len(text))
    return b"\x93NUMPY" + version + size + text


def shape(text: str, descr: str = "'|u1'") -> str:
    return f"{{'descr': {descr}, 'fortran_order': False, 'shape': {text}, }}"


SIDES = (256, (4, SIDE)), (257, (4, SIDE))
#: What → file. Each says that it has far more than a gigabyte of texels, or something of that kind.
TOO_LARGE: dict[str, bytes] = {
    "PNG": png(SIDE, SIDE),
    "PNG of 16 bits": png(SIDE, SIDE, 16),
    "PNG of one bit": png(SIDE, SIDE, 1, 0),
    "PNG with a palette": png(SIDE, SIDE, 8, 3, chunk(b"PLTE", bytes(30))),
    "PNG of 2^31": png(2**31 - 1, 2**31 - 1),
    "PNG, one row": png(2**31 - 1, 1),
    "JPEG": jpeg(SIDE, SIDE),
    "JPEG, progressive": jpeg(SIDE, SIDE, progressive=True),
    "TIFF": tiff(dict(SIDES)),
    "TIFF, deflated": tiff(dict(SIDES), compression="tiff_adobe_deflate"),
    "TIFF, LZW": tiff(dict(SIDES), compression="tiff_lzw"),
    "TIFF in large tiles": tiff({322: (4, SIDE), 323: (4, SIDE)}, compression="tiff_lzw"),
    "TIFF in tiles of 2^31": tiff({322: (4, 2**31), 323: (4, 16)}, compression="tiff_lzw"),
    "BMP": patched(saved("BMP"), 18, struct.pack("<ii", SIDE, SIDE)),
    "BMP upside down": patched(saved("BMP"), 18, struct.pack("<ii", SIDE, -SIDE)),
    "GIF": patched(saved("GIF"), 6, struct.pack("<HH", SIDE, SIDE)),
    "TGA": patched(saved("TGA"), 12, struct.pack("<HH", SIDE, SIDE)),
    "TGA, run lengths": patched(saved("TGA", compression="tga_rle"), 12, b"\x40\x9c" * 2),
    "PCX": patched(saved("PCX"), 4, struct.pack("<HHHH", 0, 0, SIDE, SIDE)),
    "PPM": b"P6 40000 40000 255\n" + bytes(64),
    "PPM, plain": b"P3 40000 40000 255\n" + b"1 " * 64,
    "PPM of 16 bits, plain": b"P3 40000 40000 65535\n" + b"1 " * 64,
    "PBM": b"P4 65536 65536\n" + bytes(64),
    "WebP, extended": webp(b"VP8X"),
    "Radiance": b"#?RADIANCE\n\n-Y 40000 +X 40000\n" + bytes(64),
    "array of 2^63": npy(shape(f"({2**63 - 1}, 2)")),
}  # fmt: skip

#: What → file, of which each is an error though its size is no larger than it may be.
DAMAGED: dict[str, bytes] = {
    "WebP, lossy": webp(b"VP8 "),
    "WebP, lossless": webp(b"VP8L"),
    "WebP, no head": b"RIFF\0\0\0\0WEBPVP8X",
    "PNG with a profile that unfolds": png(
        8, 8, 8, 2, chunk(b"iCCP", b"a\0\0" + zeros(256))
    ),
    "PNG with a text that unfolds": png(
        8, 8, 8, 2, chunk(b"zTXt", b"a\0\0" + zeros(256))
    ),
    "PNG with many texts that unfold": png(
        8, 8, 8, 2, *[chunk(b"zTXt", b"a\0\0" + zeros(1))] * 200
    ),
    "PNG with a chunk beyond its end": png(8, 8)[:33] + struct.pack(">I4s", 2**31 - 1, b"IDAT"),
    "array of an impossible side": npy(shape("(-1, 40000)")),
    "array of a side without end": npy(shape(f"(0x{'f' * 9000}, 1)")),
    "array of a product that overflows": npy(shape(f"({2**32}, {2**32})")),
    "array of objects": npy(shape("(4, 4)", "'|O'")),
    "array of nothing": npy(shape("(4, 4)", "'|V0'")),
    "array of records": npy(shape("(4, 4)", "[('a', '<f4', (1000000, 1000000))]")),
    "array with a head of four gigabytes": npy("{", 2**32 - 1, b"\2\0"),
    "array with a head of brackets": npy("(" * 60_000),
    "array with a head of minuses": npy("-" * 60_000 + "1"),
    "TIFF of pages without end": pages(3000),
    "TIFF with a strip elsewhere": tiff({273: (4, 2**32 - 1)}),
    "TIFF with many samples": tiff({277: (3, 65535)}),
}  # fmt: skip

#: What → file, which lies and can be read all the same: what it says has no bearing on its texels.
HARMLESS: dict[str, bytes] = {
    "TIFF with a strip that lies": tiff({279: (4, 2**32 - 1)}),
    "TIFF with rows without end": tiff({278: (4, 2**32 - 1), 279: (4, 4)}),
}


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[str, int]]:
    """What loading each file came to, and by how many bytes the process grew."""
    if not Path("/proc/self/statm").exists():
        pytest.skip("memory is measured on Linux only")
    folder = tmp_path_factory.mktemp("hostile")
    files = {}
    for number, (what, data) in enumerate((TOO_LARGE | DAMAGED | HARMLESS).items()):
        files[what] = folder / f"{number}"
        files[what].write_bytes(data)
    sparse = folder / "sparse"
    with sparse.open("wb") as file:
        file.write(png(8, 8))
        file.truncate(1 << 40)
    files["a file of a terabyte"] = sparse
    run = subprocess.run([sys.executable, "-c", CHILD, *files.values()], capture_output=True)
    assert run.returncode == 0, run.stderr.decode()
    actual = json.loads(run.stdout)
    return {
        what: (actual[str(file)][0], 1024 * actual[str(file)][1]) for what, file in files.items()
    }


@pytest.mark.parametrize("what", [*TOO_LARGE, "a file of a terabyte"])
def test_too_large(what: str, outcomes: dict[str, tuple[str, int]]) -> None:
    outcome, grown = outcomes[what]
    assert "[PTM-L104]" in outcome
    # Not because memory ran out while a decoder was at it.
    assert "more than the limit" in outcome or "can be stored" in outcome or "bytes, too" in outcome
    assert grown < 1 << 25


@pytest.mark.parametrize("what", DAMAGED)
def test_damaged(what: str, outcomes: dict[str, tuple[str, int]]) -> None:
    outcome, grown = outcomes[what]
    assert "[PTM-I12" in outcome or "[PTM-L104]" in outcome
    assert grown < 1 << 27


@pytest.mark.parametrize("what", HARMLESS)
def test_harmless(what: str, outcomes: dict[str, tuple[str, int]]) -> None:
    outcome, grown = outcomes[what]
    assert outcome == "loaded"
    assert grown < 1 << 25


def test_webp_is_refused_before_it_is_opened() -> None:
    limits = Limits(decoded_bytes=1 << 20)
    for kind in (b"VP8 ", b"VP8L", b"VP8X"):
        with pytest.raises(LimitError, match="PTM-L104"):
            load_image(webp(kind), limits)
    small = saved("WEBP", "RGBA", 500, lossless=True)
    with pytest.raises(LimitError, match="500 x 500"):
        load_image(small, Limits(decoded_bytes=500 * 500 * 4 - 1))
    assert load_image(small, Limits(decoded_bytes=500 * 500 * 4)).texels.shape == (500, 500, 4)
    lossy = saved("WEBP", "RGB", 300, quality=90)
    with pytest.raises(LimitError, match="300 x 300"):
        load_image(lossy, Limits(decoded_bytes=300 * 300 * 4 - 1))


def test_scans_of_a_jpeg_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    assert load_image(scans(declared.MOST_SCANS - 9)).texels.shape == (16, 16, 3)
    with pytest.raises(LimitError, match="PTM-L104"):
        load_image(scans(declared.MOST_SCANS - 8))
    # Those in a thumbnail, or in any other segment, are none.
    data = saved("JPEG")
    segment = b"\xff\xe5" + struct.pack(">H", 60_002) + b"\xff\xda" * 30_000
    assert load_image(data[:2] + segment + data[2:]).texels.shape == (16, 16, 3)


@pytest.mark.parametrize("what", TOO_LARGE | DAMAGED)
def test_from_bytes_as_from_files(what: str) -> None:
    with pytest.raises(PtmError):
        load_image((TOO_LARGE | DAMAGED)[what])
