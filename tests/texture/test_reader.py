"""Levels and windows from files, bytes and ranges; tiles; only what is needed is read."""

from __future__ import annotations

import io
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from numpy.typing import NDArray

import ptmtools.texture as texture
from ptmtools.errors import InputError, LimitError
from ptmtools.texture import Description, EncodeOptions, Limits, build_pyramid, encode
from ptmtools.texture.container import pack_head
from ptmtools.texture.pyramid import Box, covering_box, tiles_under
from tests.memory import little_memory

TILED = EncodeOptions("raw", tile=16)


def picture(height: int = 75, width: int = 101) -> NDArray[np.uint8]:
    y, x = np.mgrid[:height, :width]
    return np.stack([(x * 7 + y * 5 * c) % 251 for c in range(3)], axis=2).astype(np.uint8)


PICTURE = picture()
LEVELS = build_pyramid(PICTURE)
DATA = encode(PICTURE, TILED)
HEADER = texture.read_header(DATA)


class Recorder:
    """A range reader that remembers what it was asked for."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.asked: list[tuple[int, int]] = []

    def __call__(self, offset: int, length: int) -> bytes:
        self.asked.append((offset, length))
        return self.data[offset : offset + length]

    @property
    def bytes_read(self) -> int:
        return sum(min(length, len(self.data) - offset) for offset, length in self.asked)


def test_every_kind_of_source(tmp_path: Path) -> None:
    path = tmp_path / "a.ptm"
    path.write_bytes(DATA)
    with path.open("rb") as file:
        for source in (path, str(path), DATA, memoryview(DATA), io.BytesIO(DATA), file):
            with texture.open(source) as ptm:
                np.testing.assert_array_equal(ptm.level(), PICTURE)
        assert not file.closed
    with texture.open(Recorder(DATA)) as ptm:
        assert ptm.whole == len(ptm.header.levels)
        np.testing.assert_array_equal(ptm.level(), PICTURE)


def test_errors_name_the_file(tmp_path: Path) -> None:
    path = tmp_path / "a.ptm"
    path.write_bytes(encode(PICTURE)[:-1])
    with texture.open(path) as ptm:
        assert ptm.whole == len(ptm.header.levels) - 1
        with pytest.raises(InputError, match=r"a\.ptm: level 6: is cut.*PTM-I103"):
            ptm.level(6)
    with pytest.raises(InputError, match=r"b\.ptm: no such file.*PTM-I120"):
        texture.open(tmp_path / "b.ptm")


def test_a_level_costs_the_bytes_up_to_it() -> None:
    reader = Recorder(DATA)
    with texture.open(reader) as ptm:
        head = reader.bytes_read
        level = ptm.header.levels[3]
        np.testing.assert_array_equal(ptm.level(3), LEVELS[3])
    assert max(offset + length for offset, length in reader.asked[1:]) == level.end
    assert reader.bytes_read - head == level.end - ptm.header.levels[0].offset


def test_a_window_costs_the_tiles_over_it() -> None:
    image = np.tile(picture(64, 64), (8, 8, 1))
    reader = Recorder(encode(image, EncodeOptions("raw", tile=32)))
    with texture.open(reader) as ptm:
        finest = len(ptm.header.levels) - 1
        np.testing.assert_array_equal(ptm.window(finest, 200, 300, 5, 6), image[300:306, 200:205])
        total = ptm.header.file_size
    assert reader.bytes_read < total / 20


@settings(deadline=None, max_examples=150)
@given(data=st.data())
def test_any_window_of_any_level(data: st.DataObject) -> None:
    height, width = data.draw(st.integers(1, 90)), data.draw(st.integers(1, 90))
    image = picture(height, width)
    pyramid = build_pyramid(image)
    encoded = encode(image, EncodeOptions("raw", tile=data.draw(st.sampled_from([0, 16, 18, 40]))))
    with texture.open(encoded) as ptm:
        number = data.draw(st.integers(0, len(pyramid) - 1))
        level = pyramid[number]
        x0 = data.draw(st.integers(0, level.shape[1] - 1))
        y0 = data.draw(st.integers(0, level.shape[0] - 1))
        w = data.draw(st.integers(1, level.shape[1] - x0))
        h = data.draw(st.integers(1, level.shape[0] - y0))
        np.testing.assert_array_equal(
            ptm.window(number, x0, y0, w, h), level[y0 : y0 + h, x0 : x0 + w]
        )


@pytest.mark.parametrize("window", [(-1, 0, 2, 2), (0, 0, 0, 1), (100, 0, 2, 1), (0, 70, 1, 6)])
def test_windows_outside(window: tuple[int, int, int, int]) -> None:
    with texture.open(DATA) as ptm, pytest.raises(InputError, match="PTM-I111"):
        ptm.window(6, *window)


@pytest.mark.parametrize("profile", ["raw", "fast"])
def test_tiles_with_any_number_of_threads(profile: str) -> None:
    options = EncodeOptions(profile, tile=16)
    data = encode(PICTURE, options)
    assert {encode(PICTURE, options, threads=n) for n in (2, 5)} == {data}
    header = texture.read_header(data)
    assert header.levels[-1].tiles == (6, 4)
    for threads in (1, 2, 7):
        with texture.open(data, threads=threads) as ptm:
            for level, expected in zip(ptm.levels(), LEVELS, strict=True):
                np.testing.assert_array_equal(level, expected)


def test_a_damaged_tile_spares_the_others() -> None:
    data = bytearray(DATA)
    header = texture.read_header(bytes(data))
    data[-1] ^= 1
    finest = len(header.levels) - 1
    with texture.open(bytes(data)) as ptm:
        np.testing.assert_array_equal(ptm.window(finest, 0, 0, 20, 20), PICTURE[:20, :20])
        with pytest.raises(InputError, match=r"level 6, tile 23: the checksum.*PTM-I108"):
            ptm.level()
    assert len(texture.check(bytes(data))) == 1


def test_the_limit_is_that_of_what_is_decoded() -> None:
    image = np.tile(picture(64, 64), (8, 8, 1))
    data = encode(image, EncodeOptions("raw", tile=32))
    # 64 x 64 texels under the window, and ten times as much to decode a tile of up to 63 x 63.
    with texture.open(data, limits=Limits(64 * 64 * 3 * 11)) as ptm:
        finest = len(ptm.header.levels) - 1
        assert ptm.window(finest, 40, 40, 20, 20).shape == (20, 20, 3)
        with pytest.raises(LimitError, match="PTM-L103"):
            ptm.level()
    whole = encode(image, EncodeOptions("raw", tile=0))
    with (
        texture.open(whole, limits=Limits(64 * 64 * 3 * 11)) as ptm,
        pytest.raises(LimitError, match="PTM-L103"),
    ):
        ptm.window(finest, 40, 40, 20, 20)


@settings(deadline=None)
@given(st.integers(1, 90), st.integers(1, 90), st.sampled_from([0, 16, 18]), st.data())
def test_what_the_tiles_under_a_window_cover(width: int, height: int, side: int, data: Any) -> None:
    x0, y0 = data.draw(st.integers(0, width - 1)), data.draw(st.integers(0, height - 1))
    x1, y1 = data.draw(st.integers(x0 + 1, width)), data.draw(st.integers(y0 + 1, height))
    box = Box(x0, y0, x1, y1)
    tiles = [tile for _, tile in tiles_under(width, height, side, box)]
    assert covering_box(width, height, side, box) == (
        min(t.x0 for t in tiles), min(t.y0 for t in tiles),
        max(t.x1 for t in tiles), max(t.y1 for t in tiles),
    )  # fmt: skip


def test_a_million_tiles_are_not_listed_to_be_refused() -> None:
    groups = [(1, zlib.crc32(b"\0"))] * 17
    head = pack_head((65536, 65536, 4), "float32", EncodeOptions(tile=16), 0, b"", groups)
    data = head + bytes(17)
    with (
        little_memory(1 << 22),
        texture.open(data) as ptm,
        pytest.raises(LimitError, match="PTM-L103"),
    ):
        ptm.level()


DESCRIBED = Description(
    icc=b"a profile" * 100,
    srgb=1,
    gamma=45455,
    chromaticities=(31270, 32900, 64000, 33000, 30000, 60000, 15000, 6000),
    orientation=6,
)


@pytest.mark.parametrize("description", [Description(), Description(orientation=3), DESCRIBED])
def test_a_description_comes_back(description: Description) -> None:
    data = encode(PICTURE, description=description)
    with texture.open(data) as ptm:
        assert ptm.description() == description
        np.testing.assert_array_equal(ptm.level(), PICTURE)


def test_a_damaged_description_is_found() -> None:
    data = bytearray(encode(PICTURE, description=DESCRIBED))
    offset, length, _ = texture.read_header(bytes(data)).description
    data[offset + length - 1] ^= 1
    with texture.open(bytes(data)) as ptm, pytest.raises(InputError, match="PTM-I108"):
        ptm.description()
    (problem,) = texture.check(bytes(data))
    assert problem.startswith("description: the checksum is wrong")
    with texture.open(bytes(data[: offset + 5])) as ptm, pytest.raises(InputError, match="I103"):
        ptm.description()


def test_a_source_of_unknown_size_that_ends() -> None:
    for cut, whole in ((HEADER.levels[3].end, 4), (HEADER.levels[5].end + 70, 6)):
        with texture.open(Recorder(DATA[:cut])) as ptm:
            np.testing.assert_array_equal(ptm.level(), LEVELS[whole - 1])
            assert ptm.whole == whole
        with texture.open(Recorder(DATA[:cut])) as ptm:
            assert len(list(ptm.levels())) == whole
        with (
            texture.open(Recorder(DATA[:cut])) as ptm,
            pytest.raises(InputError, match=f"level {whole}: is cut after {cut} of .*PTM-I103"),
        ):
            ptm.level(6)


def test_a_reader_of_ranges_may_give_more_but_not_something_else() -> None:
    with texture.open(lambda offset, length: memoryview(DATA)[offset : offset + length + 9]) as ptm:
        np.testing.assert_array_equal(ptm.level(), PICTURE)
    with pytest.raises(InputError, match=r"NoneType.*PTM-I122"):
        texture.open(lambda offset, length: None)  # type: ignore[arg-type, return-value]


def test_what_is_no_source() -> None:
    for source in (5, None, io.StringIO("x")):
        with pytest.raises(TypeError, match="binary mode"):
            texture.open(source)  # type: ignore[arg-type]
    every_other = memoryview(bytes(2 * len(encode(PICTURE))))[::2]
    with pytest.raises(InputError, match="PTM-I101"):
        texture.open(every_other)


def test_a_closed_reader_says_so(tmp_path: Path) -> None:
    path = tmp_path / "a.ptm"
    path.write_bytes(encode(PICTURE))
    ptm = texture.open(path)
    ptm.close()
    with pytest.raises(InputError, match=r"a\.ptm.*PTM-I122"):
        ptm.level()


@pytest.mark.parametrize(
    "changes",
    [
        {"orientation": 0},
        {"orientation": 9},
        {"srgb": 4},
        {"gamma": -1},
        {"gamma": 1 << 40},
        {"chromaticities": (1, 2)},
        {"chromaticities": (-1,) * 8},
    ],
)
def test_descriptions_that_cannot_be(changes: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="PTM-I111"):
        encode(PICTURE, description=Description(**changes))


def test_an_allowed_error_in_an_exact_profile_is_damage() -> None:
    data = bytearray(encode(PICTURE, EncodeOptions("raw")))
    end = texture.read_header(bytes(data)).description[0]
    data[32] = 5
    data[end - 4 : end] = zlib.crc32(data[: end - 4]).to_bytes(4, "little")
    with pytest.raises(InputError, match="PTM-I105"):
        texture.read_header(bytes(data))
