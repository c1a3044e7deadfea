"""Hostile `.ptm` files and images.

Small files of every profile and kind of sample are mutated. In half of the mutations all checksums
are then made right again, so that what lies behind them is reached; such a file may decode to
another image, of the size that its head declares. Without that, only the exact image or an error
is right. So it is with the checksums of PNG.
"""

from __future__ import annotations

import io
import struct
import zlib
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.fuzz.mutation import NUMBERS, Case, damaged
from ptmtools.texture import (
    EncodeOptions,
    Limits,
    decode,
    encode,
    load_image,
    open as open_ptm,
    read_header,
)

LIMITS = Limits(decoded_bytes=1 << 24)
#: Fields of the head of a `.ptm`: offset and bytes, as in docs/formats/ptm.md.
FIELDS = ((8, 2), (10, 1), (11, 1), (12, 4), (16, 4), (20, 1), (21, 1), (22, 1), (23, 1), (24, 4),
          (28, 4), (32, 4), (36, 4), (44, 8), (52, 8), (64, 8), (72, 8))  # fmt: skip


def textures() -> list[tuple[str, NDArray[Any]]]:
    """Small images of every kind of sample."""
    rng = np.random.default_rng(7)
    y, x = np.mgrid[:37, :45]
    smooth = np.stack([x * 3 + y * (c + 1) for c in range(4)], axis=2)
    photo = (smooth + rng.integers(0, 9, smooth.shape)).clip(0, 255)
    flat = np.where((x // 9 + y // 7)[:, :, None] % 3 == 0, smooth * 0 + 200, 30)
    return [
        ("photo", photo[:, :, :3].astype(np.uint8)),
        ("flat", flat.astype(np.uint8)),
        ("grey", photo[:, :, :1].astype(np.uint8)),
        ("deep", (photo[:, :, :2] * 211).astype(np.uint16)),
        ("half", (photo[:, :, :3] / 17).astype(np.float16)),
        ("float", np.exp(photo[:, :, :3] / 9 - 12).astype(np.float32)),
    ]


@cache
def encoded() -> list[bytes]:
    """A file of every profile, kind and way of coding."""
    actual = []
    for profile in ("raw", "fast", "small", "paper"):
        for _, image in textures():
            errors = (0, 3) if profile in ("fast", "small") and image.dtype.kind == "u" else (0,)
            for max_error in errors:
                for tile in (0, 16):
                    if profile == "paper" and image.dtype.kind == "f":
                        continue
                    options = EncodeOptions(profile, max_error, tile)
                    actual.append(encode(image, options))
    return actual


class Ptm:
    """The decoder of `.ptm`: whole, by windows, level by level, and its head alone."""

    limit = 2 * LIMITS.decoded_bytes

    def __init__(self, folder: Path, outside: Path) -> None:
        self._files = encoded()
        self._exact = [decode(data) for data in self._files]

    def make(self, rng: Random) -> Case:
        """Damaged, and in half of the cases sealed again."""
        which = rng.randrange(len(self._files))
        data = self._files[which]
        changed = damaged(rng, data, rng.choice(self._files), rng.choice(((), (), FIELDS)))
        mended = rng.random() < 0.5
        if mended:
            changed = sealed(changed, data)
        return Case(changed, (which, mended, rng.randrange(4), rng.randrange(1 << 30)))

    def read(self, case: Case) -> str:
        """Decodes; AssertionError if a wrong image came out though checksums were left alone."""
        which, mended, way, chance = case.facts
        if way == 1:
            return self._windows(case.data, chance)
        if way == 2:
            with open_ptm(case.data, limits=LIMITS) as ptm:
                ptm.description()
                for _ in ptm.levels():
                    pass
                ptm.wrong_checksums()
            return "levels"
        image = decode(case.data, limits=LIMITS)
        exact = self._exact[which]
        if image.shape == exact.shape and image.tobytes() == exact.tobytes():
            return "exact"
        # A file that is cut, or of which only the end is damaged, gives a coarser level.
        finest = read_header(case.data).levels[-1]
        if image.shape[:2] != (finest.height, finest.width):
            return "a coarser level"
        assert mended, "a wrong image"
        return "another image"

    def _windows(self, data: bytes, chance: int) -> str:
        with open_ptm(lambda offset, length: data[offset : offset + length], limits=LIMITS) as ptm:
            rng = Random(chance)
            level = rng.randrange(len(ptm.header.levels))
            width, height = ptm.header.levels[level].width, ptm.header.levels[level].height
            x, y = rng.randrange(width), rng.randrange(height)
            w, h = rng.randint(1, width - x), rng.randint(1, height - y)
            assert ptm.window(level, x, y, w, h).shape[:2] == (h, w)
        return "a window"


def sealed(data: bytes, original: bytes) -> bytes:
    """With the checksums of head, tile indices and groups made right, where they can be found."""
    header = read_header(original)
    changed = bytearray(data)
    head = header.description[0]
    if len(changed) < head:
        return data
    for number, level in enumerate(header.levels):
        end = level.end
        if level.tiled:
            end = level.offset + 8 * level.tiles[0] * level.tiles[1]
            at = end
            for entry in range(level.offset, end, 8):
                length = int.from_bytes(changed[entry : entry + 4], "little")
                crc = zlib.crc32(changed[at : at + length])
                changed[entry + 4 : entry + 8] = crc.to_bytes(4, "little")
                at += length
        place = 44 + 20 * number + 16
        crc = zlib.crc32(changed[level.offset : end])
        changed[place : place + 4] = crc.to_bytes(4, "little")
    changed[head - 4 : head] = zlib.crc32(changed[: head - 4]).to_bytes(4, "little")
    return bytes(changed)


class Images:
    """The readers of image files, by name and from memory, and those of a scene's images."""

    limit = 2 * LIMITS.decoded_bytes

    def __init__(self, folder: Path, outside: Path) -> None:
        self._file = folder / "image"
        self._files = images()

    def make(self, rng: Random) -> Case:
        """Damaged; PNG, TIFF and others at the fields that give their sizes, too."""
        kind, data = rng.choice(self._files)
        fields: tuple[tuple[int, int], ...] = ()
        if rng.random() < 0.4:  # where most formats have their sizes
            fields = tuple((at, size) for at in range(min(64, len(data))) for size in (1, 2, 4))
        changed = damaged(rng, data, rng.choice(self._files)[1], fields)
        if kind == "npy" and rng.random() < 0.5:
            changed = _array(rng)
        if kind == "PNG" and rng.random() < 0.7:
            changed = sealed_png(changed)
        return Case(changed, rng.randrange(3))

    def read(self, case: Case) -> str:
        """Loads; texels are all made."""
        if case.facts == 2:
            return self._of_a_scene(case.data)
        source: Any = case.data
        if case.facts:
            self._file.write_bytes(case.data)
            source = self._file
        picture = load_image(source, LIMITS)
        assert picture.array().nbytes <= 2 * LIMITS.decoded_bytes or case.facts
        return f"{picture.texels.dtype}"

    def _of_a_scene(self, data: bytes) -> str:
        from ptmtools.scene.images import ImageStore
        from ptmtools.scene.notes import IngestNotes
        from ptmtools.scene.source import HeldBytes, SourceTexture

        store = ImageStore(IngestNotes(self._file), LIMITS.decoded_bytes)
        texture = SourceTexture(HeldBytes(data), "a/../b.png", "map_Kd", "a.mtl:1")
        decoded = store.add(store.convert(texture))
        store.record(texture, texture.channel)
        assert all("/" not in image.name for image in store.images)
        return "no image" if decoded is None else "in a scene"


def images() -> list[tuple[str, bytes]]:
    """Small images in every format that is read: what Pillow calls it, and a file."""
    from PIL import Image

    from ptmtools.texture import write_image

    noise = np.random.default_rng(3).integers(0, 255, (19, 23, 4), np.uint8)
    actual = []

    def saved(kind: str, mode: str, **settings: Any) -> None:
        stream = io.BytesIO()
        Image.fromarray(noise).convert(mode).save(stream, kind, **settings)
        actual.append((kind, stream.getvalue()))

    for mode in ("RGB", "RGBA", "L", "LA", "P", "1"):
        saved("PNG", mode)
    saved("PNG", "P", transparency=3)
    saved("PNG", "L", icc_profile=b"profile" * 99)
    for settings in ({}, {"progressive": True}, {"subsampling": 0}):
        saved("JPEG", "RGB", **settings)
    saved(
        "JPEG", "L", exif=b"Exif\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0\0\0\0\0"
    )
    for compression in ("raw", "tiff_lzw", "tiff_adobe_deflate", "packbits", "jpeg"):
        saved("TIFF", "RGB", compression=compression)
    saved("TIFF", "1", compression="group4")
    for kind, mode in (("TIFF", "CMYK"), ("TIFF", "LAB"), ("TIFF", "YCbCr"), ("JPEG", "CMYK")):
        saved(kind, mode)
    for kind in ("BMP", "GIF", "TGA", "PCX", "PPM"):
        saved(kind, "RGB")
    saved("BMP", "P")
    saved("GIF", "RGB", save_all=True, append_images=[Image.new("RGB", (23, 19))])
    saved("TGA", "RGBA", compression="tga_rle")
    for settings in (
        {"lossless": True},
        {"quality": 80},
        {"quality": 80, "exif": b"Exif\0\0II*\0"},
    ):
        saved("WEBP", "RGBA", **settings)
    actual.append(("PPM", b"P3 3 2 255\n" + b"1 22 255 " * 6))
    actual.append(("PPM", b"P3 3 2 65535\n" + b"1 22222 65535 " * 6))
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        for name, image in textures():
            for suffix in (".npy", ".tif", ".exr", ".png", ".hdr"):
                path = Path(folder) / f"{name}{suffix}"
                try:
                    write_image(path, image)
                except Exception:  # what the format does not hold
                    continue
                actual.append((suffix[1:].upper().replace("NPY", "npy"), path.read_bytes()))
    height, width = noise.shape[:2]
    mantissas = noise.tobytes()
    actual.append(("HDR", f"#?RADIANCE\n\n-Y {height} +X {width}\n".encode() + mantissas))
    return actual


def sealed_png(data: bytes) -> bytes:
    """With the checksums of its chunks made right."""
    changed = bytearray(data)
    at = 8
    while at + 12 <= len(changed):
        length = int.from_bytes(changed[at : at + 4], "big")
        if at + 12 + length > len(changed):
            break
        crc = zlib.crc32(changed[at + 4 : at + 8 + length])
        changed[at + 8 + length : at + 12 + length] = crc.to_bytes(4, "big")
        at += 12 + length
    return bytes(changed)


def _array(rng: Random) -> bytes:
    """An .npy of nonsensical head."""
    sides = [rng.choice((*NUMBERS, -1, -5)) for _ in range(rng.randrange(5))]
    shape = rng.choice((str(tuple(sides)), "(" * 5000, "-" * 9000 + "1", f"(0x{'f' * 8000},)"))
    descr = rng.choice(("'<f4'", "'|u1'", "'>u2'", "'|O'", "'|V0'", "'<U9'", "[('a','<f4')]", "5"))
    text = f"{{'descr': {descr}, 'fortran_order': {rng.choice((True, False))}, 'shape': {shape}}}\n"
    version = rng.choice((1, 2, 3, 9))
    length = rng.choice((len(text), *NUMBERS))
    size = 2 if version == 1 else 4
    head = (
        b"\x93NUMPY" + bytes([version, 0]) + (length & (1 << 8 * size) - 1).to_bytes(size, "little")
    )
    return head + text.encode() + struct.pack("<16f", *range(16))
