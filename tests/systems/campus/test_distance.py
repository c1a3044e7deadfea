"""The approximated distance, against a search along the segment."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from ptmtools.arrays import Floats
from ptmtools_systems.campus import distances

NUMBER = st.floats(-1e3, 1e3, allow_subnormal=False)
VECTOR = st.tuples(NUMBER, NUMBER, NUMBER)
SIDES = st.tuples(*[st.floats(0, 500, allow_subnormal=False)] * 3)
SHARE = st.tuples(*[st.floats(0, 1)] * 3)


def searched(eye: Floats, box: Floats, middle: Floats) -> float:
    """The last point of the segment in the box, by halving: the box is convex."""

    def inside(share: float) -> bool:
        at = middle + share * (eye - middle)
        slack = 1e-9 * (1 + np.abs(box).max())
        return bool((box[:3] - slack <= at).all() and (at <= box[3:] + slack).all())

    if inside(1.0):
        return 0.0
    low, high = 0.0, 1.0
    for _ in range(80):
        half = (low + high) / 2
        low, high = (half, high) if inside(half) else (low, half)
    return float((1 - low) * np.linalg.norm(eye - middle))


@given(eye=VECTOR, low=VECTOR, sides=SIDES, share=SHARE)
def test_as_a_search_finds_it(eye: tuple, low: tuple, sides: tuple, share: tuple) -> None:
    at, least, side = (np.array(v, float) for v in (eye, low, sides))
    box = np.concatenate([least, least + side])
    middle = np.clip(least + side * np.array(share), box[:3], box[3:])
    actual = float(distances(at, box[None], middle[None])[0])
    wanted = searched(at, box, middle)
    # The search lets in what is a billionth outside: on a way that hardly leaves, that is far.
    leaving = np.abs(at - middle) > 1e-6 * np.linalg.norm(at - middle)
    if leaving.all():
        assert actual == pytest.approx(wanted, rel=1e-3, abs=1e-2)
    nearest = np.linalg.norm(np.maximum(np.maximum(box[:3] - at, at - box[3:]), 0))
    assert nearest <= actual * (1 + 1e-9) + 1e-9
    assert actual <= np.linalg.norm(at - middle) * (1 + 1e-9)


def test_nothing_from_inside() -> None:
    box = np.array([[0.0, 0, 0, 2, 2, 2]])
    eyes = np.array([[1, 1, 1], [0.1, 1.9, 1], [2, 2, 2], [1, 1, 5]], float)
    actual = distances(eyes, box, np.array([[1.0, 1, 1]]))
    assert actual.tolist() == [[0], [0], [0], [3]]


def test_a_long_object_is_not_as_far_as_its_middle() -> None:
    """The error that the paper speaks of (figure 4)."""
    box = np.array([[0.0, 0, 0, 100, 10, 10]])
    eye = np.array([110.0, 5, 5])
    assert distances(eye, box, np.array([[50.0, 5, 5]]))[0] == pytest.approx(10)


def test_many_viewpoints_and_objects_at_once() -> None:
    random = np.random.default_rng(1)
    boxes = np.sort(random.normal(0, 50, (7, 2, 3)), axis=1).reshape(7, 6)
    middles = (boxes[:, :3] + boxes[:, 3:]) / 2
    eyes = random.normal(0, 80, (3, 5, 3))
    whole = distances(eyes, boxes, middles)
    assert whole.shape == (3, 5, 7)
    for i, j in np.ndindex(3, 5):
        assert np.array_equal(whole[i, j], distances(eyes[i, j], boxes, middles))
