"""Looking normals up: the kernel, its plain form, and a walk by the page."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from ptmtools_systems.apo.model import Octree
from ptmtools_systems.apo.traversal import NEVER, Nodes, look_up, stop_depth, unpack_normals
from tests.systems.apo.building import Node, nodes, octree_of, walk

RED, GREEN, BLUE, GREY = (255, 128, 128), (128, 255, 128), (128, 128, 255), (0, 128, 128)
#: The root has children 1 (a leaf) and 6, and this one children 0 and 7.
SMALL: Node = (GREY, {1: (RED, {}), 6: (GREEN, {0: (BLUE, {}), 7: (RED, {})})})


def plain_look_up(
    octree: Octree, q: np.ndarray, levels: int | None = None, stop: int | None = None
) -> Nodes:
    """The readable equivalent of `look_up`: all points move down a level at a time."""
    deepest = (octree.levels if levels is None else min(levels, octree.levels)) - 1
    if deepest < 0:
        raise ValueError("the look-up needs at least one level")
    rest = np.nan_to_num(q.clip(0.0, np.nextafter(1.0, 0.0)), nan=0.0)
    limit = np.full(len(q), deepest if stop is None else min(deepest, stop))
    texel = octree.texels.astype(np.int64)
    at, depth = np.zeros(len(q), dtype=np.int64), np.zeros(len(q), dtype=np.int64)
    going = np.arange(len(q))
    while len(going):
        here = at[going]
        present = texel[here, 3]
        on = (present != 0) & (depth[going] < limit[going]) & (here + 1 < len(texel))
        going, here, present = going[on], here[on], present[on]
        doubled = 2 * rest[going]
        half = doubled >= 1
        rest[going] = doubled - half
        child = half @ np.array([1, 2, 4])
        red, green, blue, inner = texel[here + 1].T
        below = (1 << child) - 1
        first = red + (green << 8) + (blue << 16)
        address_of = first + np.bitwise_count(present & below) + np.bitwise_count(inner & below)
        on = (present >> child & 1 == 1) & (address_of < len(texel))
        going = going[on]
        at[going] = address_of[on]
        depth[going] += 1
    return Nodes(at, depth, unpack_normals(octree.texels[at]))


def test_an_octree_written_down() -> None:
    octree = octree_of(SMALL)
    assert octree.texels.tolist() == [
        [*GREY, 0b01000010],
        [2, 0, 0, 0b01000000],
        [*RED, 0],
        [*GREEN, 0b10000001],
        [5, 0, 0, 0],
        [*BLUE, 0],
        [*RED, 0],
    ]
    assert octree.start.tolist() == [0, 2, 5, 7]
    q = np.array(
        [[0.7, 0.2, 0.1], [0.1, 0.6, 0.9], [0.4, 0.9, 0.9], [0.4, 0.6, 0.9], [0.1, 0.1, 0]]
    )
    actual = look_up(octree, q)
    assert actual.address.tolist() == [2, 3, 6, 3, 0]
    assert actual.depth.tolist() == [1, 1, 2, 1, 0]
    red = np.array([255, 128, 128]) / 127.5 - 1
    np.testing.assert_allclose(actual.normals[0], red / np.linalg.norm(red))
    # Child 6 of the root is from (0, ½, ½) to (½, 1, 1).
    assert look_up(octree, np.array([[0.0, 0.5, 0.5]])).address.tolist() == [5]
    assert look_up(octree, q, levels=2).address.tolist() == [2, 3, 3, 3, 0]
    assert look_up(octree, q, levels=1).depth.tolist() == [0] * 5
    assert look_up(octree, q, stop=1).depth.tolist() == [1, 1, 1, 1, 0]
    assert look_up(octree, q, stop=np.array([0, -3, NEVER, 2, 2])).depth.tolist() == [0, 0, 2, 1, 0]


cases = st.tuples(
    nodes(4),
    st.lists(st.tuples(*[st.floats(0, 1, exclude_max=True)] * 3), min_size=1, max_size=20),
    st.integers(1, 6),
    st.integers(-2, 6),
)


@given(cases)
def test_as_the_page_says(case: tuple[Node, list[tuple[float, ...]], int, int]) -> None:
    root, points, levels, stop = case
    octree = octree_of(root)
    expected = [walk(octree, list(q), levels, stop) for q in points]
    for way in (look_up, plain_look_up):
        actual = way(octree, np.array(points), levels, stop)
        assert list(zip(actual.address.tolist(), actual.depth.tolist(), strict=True)) == expected
        level = np.searchsorted(octree.start, actual.address, side="right") - 1
        np.testing.assert_array_equal(level, actual.depth)
        np.testing.assert_allclose(np.linalg.norm(actual.normals, axis=1), 1)


@given(cases, st.integers(1, 5))
def test_the_first_levels_alone_serve_as_those_of_the_whole(
    case: tuple[Node, list[tuple[float, ...]], int, int], kept: int
) -> None:
    root, points, _, stop = case
    octree = octree_of(root)
    kept = min(kept, octree.levels)
    part = replace(
        octree, texels=octree.texels[: octree.start[kept]], start=octree.start[: kept + 1]
    )
    q = np.array(points)
    for way in (look_up, plain_look_up):
        some, whole = way(part, q, None, stop), way(octree, q, kept, stop)
        np.testing.assert_array_equal(some.address, whole.address)


@given(
    st.lists(st.tuples(*[st.integers(0, 255)] * 4), min_size=1, max_size=40),
    st.integers(1, 20),
    st.integers(0, 2**32 - 1),
)
def test_damaged_octrees_lead_nowhere_else(
    texels: list[tuple[int, ...]], levels: int, seed: int
) -> None:
    octree = replace(octree_of(SMALL), texels=np.array(texels, dtype=np.uint8))
    octree = replace(octree, start=np.linspace(0, len(texels), levels + 1).astype(np.int64))
    q = np.random.default_rng(seed).random((50, 3))
    one, other = look_up(octree, q), plain_look_up(octree, q)
    np.testing.assert_array_equal(one.address, other.address)
    assert one.address.min() >= 0
    assert one.address.max() < len(texels)
    assert one.depth.max() < levels


def test_points_outside_count_as_the_nearest_within() -> None:
    octree = octree_of(SMALL)
    q = np.array([[1.5, -1, -1], [0.4, 1.0, np.inf], [np.nan, 0.9, 0.9]])
    for way in (look_up, plain_look_up):
        assert way(octree, q).address.tolist() == [2, 6, 3]


def test_there_must_be_a_level() -> None:
    with pytest.raises(ValueError, match="at least one level"):
        look_up(octree_of(SMALL), np.zeros((1, 3)), levels=0)


def test_where_to_stop() -> None:
    step = np.array([2.0, 1.0, 0.75, 0.5, np.nextafter(0.5, 0), 2.0**-13, 1e-4, 0.0, 5e-324])
    assert stop_depth(step).tolist() == [-1, 0, 1, 1, 2, 13, 14, NEVER, NEVER]
    for depth, each in zip(stop_depth(step[:7]), step[:7], strict=True):
        assert 0.5**depth <= each < 2 * 0.5**depth
