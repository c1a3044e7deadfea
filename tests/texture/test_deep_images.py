"""Images of more than 8 bits a sample are read exactly, and written exactly or not at all."""

from __future__ import annotations

import io
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image, ImageOps

from ptmtools.errors import InputError, LimitError, OutputError, PtmError
from ptmtools.texture import (
    Description,
    EncodeOptions,
    Limits,
    decode,
    encode,
    load_image,
    write_image,
)
from ptmtools.texture.images.floats import floats, save_radiance
from ptmtools.texture.images.picture import orient
from ptmtools.texture.images.png import png_bytes
from tests.texture.coding import same
from tests.texture.files import chunk, png, saved

RNG = np.random.default_rng(5)
COUNTS = (1, 2, 3, 4)
RAW = EncodeOptions("raw")


def random(kind: str, components: int, shape: tuple[int, int] = (9, 7)) -> NDArray[Any]:
    """Any bit pattern."""
    size = np.dtype(kind).itemsize
    return np.frombuffer(RNG.bytes(shape[0] * shape[1] * components * size), kind).reshape(
        *shape, components
    )


@pytest.mark.parametrize("components", COUNTS)
@pytest.mark.parametrize("smooth", [False, True])
def test_16_bit_png(components: int, smooth: bool) -> None:
    """Smooth ones use other filters; rows by hand use none."""
    texels = random("u2", components, (40, 33))
    if smooth:
        texels = np.cumsum(np.cumsum(texels % 9, 0), 1).astype(np.uint16)
    data = png_bytes(texels)
    same(load_image(data).array(), texels)
    colour = {1: 0, 2: 4, 3: 2, 4: 6}[components]
    same(
        load_image(png(33, [r.astype(">u2").tobytes() for r in texels], 16, colour)).array(), texels
    )
    same(load_image(data).texels[11:30], texels[11:30])
    assert len(data) < texels.nbytes or not smooth


def test_16_bit_png_by_another_writer(require: Callable[[str, str], None]) -> None:
    codecs = pytest.importorskip("imagecodecs", reason="pip install 'ptmtools[codecs]'")
    for components in COUNTS:
        texels = random("u2", components)
        same(load_image(codecs.png_encode(texels)).array(), texels)
        same(codecs.png_decode(png_bytes(texels)).reshape(texels.shape), texels)


@pytest.mark.parametrize(("colour", "components"), [(0, 1), (4, 2), (2, 3), (6, 4)])
def test_interlaced_16_bit_png(colour: int, components: int) -> None:
    """The seven passes of Adam7, by hand."""
    texels = random("u2", components, (13, 11))
    passes = [(0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4)]
    passes += [(0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2)]
    rows = [
        row.astype(">u2").tobytes()
        for x, y, across, down in passes
        for row in texels[y::down, x::across]
    ]
    data = png(11, rows, 16, colour, height=13, interlaced=1)
    same(load_image(data).array(), texels)


def test_colour_key_of_16_bits() -> None:
    texels = random("u2", 3)
    key = texels[2, 3]
    near = texels.copy()
    near[0, 0] = key ^ 1  # differs in low bytes only
    rows = [r.astype(">u2").tobytes() for r in near]
    actual = load_image(png(7, rows, 16, 2, chunk(b"tRNS", key.astype(">u2").tobytes()))).array()
    np.testing.assert_array_equal(actual[:, :, :3], near)
    assert np.argwhere(actual[:, :, 3] == 0).tolist() == [[2, 3]]
    assert actual[0, 0, 3] == 0xFFFF


@pytest.mark.parametrize("order", ["<", ">"])
def test_grey_tiff_needs_nothing_else(order: str) -> None:
    deep = random("u2", 1)
    same(load_image(saved(Image.fromarray(deep[:, :, 0]), "TIFF")).array(), deep)
    real = random("f4", 1)
    same(load_image(saved(Image.fromarray(real[:, :, 0]), "TIFF")).array(), real)


@pytest.mark.parametrize("kind", ["u1", "u2", "f2", "f4"])
@pytest.mark.parametrize("components", COUNTS)
def test_tiff_and_npy_hold_everything(kind: str, components: int, tmp_path: Path) -> None:
    pytest.importorskip("imagecodecs", reason="pip install 'ptmtools[codecs]'")
    texels = random(kind, components)
    for suffix in (".npy", ".TIF", ".tiff"):
        write_image(tmp_path / f"a{suffix}", texels)
        same(load_image(tmp_path / f"a{suffix}").array(), texels)
        same(load_image((tmp_path / f"a{suffix}").read_bytes()).array(), texels)


def test_a_large_tiff_has_several_strips(tmp_path: Path) -> None:
    pytest.importorskip("imagecodecs", reason="pip install 'ptmtools[codecs]'")
    texels = random("u2", 3, (700, 500))
    write_image(tmp_path / "a.tif", texels, Description(icc=b"profile", orientation=6))
    picture = load_image(tmp_path / "a.tif")
    same(picture.array(), np.ascontiguousarray(orient(texels, 6)))
    assert picture.description == Description(icc=b"profile")


@pytest.mark.parametrize("components", [1, 3])
def test_16_bit_ppm(components: int, tmp_path: Path) -> None:
    texels = random("u2", components)
    head = b"P%d # made by hand\n7\t9\n# the largest\n65535\n" % (5 if components == 1 else 6)
    data = head + texels.astype(">u2").tobytes()
    (tmp_path / "a.ppm").write_bytes(data)
    for source in (data, tmp_path / "a.ppm"):
        picture = load_image(source)
        np.testing.assert_array_equal(picture.array(), texels)
        np.testing.assert_array_equal(decode(encode(picture.texels, RAW)), texels)
    (tmp_path / "a.ppm").write_bytes(data[:-1])
    for cut in (data[:-1], tmp_path / "a.ppm"):
        with pytest.raises(InputError, match="PTM-I125"):
            load_image(cut)


@pytest.mark.parametrize("components", [1, 3])
def test_plain_16_bit_ppm(components: int, monkeypatch: pytest.MonkeyPatch) -> None:
    texels = random("u2", components)
    head = b"P%d # made by hand\n7\t9\n65535\n" % (2 if components == 1 else 3)
    body = b"\n".join(b"  ".join(b"%d" % v for v in row.ravel()) for row in texels)
    for block in (1, 7, 1 << 20):
        monkeypatch.setattr("ptmtools.texture.images.deep._BLOCK", block)
        same(load_image(head + body).array(), texels)
        same(load_image(head + body + b"\n").array(), texels)
    last = body.rindex(b" ")
    for bad in (
        body[:last],
        body[:last] + b" 65536",
        body[:last] + b" -1",
        body[:last] + b" x",
        body[:last] + b" " + b"0" * 11,
        b"",
    ):
        with pytest.raises(InputError, match="PTM-I125"):
            load_image(head + bad)
    with pytest.raises(LimitError, match="PTM-L104"):
        load_image(b"P2 60000 60000 65535 1")


@pytest.mark.parametrize("shape", [(9, 7), (9, 7, 1), (9, 7, 4)])
@pytest.mark.parametrize("kind", ["u1", "<u2", ">u2", "<f2", ">f4"])
def test_npy_is_mapped(kind: str, shape: tuple[int, ...], tmp_path: Path) -> None:
    texels = RNG.integers(0, 99, shape).astype(kind)
    np.save(tmp_path / "a.npy", texels)
    picture = load_image(tmp_path / "a.npy")
    assert isinstance(picture.texels, np.memmap)
    np.testing.assert_array_equal(
        decode(encode(picture.texels, RAW)), texels.reshape(9, 7, -1), strict=False
    )
    np.save(tmp_path / "b.npy", np.asfortranarray(texels))
    np.testing.assert_array_equal(load_image(tmp_path / "b.npy").array(), picture.array())


def npy(texels: object) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, texels, allow_pickle=True)  # type: ignore[arg-type]
    return buffer.getvalue()


#: Of no image, and what is said of them.
SHAPES = ((), (9,), (9, 7, 0), (9, 7, 5), (4, 4, 5), (1, 9, 7, 3))
NO_IMAGE = r"\(height, width, 1 to 4 components\).*PTM-I126"
WHOLE = npy(np.zeros((9, 7, 3), np.uint16))
VAST = npy(np.zeros((3, 4, 4), np.float32)).replace(
    b"(3, 4, 4), }" + 8 * b" ", b"(60000, 60000, 4), }"
)


@pytest.mark.parametrize(
    ("data", "code"),
    [
        (npy(np.array([{}], object)), "PTM-I12[56]"),
        (npy(np.zeros((4, 4))), "PTM-I126"),
        *((npy(np.zeros(shape, np.uint8)), NO_IMAGE) for shape in SHAPES),
        (npy(np.zeros((4, 4), np.int16)), "PTM-I126"),
        (npy(np.zeros((0, 4), np.uint8)), "PTM-I125"),
        (npy(np.zeros((1, 65537), np.uint8)), "PTM-L104"),
        (WHOLE[:-1], "PTM-I125"),
        (WHOLE[:20], "PTM-I125"),
        (WHOLE.replace(b"(9, 7, 3)", b"(9e99, 7)"), "PTM-I125"),
    ],
)
def test_npy_that_is_no_image(data: bytes, code: str, tmp_path: Path) -> None:
    (tmp_path / "a.npy").write_bytes(data)
    for source in (data, tmp_path / "a.npy"):
        with pytest.raises(InputError, match=code):
            load_image(source)


def test_npy_that_is_too_large(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Refused by its head: no memory is taken for it."""
    assert b"60000" in VAST
    monkeypatch.setattr(np, "ndarray", None)
    with pytest.raises(LimitError, match="PTM-L104"):
        load_image(VAST)
    monkeypatch.setattr(np, "memmap", None)
    (tmp_path / "a.npy").write_bytes(VAST)
    with pytest.raises(InputError, match="PTM-I125"):  # what is mapped takes none
        load_image(tmp_path / "a.npy")


def hdr(body: bytes, size: str = "-Y 2 +X 9", kind: str = "32-bit_rle_rgbe") -> bytes:
    return f"#?RADIANCE\n# by hand\nFORMAT={kind}\nEXPOSURE=2\n\n{size}\n".encode() + body


def test_radiance_by_hand() -> None:
    """Two coded scanlines: runs, and bytes as they are; then the same plain."""
    row = [bytes([200, 100, 50, 129 + i]) for i in range(8)] + [bytes([1, 2, 3, 0])]
    plain = b"".join(row)
    coded = bytes([2, 2, 0, 9])
    for i, value in enumerate((200, 100, 50)):
        coded += bytes([128 + 8, value, 1, i + 1])
    coded += bytes([9]) + bytes(texel[3] for texel in row)
    actual = load_image(hdr(coded + coded)).array()
    same(actual, load_image(hdr(plain + plain)).array())
    assert actual[1, 0].tolist() == [200 / 128, 100 / 128, 50 / 128]
    assert actual[1, 1].tolist() == [200 / 64, 100 / 64, 50 / 64]
    assert actual[0, 8].tolist() == [0, 0, 0]
    for end in range(1, len(coded) + 1):
        with pytest.raises(InputError, match="PTM-I125"):
            load_image(hdr(coded + coded[:-end]))


def test_radiance_agrees_with_another_reader() -> None:
    codecs = pytest.importorskip("imagecodecs", reason="pip install 'ptmtools[codecs]'")
    texels = RNG.normal(0, 9, (20, 30, 3)).astype(np.float32) ** 2
    data = codecs.rgbe_encode(texels, header=True)
    same(load_image(data).array(), codecs.rgbe_decode(data, header=True))


def test_radiance_holds_what_it_holds(tmp_path: Path) -> None:
    mantissa = RNG.integers(0, 256, (9, 7, 4), dtype=np.uint8)
    mantissa[0, :, 3] = 0
    mantissa[1, :, 3] = 255
    mantissa[2, :, 3] = 1  # denormal as float32
    texels = floats(mantissa)
    write_image(tmp_path / "a.hdr", texels)
    same(load_image(tmp_path / "a.hdr").array(), texels)
    for other in (
        texels + np.float32(1e-3),
        -texels,
        np.full((2, 2, 3), np.nan, np.float32),
        np.full((2, 2, 3), np.inf, np.float32),
        texels[:, :, :2],
        np.full((2, 2, 3), 3e38, np.float32),
    ):
        with pytest.raises(OutputError, match="PTM-O101"):
            save_radiance(io.BytesIO(), other, Description())


@pytest.mark.parametrize(
    ("data", "code"),
    [
        (hdr(bytes(72), "+Y 2 +X 9"), "PTM-I126"),
        (hdr(bytes(72), kind="32-bit_rle_xyze"), "PTM-I126"),
        (hdr(bytes(72), "-Y 65537 +X 9"), "PTM-L104"),
        (hdr(bytes(72), "-Y 60000 +X 60000"), "PTM-L104"),
        (hdr(bytes(72), "-Y 3000 +X 3000"), "PTM-I125"),
        (hdr(bytes(72), "-Y 0 +X 9"), "PTM-I125"),
        (hdr(bytes([1, 1, 1, 8] * 18)), "PTM-I125"),
        (b"#?RADIANCE\n", "PTM-I125"),
    ],
)
def test_radiance_refused(data: bytes, code: str) -> None:
    with pytest.raises(InputError, match=code):
        load_image(data)


@pytest.mark.parametrize("kind", ["f2", "f4"])
def test_openexr(kind: str, tmp_path: Path) -> None:
    pytest.importorskip("OpenEXR", reason="pip install 'ptmtools[exr]'")
    for components in COUNTS:
        texels = RNG.normal(0, 9, (9, 7, components)).astype(kind)
        texels[0, 0] = np.inf
        write_image(tmp_path / "a.exr", texels, force=True)
        same(load_image(tmp_path / "a.exr").array(), texels)
        data = (tmp_path / "a.exr").read_bytes()
        same(load_image(data).array(), texels)
    with pytest.raises(LimitError, match="PTM-L104"):
        load_image(data, Limits(decoded_bytes=99))
    for bad in (data[:-9], data[:40]):
        with pytest.raises(InputError, match="PTM-I125"):
            load_image(bad)
    with pytest.raises(OutputError, match="PTM-O101"):
        write_image(tmp_path / "b.exr", np.zeros((2, 2, 3), np.uint8))


@pytest.mark.parametrize(("module", "suffix"), [("imagecodecs", "tif"), ("OpenEXR", "exr")])
def test_what_is_not_installed_is_named(
    module: str, suffix: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip(module)
    write_image(tmp_path / f"a.{suffix}", random("f4", 3))
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(PtmError, match=r"pip install 'ptmtools\[.*PTM-M10") as caught:
        load_image(tmp_path / f"a.{suffix}")
    assert caught.value.exit_status == 6


@pytest.mark.parametrize("orientation", range(1, 9))
def test_orientation_as_pillow_applies_it(orientation: int) -> None:
    texels = random("u1", 3)
    exif = Image.Exif()
    exif[0x0112] = orientation
    data = saved(Image.fromarray(texels), exif=exif)
    picture = load_image(data)
    assert picture.description.orientation == orientation
    same(picture.array(), texels)
    shown = np.asarray(ImageOps.exif_transpose(Image.open(io.BytesIO(data))))
    upright = picture.upright()
    np.testing.assert_array_equal(upright.array(), shown)
    np.testing.assert_array_equal(decode(encode(upright.texels, RAW)), shown)
    assert upright.description.orientation == 1


DESCRIPTIONS = [
    Description(),
    Description(srgb=1, gamma=45455),
    Description(icc=b"any profile", orientation=3),
    Description(
        gamma=100_000, chromaticities=(31270, 32900, 64000, 33000, 30000, 60000, 15000, 6000)
    ),
]


@pytest.mark.parametrize("description", DESCRIPTIONS)
@pytest.mark.parametrize("kind", ["u1", "u2"])
def test_png_keeps_what_is_said_of_the_texels(description: Description, kind: str) -> None:
    texels = random(kind, 3)
    picture = load_image(png_bytes(texels, description))
    assert picture.description == description
    same(picture.array(), texels)


def test_what_is_not_written(tmp_path: Path) -> None:
    for name, kind, why in (
        ("a.jpg", "u1", "would change"),
        ("a.xyz", "u1", "PTM-O101"),
        ("a", "u1", "PTM-O101"),
        ("a.png", "f4", "PTM-O101"),
        ("a.png", "f2", "PTM-O101"),
    ):
        texels = random(kind, 3)
        with pytest.raises(OutputError) as caught:
            write_image(tmp_path / name, texels)
        assert why in str(caught.value)
        assert caught.value.file == str(tmp_path / name)
        assert ".npy" in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_limits_are_those_of_the_caller() -> None:
    data = saved(Image.new("RGB", (30, 20)))
    assert load_image(data, Limits(decoded_bytes=1800)).texels.shape == (20, 30, 3)
    with pytest.raises(LimitError, match=r"PTM-L104|--limit"):
        load_image(data, Limits(decoded_bytes=1799))
