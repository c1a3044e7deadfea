"""Texture memory comes to what is wanted, within its budget, whatever was there before."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.web import node

HERE = Path(__file__).parent


@pytest.mark.parametrize("count", [2, 5, 11, 40])
def test_it_comes_to_what_is_wanted(count: int) -> None:
    """Also where it is full to the brim, and textures must shrink before others can grow."""
    for stage in json.loads(node.run(HERE / "memory.mjs", 1024, count)):
        assert stage["held"] == stage["wanted"]
        assert stage["peak"] <= stage["budget"]


def test_the_most_urgent_comes_first() -> None:
    """Fewer levels make room, any level is better than a colour, more are better than exact ones;
    of equal urgency by the share of the view. What is not wanted is not decoded."""
    actual = json.loads(node.run(HERE / "urgency.mjs"))
    assert actual["order"] == [[5, 1], [3, 2], [2, 1], [1, 4], [0, 2]]
    assert actual["held"] == [2, 4, 1, 2, 0, 1]
    assert actual["loss"][:4] == [0, 0, 0, 0]
