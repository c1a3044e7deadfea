"""Served files are checked against the index before a walk."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.errors import DatabaseError, LimitError
from ptmtools.output.served import read_served
from ptmtools.rendering.pyramids import read_pyramids
from ptmtools.walk import Walk
from ptmtools_lab.report import rate_text
from ptmtools_lab.world import prepare

Change = Callable[[Any], object]


@pytest.fixture
def copy(two_rooms: Path, tmp_path: Path) -> Path:
    """A served folder to spoil."""
    return Path(shutil.copytree(two_rooms / "www", tmp_path / "www"))


def textures(folder: Path) -> list[Path]:
    index = json.loads((folder / "hints.json").read_text())
    return [folder / row["file"] for row in index["textures"]]


def test_a_texture_that_is_cut(copy: Path) -> None:
    file = textures(copy)[0]
    file.write_bytes(file.read_bytes()[:-10])
    with pytest.raises(DatabaseError, match="not the texture that the index has"):
        read_pyramids(read_served(copy))


def test_the_texture_of_another(copy: Path) -> None:
    one, other = textures(copy)[:2]
    one.write_bytes(other.read_bytes())
    with pytest.raises(DatabaseError, match="PTM-D006"):
        read_pyramids(read_served(copy))


def test_a_texture_that_is_gone(copy: Path) -> None:
    textures(copy)[0].unlink()
    with pytest.raises(DatabaseError, match="PTM-D005"):
        read_pyramids(read_served(copy))


@pytest.mark.parametrize(
    "change",
    [
        lambda record: record.update(need=[[999, 0, 0.5]]),
        lambda record: record.update(need=[[0, 30, 0.5]]),
        lambda record: record.update(textureShares=[[[999, 0.5]]] * len(record["visible"])),
        lambda record: record["visible"].reverse(),
        lambda record: record.update(cell=1),
    ],
    ids=["texture", "level", "shares", "visible", "cell"],
)
def test_a_record_that_says_what_is_not(copy: Path, change: Change) -> None:
    file = copy / "hints/c0000.json"
    record = json.loads(file.read_text())
    assert len(record["visible"]) > 1
    change(record)
    file.write_text(json.dumps(record))
    with pytest.raises(DatabaseError, match="PTM-D006"):
        read_served(copy)


def test_a_walk_without_end(copy: Path) -> None:
    eye, ahead = np.zeros((2, 3)), np.array([[1.0, 0, 0]] * 2)
    walk = Walk(np.array([0.0, 1e300]), eye, ahead, 1.0, 1.5)
    with pytest.raises(LimitError, match="PTM-L400"):
        prepare(read_served(copy), walk)


def test_links_have_names() -> None:
    rates = [1, 999, 56_000, 4e6, 1e9, 0.5, None]
    assert [rate_text(rate) for rate in rates] == [
        "1 bit/s",
        "999 bit/s",
        "56 kbit/s",
        "4 Mbit/s",
        "1 Gbit/s",
        "0.5 bit/s",
        "unlimited bandwidth",
    ]
