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
