"""The hall of statues: they stand apart on its floor, between pictures on its walls."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from ptmtools_samples.options import StatueHallOptions
from ptmtools_samples.photo_gallery import HEIGHT, WIDTH_RATIO
from ptmtools_samples.statue_hall import (
    SPACING,
    STATUE_HEIGHT,
    make_statue_hall,
    statue_rows,
)

from ptmtools.errors import InputError

SMALL = StatueHallOptions(statues=5, triangles=1500, images=2)


def statues(rows: list[str], first: int = 0) -> dict[str, np.ndarray]:
    """Points of each statue; every face has three points of its own statue."""
    actual: dict[str, list[list[float]]] = {}
    faces: list[int] = []
    name = ""
    for row in rows:
        word, *rest = row.split()
        if word == "o":
            name = rest[0]
            actual[name] = []
        elif word == "v":
            actual[name].append([float(v) for v in rest])
        elif word == "f":
            faces += [int(v) for v in rest]
    count = first + sum(map(len, actual.values()))
    assert first < min(faces)
    assert max(faces) == count
    return {name: np.array(points) for name, points in actual.items()}


def test_they_stand_apart_on_the_floor() -> None:
    length = 20.0
    actual = statues(statue_rows(SMALL, length, 7), 7)
    assert len(actual) == 5
    boxes = [(p.min(axis=0), p.max(axis=0)) for p in actual.values()]
    for low, high in boxes:
        assert low[1] == pytest.approx(0, abs=1e-6)
        assert 0.5 < high[1] <= STATUE_HEIGHT + 1e-3
        assert (low >= 0).all()
        assert (high <= [length, HEIGHT, length * WIDTH_RATIO]).all()
    for (_, before), (after, _) in pairwise(boxes):
        assert before[0] < after[0]


def test_the_same_again_and_another_seed() -> None:
    files, again = dict(make_statue_hall(SMALL)), dict(make_statue_hall(SMALL))
    other = dict(make_statue_hall(StatueHallOptions(statues=5, triangles=1500, images=2, seed=2)))
    assert list(files)[-2:] == ["statue_hall.mtl", "statue_hall.obj"]
    model = files["statue_hall.obj"]()
    assert model == again["statue_hall.obj"]() != other["statue_hall.obj"]()
    # A hall for so many, though two pictures need less.
    xs = [float(line.split()[1]) for line in model.decode().splitlines() if line.startswith("v ")]
    assert max(xs) >= 4 * SPACING


def test_numbers_out_of_range() -> None:
    with pytest.raises(InputError, match=r"--statues 0"):
        StatueHallOptions(statues=0)
