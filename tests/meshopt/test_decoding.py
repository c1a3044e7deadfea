"""Buffer views compressed with meshopt, beside the library that defines the format."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from ptmtools.meshopt.decoding import decode

SEEDS = st.integers(0, 2**32 - 1)
#: The example of 4-bit sentinel coding in the specification, and the deltas that it says it holds.
EXAMPLE = bytes.fromhex("175ff0bc77a921003 4b5".replace(" ", ""))
DELTAS = [-1, -4, -3, 26, -91, 0, -6, 6, -4, -4, 5, -5, 1, -1, 0, 0]


@pytest.fixture(scope="module")
def peer(require: Callable[[str, str], None]) -> Any:
    try:
        import meshopt
    except ImportError:
        require("meshopt", "pip install meshopt")
    return meshopt


def extension(mode: str, count: int, stride: int, filtered: str = "NONE") -> dict[str, Any]:
    return {"mode": mode, "count": count, "byteStride": stride, "filter": filtered}


def rows(random: np.random.Generator, count: int, stride: int) -> np.ndarray:
    """Elements as they are found: constants, steps of few bits, noise, floats, by columns."""
    out = np.empty((count, stride), np.uint8)
    for channel in range(0, stride, 4):
        kind = random.integers(6)
        if kind == 0:
            part = np.full((count, 4), random.integers(256))
        elif kind == 1:
            steps = random.integers(
                -(2 ** random.integers(1, 8)), 2 ** random.integers(0, 8), (count, 4)
            )
            part = np.cumsum(steps, axis=0) & 255
        elif kind == 2:
            part = random.integers(0, 256, (count, 4))
        elif kind == 3:
            walk = np.cumsum(random.integers(-300, 300, (count, 2)), axis=0)
            part = walk.astype(np.int16).view(np.uint8).reshape(count, 4)
        else:
            wave = np.sin(np.arange(count) / random.integers(1, 99)).astype(np.float32)
            part = wave.view(np.uint8).reshape(count, 4)
        out[:, channel : channel + 4] = part
    return out


def test_the_example_of_the_specification() -> None:
    """One byte of each of 16 elements of 4; the others stay what the baseline says."""
    tail = bytes(28) + bytes([0, 7, 8, 9])
    stream = bytes([0xA0, 0b10]) + EXAMPLE + bytes([0, 0, 0]) + tail
    actual = np.frombuffer(decode(stream, extension("ATTRIBUTES", 16, 4)), np.uint8).reshape(16, 4)
    assert np.diff(actual[:, 0].astype(int), prepend=0).astype(np.int8).tolist() == DELTAS
    assert (actual[:, 1:] == [7, 8, 9]).all()


@settings(max_examples=150)
@given(SEEDS)
def test_elements_come_back(peer: Any, seed: int) -> None:
    random = np.random.default_rng(seed)
    stride = 4 * int(random.choice([1, 2, 3, 4, 5, 8, 16, 32, 63, 64]))
    data = rows(random, int(random.integers(1, 700)), stride)
    for version in (0, 1):
        for level in range(4):
            stream = peer.encode_vertex_buffer_level(data, level, version)
            assert decode(stream, extension("ATTRIBUTES", *data.shape)) == data.tobytes()


@settings(max_examples=150)
@given(SEEDS)
def test_triangles_come_back(peer: Any, seed: int) -> None:
    """Up to the corner that each begins with, which the encoder may turn."""
    random = np.random.default_rng(seed)
    triangles, vertices = int(random.integers(1, 500)), int(random.integers(3, 60000))
    if random.random() < 0.5:  # a strip, of which parts come again elsewhere
        first = np.arange(triangles) + random.integers(0, 9) * (random.random(triangles) < 0.1)
        index = (first[:, None] + [0, 1, 2]) % vertices
    else:
        index = random.integers(0, vertices, (triangles, 3))
    if random.random() < 0.2:  # two streams, one behind the other
        index = np.concatenate([index, index])
    index = index.astype(np.uint32)
    stream = peer.encode_index_buffer(index.ravel())
    expected = np.asarray(peer.decode_index_buffer(stream, index.size, 4)).ravel()
    for stride, kind in ((4, np.uint32), (2, np.uint16)):
        actual = np.frombuffer(decode(stream, extension("TRIANGLES", index.size, stride)), kind)
        assert np.array_equal(actual, expected.astype(kind))
    actual = np.frombuffer(decode(stream, extension("TRIANGLES", index.size, 4)), np.uint32)
    assert np.array_equal(turned(actual), turned(index))


def turned(index: np.ndarray) -> np.ndarray:
    """Triangles from the corner on that makes them come first, by all of their corners: two may be
    the same vertex."""
    corners = index.reshape(-1, 3).astype(np.int64)
    turns = np.stack([np.roll(corners, k, axis=1) for k in range(3)])
    first = (turns @ [1 << 40, 1 << 20, 1]).argmin(axis=0)
    return np.asarray(turns[first, np.arange(len(corners))])


@settings(max_examples=100)
@given(SEEDS)
def test_indices_come_back(peer: Any, seed: int) -> None:
    random = np.random.default_rng(seed)
    steps = random.integers(-(2 ** random.integers(1, 20)), 2 ** random.integers(1, 20), 400)
    index = np.abs(np.cumsum(steps))[: random.integers(1, 400)].astype(np.uint32)
    stream = peer.encode_index_sequence(index)
    assert decode(stream, extension("INDICES", len(index), 4)) == index.tobytes()
    assert decode(stream, extension("INDICES", len(index), 2)) == index.astype(np.uint16).tobytes()


@pytest.mark.parametrize("version", [0, 1])
@pytest.mark.parametrize("name", ["OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"])
def test_filters(peer: Any, name: str, version: int) -> None:
    """Within one unit in the last place of integers, and floats exactly, as the specification
    asks."""
    random = np.random.default_rng(7)
    vector = random.normal(size=(500, 4))
    unit = (vector / np.linalg.norm(vector, axis=1)[:, None]).astype(np.float32)
    vector[:, :3] /= np.linalg.norm(vector[:, :3], axis=1)[:, None]
    vector[:, 3] = np.sign(vector[:, 3])
    colour = random.random((500, 4)).astype(np.float32)
    made = {
        "OCTAHEDRAL": [
            peer.encode_filter_oct(vector.astype(np.float32), stride, bits)
            for stride, bits in ((4, 8), (4, 5), (8, 16), (8, 11))
        ],
        "QUATERNION": [peer.encode_filter_quat(unit, 8, bits) for bits in (16, 9, 4)],
        "EXPONENTIAL": [
            peer.encode_filter_exp((1e3 * unit[:, :width]).astype(np.float32), bits)
            for width, bits in ((3, 15), (4, 24), (1, 8))
        ],
        "COLOR": [
            peer.encode_filter_color(colour, stride, bits)
            for stride, bits in ((4, 8), (4, 5), (8, 16), (8, 12))
        ],
    }[name]
    kinds = {4: np.int8, 8: np.int16}
    for filtered in made:
        data = np.ascontiguousarray(filtered).view(np.uint8).reshape(500, -1)
        stride = data.shape[1]
        stream = peer.encode_vertex_buffer_level(data, 2, version)
        actual = decode(stream, extension("ATTRIBUTES", 500, stride, name))
        wanted = np.asarray(peer.decode_gltf_buffer(stream, 500, stride, "ATTRIBUTES", name))
        if name == "EXPONENTIAL":
            assert actual == wanted.tobytes()
            continue
        kind = np.dtype(kinds[stride])
        kind = np.dtype(f"u{kind.itemsize}") if name == "COLOR" else kind
        apart = np.frombuffer(actual, kind).astype(int) - np.frombuffer(wanted.tobytes(), kind)
        assert np.abs(apart).max() <= 1


@settings(max_examples=400)
@given(SEEDS)
def test_what_is_damaged_is_told(peer: Any, seed: int) -> None:
    """Bytes that are others, missing or too many: an error or other elements, never more."""
    random = np.random.default_rng(seed)
    kind = int(random.integers(4))
    if kind < 2:
        data = rows(random, 300, 12)
        stream, how = (
            peer.encode_vertex_buffer_level(data, 2, kind),
            extension("ATTRIBUTES", 300, 12),
        )
    elif kind == 2:
        index = random.integers(0, 200, 300).astype(np.uint32)
        stream, how = peer.encode_index_buffer(index), extension("TRIANGLES", 300, 4)
    else:
        index = random.integers(0, 200, 300).astype(np.uint32)
        stream, how = peer.encode_index_sequence(index), extension("INDICES", 300, 4)
    whole = decode(stream, how)
    spoilt = bytearray(stream)
    for _ in range(int(random.integers(1, 4))):
        spoilt[int(random.integers(len(spoilt)))] = int(random.integers(256))
    cut = spoilt[: int(random.integers(len(spoilt) + 1))]
    for bad in (bytes(spoilt), bytes(cut), bytes(stream) + b"\0"):
        with suppress(ValueError):
            assert len(decode(bad, how)) == len(whole)
    with pytest.raises(ValueError, match="meshopt"):
        decode(bytes(stream)[:-1], how)


@pytest.mark.parametrize("mode", ["ATTRIBUTES", "TRIANGLES", "INDICES"])
def test_a_count_that_no_data_could_hold(mode: str) -> None:
    head = {"ATTRIBUTES": 0xA1, "TRIANGLES": 0xE1, "INDICES": 0xD1}[mode]
    with pytest.raises(ValueError, match="bytes for 9000000000000000 "):
        decode(bytes([head]) + bytes(2000), extension(mode, 9 * 10**15, 4))


@pytest.mark.parametrize(
    ("how", "match"),
    [
        (extension("ATTRIBUTES", 1, 6), "stride of 6"),
        (extension("ATTRIBUTES", 1, 260), "stride of 260"),
        (extension("ATTRIBUTES", 1, 12, "QUATERNION"), "'QUATERNION' with a stride of 12"),
        (extension("ATTRIBUTES", 1, 12, "COLOR"), "stride of 12"),
        (extension("ATTRIBUTES", 1, 4, "SQUARE"), "'SQUARE' with"),
        (extension("TRIANGLES", 3, 1), "stride of 1"),
        (extension("INDICES", 3, 4, "COLOR"), "filter COLOR"),
        (extension("POINTS", 3, 4), "'POINTS'"),
    ],
)
def test_what_contradicts_itself(how: dict[str, Any], match: str) -> None:
    stream = bytes([{"TRIANGLES": 0xE1, "INDICES": 0xD1}.get(how["mode"], 0xA0)]) + bytes(500)
    with pytest.raises(ValueError, match=match):
        decode(stream, how)
