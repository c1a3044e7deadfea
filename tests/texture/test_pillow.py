"""Pillow opens and saves `.ptm` files, level by level, without a loss it does not tell."""

from __future__ import annotations

import io
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image, ImageFile, ImageOps, UnidentifiedImageError

import ptmtools.pillow
from ptmtools.pillow import PtmImageFile
from ptmtools.texture import (
    Description,
    EncodeOptions,
    build_pyramid,
    decode,
    encode,
    load_image,
    open as open_ptm,
    read_header,
)

RNG = np.random.default_rng(3)
RGB = RNG.integers(0, 256, (45, 70, 3), dtype=np.uint8)
RAW = EncodeOptions("raw")
LEVELS = build_pyramid(RGB)
DATA = encode(RGB, RAW)
HEADER = read_header(DATA)
SIZES = [(level.shape[1], level.shape[0]) for level in LEVELS]


@pytest.fixture(autouse=True, scope="module")
def _registered() -> None:
    ptmtools.pillow.register()


def opened(data: bytes) -> PtmImageFile:
    image = Image.open(io.BytesIO(data))
    assert isinstance(image, PtmImageFile)
    return image


def saved(image: Image.Image, **options: Any) -> bytes:
    buffer = io.BytesIO()
    image.save(buffer, "PTM", **{"profile": "raw", **options})
    return buffer.getvalue()


@pytest.mark.parametrize("mode", ["L", "LA", "RGB", "RGBA", "I;16", "F"])
def test_what_is_saved_is_opened(mode: str, tmp_path: Path) -> None:
    kind = {"I;16": np.uint16, "F": np.float32}.get(mode, np.uint8)
    components = 1 if mode in ("I;16", "F") else len(mode)
    shape = (45, 70) if components == 1 else (45, 70, components)
    texels = RNG.integers(0, 256, shape).astype(kind)
    texels *= kind(257) if mode == "I;16" else kind(1)
    Image.fromarray(texels).save(tmp_path / "a.ptm", profile="raw")
    with Image.open(tmp_path / "a.ptm") as image:
        assert (image.format, image.mode, image.size) == ("PTM", mode, (70, 45))
        np.testing.assert_array_equal(np.asarray(image), texels)
    np.testing.assert_array_equal(decode(tmp_path / "a.ptm").reshape(shape), texels)


def test_half_floats_are_widened() -> None:
    half = RNG.normal(0, 1, (5, 4)).astype(np.float16)
    np.testing.assert_array_equal(np.asarray(opened(encode(half, RAW))), half.astype(np.float32))


def test_palettes_and_bits_become_texels() -> None:
    index = Image.fromarray(RNG.integers(0, 4, (9, 7), np.uint8), "P")
    index.putpalette(list(range(12)))
    image = opened(saved(index))
    np.testing.assert_array_equal(np.asarray(image), np.asarray(index.convert("RGB")))
    index.info["transparency"] = 2
    image = opened(saved(index))
    np.testing.assert_array_equal(np.asarray(image), np.asarray(index.convert("RGBA")))
    bits = Image.fromarray(RNG.integers(0, 2, (9, 7)) > 0)
    np.testing.assert_array_equal(np.asarray(opened(saved(bits))), np.asarray(bits) * 255)


class Watched(io.BytesIO):
    """Knows how far it was read."""

    furthest = 0

    def read(self, size: int | None = -1) -> bytes:
        data = super().read(size)
        self.furthest = max(self.furthest, self.tell())
        return data


def test_opening_reads_the_head_and_a_draft_no_finer_groups() -> None:
    data = encode(np.tile(RGB, (4, 4, 1)), RAW)
    header = read_header(data)
    file = Watched(data)
    # Only ours: the plug-ins of other formats may read on before they give up.
    image = Image.open(file, formats=["PTM"])
    assert file.furthest < 1000
    assert image.draft(None, (70, 45)) == ("RGB", (0, 0, 70, 45))
    assert file.furthest < 1000
    image.load()
    assert file.furthest <= header.levels[-3].end + 8
    np.testing.assert_array_equal(np.asarray(image), decode(data, len(header.levels) - 3))


@pytest.mark.parametrize(
    ("asked", "number"), [((70, 45), 5), ((36, 1), 5), ((35, 22), 4), ((1, 1), 0), ((17, 12), 4)]
)
def test_draft_is_not_smaller_than_asked(asked: tuple[int, int], number: int) -> None:
    image = opened(DATA)
    assert image.levels == SIZES
    assert image.draft("L", asked) is not None
    assert (image.level, image.size, image.mode) == (number, SIZES[number], "RGB")
    np.testing.assert_array_equal(np.asarray(image), LEVELS[number])
    assert image.draft(None, (1, 1)) is None  # too late


def test_nothing_is_large_enough() -> None:
    image = opened(DATA)
    assert image.draft(None, (71, 1)) is None
    assert image.size == (70, 45)


def test_reduce_and_level() -> None:
    image = opened(DATA)
    assert callable(image.reduce)
    image.reduce = 2
    assert image.size == SIZES[-3]
    np.testing.assert_array_equal(np.asarray(image), LEVELS[-3])
    assert image.reduce(2).size == (9, 6)  # Pillow's, rounding up
    image = opened(DATA)
    image.reduce = 2
    assert image.reduce == 2
    assert image.reduce(2).size == (9, 6)
    image = opened(DATA)
    image.reduce = 2
    assert image.resize((5, 5), reducing_gap=1.0).size == (5, 5)
    with pytest.raises(ValueError, match="is loaded"):
        image.level = 0
    image = opened(DATA)
    with pytest.raises(ValueError, match="levels 0 to 5"):
        image.level = 6
    image.level = 0
    np.testing.assert_array_equal(np.asarray(image), LEVELS[0])


def test_thumbnails_come_from_a_level() -> None:
    image = opened(encode(np.tile(RGB, (4, 4, 1)), RAW))
    image.thumbnail((40, 40))
    assert image.size == (40, 26)
    assert image.level == len(image.levels) - 2


def test_colour_and_orientation() -> None:
    description = Description(b"profile", 1, 45455, tuple(range(1000, 9000, 1000)), 6)
    data = encode(RGB, RAW, description=description)
    image = opened(data)
    assert image.info["icc_profile"] == b"profile"
    assert image.info["gamma"] == 0.45455
    assert image.info["ptm"] == read_header(data)
    assert ImageOps.exif_transpose(image).size == (45, 70)
    assert open_ptm(saved(image)).description() == description
    assert open_ptm(saved(ImageOps.exif_transpose(image))).description().orientation == 1
    changed = open_ptm(saved(image, icc_profile=None, exif=b"")).description()
    assert (changed.icc, changed.orientation, changed.gamma) == (None, 1, 45455)
    exif = Image.Exif()
    exif[0x0112] = 3
    changed = open_ptm(saved(image, icc_profile=b"x", exif=exif)).description()
    assert (changed.icc, changed.orientation) == (b"x", 3)
    png = io.BytesIO()
    image.save(png, "PNG")
    assert Image.open(png).info["icc_profile"] == b"profile"


@pytest.mark.parametrize("value", [0, 9, 300, "x", -1, 2.5, None])
def test_an_impossible_orientation_is_none(value: object) -> None:
    exif = Image.Exif()
    exif[0x0112] = value
    data = saved(Image.fromarray(RGB), exif=exif)
    assert open_ptm(data).description() == Description()
    image = Image.fromarray(RGB)
    image.getexif()[0x0112] = value
    np.testing.assert_array_equal(decode(saved(image)), RGB)
    np.testing.assert_array_equal(decode(saved(image, exif=b"garbage")), RGB)


def test_a_damaged_description_is_a_warning() -> None:
    data = bytearray(encode(RGB, RAW, description=Description(b"a profile", orientation=6)))
    data[data.index(b"a profile")] ^= 1
    with pytest.warns(UserWarning, match="PTM-I108"):
        image = opened(bytes(data))
    assert "icc_profile" not in image.info
    assert image.getexif().get(0x0112, 1) == 1
    np.testing.assert_array_equal(np.asarray(image), RGB)


@pytest.mark.parametrize("mode", ["1", "L", "RGB", "I;16"])
def test_a_colour_key_becomes_alpha(mode: str, tmp_path: Path) -> None:
    grey = RNG.integers(0, 2, (9, 7), np.uint8) * 255
    texels = {"1": grey > 0, "L": grey, "RGB": RGB, "I;16": grey.astype(np.uint16) * 257}[mode]
    key = tuple(RGB[2, 3].tolist()) if mode == "RGB" else int(texels.max())
    Image.fromarray(texels).save(tmp_path / "a.png", transparency=key)
    with Image.open(tmp_path / "a.png") as image:
        assert image.mode == mode
        actual = decode(saved(image))
    np.testing.assert_array_equal(actual, load_image(tmp_path / "a.png").array())
    assert 0 < (actual[:, :, -1] == 0).sum() < actual[:, :, -1].size


def test_what_is_no_colour_key() -> None:
    image = Image.fromarray(RGB)
    for key in (3, b"123", (1, 2), (1, 2, "x")):
        image.info["transparency"] = key
        np.testing.assert_array_equal(decode(saved(image)), RGB)


def test_options_of_saving() -> None:
    image = Image.fromarray(RGB)
    header = read_header(saved(image, tile=16, min_side=10))
    assert (header.profile, header.tile, len(header.levels)) == ("raw", 16, 3)
    for wrong in ({"profile": "tiny"}, {"tile": 7}, {"max_error": -1}):
        with pytest.raises(ValueError, match="PTM-I111"):
            saved(image, **wrong)
    with pytest.raises(OSError, match="CMYK"):
        saved(Image.new("CMYK", (3, 3)))

    class Pipe(io.RawIOBase):
        written = b""

        def write(self, data: Any) -> int:
            self.written += bytes(data)
            return len(data)

    pipe = Pipe()
    image.save(pipe, "PTM", profile="raw")  # type: ignore[arg-type]
    assert pipe.written == saved(image)


def test_a_failed_save_leaves_no_file(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="PTM-I111"):
        Image.fromarray(RGB).save(tmp_path / "a.ptm", profile="tiny")
    assert list(tmp_path.iterdir()) == []


def test_what_pillow_has_no_mode_for() -> None:
    for texels in (np.zeros((4, 4, 3), np.uint16), np.zeros((4, 4, 3), np.float32)):
        with pytest.raises(OSError, match="has no mode for 3 components"):
            Image.open(io.BytesIO(encode(texels, RAW)))


@pytest.mark.parametrize("truncated", [False, True])
def test_a_file_cut_short(truncated: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ImageFile, "LOAD_TRUNCATED_IMAGES", truncated)
    data = DATA[: HEADER.levels[-1].end - 1]
    image = opened(data)
    assert image.size == (70, 45)
    if truncated:
        actual = np.asarray(image)
        assert actual.shape == (45, 70, 3)
        np.testing.assert_array_equal(actual[:44, :70][::2, ::2], LEVELS[-2])
        np.testing.assert_array_equal(actual[44], actual[43])
    else:
        with pytest.raises(OSError, match="PTM-I103"):
            image.load()
    image = opened(data)
    image.reduce = 1
    np.testing.assert_array_equal(np.asarray(image), LEVELS[-2])
    with pytest.raises(OSError, match="PTM-I103"):
        Image.open(io.BytesIO(data[:60]))
    with pytest.raises(OSError, match="PTM-I103"):
        opened(DATA[: HEADER.levels[0].offset]).load()


def test_damage_is_told() -> None:
    data = bytearray(DATA)
    data[-9] ^= 1
    with pytest.raises(OSError, match="PTM-I108"):
        opened(bytes(data)).load()
    data[30] ^= 1
    with pytest.raises(OSError, match="PTM-I105"):
        opened(bytes(data))


def test_other_files_of_that_suffix(tmp_path: Path) -> None:
    (tmp_path / "a.ptm").write_bytes(b"PTM_1.2\nPTM_FORMAT_RGB\n9\n9\n")
    with pytest.raises(UnidentifiedImageError):
        Image.open(tmp_path / "a.ptm")


def test_pillows_limit_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 1000)
    with pytest.raises(Image.DecompressionBombError):
        Image.open(io.BytesIO(DATA))


def test_files_are_closed(tmp_path: Path) -> None:
    Image.fromarray(RGB).save(tmp_path / "a.ptm", profile="raw")
    with warnings.catch_warnings():
        warnings.simplefilter("error", ResourceWarning)
        Image.open(tmp_path / "a.ptm").load()
        with Image.open(tmp_path / "a.ptm"):
            pass
        image = Image.open(tmp_path / "a.ptm")
        image.close()
        with pytest.raises(ValueError, match="closed"):
            image.load()
