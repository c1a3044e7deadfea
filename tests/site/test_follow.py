"""The visitor's body in a museum of two storeys: it goes where walks go, and nowhere else."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.cli.main import main
from tests.web import node

HERE = Path(__file__).resolve().parent


@pytest.fixture(scope="module")
def followed(
    museum_db: Path,
    tmp_path_factory: pytest.TempPathFactory,
    require: Callable[[str, str], None],
) -> Any:
    """What `follow.mjs` tells of a walk through every room."""
    if remedy := node.missing():
        require("node", remedy)
    walk = tmp_path_factory.mktemp("walk") / "walk.json"
    assert main(["path", str(museum_db), "-o", str(walk)]) == 0
    return json.loads(node.run(HERE / "follow.mjs", museum_db / "www", walk))


def test_a_walk_can_be_followed(followed: Any) -> None:
    """Through doors, up and down the stairs."""
    assert followed["done"] == 1
    assert followed["off"] < 0.4
    assert len(followed["cells"]) > 5
    assert np.ptp(np.array(followed["eyes"])[:, 1]) > 4


def test_the_eye_glides(followed: Any) -> None:
    """In a frame of 1/144 s, which each fourth is, by little, whatever is climbed."""
    assert abs(np.diff(np.array(followed["eyes"])[:, 1])[::4]).max() < 0.05


def test_nobody_gets_out(followed: Any) -> None:
    """From no viewpoint, whatever one does."""
    assert followed["wild"] > 3000
    assert followed["astray"] == 0
