"""Triangles are packed for the GPU in batches, each with its box, and none is lost."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.web import node

HERE = Path(__file__).parent


@pytest.mark.parametrize("painted", [False, True])
@pytest.mark.parametrize(
    ("shapes", "batches", "size"),
    [
        ([(0, 3, 1)], 1, 2),
        ([(0, 100, 2048)], 1, 2),
        ([(0, 100, 2049)], 2, 2),
        ([(1, 50, 3000), (0, 60, 10), (1, 70, 1100), (-1, 4, 2)], 5, 2),
        ([(0, 65_535, 100)], 1, 2),
        ([(0, 65_536, 100)], 1, 4),
        ([(0, 40_000, 30_000), (1, 30_000, 20_000)], 25, 4),
    ],
)
def test_every_triangle_is_in_one_batch(
    painted: bool, shapes: list[tuple[int, int, int]], batches: int, size: int
) -> None:
    """Texture, vertices and triangles of each shape; those of one look lie side by side."""
    actual = json.loads(node.run(HERE / "pack.mjs", json.dumps([painted, shapes])))
    assert actual["same"]
    assert actual["corners"] == 3 * sum(triangles for *_, triangles in shapes)
    assert actual["outside"] == 0
    assert actual["most"] <= 2048
    assert (actual["batches"], actual["size"]) == (batches, size)
    assert actual["painted"] is (painted and len(shapes) > 1)
    assert actual["pauses"] >= max(batches, max(vertices for _, vertices, _ in shapes) >> 14)
