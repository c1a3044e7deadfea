"""Distinct rows and neighbours across edges, against slow and obvious ways to find them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from ptmtools.cells import search
from ptmtools.cells.fabric import Welded, across_edges
from ptmtools.cells.search import connect, distinct

ROWS = st.lists(st.tuples(*[st.sampled_from([0.0, -0.0, 1.0, 2.0**60, 1e-300])] * 3), max_size=40)


def first_of_each(rows: list[tuple[float, ...]]) -> tuple[list[int], list[int]]:
    seen: dict[tuple[float, ...], int] = {}
    place = [seen.setdefault(row, len(seen)) for row in rows]
    return [rows.index(row) for row in seen], place


@pytest.mark.parametrize("factor", [search._FACTOR, np.uint64(0)], ids=["hash", "collisions"])
def test_distinct_rows(monkeypatch: pytest.MonkeyPatch, factor: np.uint64) -> None:
    monkeypatch.setattr(search, "_FACTOR", factor)

    @given(ROWS)
    def check(rows: list[tuple[float, ...]]) -> None:
        first, place = distinct(np.array(rows, dtype=np.float64).reshape(-1, 3))
        assert (first.tolist(), place.tolist()) == first_of_each(rows)

    check()


def test_repeated_and_flat_triangles_are_left_out() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0]], dtype=np.float64)
    # The second is the first turned over, by another vertex; the third has one corner twice.
    triangles = np.array([[0, 1, 2], [2, 3, 0], [1, 3, 2], [1, 4, 2]])
    mesh = Welded.from_triangles(points, triangles)
    assert mesh.source.tolist() == [0, 3]
    assert np.array_equal(mesh.corners, points[triangles[[0, 3]]])


def test_neighbours_across_edges() -> None:
    # A strip 0-1-2; 3 shares an edge of the first with another, 4 is wound the other way.
    triangle = np.array([[0, 1, 2], [2, 1, 3], [2, 3, 4], [1, 0, 5], [3, 4, 6]])
    turned = np.zeros(5, dtype=bool)
    one_way = across_edges(triangle, turned).tolist()
    assert one_way[0] == [3, 1, -1]
    assert one_way[1] == [0, -1, 2]
    assert one_way[2] == [1, -1, -1]  # both have the edge from 3 to 4 in that direction
    turned[4] = True
    assert across_edges(triangle, turned).tolist()[2] == [1, 4, -1]
    third = np.concatenate([triangle, [[1, 2, 7]]])
    assert across_edges(third, np.zeros(6, dtype=bool)).tolist()[0] == [3, -1, -1]


@given(st.integers(0, 2**32 - 1), st.integers(0, 30), st.integers(2, 3))
def test_connected_indices_are_those_of_a_flood(seed: int, count: int, width: int) -> None:
    rows = np.random.default_rng(seed).integers(0, 25, (count, width))
    label = np.arange(25)
    for _ in range(25):
        for row in rows:
            label[row] = label[row].min()
    assert np.array_equal(connect(25, rows), label)
