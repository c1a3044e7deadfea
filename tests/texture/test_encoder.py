"""Kept parts of a pyramid, and images that are never whole in memory."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ptmtools.texture as texture
from ptmtools.errors import InputError, OutputError
from ptmtools.texture import EncodeOptions, build_pyramid, decode_levels, encode, encode_to

IMAGE = np.random.default_rng(1).integers(0, 256, (100, 37, 3), dtype=np.uint8)


@pytest.mark.parametrize(
    ("options", "kept"),
    [
        (EncodeOptions("raw"), (0, 6)),
        (EncodeOptions("raw", min_level=2), (2, 6)),
        (EncodeOptions("raw", max_level=3), (0, 4)),
        (EncodeOptions("raw", min_level=1, max_level=-2), (1, 5)),
        (EncodeOptions("raw", min_level=-1), (5, 6)),
        (EncodeOptions("raw", min_level=7), (5, 6)),
        (EncodeOptions("raw", min_level=-9), (0, 6)),
        (EncodeOptions("raw", max_level=-9), (0, 1)),
        (EncodeOptions("raw", min_level=5, max_level=-3), (3, 4)),
        (EncodeOptions("raw", max_level=99), (0, 6)),
        (EncodeOptions("raw", min_side=5), (3, 6)),
        (EncodeOptions("raw", min_side=5, max_side=60), (3, 5)),
        (EncodeOptions("raw", min_side=1000), (5, 6)),
        (EncodeOptions("raw", max_side=1), (0, 1)),
    ],
)
def test_levels_kept(options: EncodeOptions, kept: tuple[int, int]) -> None:
    data = encode(IMAGE, options)
    header = texture.read_header(data)
    assert (header.width, header.height, header.trimmed) == (37, 100, 6 - kept[1])
    levels = list(decode_levels(data))
    for level, expected in zip(levels, build_pyramid(IMAGE)[slice(*kept)], strict=True):
        np.testing.assert_array_equal(level, expected)


class Strips:
    """An image that can only be read a few rows at a time."""

    def __init__(self, image: np.ndarray, most: int) -> None:
        self.shape, self.dtype = image.shape, image.dtype
        self._image, self._most = image, most

    def __getitem__(self, rows: slice) -> np.ndarray:
        assert 0 < rows.stop - rows.start <= self._most
        return self._image[rows]


def test_rows_that_come_in_strips(tmp_path: Path) -> None:
    image = np.tile(IMAGE, (12, 40, 1))
    options = EncodeOptions("raw", tile=64)
    expected = encode(image, options)
    assert encode(Strips(image, 127), options) == expected
    np.save(tmp_path / "a.npy", image)
    assert encode(np.load(tmp_path / "a.npy", mmap_mode="r"), options) == expected


def test_into_the_middle_of_a_file() -> None:
    file = io.BytesIO(b"before")
    file.seek(6)
    encode_to(file, IMAGE)
    assert file.getvalue() == b"before" + encode(IMAGE)
    assert file.tell() == len(file.getvalue())


def test_foreign_byte_order_is_no_other_image() -> None:
    deep = IMAGE.astype(np.uint16) * 200
    raw = EncodeOptions("raw")
    assert encode(deep.astype(">u2"), raw) == encode(deep.astype("<u2"), raw)


@pytest.mark.parametrize("profile", ["fast", "small"])
def test_an_allowed_error_never_costs_much(profile: str) -> None:
    """Flat images are smaller without error; noise with it."""
    flat = np.kron(np.arange(48).reshape(6, 8) * 37 % 5 * 50, np.ones((15, 13)))
    for image in (flat.astype(np.uint8), IMAGE):
        exact, within = (
            len(encode(image, EncodeOptions(profile, max_error=error))) for error in (0, 3)
        )
        assert within <= exact + 20


def test_a_file_open_for_appending_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.ptm"
    path.write_bytes(b"before")
    with path.open("ab") as file, pytest.raises(OutputError, match=r"a\.ptm.*appending.*PTM-O002"):
        encode_to(file, IMAGE)
    assert path.read_bytes() == b"before"


@pytest.mark.parametrize("options", [{"tile": 64.0}, {"tile": "a"}, {"max_error": True}])
def test_options_of_another_type(options: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="PTM-I111"):
        encode(IMAGE, EncodeOptions("raw", **options))


@pytest.mark.parametrize("image", [[[1, 2], [3, 4]], None, b"abc"])
def test_what_is_no_array(image: Any) -> None:
    with pytest.raises(InputError, match="PTM-I126"):
        encode(image)
