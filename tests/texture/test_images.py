"""Image files are read exactly or refused, and written whole or not at all."""

from __future__ import annotations

import io
import os
import struct
import threading
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from ptmtools.errors import InputError, OutputError
from ptmtools.texture import (
    decode,
    encode,
    load_image,
    read_image,
    read_ptm,
    write_image,
)
from tests.texture.files import chunk, png, saved

RNG = np.random.default_rng(11)
GREY = RNG.integers(0, 256, (9, 7), dtype=np.uint8)
RGB = RNG.integers(0, 256, (9, 7, 3), dtype=np.uint8)
RGBA = RNG.integers(0, 256, (9, 7, 4), dtype=np.uint8)


@pytest.mark.parametrize("kind", ["PNG", "TIFF", "TGA", "BMP", "PPM", "PCX"])
def test_lossless_formats_are_exact(kind: str) -> None:
    np.testing.assert_array_equal(read_image(saved(Image.fromarray(RGB), kind)), RGB)
    np.testing.assert_array_equal(read_image(saved(Image.fromarray(GREY), kind)), GREY[:, :, None])


@pytest.mark.parametrize("kind", ["PNG", "TIFF", "TGA", "WEBP"])
def test_alpha_is_exact(kind: str) -> None:
    options = {"lossless": True, "exact": True} if kind == "WEBP" else {}
    np.testing.assert_array_equal(read_image(saved(Image.fromarray(RGBA), kind, **options)), RGBA)


def test_grey_and_alpha() -> None:
    both = RGBA[:, :, :2]
    np.testing.assert_array_equal(read_image(saved(Image.fromarray(both))), both)


def test_one_bit_images_become_black_and_white() -> None:
    bits = RNG.integers(0, 2, (9, 7)).astype(np.bool_)
    actual = read_image(saved(Image.fromarray(bits)))
    np.testing.assert_array_equal(actual[:, :, 0], np.where(bits, 255, 0))


def test_palettes() -> None:
    index = RNG.integers(0, 5, (9, 7)).astype(np.uint8)
    colours = RNG.integers(0, 256, (5, 3), dtype=np.uint8)
    image = Image.fromarray(index, "P")
    image.putpalette(colours.tobytes())
    np.testing.assert_array_equal(read_image(saved(image)), colours[index])
    np.testing.assert_array_equal(read_image(saved(image, "GIF")), colours[index])

    alpha = np.array([0, 9, 255, 128, 77], np.uint8)
    actual = read_image(saved(image, transparency=alpha.tobytes()))
    np.testing.assert_array_equal(actual, np.dstack([colours[index], alpha[index]]))
    actual = read_image(saved(image, transparency=3))
    np.testing.assert_array_equal(actual, np.dstack([colours[index], np.where(index == 3, 0, 255)]))


def test_colour_keys() -> None:
    data = saved(Image.fromarray(RGB), transparency=tuple(RGB[2, 3].tolist()))
    alpha = np.where((RGB[2, 3] == RGB).all(axis=2), 0, 255)
    np.testing.assert_array_equal(read_image(data), np.dstack([RGB, alpha]))
    data = saved(Image.fromarray(GREY), transparency=int(GREY[4, 4]))
    alpha = np.where(GREY[4, 4] == GREY, 0, 255)
    np.testing.assert_array_equal(read_image(data), np.dstack([GREY, alpha]))


def test_what_is_converted_strip_by_strip() -> None:
    """Images of more than a strip: Pillow must not lose palette or key on the way."""
    index = RNG.integers(0, 256, (700, 600), dtype=np.uint8)
    image = Image.fromarray(index, "P")
    image.putpalette(RNG.integers(0, 256, 768, dtype=np.uint8).tobytes())
    for given in ({}, {"transparency": bytes(range(256))}, {"transparency": 77}):
        data = saved(image, **given)
        mode = "RGBA" if given else "RGB"
        wanted = np.asarray(Image.open(io.BytesIO(data)).convert(mode))
        np.testing.assert_array_equal(read_image(data), wanted)
        np.testing.assert_array_equal(load_image(data).texels[431:440], wanted[431:440])
    actual = read_image(saved(Image.fromarray(index), transparency=5))
    np.testing.assert_array_equal(actual[:, :, 1], np.where(index == 5, 0, 255))
    bits = index > 99
    np.testing.assert_array_equal(read_image(saved(Image.fromarray(bits)))[:, :, 0], bits * 255)


@pytest.mark.parametrize("depth", [1, 2, 4])
def test_colour_keys_of_shallow_greys(depth: int) -> None:
    """Pillow widens the texels but not the key."""
    top = (1 << depth) - 1
    values = [0, top, top, 0, 0, 0, top, 0][: 8 // depth]
    packed = sum(value << (8 - depth * (i + 1)) for i, value in enumerate(values))
    data = png(len(values), [bytes([packed])], depth, 0, chunk(b"tRNS", struct.pack(">H", top)))
    expected = [[255 * (v == top), 0 if v == top else 255] for v in values]
    assert read_image(data)[0].tolist() == expected


def test_jpeg_is_taken_as_it_decodes() -> None:
    data = saved(Image.fromarray(RGB), "JPEG", quality=90)
    np.testing.assert_array_equal(
        read_image(data), np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))
    )


def test_orientation_is_not_applied() -> None:
    exif = Image.Exif()
    exif[274] = 6
    data = saved(Image.fromarray(RGB), exif=exif)
    np.testing.assert_array_equal(read_image(data), RGB)


@pytest.mark.parametrize(("kind", "block"), [("PNG", b"garbage"), ("WEBP", b"Exif\0\0garbage!")])
def test_a_malformed_exif_block_says_nothing(kind: str, block: bytes) -> None:
    picture = load_image(saved(Image.fromarray(RGB), kind, exif=block, lossless=True))
    assert picture.description.orientation == 1
    np.testing.assert_array_equal(picture.array(), RGB)


@pytest.mark.parametrize("cut", range(1, 25))
def test_a_png_without_its_end_is_cut(cut: int) -> None:
    with pytest.raises(InputError, match="PTM-I125"):
        read_image(saved(Image.fromarray(RGB))[:-cut])


def test_checksums_of_a_png() -> None:
    """Those that texels depend on: Pillow does not look at that of the data."""
    data = saved(Image.fromarray(RGB), dpi=(72, 72))
    at = data.index(b"IEND") - 5  # the last byte of the checksum of the data
    with pytest.raises(InputError, match="PTM-I125"):
        read_image(data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :])
    np.testing.assert_array_equal(read_image(data + b"whatever follows"), RGB)
    end = data.index(b"IEND") - 4
    text = struct.pack(">I", 3) + b"tEXta\0b" + b"none"  # of no consequence
    np.testing.assert_array_equal(read_image(data[:end] + text + data[end:]), RGB)


def bmp_of_16_bits(*masks: int) -> bytes:
    texels = np.arange(32, dtype="<u2").tobytes()
    head = struct.pack("<IiiHHIIiiII", 40, 8, 4, 1, 16, 3 if masks else 0, len(texels), 0, 0, 0, 0)
    head += struct.pack(f"<{len(masks)}I", *masks)
    return b"BM" + struct.pack("<IHHI", 78, 0, 0, 14 + len(head)) + head + texels


TGA_16 = bytes([0, 0, 2, *bytes(9)]) + struct.pack("<HHBB", 4, 2, 16, 0x20) + bytes(16)
#: Eight texels, four colours of 16 bits.
TGA_PALETTE_16 = bytes([0, 1, 1]) + struct.pack("<HHB", 0, 4, 16) + bytes(4)
TGA_PALETTE_16 += struct.pack("<HHBB", 4, 2, 8, 0x20) + bytes(range(8)) + bytes(8)

DEEP = RNG.integers(0, 65536, (9, 7), dtype=np.uint16)
REFUSED = {
    "16-bit grey PNG": (saved(Image.fromarray(DEEP)), "PTM-I126"),
    "16-bit RGB PNG": (png(2, [bytes(range(12))] * 3, 16, 2), "PTM-I126"),
    "16-bit RGBA PNG": (png(2, [bytes(range(16))] * 3, 16, 6), "PTM-I126"),
    "16-bit grey and alpha PNG": (png(2, [bytes(range(8))] * 3, 16, 4), "PTM-I126"),
    "16-bit TIFF": (saved(Image.fromarray(DEEP), "TIFF"), "PTM-I126"),
    "float TIFF": (saved(Image.fromarray(DEEP.astype(np.float32)), "TIFF"), "PTM-I126"),
    "CMYK JPEG": (saved(Image.fromarray(RGBA, "CMYK"), "JPEG"), "PTM-I126"),
    "CMYK TIFF": (saved(Image.fromarray(RGBA, "CMYK"), "TIFF"), "PTM-I126"),
    "YCbCr TIFF": (saved(Image.fromarray(RGB, "YCbCr"), "TIFF"), "PTM-I126"),
    "Lab TIFF": (saved(Image.fromarray(RGB, "LAB"), "TIFF"), "PTM-I126"),
    "16-bit PPM": (b"P6 1 1 65535\n" + bytes(6), "PTM-I126"),
    "TIFF of odd bits": (
        saved(Image.fromarray(GREY), "TIFF").replace(
            struct.pack("<HHII", 258, 3, 1, 8), struct.pack("<HHII", 258, 3, 1, 7)
        ),
        "PTM-I126",
    ),
    "BMP of 5 and 6 bits": (bmp_of_16_bits(0xF800, 0x7E0, 0x1F), "PTM-I126"),
    "BMP of 5 bits": (bmp_of_16_bits(0x7C00, 0x3E0, 0x1F), "PTM-I126"),
    "BMP of 16 bits a texel": (bmp_of_16_bits(), "PTM-I126"),
    "TGA of 16 bits a texel": (TGA_16, "PTM-I126"),
    "TGA with a palette of 5 bits": (TGA_PALETTE_16, "PTM-I126"),
    "PPM of 4 bits": (b"P5 2 1 15\n\1\2", "PTM-I126"),
    "animated GIF": (
        saved(
            Image.fromarray(GREY), "GIF", save_all=True, append_images=[Image.fromarray(255 - GREY)]
        ),
        "PTM-I126",
    ),
    "animated PNG": (
        saved(Image.fromarray(RGB), save_all=True, append_images=[Image.fromarray(255 - RGB)]),
        "PTM-I126",
    ),
    "TIFF of two pages": (
        saved(
            Image.fromarray(RGB), "TIFF", save_all=True, append_images=[Image.fromarray(255 - RGB)]
        ),
        "PTM-I126",
    ),
    "empty": (b"", "PTM-I125"),
    "text": (b"o model\nv 0 0 0\n", "PTM-I125"),
    "a format not read": (saved(Image.fromarray(RGB), "ICO"), "PTM-I125"),
    "a .ptm": (encode(RGB), "PTM-I125"),
    "HP's .ptm": (b"PTM_1.2\nPTM_FORMAT_RGB\n", "PTM-I101"),
    "truncated PNG": (saved(Image.fromarray(RGB))[:-60], "PTM-I125"),
    "truncated JPEG": (saved(Image.fromarray(RGB).resize((99, 99)), "JPEG")[:-400], "PTM-I125"),
    "truncated BMP": (saved(Image.fromarray(RGB), "BMP")[:-60], "PTM-I125"),
    "damaged PNG": (
        saved(Image.fromarray(RGB)).replace(b"IDAT", b"IDAT\0\0\0", 1),
        "PTM-I125",
    ),
    "too wide": (png(65537, [bytes(65537)], 8, 0), "PTM-L104"),
}


@pytest.mark.parametrize("case", sorted(REFUSED))
def test_refused(case: str, tmp_path: Path) -> None:
    data, code = REFUSED[case]
    file = tmp_path / "wåll paper.img"
    file.write_bytes(data)
    with pytest.raises(InputError, match=code) as caught:
        read_image(file)
    error = caught.value
    assert error.file == str(file)
    assert error.remedy
    assert "\n" not in str(error)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes that have a name")
@pytest.mark.parametrize("kind", ["png", "npy", "ppm", "exr"])
def test_pipes(kind: str, tmp_path: Path) -> None:
    """They cannot seek, nor be mapped, nor be opened twice."""
    if kind == "exr":
        pytest.importorskip("OpenEXR", reason="pip install 'ptmtools[exr]'")
    texels = RGB.astype({"npy": np.uint16, "ppm": np.uint16, "exr": np.float32}.get(kind, np.uint8))
    plain = tmp_path / f"plain.{kind}"
    if kind == "ppm":
        plain.write_bytes(b"P6 7 9 65535\n" + texels.astype(">u2").tobytes())
    else:
        write_image(plain, texels)
    os.mkfifo(tmp_path / "pipe")
    writer = threading.Thread(
        target=(tmp_path / "pipe").write_bytes, args=[plain.read_bytes()], daemon=True
    )
    writer.start()
    actual = load_image(tmp_path / "pipe").array()
    writer.join()
    np.testing.assert_array_equal(actual, texels)


def test_paths_that_lead_nowhere(tmp_path: Path) -> None:
    for read in (read_image, read_ptm):
        with pytest.raises(InputError, match="PTM-I120"):
            read(tmp_path / "absent.png")
        with pytest.raises(InputError, match="PTM-I122"):
            read(tmp_path)
        with pytest.raises(InputError, match="PTM-I122"):
            read(f"{tmp_path}/\0")


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="needs permissions that bind")
def test_a_file_that_may_not_be_read(tmp_path: Path) -> None:
    file = tmp_path / "a.png"
    file.touch(0o000)
    with pytest.raises(InputError, match="PTM-I122"):
        read_image(file)


def test_read_ptm_names_the_file(tmp_path: Path) -> None:
    file = tmp_path / "a.ptm"
    file.write_bytes(encode(RGB))
    np.testing.assert_array_equal(decode(read_ptm(file)), RGB)
    for data, code in (
        (b"", "PTM-I101"),
        (b"PTM_1.1\n", "PTM-I101"),
        (encode(RGB)[:50], "PTM-I103"),
    ):
        file.write_bytes(data)
        with pytest.raises(InputError, match=code) as caught:
            read_ptm(file)
        assert caught.value.file == str(file)


@pytest.mark.parametrize("image", [GREY[:, :, None], RGBA[:, :, :2], RGB, RGBA])
def test_written_png_holds_the_texels(image: NDArray[np.uint8], tmp_path: Path) -> None:
    write_image(tmp_path / "out.png", image)
    np.testing.assert_array_equal(read_image(tmp_path / "out.png"), image)


def test_an_image_that_cannot_be_written_leaves_nothing(tmp_path: Path) -> None:
    out, folder = tmp_path / "out.png", tmp_path / "folder.png"
    folder.mkdir()
    write_image(out, RGB)
    with pytest.raises(OutputError, match="PTM-O001"):
        write_image(out, 255 - RGB)
    np.testing.assert_array_equal(read_image(out), RGB)
    write_image(out, 255 - RGB, force=True)
    np.testing.assert_array_equal(read_image(out), 255 - RGB)
    for target in (folder, tmp_path / "absent" / "out.png"):
        with pytest.raises(OutputError, match="PTM-O002"):
            write_image(target, RGB, force=True)
    assert sorted(tmp_path.iterdir()) == [folder, out]


def test_importing_the_package_loads_nothing_heavy() -> None:
    import subprocess
    import sys

    script = (
        "import sys, ptmtools.texture; print(sorted({'numpy', 'numba', 'PIL'} & set(sys.modules)))"
    )
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, check=True, text=True)
    assert run.stdout.strip() == "[]"
