"""Encoded buffer views, read back by our decoder and by the library that defines the format."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from ptmtools.meshopt.decoding import decode
from ptmtools.meshopt.encoding import (
    ALL_WIDTHS,
    encode_attributes,
    encode_triangles,
    exponential,
    reorder,
)

SEEDS = st.integers(0, 2**32 - 1)


@pytest.fixture(scope="module")
def peer(require: Callable[[str, str], None]) -> Any:
    try:
        import meshopt
    except ImportError:
        require("meshopt", "pip install meshopt")
    return meshopt


def walks(random: np.random.Generator, count: int, stride: int) -> np.ndarray:
    """Bytes that change by steps of a width that differs by column; some never do."""
    width = random.choice([0, 1, 3, 9, 200], stride)
    steps = random.integers(-width, width + 1, (count, stride))
    return (np.cumsum(steps, axis=0) & 255).astype(np.uint8)


def meshes(random: np.random.Generator) -> np.ndarray:
    """A grid of quads, a heap of triangles, or both, of which some come twice."""
    width, height = random.integers(1, 25, 2)
    corner = (np.arange(height)[:, None] * (width + 1) + np.arange(width)).ravel()[:, None]
    grid = np.vstack([corner + [0, 1, width + 2], corner + [0, width + 2, width + 1]])
    heap = random.integers(0, random.integers(3, 3000), (random.integers(1, 300), 3))
    mesh = [grid, heap, np.vstack([grid, heap, grid[::3]])][random.integers(3)]
    return random.permutation(mesh) if random.random() < 0.3 else mesh


def canonical(triangle: np.ndarray) -> list[tuple[int, ...]]:
    """Sorted triangles, each turned to its least form."""
    return sorted(
        min((a, b, c), (b, c, a), (c, a, b)) for a, b, c in triangle.astype(np.int64).tolist()
    )


@settings(max_examples=150)
@given(SEEDS)
def test_elements_come_back(peer: Any, seed: int) -> None:
    random = np.random.default_rng(seed)
    stride = 4 * int(random.choice([1, 2, 3, 5, 8, 33, 64]))
    data = walks(random, int(random.integers(1, 700)), stride)
    sizes = []
    for widths in (0, 2, 4, ALL_WIDTHS):
        stream = encode_attributes(data, widths)
        sizes.append(len(stream))
        extension = {"mode": "ATTRIBUTES", "count": len(data), "byteStride": stride}
        assert decode(stream, extension) == data.tobytes()
        decoded = np.asarray(peer.decode_vertex_buffer(stream, len(data), stride))
        assert decoded.tobytes() == data.tobytes()
    assert min(sizes) == sizes[-1] == len(peer.encode_vertex_buffer_level(data, 3, 0))


@settings(max_examples=150)
@given(SEEDS)
def test_triangles_come_back(peer: Any, seed: int) -> None:
    """In their order, each with its winding; no longer than the library's, up to its table."""
    triangle = meshes(np.random.default_rng(seed))
    stream = encode_triangles(triangle)
    extension = {"mode": "TRIANGLES", "count": triangle.size, "byteStride": 4}
    actual = np.frombuffer(decode(stream, extension), np.uint32).reshape(-1, 3)
    assert [canonical(one[None]) for one in actual] == [canonical(one[None]) for one in triangle]
    decoded = np.asarray(peer.decode_index_buffer(stream, triangle.size, 4))
    assert np.array_equal(decoded.ravel(), actual.ravel())
    longest = len(peer.encode_index_buffer(triangle.astype(np.uint32).ravel()))
    assert len(stream) <= longest * 1.02 + 8


@settings(max_examples=100)
@given(SEEDS)
def test_a_reordered_mesh_is_the_same(seed: int) -> None:
    triangle = meshes(np.random.default_rng(seed))
    used, again = reorder(triangle)
    assert canonical(used[again]) == canonical(triangle)
    first = np.unique(again.ravel(), return_index=True)[1]
    assert (np.diff(first) > 0).all()


def test_neighbours_follow_each_other() -> None:
    """Triangles of a grid in any order: a byte each, with the head and the table."""
    random = np.random.default_rng(5)
    corner = (np.arange(40)[:, None] * 41 + np.arange(40)).ravel()[:, None]
    grid = np.vstack([corner + [0, 1, 42], corner + [0, 42, 41]])
    _, triangle = reorder(random.permutation(grid))
    assert len(encode_triangles(triangle)) < 1.2 * len(grid)
    assert len(encode_triangles(random.permutation(grid))) > 3 * len(grid)


@given(SEEDS)
def test_the_exponential_filter_is_exact(peer: Any, seed: int) -> None:
    random = np.random.default_rng(seed)
    steps = random.integers(-(2**23), 2**23, (50, 5)) >> random.integers(0, 22, 5)
    exponent = np.broadcast_to(random.integers(-100, 100, 5), steps.shape)
    stream = encode_attributes(exponential(steps, exponent))
    extension = {"mode": "ATTRIBUTES", "count": 50, "byteStride": 20, "filter": "EXPONENTIAL"}
    actual = np.frombuffer(decode(stream, extension), "<f4").reshape(50, 5)
    assert np.array_equal(actual, steps * 2.0**exponent)
    decoded = peer.decode_gltf_buffer(stream, 50, 20, "ATTRIBUTES", "EXPONENTIAL")
    assert np.asarray(decoded).tobytes() == actual.tobytes()


def test_nothing_and_too_much_are_refused() -> None:
    for shape in ((0, 4), (3, 6), (3, 260)):
        with pytest.raises(ValueError, match="stride"):
            encode_attributes(np.zeros(shape, np.uint8))
    for triangle in (
        np.zeros((0, 3), np.int64),
        np.array([[0, 1, -1]]),
        np.array([[0, 1, 1 << 32]]),
    ):
        with pytest.raises(ValueError, match="index"):
            encode_triangles(triangle)
