"""Images whose pixels are converted: the model is built, and a warning names each conversion."""

from __future__ import annotations

import io
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ptmtools.errors import InputError
from ptmtools.scene import IngestOptions, Scene, ingest
from ptmtools.scene.images import is_plain
from ptmtools.scene.notes import warnings
from ptmtools.texture.images import load_image, png_bytes
from ptmtools.texture.samples import round_to_eight_bits
from tests.scene.conftest import noise, png

Textured = Callable[..., Path]
INKS = np.array([[[0, 0, 0, 0], [255, 0, 0, 0]], [[0, 100, 200, 50], [0, 0, 0, 255]]], np.uint8)
#: L*a*b* of the red of sRGB, 8 bits.
REDDISH = (136, 208, 195)
PURE = np.array([[[0, 0, 0, 0], [255, 0, 0, 0], [0, 0, 0, 255]]], np.uint8)
DEEP = np.array([[[0, 128, 129], [65535, 65406, 65407]]], np.uint16)


def saved(image: Image.Image, kind: str, **options: object) -> bytes:
    stream = io.BytesIO()
    image.save(stream, kind, **options)
    return stream.getvalue()


def profile() -> bytes:
    """An ICC profile (ICC.1:2001-04, 6.5.7, lut8Type) of four inks, of which the first is red."""
    inks = np.ndindex(2, 2, 2, 2)
    colours = [REDDISH if ink == (1, 0, 0, 0) else (255 * (not ink[3]), 128, 128) for ink in inks]
    unity = struct.pack(">9i", *(65536 * (n % 4 == 0) for n in range(9)))
    ramp = bytes(range(256))
    lut = b"mft1" + bytes(4) + bytes([4, 3, 2, 0]) + unity
    lut += 4 * ramp + bytes(np.array(colours, np.uint8)) + 3 * ramp
    text = b"desc" + bytes(4) + struct.pack(">I", 2) + b"x\0" + bytes(78)
    white = struct.pack(">3i", 63190, 65536, 54061)
    parts = {b"desc": text, b"wtpt": b"XYZ " + bytes(4) + white, b"A2B0": lut}
    tags, listed, end = b"", struct.pack(">I", len(parts)), 128 + 4 + 12 * len(parts)
    for name, data in parts.items():
        listed += name + struct.pack(">II", end + len(tags), len(data))
        tags += data + bytes(-len(data) % 4)
    head = struct.pack(">I4xI4s4s4s", end + len(tags), 0x02400000, b"prtr", b"CMYK", b"Lab ")
    head = (head.ljust(36, b"\0") + b"acsp").ljust(68, b"\0") + white
    return head.ljust(128, b"\0") + listed + tags


def mixed(inks: np.ndarray) -> np.ndarray:
    """Colours of inks as browsers mix them without a profile."""
    light = 1 - inks.astype(float) / 255
    return 255 * light[..., :3] * light[..., 3:]


def animated() -> bytes:
    first, second = (Image.fromarray(noise(seed)) for seed in (1, 2))
    return saved(first, "webp", save_all=True, append_images=[second], lossless=True)


TIFF = saved(Image.fromarray(INKS, "CMYK"), "tiff")
COARSE = ("profile.tif", "lab.tif")
#: Name of the file → its bytes, the texels expected, and what the warning says.
CONVERTED = {
    "inks.tif": (TIFF, mixed(INKS), "has the colour model CMYK, converted to 8-bit RGB"),
    "profile.tif": (
        saved(Image.fromarray(PURE, "CMYK"), "tiff", icc_profile=profile()),
        [[[255, 255, 255], [255, 0, 0], [0, 0, 0]]],
        "has the colour model CMYK, converted to 8-bit RGB by its colour profile",
    ),
    "damaged.tif": (
        saved(Image.fromarray(INKS, "CMYK"), "tiff", icc_profile=b"no profile"),
        mixed(INKS),
        "has the colour model CMYK, converted to 8-bit RGB",
    ),
    "lab.tif": (
        saved(Image.merge("LAB", [Image.new("L", (2, 2), n) for n in (136, 208, 195)]), "tiff"),
        [[[255, 0, 0]]],
        "has the colour model LAB, converted to 8-bit RGB",
    ),
    "deep.png": (
        png_bytes(DEEP),
        [[[0, 0, 1], [255, 254, 255]]],
        "has uint16 samples, converted to 8 bits",
    ),
    "float.tif": (
        saved(Image.fromarray(np.array([[-1, 0, 0.5, 1, 9, np.nan]], np.float32)), "tiff"),
        [[[0], [0], [128], [255], [255], [0]]],
        "has float32 samples, converted to 8 bits",
    ),
    "third.ppm": (b"P6 1 1 3\n\0\1\2", [[[0, 85, 170]]], "scaled to 8 bits"),
    "frames.webp": (animated(), noise(1), "of which the first is used"),
}


def texels(scene: Scene) -> np.ndarray:
    return load_image(scene.images[0].load()).array()


@pytest.mark.parametrize("name", CONVERTED)
def test_an_image_that_must_be_converted_is_and_the_warning_says_how(
    textured: Textured, name: str
) -> None:
    data, expected, text = CONVERTED[name]
    scene = ingest(textured(f"Kd 1 0 0\nmap_Kd {name}", {name: data}))
    # L*a*b* of 8 bits is coarse.
    assert np.abs(texels(scene) - np.asarray(expected, float)).max() <= (
        11 if name in COARSE else 1
    )
    (warning,) = [line for line in warnings(scene.notes) if "N126" in line]
    assert warning.startswith(f"room.mtl:3: map_Kd {name}: ")
    assert warning.endswith(f"{text} [PTM-N126]")
    assert scene.images[0].files == ()
    assert not is_plain(data, name, 1 << 30)


def test_of_every_value_of_16_bits_the_nearest_of_8() -> None:
    values = np.arange(65536, dtype=np.uint16)
    assert np.array_equal(round_to_eight_bits(values), np.rint(values * (255 / 65535)))


def test_alpha_of_16_bits_remains(textured: Textured) -> None:
    deep = np.array([[[0, 0, 65535, 65535], [0, 0, 65535, 300]]], np.uint16)
    scene = ingest(textured("map_Kd w.png", {"w.png": png_bytes(deep)}))
    assert texels(scene)[0, :, 3].tolist() == [255, 1]
    assert scene.materials[0].transparent


def test_heights_keep_their_16_bits(textured: Textured) -> None:
    """A slope that 8 bits would flatten."""
    slope = np.tile(32 * np.arange(64, dtype=np.uint16), (64, 1))
    scene = ingest(textured("map_Bump -bm 100 h.png", {"h.png": png_bytes(slope[..., None])}))
    assert len(np.unique(texels(scene)[1:-1, 1:-1, 0])) == 1
    assert texels(scene)[3, 3, 0] < 120
    assert "PTM-N126" not in {note.code for note in scene.notes}


def test_a_jpeg_of_12_bits_is_none_of_the_images_that_are_read(textured: Textured) -> None:
    data = bytearray(saved(Image.fromarray(noise(1)), "jpeg"))
    data[data.index(b"\xff\xc0") + 4] = 12
    scene = ingest(textured("map_Kd w.jpg", {"w.jpg": bytes(data)}))
    (note,) = [note for note in scene.notes if note.code == "PTM-N206"]
    assert "12-bit" in note.message
    assert "damaged" not in note.message


def test_strict_names_all_at_once(textured: Textured) -> None:
    """One warning for each image, however many materials use it."""
    cut = png(noise(3))[:-8]
    files = {"a.tif": TIFF, "b.png": png_bytes(DEEP), "c.png": cut}
    mtl = "map_Kd a.tif\nnewmtl b\nmap_Kd b.png\nnewmtl c\nmap_Kd c.png\nnewmtl d\nmap_Kd a.tif"
    faces = "".join(f"usemtl {name}\nf {row}\n" for name, row in FACES.items())
    path = textured(mtl, files, faces)
    scene = ingest(path)
    lines = [line.split(": ")[1] for line in warnings(scene.notes)]
    assert [line for line in lines if "map_Kd" in line] == [
        "map_Kd c.png",
        "map_Kd a.tif",
        "map_Kd b.png",
    ]
    assert [material.image for material in scene.materials] == [0, 1, -1, 0]
    with pytest.raises(InputError) as caught:
        ingest(path, IngestOptions(strict=True))
    assert all(name in str(caught.value) for name in files)


FACES = {"wall": "1/1 2/2 3/3", "b": "1/1 3/3 4/4", "c": "1/1 2/2 4/4", "d": "2/2 3/3 4/4"}
