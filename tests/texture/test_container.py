"""The head, truncation, damage and hostile sizes."""

from __future__ import annotations

import struct
import zlib
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from ptmtools.errors import InputError, LimitError
from ptmtools.texture import (
    EncodeOptions,
    Limits,
    PtmHeader,
    build_pyramid,
    check,
    decode,
    decode_levels,
    encode,
    read_header,
    whole_levels,
)
from ptmtools.texture.container import HEAD_MAX, MAGIC
from tests.memory import little_memory

Y, X = np.mgrid[:11, :13]
IMAGE = np.stack([(X * 17 + Y * 5 * c) % 256 for c in range(3)], axis=2).astype(np.uint8)
PYRAMID = build_pyramid(IMAGE)


@pytest.fixture(params=["raw", "fast"])
def data(request: pytest.FixtureRequest) -> bytes:
    """A whole file."""
    return encode(IMAGE, EncodeOptions(request.param))


def sealed(data: bytes, at: int, packed: bytes) -> bytes:
    """The file with part of its head overwritten and the head's checksum made right again."""
    head = bytearray(data[: read_header(data).levels[0].offset])
    head[at : at + len(packed)] = packed
    head[-4:] = zlib.crc32(head[:-4]).to_bytes(4, "little")
    return bytes(head) + data[len(head) :]


@pytest.mark.parametrize("profile", ["raw", "fast"])
def test_header_says_everything(profile: str) -> None:
    data = encode(IMAGE, EncodeOptions(profile))
    header = read_header(data[:HEAD_MAX])
    assert isinstance(header, PtmHeader)
    assert (header.width, header.height, header.components) == (13, 11, 3)
    assert (header.profile, header.kind) == (profile, "uint8")
    assert (header.version, header.trimmed) == (2, 0)
    assert (header.tile, header.max_error, header.description[1]) == (512, 0, 0)
    sizes = [(level.width, level.height) for level in header.levels]
    assert sizes == [(1, 1), (3, 2), (6, 5), (13, 11)]
    assert [level.gpu_bytes for level in header.levels] == [3, 21, 111, 540]
    assert header.levels[0].offset + sum(level.length for level in header.levels) == len(data)
    assert header.file_size == len(data)
    for level in header.levels:
        assert zlib.crc32(data[level.offset : level.end]) == level.crc32


def test_the_largest_head_fits_in_the_read_that_is_promised() -> None:
    image = np.zeros((1 << 16, 1 << 16, 1), np.uint8)[:1]  # no memory is touched
    assert read_header(encode(image, EncodeOptions("raw"))[:HEAD_MAX]).levels[0].width == 1 << 16
    assert HEAD_MAX <= 4096


def test_every_truncation(data: bytes) -> None:
    """Wherever a file is cut, the finest whole level comes out, or an error that says what is."""
    header = read_header(data)
    for size in range(len(data)):
        cut = data[:size]
        assert check(cut)
        if size < header.levels[0].offset:
            code = "PTM-I101" if size == 0 else "PTM-I103"
            with pytest.raises(InputError, match=code):
                decode(cut)
            continue
        whole = whole_levels(header, size)
        assert whole == sum(level.end <= size for level in header.levels)
        if whole:
            np.testing.assert_array_equal(decode(cut), PYRAMID[whole - 1])
            assert len(list(decode_levels(cut))) == whole
            last = f"the last whole level is {whole - 1}"
        else:
            with pytest.raises(InputError, match="PTM-I103"):
                decode(cut)
            last = "no level is complete"
        for n in range(whole, len(header.levels)):
            with pytest.raises(InputError, match=f"level {n}.*{last}.*PTM-I103"):
                decode(cut, n)


def test_every_flipped_bit_is_found(data: bytes) -> None:
    for at in range(len(data)):
        for bit in (0, 3, 7):
            damaged = bytearray(data)
            damaged[at] ^= 1 << bit
            assert check(bytes(damaged)), (at, bit)
            with pytest.raises(InputError):
                decode(bytes(damaged))
    assert check(data) == []


def test_damage_leaves_the_levels_below_it(data: bytes) -> None:
    at = read_header(data).levels[2].offset
    damaged = data[:at] + bytes([data[at] ^ 255]) + data[at + 1 :]
    np.testing.assert_array_equal(decode(damaged, 1), PYRAMID[1])
    with pytest.raises(InputError, match=r"level 2: .*coarser levels.*PTM-I108"):
        decode(damaged)
    (problem,) = check(damaged)
    assert problem.startswith("level 2: the checksum is wrong")


def test_no_such_level(data: bytes) -> None:
    for level in (-1, 4):
        with pytest.raises(InputError, match=r"it has levels 0 to 3.*PTM-I111"):
            decode(data, level)


def test_what_lies_behind_the_last_group_is_reported() -> None:
    data = encode(IMAGE)
    assert check(data + b"xyz") == ["3 bytes after the last group"]
    np.testing.assert_array_equal(decode(data + b"xyz"), IMAGE)


@pytest.mark.parametrize(
    ("data", "code"),
    [
        (b"", "PTM-I101"),
        (b"\x89PNG\r\n\x1a\n" + bytes(60), "PTM-I101"),
        (b"PTM_1.2\nPTM_FORMAT_RGB\n", "PTM-I101"),
        (MAGIC[:3], "PTM-I103"),
        (MAGIC, "PTM-I103"),
        (MAGIC.replace(b"\r\n", b"\n") + bytes(60), "PTM-I101"),
    ],
)
def test_other_files(data: bytes, code: str) -> None:
    with pytest.raises(InputError, match=code):
        read_header(data)
    assert len(check(data)) == 1


# Offsets as in docs/formats/ptm.md.
@pytest.mark.parametrize(
    ("at", "packed", "code"),
    [
        (8, struct.pack("<H", 3), "PTM-I104"),
        (8, struct.pack("<H", 0), "PTM-I104"),
        (8, struct.pack("<H", 1), "PTM-I105"),
        (10, b"\7", "PTM-I104"),
        (11, b"\4", "PTM-I104"),
        (12, struct.pack("<I", 0), "PTM-I105"),
        (12, struct.pack("<I", 0xFFFFFFFF), "PTM-L104"),
        (16, struct.pack("<I", 65537), "PTM-L104"),
        (20, b"\0", "PTM-I105"),
        (20, b"\5", "PTM-I105"),
        (21, b"\0", "PTM-I105"),
        (21, b"\5", "PTM-I105"),
        (22, b"\1", "PTM-I105"),
        (22, b"\xff", "PTM-I105"),
        (23, b"\1", "PTM-I105"),
        (24, struct.pack("<I", 0xFFFFFFFF), "PTM-I105"),
        (28, struct.pack("<I", 14), "PTM-I105"),
        (28, struct.pack("<I", 17), "PTM-I105"),
        (28, struct.pack("<I", 0x80000000), "PTM-I105"),
        (32, struct.pack("<I", 256), "PTM-I105"),
        (36, struct.pack("<I", 0xFFFFFFFF), "PTM-I105"),
        (36, struct.pack("<I", 1), "PTM-I105"),
        (44, struct.pack("<Q", 1 << 63), "PTM-I105"),
        (52, struct.pack("<Q", 1 << 40), "PTM-I105"),
        (52, struct.pack("<Q", 0), "PTM-I105"),
    ],
)
def test_hostile_heads_are_refused_without_taking_memory(at: int, packed: bytes, code: str) -> None:
    data = sealed(encode(IMAGE), at, packed)
    with little_memory(1 << 20), pytest.raises(InputError) as caught:
        decode(data)
    assert caught.value.code == code


def test_a_small_file_of_a_huge_image_is_refused_without_taking_memory() -> None:
    """Right in every checksum and range: only the limit and the groups themselves can tell."""
    data = encode(np.zeros((16, 16, 3), np.uint8))
    huge = sealed(data, 12, struct.pack("<II", 65536, 65536))
    tables = 1 << 24
    with little_memory(tables), pytest.raises(InputError, match=r"PTM-L103|PTM-I112"):
        decode(huge)


def test_a_level_beyond_the_limit_is_refused_before_memory_is_taken() -> None:
    data = encode(np.zeros((300, 200, 3), np.uint8))
    with pytest.raises(LimitError, match="PTM-L103"):
        decode(data, limits=Limits(decoded_bytes=300 * 200 * 3 * 11 - 1))
    with pytest.raises(LimitError, match="PTM-L103"):
        next(decode_levels(data, limits=Limits(decoded_bytes=10)))
    assert decode(data, limits=Limits(decoded_bytes=300 * 200 * 3 * 11)).shape == (300, 200, 3)
    assert decode(data, 3, Limits(decoded_bytes=18 * 12 * 3 * 11)).shape == (18, 12, 3)


@pytest.mark.parametrize(
    "image",
    [
        np.zeros((4, 4), np.int16),
        np.zeros((4, 4), np.float64),
        np.zeros(4, np.uint8),
        np.zeros((4, 4, 5), np.uint8),
        np.zeros((4, 4, 0), np.uint8),
        np.zeros((0, 4, 3), np.uint8),
        np.zeros((1, 1, 1, 1), np.uint8),
    ],
)
def test_arrays_that_are_no_images(image: NDArray[np.uint8]) -> None:
    with pytest.raises(InputError, match="PTM-I126"):
        encode(image)


@pytest.mark.parametrize(
    "change",
    [
        {"profile": "smaller"},
        {"min_side": 0},
        {"max_side": -1},
        {"tile": 8},
        {"tile": 33},
        {"tile": -512},
        {"max_error": -1},
        {"max_error": 256},
        {"max_error": 1, "profile": "raw"},
        {"min_level": 2, "max_level": 1},
    ],
)
def test_impossible_options(change: dict[str, object]) -> None:
    with pytest.raises(InputError, match="PTM-I111"):
        encode(IMAGE, replace(EncodeOptions(), **change))


def test_sides_beyond_the_format() -> None:
    image = np.broadcast_to(np.uint8(0), (1, 65537))
    with pytest.raises(LimitError, match="PTM-L104"):
        encode(image)
