"""The committed two rooms are what the script makes, and what their comments say."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from ptmtools_samples.two_rooms import make_two_rooms

FOLDER = Path(__file__).resolve().parents[2] / "sample_data" / "two_rooms"


def test_committed_files_are_those_of_the_generator() -> None:
    made = {name: load() for name, load in make_two_rooms()}
    committed = {p.name: p.read_bytes() for p in FOLDER.iterdir()}
    assert committed.keys() == made.keys()
    for name, data in made.items():
        if name.endswith(".png"):  # compressors may differ, pixels may not
            with Image.open(io.BytesIO(data)) as a, Image.open(FOLDER / name) as b:
                assert a.size == b.size == (64, 64)
                assert np.array_equal(np.asarray(a), np.asarray(b))
            assert len(committed[name]) <= 10 * 1024
        else:
            assert committed[name] == data
    assert sum(len(data) for data in committed.values()) < 100 * 1024


@pytest.fixture(scope="module")
def rooms(read: Callable[..., Any]) -> Any:
    return read((FOLDER / "two_rooms.obj").read_text().splitlines())


def test_surface_and_volume_are_those_of_the_comment(rooms: Any) -> None:
    assert np.linalg.norm(rooms.normals, axis=1).sum() / 2 == pytest.approx(157.2, abs=1e-9)
    assert -rooms.volume() == pytest.approx(96.4, abs=1e-9)
    assert np.allclose(rooms.normals.sum(axis=0), 0)


def test_coordinates_are_round(rooms: Any) -> None:
    assert set(rooms.corners.ravel().tolist()) == {0, 1.5, 2, 2.5, 3, 4, 4.2, 8.2}


def test_one_sees_from_room_to_room_only_through_the_door(rooms: Any) -> None:
    origins = np.array([[2, 1, 2.0]] * 3)
    rays = np.array([[1, 0, 0], [1, 0, 0.5], [1, 0.7, 0]], dtype=float)
    distance = rooms.distances(origins, rays / np.linalg.norm(rays, axis=1, keepdims=True))
    ends = origins[:, 0] + distance * (rays / np.linalg.norm(rays, axis=1, keepdims=True))[:, 0]
    assert ends == pytest.approx([8.2, 4, 4], abs=1e-5)
